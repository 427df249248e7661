"""The page in Chromium: mouse, keys, a finger, links, a server that comes back, nothing from elsewhere."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import settings

from farm_ar.envs import first_difference
from farm_ar.geometry import footprints_overlap
from farm_ar.web.pointer import Pointer
from farm_ar.web.recordings import demonstrations
from tests.web.conftest import Page, serving


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
    assert not page.page.locator("#starting").is_visible()
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
    page.page.click("#begin")
    page.until(lambda: "Snapshot" not in page.page.locator("#news").inner_text())
    assert not page.wrong
    assert all(url.startswith(("http://127.0.0.1:", "data:", "blob:")) for url in page.asked)


def test_what_fools_it_is_kept_as_the_least_but_not_what_an_earlier_visit_did(open_page) -> None:
    page = open_page("#seed=0")
    news, record = page.page.locator("#news"), page.page.locator("#record")
    first, second = page.place("magenta-hutch"), page.place("purple-hutch")
    page.drag("magenta-hutch", 0.6, 0.15)
    page.drag("purple-hutch", *first)
    page.drag("magenta-hutch", *second)
    page.leave()
    page.until(lambda: news.inner_text().startswith("Snapshot 1: "))

    def marked_on_the_table(label: str) -> bool:  # the lower edge of the plate that stands there is red
        x, z = page.place(label)
        red, green, blue = page.colour_at(x + 0.03, z + 0.0044)
        return red > 120 and max(green, blue) < 90

    assert not marked_on_the_table("purple-hutch")
    page.page.keyboard.press("t")
    page.until(lambda: news.inner_text().startswith("Snapshot 1. It was fooled for "))
    page.until(lambda: marked_on_the_table("purple-hutch") and marked_on_the_table("magenta-hutch"))
    assert not marked_on_the_table("yellow-coop")
    kept = record.inner_text()
    assert kept == f"Your least: spatial fooled for {page.game.effort_cm:.1f} cm."
    marked = page.page.locator("#answers li", has=page.page.locator("strong"))
    assert {one.split()[0] for one in marked.all_inner_texts()} == {"magenta-hutch", "purple-hutch"}
    page.drag("blue-coop", 0.6, 0.15)
    page.leave()
    page.until(lambda: news.inner_text().endswith("after earlier visits: no record."))
    assert record.inner_text() == kept
    page.page.select_option("#method", "nearest")
    page.until(lambda: page.game.reid == "nearest")
    page.until(lambda: record.inner_text() == "")
    assert not page.wrong


def test_a_second_method_is_shown_beside_the_first(open_page) -> None:
    page = open_page()
    page.page.select_option("#beside", "nearest")
    page.until(lambda: page.game.beside == "nearest")
    page.drag("blue-coop", 0.6, 0.15)
    page.leave()
    rows = page.page.locator("#answers li")
    page.until(lambda: rows.count() > 0)
    said = [one.split() for one in rows.all_inner_texts()]
    assert all(one.index("nearest:") < len(one) - 1 for one in said)
    assert len(said) == len(page.game.world.sightings[-1].source) - 1  # the shed
    assert "beside=nearest" in page.page.url
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
    yaw = page.game.world.truth.yaw[page.game.world.truth.index("cyan-hutch")]
    finger("touchStart", (x, y), (x + 60, y))
    for angle in (0.2, 0.4, 0.6):  # clockwise, as seen from above
        finger("touchMove", (x, y), (x + 60 * np.cos(angle), y + 60 * np.sin(angle)))
    page.until(lambda: abs(page.game.world.tabletop.hand.yaw - 0.6) < 0.02)
    finger("touchEnd")
    page.until(lambda: len(page.game.world.sightings) == 1)
    turned = page.game.world.truth.yaw[page.game.world.truth.index("cyan-hutch")] - yaw
    assert turned == pytest.approx(0.6, abs=0.02)
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


def test_a_link_to_what_there_is_not_says_so_and_another_game_begins(open_page) -> None:
    page = open_page("#seed=3&reid=magic")
    assert page.page.locator("#news").inner_text().startswith("reid: must be one of")
    assert (page.game.reid, page.game.seed) == ("spatial", 0)


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
    assert page.game.round.facts["adversary"]["wrong"] > 0
    assert news.inner_text().endswith("It wins.")
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
    assert (
        page.page.locator("#truth").get_attribute("aria-pressed") == "false"
    )  # the first visit is not judged unasked
    assert page.page.locator("#mode").input_value() == "free"
    page.page.reload()
    page.page.goto(page.page.url.split("#")[0])
    page.page.wait_for_selector("body[data-step]")
    assert [table.game.round.mode for table in page.app.state.tables.values()] == ["free", "free"]
    assert not page.wrong


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
    page.page.select_option("#mode", "free")
    page.until(lambda: page.page.locator("#news").inner_text().startswith("Your turn: swap two"))
    assert not page.wrong


def test_the_page_comes_back_when_the_server_does(browser) -> None:
    with serving() as (link, app):
        page = Page(browser, link + "#seed=5&mode=tidy", app)
        page.until(lambda: page.game.round.stage == "tidy")
    page.page.wait_for_selector("#lost:not([hidden])", timeout=20_000)
    with serving(int(link.rsplit(":", 1)[1].strip("/"))) as (_, page.app):
        page.page.wait_for_selector("#lost", state="hidden", timeout=20_000)
        news = page.page.locator("#news")
        page.until(
            lambda: news.inner_text().startswith("The connection is back; the server began the game anew")
        )
        assert (page.game.seed, page.game.round.mode) == (5, "tidy")
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
    began = page.game
    page.page.select_option("#watch", "")
    page.page.wait_for_selector("#player", state="hidden", timeout=20_000)
    assert page.game is began
    assert page.page.locator("#watch").input_value() == ""
    assert page.page.locator("#role").inner_text() == ""
    assert not page.page.locator("#lost").is_visible()
    page.page.select_option("#watch", "this game")
    page.page.wait_for_selector("#player:not([hidden])", timeout=30_000)
    assert not page.wrong


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
