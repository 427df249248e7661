"""A page that shows what an environment does: `render_mode="human"`."""

from __future__ import annotations

import asyncio
import json
import threading
import time
import webbrowser
from typing import Any

import uvicorn
from fastapi import FastAPI, WebSocket, WebSocketDisconnect

from farm_ar.errors import InputError
from farm_ar.game_logic.render_state import RenderState
from farm_ar.scenes import Scene
from farm_ar.service.access import Access
from farm_ar.service.network import listening
from farm_ar.web.messages import Json, told_moment, told_scene
from farm_ar.web.pages import add_files

READY_S = 10.0
"""How long a server may take to listen."""


class PageWindow:
    """A page on this machine that shows one moment after the other, to any number who look.

    Args:
        scene: what is shown.
        frames_per_second: `show` waits so that there are no more.
    """

    def __init__(self, scene: Scene, frames_per_second: float) -> None:
        self._scene, self._pause, self._last = scene, 1 / frames_per_second, 0.0
        self._steps = 0
        self._message: str | None = None
        self._viewers: set[asyncio.Queue[str]] = set()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._socket = listening("127.0.0.1", 0)
        self.link = f"http://127.0.0.1:{self._socket.getsockname()[1]}/"
        config = uvicorn.Config(
            self._app(),
            log_level="error",
            ws="websockets-sansio",
            timeout_graceful_shutdown=1,
            lifespan="off",
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, args=([self._socket],), daemon=True)
        self._thread.start()
        end = time.monotonic() + READY_S
        while not self._server.started and time.monotonic() < end:
            time.sleep(0.01)
        webbrowser.open(self.link)

    def show(self, moment: RenderState) -> None:
        """Show a moment from now on."""
        time.sleep(max(0.0, self._last + self._pause - time.monotonic()))
        self._last = time.monotonic()
        self._steps += 1
        state = {"kind": "state", "step": self._steps, **told_moment(moment)}
        price: Json = {"effort_cm": 0.0, "visit_cm": 0.0, "par_cm": None, "snapshots": 0, "over": False}
        self._message = json.dumps({**state, **price}, separators=(",", ":"))
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._tell, self._message)

    def close(self) -> None:
        """The page is not served any more."""
        self._server.should_exit = True
        self._thread.join(timeout=5)
        self._socket.close()

    def _tell(self, message: str) -> None:
        for queue in self._viewers:
            if queue.full():
                queue.get_nowait()
            queue.put_nowait(message)

    def _app(self) -> FastAPI:
        app, access = FastAPI(docs_url=None, redoc_url=None), Access()

        @app.websocket("/games/{name}")
        async def look(socket: WebSocket, name: str) -> None:
            try:
                access.check(socket.headers, socket.query_params)
            except InputError as problem:
                await socket.close(1008, str(problem)[:120])
                return
            await socket.accept()
            self._loop = asyncio.get_running_loop()
            queue: asyncio.Queue[str] = asyncio.Queue(4)
            self._viewers.add(queue)
            try:
                await socket.send_text(json.dumps(self._hello(name)))
                if self._message is not None:
                    await socket.send_text(self._message)
                while True:
                    await socket.send_text(await queue.get())
            except (WebSocketDisconnect, RuntimeError):
                pass
            finally:
                self._viewers.discard(queue)

        @app.get("/recordings.json")
        async def recordings() -> dict[str, Any]:
            return {"recordings": {}, "gallery": {}}

        add_files(app)
        return app

    def _hello(self, name: str) -> Json:
        none: Json = {
            "seed": 0,
            "reid": "",
            "beside": None,
            "jitter": "",
            "gaze": "",
            "gazes": [],
            "methods": [],
        }
        return {"kind": "hello", "game": name, "role": "watcher", **none, **told_scene(self._scene)}
