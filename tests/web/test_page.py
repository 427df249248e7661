"""The page in Chromium: mouse, keys, a finger, links, a server that comes back, nothing from elsewhere."""

from __future__ import annotations

import subprocess
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from farm_ar.envs import first_difference
from farm_ar.geometry import footprints_overlap
from farm_ar.web.export import export
from farm_ar.web.gallery import shipped_gallery
from farm_ar.web.game import Game
from farm_ar.web.pointer import Pointer
from farm_ar.web.recordings import demonstrations
from tests.web.conftest import ROOT, Page, serving


def test_dragging_freezes_leaving_looks_and_labels_follow(open_page) -> None:
    page = open_page()
    start, goal = page.place("blue-coop"), (0.6, 0.15)
    page.page.mouse.move(*page.on_page(*start))
    page.hand_at(*start)
    page.page.mouse.down()
    page.until(lambda: page.game.world.tabletop.hand.gripped is not None)
    page.page.mouse.move(*page.on_page(*goal), steps=5)
    page.hand_at(*goal)
    assert page.page.locator("#phase").inner_text().startswith("Hand in view")
    page.page.mouse.wheel(0, 100)
    page.until(lambda: abs(page.game.world.tabletop.hand.yaw) > 0.1)
    page.page.mouse.up()
    page.until(lambda: page.game.world.tabletop.hand.gripped is None)
    page.page.mouse.move(880, 10, steps=3)
    page.page.wait_for_selector("#answers li")
    moved = page.place("blue-coop")
    assert abs(moved[0] - goal[0]) < 0.02
    assert abs(moved[1] - goal[1]) < 0.02
    assert (
        page.page.locator("#answers li").count() == len(page.game.world.sightings[-1].source) - 1
    )  # the shed
    assert "Do you believe it" in page.page.locator("#news").inner_text()
    page.page.keyboard.press("t")
    assert page.page.locator("#truth").get_attribute("aria-pressed") == "true"
    page.until(lambda: "Snapshot 1." in page.page.locator("#news").inner_text())
    assert not page.wrong
    assert all(url.startswith(("http://127.0.0.1:", "data:", "blob:")) for url in page.asked)


def test_keys_play_the_whole_game(open_page) -> None:
    page = open_page()
    pane = page.page.locator("#above")
    pane.focus()
    pane.press("ArrowUp")
    page.until(lambda: page.game.pointer.x is not None)
    before = page.game.pointer.x, page.game.pointer.z
    for key in ("ArrowRight", "ArrowUp", "e", " "):
        pane.press(key)
    page.until(lambda: page.game.pointer.grip and page.game.pointer.turn > 0.1)
    assert page.game.pointer.x == pytest.approx(before[0] + 0.02)
    assert page.game.pointer.z == pytest.approx(before[1] + 0.02)
    pane.press("Enter")
    page.until(lambda: page.game.pointer.x is None)
    assert not page.wrong


