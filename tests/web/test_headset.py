"""The table in a room (WebXR), with an emulated headset: found, placed, played with the controller.

Needs npm and the packages of web/package-lock.json; where they cannot be had the test is skipped.
"""

import math
from pathlib import Path
from typing import Any

import pytest

from tests.web.conftest import Page

EMULATED = """
window.device = new IWER.XRDevice(IWER.metaQuest3);
device.installRuntime({ forceInstall: true });
// It takes a matrix where the standard has an XRRigidTransform.
const offset = XRReferenceSpace.prototype.getOffsetReferenceSpace;
XRReferenceSpace.prototype.getOffsetReferenceSpace = function (way) {
  window.corner = [way.position.x, way.position.y, way.position.z];
  return offset.call(this, way.matrix);
};
device.installSEM(IWER_SEM.SyntheticEnvironmentModule);
"""

LOOK_DOWN = """() => {
  device.sem.loadEnvironment(room);
  window.corner = null;
  device.position.set(0, 1.6, 0.5);
  device.quaternion.set(Math.sin(-0.35), 0, 0, Math.cos(-0.35));
}"""

AIM = """([x, z]) => {
  const controller = device.controllers.right, from = [0.2, 1.3, 0.4];
  controller.position.set(...from);
  const way = [corner[0] + x, corner[1], corner[2] - z].map((value, k) => value - from[k]);
  const [dx, dy, dz] = way.map((value) => value / Math.hypot(...way));
  const yaw = Math.atan2(-dx, -dz) / 2, pitch = Math.asin(dy) / 2;
  const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  controller.quaternion.set(cy * sp, sy * cp, -sy * sp, cy * cp);
}"""

TRIGGER = "(value) => device.controllers.right.updateButtonValue('trigger', value)"


@pytest.fixture
def in_room(open_page: Any, packages: Path) -> Page:
    modules = packages / "node_modules"
    room = (modules / "@iwer/sem/captures/office_small.json").read_text()
    scripts = (modules / "iwer/build/iwer.min.js", modules / "@iwer/sem/build/iwer-sem.min.js")
    return open_page(scripts=[*(one.read_text() for one in scripts), EMULATED, f"window.room = {room}"])


def trigger(page: Page, value: int) -> None:
    page.page.evaluate(TRIGGER, value)
    page.page.wait_for_timeout(300)


def selected(page: Page) -> bool:
    """Whether the table stands somewhere after one more select."""
    trigger(page, 1)
    trigger(page, 0)
    return bool(page.page.evaluate("corner !== null"))


def begin(page: Page) -> None:
    page.page.evaluate(LOOK_DOWN)
    page.page.locator("#ar").click()
    page.until(lambda: page.page.locator("#news").inner_text().startswith("Look at a table"))


def test_the_table_stands_where_it_was_put_and_the_controller_is_the_hand(in_room: Page) -> None:
    page, inside = in_room, in_room.page
    begin(page)
    page.until(lambda: selected(page))  # once the surface is found
    x, y, z = inside.evaluate("corner")
    assert (x, y) == (pytest.approx(-0.6, abs=0.02), pytest.approx(0.76, abs=0.02))  # on the desk of the room
    assert z == pytest.approx(-0.1, abs=0.05)
    start = page.place("orange-coop")
    inside.evaluate(AIM, start)
    page.hand_at(*start)
    trigger(page, 1)
    page.until(lambda: page.game.world.tabletop.hand.gripped is not None)
    inside.evaluate(AIM, [0.6, 0.15])
    page.hand_at(0.6, 0.15)
    trigger(page, 0)
    page.until(lambda: page.game.world.tabletop.hand.gripped is None)
    inside.evaluate(AIM, [3.0, 0.3])
    page.until(lambda: len(page.game.world.sightings) == 1)
    moved = page.place("orange-coop")
    assert moved == (pytest.approx(0.6, abs=0.02), pytest.approx(0.15, abs=0.02))
    assert not page.wrong


def test_what_the_device_loses_ends_nothing_but_what_hangs_on_it(in_room: Page) -> None:
    page, inside = in_room, in_room.page
    hand, news = page.game.world.tabletop, inside.locator("#news")
    begin(page)
    for half in (0.6, 0.0):  # the ceiling, then a wall
        inside.evaluate(f"device.quaternion.set({math.sin(half)}, 0, 0, {math.cos(half)})")
        inside.wait_for_timeout(500)
        assert not selected(page)
    inside.evaluate(LOOK_DOWN.replace("device.sem.loadEnvironment(room);", ""))
    page.until(lambda: selected(page))
    inside.evaluate(AIM, page.place("orange-coop"))
    page.hand_at(*page.place("orange-coop"))
    trigger(page, 1)
    page.until(lambda: hand.hand.gripped is not None)
    inside.evaluate("device.controllers.right.connected = device.controllers.left.connected = false")
    page.until(lambda: len(page.game.world.sightings) == 1)  # the hand let go and left
    assert hand.hand.gripped is None
    trigger(page, 0)
    inside.evaluate("device.controllers.right.connected = true")
    inside.evaluate(AIM, page.place("red-coop"))
    page.hand_at(*page.place("red-coop"))
    inside.evaluate("device.recenter()")
    page.until(lambda: news.inner_text().startswith("Look at a table"))
    page.until(lambda: page.game.pointer.away)
    inside.evaluate(LOOK_DOWN.replace("device.sem.loadEnvironment(room);", ""))
    page.until(lambda: selected(page))
    assert not page.wrong


def test_after_the_session_the_page_goes_on_and_another_one_can_be_begun(in_room: Page) -> None:
    page, inside = in_room, in_room.page
    begin(page)
    page.until(lambda: selected(page))
    inside.evaluate(AIM, page.place("orange-coop"))
    page.hand_at(*page.place("orange-coop"))
    trigger(page, 1)
    page.until(lambda: page.game.world.tabletop.hand.gripped is not None)
    inside.evaluate("device.activeSession.end()")
    page.until(lambda: inside.locator("#news").inner_text().startswith(("Back on the page", "Snapshot 1")))
    page.until(lambda: len(page.game.world.sightings) == 1)
    start = page.place("red-coop")
    inside.mouse.move(*page.on_page(*start))
    page.hand_at(*start)
    inside.mouse.down()
    page.until(lambda: page.game.world.tabletop.hand.gripped is not None)
    inside.mouse.up()
    step = inside.evaluate("document.body.dataset.step")
    page.until(lambda: inside.evaluate("document.body.dataset.step") != step)  # it is drawn
    begin(page)
    page.until(lambda: selected(page))
    assert not page.wrong


def test_without_such_a_device_there_is_no_button(open_page: Any) -> None:
    assert not open_page().page.locator("#ar").is_visible()
