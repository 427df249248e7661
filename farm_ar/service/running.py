"""Running the service until a signal ends it."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
from collections.abc import Callable, Iterator
from typing import Any

from farm_ar.service.network import Certificate
from farm_ar.service.refusals import missing_package

try:
    import uvicorn
except ImportError:
    raise missing_package("uvicorn") from None

PATIENCE_S = 3
"""How long requests that are under way are waited for at the end."""


class _Server(uvicorn.Server):
    """A server that says when it listens, and ends at a signal without passing it on."""

    def __init__(self, config: uvicorn.Config, ready: Callable[[], None]) -> None:
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if not self.should_exit:
            self._ready()

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        loop = asyncio.get_running_loop()
        for one in (signal.SIGINT, signal.SIGTERM):
            with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
                loop.add_signal_handler(one, self.handle_exit, one, None)
        yield


def run(app: Any, at: socket.socket, ready: Callable[[], None], tls: Certificate | None = None) -> None:
    """Serve an application until Ctrl-C or a signal to end.

    Args:
        app: the ASGI application.
        at: a socket that listens.
        ready: called when requests are answered.
        tls: with it, HTTPS.
    """
    asyncio.run(_Server(config_of(app, tls), ready).serve([at]))


def config_of(app: Any, tls: Certificate | None = None) -> uvicorn.Config:
    """How an application is served.

    Messages are not compressed: each listener would have them compressed anew, though all get the same.
    """
    return uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        server_header=False,
        date_header=False,
        ws="websockets-sansio",
        ws_max_size=2**16,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=PATIENCE_S,
        ssl_certfile=None if tls is None else tls.certificate,
        ssl_keyfile=None if tls is None else tls.key,
    )
