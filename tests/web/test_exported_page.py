"""The page as files: without a server of ours, and as its sources make it."""

from __future__ import annotations

import re
import subprocess
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest

from farm_ar.web.export import export
from farm_ar.web.gallery import cards_of, shipped_gallery
from farm_ar.web.game import Game
from farm_ar.web.recordings import demonstrations
from tests.web.conftest import ROOT, Page


class QuietHandler(SimpleHTTPRequestHandler):
    def log_message(self, *said: Any) -> None:
        pass


def test_an_exported_page_needs_no_server(browser, tmp_path) -> None:
    game = Game(seed=1)
    for _ in range(20):
        game.step()
    folder = tmp_path / "page"
    written = export(folder, {"mine": game.trace()})
    files = {path.relative_to(folder).as_posix() for path in written}
    assert files >= {"index.html", "recordings/mine.json", "three-LICENSE.txt"}
    assert "Copyright" in (folder / "three-LICENSE.txt").read_text()
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(QuietHandler, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    page = Page(browser, f"http://127.0.0.1:{server.server_address[1]}/", None)
    assert page.page.locator("#watch option").count() == len(demonstrations()) + len(shipped_gallery()) + 2
    assert not page.page.locator("#method").is_visible()
    page.page.select_option("#watch", "mine")
    page.until(lambda: "20 steps" in page.page.locator("#news").inner_text())
    page.page.click("#gallery summary")
    card = list(cards_of(shipped_gallery()).values())[1]
    dot = page.page.locator("#cards svg >> nth=1").locator("circle").first
    x, z = card["ways"][0][:2]
    assert float(dot.get_attribute("cx")) == pytest.approx(x)
    assert float(dot.get_attribute("cy")) == pytest.approx(card["depth"] - z)
    page.page.click("#cards button >> nth=1")
    page.until(lambda: re.search("wrong labels? after", page.page.locator("#news").inner_text()))
    assert page.page.locator("#watch").input_value() == "failure-1"
    page.page.locator("#bar").evaluate(
        "(bar) => { bar.value = bar.max; bar.dispatchEvent(new Event('input')); }"
    )
    page.page.wait_for_selector("#answers strong")
    assert not page.wrong
    page.close()
    server.shutdown()
    server.server_close()


def test_an_exported_page_plays_by_itself(browser, tmp_path) -> None:
    export(tmp_path, {})
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(QuietHandler, directory=str(tmp_path)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    page = Page(browser, f"http://127.0.0.1:{server.server_address[1]}/", None, shown=False)
    news = page.page.locator("#news")
    assert news.inner_text().startswith("Watch:")
    assert "No animals run here" in page.page.locator("#role").inner_text()
    page.until(lambda: news.inner_text().startswith("Fooled for "))
    wrong = page.page.locator("#answers strong")
    page.until(lambda: wrong.count() == 2)
    pair = [one.removeprefix("✗ is ") for one in wrong.all_inner_texts()]
    assert all(one in news.inner_text() for one in pair)
    page.page.click("#onward")
    page.until(lambda: news.inner_text().startswith("Your turn:"))
    assert page.page.locator("#answers li").count() == 0
    assert not page.wrong
    assert all(url.startswith(("http://127.0.0.1:", "data:", "blob:")) for url in page.asked)
    page.close()
    server.shutdown()
    server.server_close()


def test_an_exported_page_that_is_opened_as_a_file_says_what_it_needs(browser, tmp_path) -> None:
    export(tmp_path, {})
    page = browser.new_page()
    page.goto((tmp_path / "index.html").as_uri())
    assert "a web server" in page.locator("#starting").inner_text()
    page.close()


def test_the_bundle_is_what_its_sources_make(packages) -> None:
    """Where the packages cannot be had the test is skipped."""
    static = packages.parent / "farm_ar" / "web" / "static"
    static.mkdir(parents=True)
    subprocess.run(["npm", "run", "-s", "check"], cwd=packages, check=True)
    subprocess.run(["npm", "run", "-s", "build"], cwd=packages, check=True)
    made = sorted(file.name for file in static.iterdir())
    assert made == sorted(file.name for file in (ROOT / "farm_ar" / "web" / "static").iterdir())
    for name in made:
        assert (static / name).read_bytes() == (ROOT / "farm_ar" / "web" / "static" / name).read_bytes(), name
