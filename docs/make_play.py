"""Films the page in Chromium: two hutches that look alike are exchanged, and the headset is fooled.

    python docs/make_play.py [CHROMIUM]

writes docs/images/play.gif. The game waits for every picture, so the film is as smooth on a busy machine.
"""

import asyncio
import shutil
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import uvicorn
from playwright.sync_api import Page, sync_playwright

from farm_ar.drawing.video import write_gif
from farm_ar.service.network import listening
from farm_ar.web.app import Table, make_web_app
from farm_ar.web.game import Game
from farm_ar.web.pointer import STEPS_PER_SECOND

OUT = Path(__file__).parent / "images" / "play.gif"
SIZE = {"width": 1000, "height": 600}
WIDTH, COLOURS, EVERY, AFTER_S = 720, 128, 5, 4.0
SETTLED_MS = 60
SOFTWARE_GL = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def pictures(page: Page, table: Table, loop: asyncio.AbstractEventLoop) -> Iterator[np.ndarray]:
    """The page after every `EVERY` steps of the game, until some seconds after the headset was fooled."""

    async def further() -> None:
        for _ in range(EVERY):
            table.tick()

    end = None
    while end is None or table.game.steps < end:
        asyncio.run_coroutine_threadsafe(further(), loop).result()
        page.wait_for_function(
            "(step) => Number(document.body.dataset.step) >= step", arg=table.game.steps - 1
        )
        page.wait_for_timeout(SETTLED_MS)
        yield cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
        if end is None and table.game.round.stage == "fooled":
            end = table.game.steps + AFTER_S * STEPS_PER_SECOND


def main() -> None:
    at, app = listening("127.0.0.1", 0), make_web_app()
    server = uvicorn.Server(uvicorn.Config(app, log_level="error", ws="websockets-sansio"))
    threading.Thread(target=server.run, args=([at],), daemon=True).start()
    Game().step()
    chromium = sys.argv[1] if len(sys.argv) > 1 else shutil.which("chromium")
    with sync_playwright() as playwright:
        page = playwright.chromium.launch(executable_path=chromium, args=SOFTWARE_GL).new_page(viewport=SIZE)
        page.goto(f"http://127.0.0.1:{at.getsockname()[1]}/#mode=free")
        page.wait_for_selector("body[data-step]", timeout=60_000)
        page.wait_for_timeout(3000)
        (table,) = app.state.tables.values()
        loop = table.clock.get_loop()
        loop.call_soon_threadsafe(table.clock.cancel)
        page.select_option("#mode", "show")
        while table.game.round.mode != "show":
            page.wait_for_timeout(50)
        shown = list(pictures(page, table, loop))
    write_gif(OUT, shown, STEPS_PER_SECOND / EVERY, WIDTH, COLOURS)
    print(f"Wrote {OUT}, {OUT.stat().st_size / 1e6:.1f} MB, {len(shown)} pictures")


if __name__ == "__main__":
    main()
