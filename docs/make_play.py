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
        palette = self.pictures[-1].quantize(256, Image.Quantize.FASTOCTREE)
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
        camera = Camera(page)
        page.select_option("#mode", "show")
        while table.game.round.stage != "fooled":
            camera.film(0.5)
        camera.film(4)
        camera.save()
    print(f"Wrote {OUT}, {OUT.stat().st_size / 1e6:.1f} MB, {len(camera.pictures)} pictures")


if __name__ == "__main__":
    main()
