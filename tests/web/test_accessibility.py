"""The page by keys, for screen readers, and with less motion."""

from __future__ import annotations

import pytest


def test_keys_play_the_whole_game(open_page) -> None:
    page = open_page()
    pane, touched = page.page.locator("#above"), page.page.locator("#touched")
    pane.focus()
    pane.press("ArrowUp")
    page.until(lambda: page.game.pointer.x is not None)
    before = page.game.pointer.x, page.game.pointer.z
    for key in ("ArrowRight", "ArrowUp", "e", " "):
        pane.press(key)
    page.until(lambda: page.game.pointer.grip and page.game.pointer.turn > 0.1)
    assert page.game.pointer.x == pytest.approx(before[0] + 0.02)
    assert page.game.pointer.z == pytest.approx(before[1] + 0.02)
    pane.press(" ")
    pane.press("q")
    stands = page.page.locator("#stands li", has_text="orange-coop").inner_text()
    x, z = page.place("orange-coop")
    assert stands == f"orange-coop: {100 * x:.0f} cm from the left, {100 * z:.0f} cm from you"
    while abs(page.game.pointer.x - x) > 0.02 or abs(page.game.pointer.z - z) > 0.02:
        way = x - page.game.pointer.x, z - page.game.pointer.z
        key = ("ArrowLeft", "ArrowRight") if abs(way[0]) > 0.02 else ("ArrowDown", "ArrowUp")
        pane.press(key[int(way[0 if abs(way[0]) > 0.02 else 1] > 0)])
        page.page.wait_for_timeout(50)
    page.until(lambda: touched.inner_text().startswith("Over a coop, "))
    pane.press(" ")
    page.until(lambda: touched.inner_text() == "You hold a coop.")
    for _ in range(3):
        pane.press("ArrowDown")
    page.until(lambda: page.place("orange-coop")[1] < z - 0.05)  # what lets go sets down where the hand is
    pane.press(" ")
    page.until(lambda: touched.inner_text().startswith("Set down "))
    pane.press("Enter")
    page.until(lambda: page.game.pointer.x is None)
    page.until(lambda: len(page.game.world.sightings) == 1)
    moved = page.place("orange-coop")
    assert moved[1] < z - 0.03
    page.until(
        lambda: page.page.locator("#stands li", has_text="orange-coop").inner_text() != stands
    )  # as the headset said
    assert not page.wrong


GO_ON = """async (menu, times) => {
  for (let k = 0; k < times; k += 1) {
    menu.selectedIndex += 1;
    menu.dispatchEvent(new Event("change"));
    await new Promise((soon) => setTimeout(soon));
  }
}"""


def test_keys_go_through_a_menu_without_beginning_what_lies_between(open_page) -> None:
    page = open_page()
    chooser = page.page.locator("#mode")
    chooser.focus()
    chooser.press("ArrowDown")
    first = chooser.input_value()
    page.until(lambda: page.game.round.mode == first)
    began = {first}
    chooser.evaluate(GO_ON, 3)  # fast, for a busy machine takes its time for each key
    page.until(lambda: began.add(page.game.round.mode) or "tidy" in began)
    assert began == {first, "tidy"}
    assert page.page.evaluate("document.activeElement.id") == "mode"
    assert not page.wrong


def test_who_wants_less_motion_is_not_shown_any_unasked(open_page) -> None:
    page = open_page(shown=False, reduced_motion="reduce")
    assert page.game.round.mode == "free"
    page.page.select_option("#mode", "show")
    page.until(lambda: page.game.round.mode == "show")


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
