"""Running the service until a signal ends it."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import signal
import socket
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from farm_ar.service.limits import ServiceLimits
from farm_ar.service.network import Certificate
from farm_ar.service.refusals import TOO_MANY, RefusedError, missing_package
from farm_ar.service.service import refused
from farm_ar.service.shortcut import Message, Receive, Send, send_answer

try:
    import h11
    import uvicorn
    from uvicorn.protocols.http.h11_impl import H11Protocol
except ImportError:
    raise missing_package("uvicorn") from None

PATIENCE_S = 3
"""How long requests that are under way are waited for at the end."""

HEAD_S = 10.0
"""How long the head of a request may take to arrive; a body has a limit of its own."""

FULL_HEAD_S = 1.0
"""The same where there are too many connections."""


class _Protocol(H11Protocol):
    """HTTP that ends connections on which no whole head comes, and refuses those that are too many.

    Args:
        most: connections at once; on each one beyond it, its first request is answered with "come again".
        more: as of `H11Protocol`.
    """

    _patience: asyncio.TimerHandle | None = None
    _full = False

    def __init__(self, most: int, **more: Any) -> None:
        super().__init__(**more)
        self._most = most

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._full = len(self.connections) > self._most
        if self._full:
            self.app = partial(_come_again, self._most)
        self._wait()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        if self._patience is not None:
            self._patience.cancel()
        super().connection_lost(exc)

    def _wait(self) -> None:
        if self.conn.their_state is not h11.IDLE:
            if self._patience is not None:
                self._patience.cancel()
            self._patience = None
        elif self._patience is None:
            patience = FULL_HEAD_S if self._full else HEAD_S
            self._patience = self.loop.call_later(patience, self.transport.close)

    def _should_upgrade(self) -> bool:
        return not self._full and super()._should_upgrade()


async def _come_again(most: int, scope: Message, receive: Receive, send: Send) -> None:
    """Answer a request on a connection that is one too many."""
    expected = f"must be at most {most} at once: close others, or come again"
    await send_answer(refused(RefusedError(TOO_MANY, "connections", expected, "more")), send, close=True)


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


def run(
    app: Any,
    at: socket.socket,
    ready: Callable[[], None],
    tls: Certificate | None = None,
    limits: ServiceLimits | None = None,
) -> None:
    """Serve an application until Ctrl-C or a signal to end.

    Args:
        app: the ASGI application.
        at: a socket that listens.
        ready: called when requests are answered.
        tls: with it, HTTPS.
        limits: of connections.
    """
    gc.collect()
    gc.freeze()  # what has been loaded stays: looking through it again and again would hold up requests
    asyncio.run(_Server(config_of(app, tls, limits), ready).serve([at]))


def config_of(
    app: Any, tls: Certificate | None = None, limits: ServiceLimits | None = None
) -> uvicorn.Config:
    """How an application is served; with a certificate, by HTTPS.

    Messages are not compressed: each listener would have them compressed anew, though all get the same. Who
    asks is who is connected: no header says otherwise.
    """
    return uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        server_header=False,
        date_header=False,
        proxy_headers=False,
        http=partial(_Protocol, (limits or ServiceLimits()).most_connections),  # type: ignore[arg-type]
        ws="websockets-sansio",
        ws_max_size=2**16,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=PATIENCE_S,
        ssl_certfile=None if tls is None else tls.certificate,
        ssl_keyfile=None if tls is None else tls.key,
    )
