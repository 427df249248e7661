"""The table in a room (WebXR), with an emulated headset: found, placed, played with the controller.

Needs npm and the packages of web/package-lock.json; where they cannot be had the test is skipped.
"""

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


def test_the_table_stands_where_it_was_put_and_the_controller_is_the_hand(in_room: Page) -> None:
    page, inside = in_room, in_room.page
    inside.evaluate(LOOK_DOWN)
    inside.locator("#ar").click()
    news = inside.locator("#news")
    page.until(lambda: news.inner_text().startswith("Look at a table"))

    def trigger(value: int) -> None:
        inside.evaluate(TRIGGER, value)
        inside.wait_for_timeout(300)

    def placed() -> bool:
        trigger(1)
        trigger(0)
        return bool(news.inner_text().startswith("Point at a building"))

    page.until(placed)  # once the surface is found
    x, y, z = inside.evaluate("corner")
    assert (x, y) == (pytest.approx(-0.6, abs=0.02), pytest.approx(0.76, abs=0.02))  # on the desk of the room
    assert z == pytest.approx(-0.1, abs=0.05)
    start = page.place("orange-coop")
    inside.evaluate(AIM, start)
    page.hand_at(*start)
    trigger(1)
    page.until(lambda: page.game.world.tabletop.hand.gripped is not None)
    inside.evaluate(AIM, [0.6, 0.15])
    page.hand_at(0.6, 0.15)
    trigger(0)
    page.until(lambda: page.game.world.tabletop.hand.gripped is None)
    inside.evaluate(AIM, [3.0, 0.3])
    page.until(lambda: len(page.game.world.sightings) == 1)
    moved = page.place("orange-coop")
    assert moved == (pytest.approx(0.6, abs=0.02), pytest.approx(0.15, abs=0.02))
    assert not page.wrong


def test_without_such_a_device_there_is_no_button(open_page: Any) -> None:
    assert not open_page().page.locator("#ar").is_visible()
