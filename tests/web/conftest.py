"""The page in Chromium, what stands behind it, and the packages of its sources."""

from __future__ import annotations

import os
import shutil
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import uvicorn

from farm_ar.service.network import listening
from farm_ar.web.app import make_web_app
from farm_ar.web.game import Game

ROOT = Path(__file__).parents[2]

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

SOFTWARE_GL = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@contextmanager
def serving(port: int = 0, scene: str = "farm") -> Iterator[tuple[str, Any]]:
    """The page on a port of this machine: its address, and the application."""
    at, app = listening("127.0.0.1", port), make_web_app(scene=scene)
    config = uvicorn.Config(app, log_level="error", ws="websockets-sansio", timeout_graceful_shutdown=1)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, args=([at],), daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.02)
    try:
        yield f"http://127.0.0.1:{at.getsockname()[1]}/", app
    finally:
        server.should_exit = True
        thread.join(timeout=10)
        at.close()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if CHROMIUM is None:
        (pytest.fail if os.environ.get("FARM_AR_CLIENTS") == "all" else pytest.skip)("there is no Chromium")
    api = pytest.importorskip("playwright.sync_api")
    Game().step()  # compiles what is not compiled
    with api.sync_playwright() as playwright:
        one = playwright.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE_GL)
        yield one
        one.close()


class Page:
    """A page, the server's game behind it, and what went wrong."""

    def __init__(
        self, browser: Any, link: str, app: Any, scripts: Sequence[str] = (), **context: Any
    ) -> None:
        context.setdefault("viewport", {"width": 900, "height": 560})
        shown = context.pop("shown", True)
        self.context = browser.new_context(**context)
        if shown:
            self.context.add_init_script(script="localStorage.setItem('shown', 'yes')")
        for script in scripts:
            self.context.add_init_script(script=script)
        self.page = self.context.new_page()
        self.app, self.wrong, self.asked = app, [], []
        self.page.on("console", lambda said: self.wrong.append(said.text) if said.type == "error" else None)
        self.page.on("pageerror", lambda problem: self.wrong.append(str(problem)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(link)
        self.page.wait_for_selector("body[data-step]", timeout=60_000)

    @property
    def game(self) -> Game:
        (table,) = self.app.state.tables.values()
        return table.game

    def on_page(self, x: float, z: float) -> tuple[float, float]:
        """Where a point of the table is shown."""
        box = self.page.locator("#above").bounding_box()
        wide, deep = 0.69, 0.49  # half of what is shown at least: the table and 9 cm about it
        scale = min(box["width"] / (2 * wide), box["height"] / (2 * deep))
        return box["x"] + box["width"] / 2 + (x - 0.6) * scale, box["y"] + box["height"] / 2 - (
            z - 0.4
        ) * scale

    def place(self, label: str) -> tuple[float, float]:
        truth = self.game.world.truth
        return tuple(truth.position[truth.index(label)].tolist())

    def until(self, condition: Callable[[], bool], seconds: float = 60.0) -> None:
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, self.wrong
            self.page.wait_for_timeout(50)

    def colour_at(self, x: float, z: float) -> tuple[int, int, int]:
        """Red, green and blue of what is shown where a point of the table is, 0 to 255."""
        at = self.on_page(x, z)
        clip = {"x": at[0] - 1, "y": at[1] - 1, "width": 3, "height": 3}
        picture = cv2.imdecode(np.frombuffer(self.page.screenshot(clip=clip), np.uint8), cv2.IMREAD_COLOR)
        return tuple(picture[1, 1, ::-1].tolist())

    def drag(self, label: str, x: float, z: float) -> None:
        """Carry a building with the mouse, and let go of it."""
        mouse, hand = self.page.mouse, self.game.world.tabletop
        start = self.place(label)
        mouse.move(*self.on_page(*start))
        self.hand_at(*start)
        mouse.down()
        self.until(lambda: hand.hand.gripped is not None)
        mouse.move(*self.on_page(x, z), steps=5)
        self.hand_at(x, z)
        mouse.up()
        self.until(lambda: hand.hand.gripped is None)

    def leave(self) -> None:
        """Take the mouse from the table, and wait until the headset has looked."""
        seen = len(self.game.world.sightings)
        self.page.mouse.move(880, 10, steps=3)
        self.until(lambda: len(self.game.world.sightings) > seen)

    def hand_at(self, x: float, z: float) -> None:
        self.until(lambda: abs(self.game.world.tabletop.hand.position - [x, z]).max() < 1e-3)

    def close(self) -> None:
        self.context.close()


@pytest.fixture
def open_page(browser: Any) -> Iterator[Callable[..., Page]]:
    pages: list[Page] = []
    with serving() as (link, app):

        def open_one(end: str = "", **context: Any) -> Page:
            pages.append(Page(browser, link + end, app, **context))
            return pages[-1]

        yield open_one
        for page in pages:
            page.close()


@pytest.fixture(scope="session")
def packages(tmp_path_factory) -> Path:
    """The page's sources with the packages of their lock file, which npm fetches."""
    if shutil.which("npm") is None:
        if os.environ.get("FARM_AR_CLIENTS") == "all":
            pytest.fail("there is no npm, and FARM_AR_CLIENTS=all says that nothing is skipped")
        pytest.skip("there is no npm")
    web = tmp_path_factory.mktemp("page") / "web"
    shutil.copytree(ROOT / "web", web, ignore=shutil.ignore_patterns("node_modules"))
    shutil.copytree(ROOT / "clients" / "js", web.parent / "clients" / "js")
    got = subprocess.run(["npm", "ci"], cwd=web, capture_output=True, text=True, check=False)
    if got.returncode:
        pytest.skip(f"npm ci: {got.stderr[-300:]}")
    return web