def test_a_finger_drags_on_a_phone(open_page) -> None:
    page = open_page(viewport={"width": 390, "height": 780}, has_touch=True, is_mobile=True)
    start = page.place("cyan-hutch")
    x, y = page.on_page(*start)
    touch = page.context.new_cdp_session(page.page)

    def finger(kind: str, *points: tuple[float, float]) -> None:
        told = [{"x": a, "y": b, "id": k} for k, (a, b) in enumerate(points)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": told})

    finger("touchStart", (x, y))
    page.until(lambda: page.game.world.tabletop.hand.gripped is not None)
    x, y = page.on_page(0.5, 0.1)
    finger("touchMove", (x, y))
    page.hand_at(0.5, 0.1)
    finger("touchEnd")
    page.until(lambda: len(page.game.world.sightings) == 1)
    assert not page.wrong
    width = page.page.evaluate("() => document.documentElement.scrollWidth")
    assert width <= 390


def test_a_link_shows_a_game_to_those_who_watch(open_page) -> None:
    page = open_page()
    other = open_page(page.page.url.split("/", 3)[3])
    assert "You watch" in other.page.locator("#role").inner_text()
    other.page.mouse.move(*other.on_page(0.6, 0.4))
    other.page.wait_for_timeout(300)
    assert page.game.pointer.x is None
    page.page.select_option("#method", "likelihood")
    page.until(lambda: page.game.reid == "likelihood")
    page.close()
    other.until(lambda: other.page.locator("#role").inner_text() == "")  # who watched plays on
    assert not page.wrong
    assert not other.wrong


def test_a_duel_is_played_on_the_page(open_page) -> None:
    page = open_page("#seed=3&mode=duel&reid=distance")
    assert (page.game.seed, page.game.reid, page.game.round.mode) == (3, "distance", "duel")
    pane, news = page.page.locator("#above"), page.page.locator("#news")
    page.page.click("#onward")
    page.page.wait_for_selector("body.curtain")
    assert not page.page.locator("#look").is_visible()
    page.page.wait_for_selector("#guesses select", timeout=60_000)
    choosers = page.page.locator("#guesses select")
    assert choosers.count() == len(page.game.round.facts["in_view"])
    assert "cm from the left" in choosers.first.get_attribute("aria-label")
    assert f"0 of {choosers.count()} named" in page.page.locator("#onward").inner_text()
    third = int(page.game.handles.object_of[page.game.round.facts["in_view"][2]])
    page.page.mouse.click(*page.on_page(*page.game.world.truth.position[third].tolist()))
    page.until(lambda: choosers.nth(2).evaluate("(one) => one === document.activeElement"))
    assert page.page.locator("#onward").is_disabled()
    choosers.nth(2).select_option(page.game.world.truth.labels[third])
    page.page.click("#onward")
    page.until(lambda: news.inner_text().startswith("You have 1 of"))
    assert page.page.locator("#answers li").first.inner_text().count("you:") == 1
    page.page.click("#onward")
    page.until(lambda: "your turn" in news.inner_text())
    assert page.page.locator("#stands li").count() == len(page.game.world.truth)
    pane.focus()
    pane.press("ArrowUp")
    page.until(lambda: page.game.world.phase.text == "hand")
    pane.press("Enter")
    page.until(lambda: "0 wrong labels for 0.0 cm" in news.inner_text())
    page.page.click("#onward")
    page.until(lambda: page.game.seed == 4 and page.game.round.stage == "study")
    assert not page.wrong


def test_a_first_visit_is_shown_how_it_is_fooled_and_then_plays(open_page) -> None:
    page = open_page(shown=False)
    news = page.page.locator("#news")
    assert page.game.round.mode == "show"
    page.until(lambda: news.inner_text().startswith("Watch:"), seconds=3)
    page.until(lambda: news.inner_text().startswith("Fooled for "))
    pair = page.game.round.told()["pair"]
    marked = page.page.locator("#answers li", has=page.page.locator("strong"))
    page.until(lambda: marked.count() == 2)
    assert {one.split()[0] for one in marked.all_inner_texts()} == set(pair)
    page.page.click("#onward")
    page.until(lambda: page.game.round.mode == "free")
    page.until(lambda: page.page.locator("#answers li").count() == 0)
    assert page.page.locator("#mode").input_value() == "free"
    page.page.reload()
    page.page.goto(page.page.url.split("#")[0])
    page.page.wait_for_selector("body[data-step]")
    assert [table.game.round.mode for table in page.app.state.tables.values()] == ["free", "free"]
    assert not page.wrong


def test_who_wants_less_motion_is_not_shown_any_unasked(open_page) -> None:
    page = open_page(shown=False, reduced_motion="reduce")
    assert page.game.round.mode == "free"
    page.page.select_option("#mode", "show")
    page.until(lambda: page.game.round.mode == "show")


def test_tidying_up_says_what_is_left_and_keeps_the_best(open_page) -> None:
    page = open_page()
    page.page.select_option("#mode", "tidy")
    page.until(lambda: page.game.round.stage == "tidy")
    page.until(lambda: "left to tidy up" in page.page.locator("#effort").inner_text())
    pane = page.page.locator("#above")
    pane.focus()

    def tidied() -> bool:  # a visit that was too short to be seen is made again
        pane.press("ArrowUp")
        page.page.wait_for_timeout(500)
        pane.press("Enter")
        page.page.wait_for_timeout(2000)
        return bool(page.game.round.stage == "tidied")

    page.until(tidied)
    page.until(lambda: page.page.locator("#record").inner_text() == "Your best: 0.0% tidied up.")
    assert "mode=tidy" in page.page.url
    assert not page.wrong


def test_the_page_comes_back_when_the_server_does(browser) -> None:
    with serving() as (link, app):
        page = Page(browser, link, app)
    page.page.wait_for_selector("#lost:not([hidden])", timeout=20_000)
    with serving(int(link.rsplit(":", 1)[1].strip("/"))):
        page.page.wait_for_selector("#lost", state="hidden", timeout=20_000)
        page.close()


def test_a_demonstration_is_watched_with_a_scrubber_and_the_game_goes_on(open_page) -> None:
    page = open_page()
    name = next(iter(demonstrations()))
    page.page.wait_for_selector(f'#watch option[value="{name}"]', state="attached")
    page.page.select_option("#watch", name)
    page.page.wait_for_selector("#player:not([hidden])", timeout=60_000)
    page.page.locator("#run").click()
    bar = page.page.locator("#bar")
    bar.evaluate("(bar) => { bar.value = bar.max; bar.dispatchEvent(new Event('input')); }")
    page.page.wait_for_selector("#answers li")
    assert "Snapshot" in page.page.locator("#news").inner_text()
    page.page.select_option("#watch", "")
    page.page.wait_for_selector("#player", state="hidden", timeout=20_000)
    page.page.select_option("#watch", "this game")
    page.page.wait_for_selector("#player:not([hidden])", timeout=30_000)
    assert not page.wrong


def test_an_exported_page_needs_no_server(browser, tmp_path) -> None:
    game = Game(seed=1)
    for _ in range(20):
        game.step()
    folder = tmp_path / "page"
    written = export(folder, {"mine": game.trace()})
    assert {path.relative_to(folder).as_posix() for path in written} >= {"index.html", "recordings/mine.json"}
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(QuietHandler, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    page = Page(browser, f"http://127.0.0.1:{server.server_address[1]}/", None)
    assert page.page.locator("#watch option").count() == len(demonstrations()) + len(shipped_gallery()) + 2
    assert not page.page.locator("#method").is_visible()
    page.page.select_option("#watch", "mine")
    page.until(lambda: "20 steps" in page.page.locator("#news").inner_text())
    page.page.click("#gallery summary")
    page.page.click("#cards button >> nth=1")
    page.until(lambda: "wrong labels after" in page.page.locator("#news").inner_text())
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


STORM = """
async ([seed, count, buildings]) => {
  HTMLElement.prototype.setPointerCapture = () => {};  // there are no such pointers
  let state = seed;
  const draw = (most) => {
    state = (Math.imul(state, 1103515245) + 12345) >>> 0;
    return Math.floor((state / 4294967296) * most);
  };
  const pane = document.getElementById("above");
  const box = pane.getBoundingClientRect();
  const kinds = ["pointerdown", "pointermove", "pointermove", "pointerup", "pointercancel", "pointerleave"];
  const keys = ["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", " ", "q", "e", "Enter", "Escape", "t"];
  const pause = (ms) => new Promise((later) => setTimeout(later, ms));
  const cancelable = true, bubbles = true;
  for (let k = 0; k < count; k++) {
    const anywhere = [box.left - 30 + draw(box.width + 60), box.top - 30 + draw(box.height + 60)];
    const [clientX, clientY] = draw(2) ? buildings[draw(buildings.length)] : anywhere;
    const key = keys[draw(keys.length)], deltaY = draw(200) - 100;
    if (draw(5) === 0) pane.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles }));
    else if (draw(8) === 0) pane.dispatchEvent(new WheelEvent("wheel", { deltaY, cancelable }));
    else pane.dispatchEvent(new PointerEvent(kinds[draw(kinds.length)], {
      pointerId: 1 + draw(3), pointerType: draw(2) ? "touch" : "mouse", clientX, clientY, bubbles, cancelable,
    }));
    if (draw(10) === 0) await pause(draw(100));
    if (draw(40) === 0) await pause(300);
    if (draw(150) === 0) {
      document.getElementById("look").click();
      await pause(900);
    }
  }
  for (const pointerId of [1, 2, 3]) pane.dispatchEvent(new PointerEvent("pointerup", { pointerId }));
}
"""


def test_a_storm_of_events_leaves_no_broken_state(open_page) -> None:
    page = open_page()
    buildings = [page.on_page(*place) for place in page.game.world.truth.position.tolist()]
    page.page.evaluate(STORM, [7, 10_000 if settings().max_examples > 50 else 1000, buildings])
    page.page.locator("#look").click()
    page.until(lambda: page.game.pointer == Pointer())
    page.until(lambda: page.game.world.phase.text == "play" and page.game.world.tabletop.hand.gripped is None)
    game, layout = page.game.world, page.game.world.truth
    assert len(game.sightings) > 2
    assert page.game.effort_cm > 0
    assert game.tabletop.on_table(1e-6).all()
    apart = ~footprints_overlap(
        *(values[:, None] for values in (layout.position, layout.yaw, layout.size - 1e-6)),
        *(layout.position, layout.yaw, layout.size - 1e-6),
    )
    assert (apart | np.eye(len(layout), dtype=bool)).all()
    make = page.game.trace_so_far()
    assert first_difference(make()) is None
    start = page.place("red-coop")
    page.page.mouse.move(*page.on_page(*start))
    page.hand_at(*start)  # and the game goes on
    assert not page.wrong


AXE = """async () => (await axe.run({ resultTypes: ["violations"] })).violations
  .flatMap(({ id, nodes }) => nodes.map(({ target }) => `${id}: ${target}`))"""


def test_no_mode_keeps_anybody_out(open_page, packages) -> None:
    """What axe-core finds, at every stage of every mode and on a phone."""
    axe = (packages / "node_modules" / "axe-core" / "axe.min.js").read_text()
    page = open_page(shown=False, scripts=[axe])
    inside, found = page.page, {}

    def check(name: str) -> None:
        if problems := inside.evaluate(AXE):
            found[name] = problems

    check("showing")
    page.until(lambda: page.game.round.stage == "fooled")
    check("fooled")
    inside.click("#onward")
    page.until(lambda: page.game.round.stage == "free")
    for mode in ("guess", "tidy"):
        inside.select_option("#mode", mode)
        page.until(lambda mode=mode: page.game.round.mode == mode)
        inside.wait_for_timeout(300)
        check(mode)
    page.until(lambda: page.game.round.stage == "tidy")
    inside.select_option("#mode", "duel")
    page.until(lambda: page.game.round.mode == "duel")
    inside.click("#onward")
    inside.wait_for_selector("#guesses select", timeout=60_000)
    check("guess")
    inside.locator("#guesses select").first.select_option(index=1)
    inside.click("#onward")
    page.until(lambda: page.game.round.stage == "answered")
    inside.wait_for_selector("#answers strong")
    check("answered")
    inside.set_viewport_size({"width": 390, "height": 844})
    check("on a phone")
    inside.click("#gallery summary")
    inside.click("#cards button >> nth=1")
    inside.wait_for_selector("#player:not([hidden])", timeout=60_000)
    check("a failure")
    assert found == {}
    assert not page.wrong


class QuietHandler(SimpleHTTPRequestHandler):
    def log_message(self, *said: Any) -> None:
        pass


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
