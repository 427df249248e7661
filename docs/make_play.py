"""Films the page in Chromium: two hutches that look alike are exchanged, and the headset is fooled.

    python docs/make_play.py [CHROMIUM]

writes docs/images/play.gif.
"""

import base64
import io
import shutil
import sys
import threading
import time
from pathlib import Path
from typing import Any

import uvicorn
from PIL import Image
from playwright.sync_api import Page, sync_playwright

from farm_ar.service.network import listening
from farm_ar.web.app import make_web_app
from farm_ar.web.game import Game

OUT = Path(__file__).parent / "images" / "play.gif"
SIZE = {"width": 1000, "height": 600}
SHOWN = (800, 480)
LEAST_S = 0.15
SOFTWARE_GL = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]

PATH = [
    ("magenta-hutch", (0.6, 0.2)),
    ("cyan-hutch", "magenta-hutch"),
    ("magenta-hutch", "cyan-hutch"),
]
"""What goes where, one after the other; a name stands for where that stood at first."""


class Camera:
    """Keeps what Chromium shows of a page, as it comes."""

    def __init__(self, page: Page) -> None:
        self._page, self._session = page, page.context.new_cdp_session(page)
        self.pictures, self._times = [], []
        self._session.on("Page.screencastFrame", self._keep)
        self._session.send("Page.startScreencast", {"format": "jpeg", "quality": 90})

    def film(self, seconds: float) -> None:
        self._page.wait_for_timeout(1000 * seconds)

    def save(self) -> None:
        palette = self.pictures[-1].quantize(160, Image.Quantize.MAXCOVERAGE)
        first, *rest = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in self.pictures]
        between = zip(self._times, self._times[1:], strict=False)
        shown_ms = [round(1000 * (b - a)) for a, b in between] + [1500]
        first.save(OUT, save_all=True, append_images=rest, duration=shown_ms, loop=0, optimize=True)

    def _keep(self, frame: dict[str, Any]) -> None:
        self._session.send("Page.screencastFrameAck", {"sessionId": frame["sessionId"]})
        time = frame["metadata"]["timestamp"]
        if not self._times or time - self._times[-1] >= LEAST_S:
            picture = Image.open(io.BytesIO(base64.b64decode(frame["data"]))).convert("RGB")
            self.pictures.append(picture.resize(SHOWN, Image.Resampling.LANCZOS))
            self._times.append(time)


def on_page(page: Page, x: float, z: float) -> tuple[float, float]:
    """Where a point of the table is shown."""
    box = page.locator("#above").bounding_box()
    scale = min(box["width"] / 1.38, box["height"] / 0.98)
    return box["x"] + box["width"] / 2 + (x - 0.6) * scale, box["y"] + box["height"] / 2 - (z - 0.4) * scale


def main() -> None:
    at, app = listening("127.0.0.1", 0), make_web_app()
    server = uvicorn.Server(uvicorn.Config(app, log_level="error", ws="websockets-sansio"))
    threading.Thread(target=server.run, args=([at],), daemon=True).start()
    Game().step()
    chromium = sys.argv[1] if len(sys.argv) > 1 else shutil.which("chromium")
    with sync_playwright() as playwright:
        page = playwright.chromium.launch(executable_path=chromium, args=SOFTWARE_GL).new_page(viewport=SIZE)
        page.goto(f"http://127.0.0.1:{at.getsockname()[1]}/")
        page.wait_for_selector("body[data-step]", timeout=60_000)
        time.sleep(3)
        (table,) = app.state.tables.values()
        truth = table.game.world.truth
        stood = {
            name: tuple(place) for name, place in zip(truth.labels, truth.position.tolist(), strict=True)
        }
        camera = Camera(page)
        page.keyboard.press("t")
        camera.film(1)
        for label, goal in PATH:
            now = table.game.world.truth
            start = tuple(now.position[now.index(label)].tolist())
            goal = stood.get(goal, goal)
            page.mouse.move(*on_page(page, *start))
            camera.film(0.9)
            page.mouse.down()
            camera.film(0.2)
            page.mouse.move(*on_page(page, *goal), steps=6)
            camera.film(0.9)
            page.mouse.up()
        page.mouse.move(SIZE["width"] - 20, 20)
        camera.film(4)
        camera.save()
    print(f"Wrote {OUT}, {OUT.stat().st_size / 1e6:.1f} MB, {len(camera.pictures)} pictures")


if __name__ == "__main__":
    main()
