"""What the page draws on its canvas, by single points of it."""

from __future__ import annotations

import json

import numpy as np

from tests.web.conftest import Page, serving

BLUE = (0x2F, 0x6F, 0xD0)


def test_a_label_stays_where_it_was_until_the_headset_has_looked(open_page) -> None:
    """The left end of the blue plate, which is drawn above where the label is believed to be."""
    page = open_page()
    x, z = page.place("blue-coop")

    def blue(x: float, z: float) -> bool:
        return max(abs(a - b) for a, b in zip(page.colour_at(x - 0.06, z + 0.026), BLUE, strict=True)) < 16

    page.until(lambda: blue(x, z))
    page.drag("blue-coop", 0.6, 0.15)
    page.page.wait_for_timeout(300)
    assert blue(x, z)
    assert not blue(0.6, 0.15)
    page.leave()
    page.until(lambda: blue(0.6, 0.15))
    assert not blue(x, z)


def test_what_is_turned_clockwise_is_drawn_so(browser, tmp_path) -> None:
    size, rows = [0.05, 0.05, 0.3], []
    for name, x, yaw in (("one", 0.4, 45), ("two", 0.8, -45)):
        rows.append({"label": name, "category": "bar", "x": x, "z": 0.4, "yaw_deg": yaw, "size_whd": size})
    shed = {
        "label": "shed",
        "category": "shed",
        "x": 0.1,
        "z": 0.7,
        "yaw_deg": 0,
        "size_whd": [0.1, 0.1, 0.1],
    }
    file = tmp_path / "bars.json"
    file.write_text(json.dumps({"size_m": [1.2, 0.8], "objects": [*rows, {**shed, "fixed": True}]}))
    with serving(scene=str(file)) as (link, app):
        page = Page(browser, link + "#seed=0", app)
        layout = page.game.world.truth
        for place, yaw in zip(layout.position[:2], layout.yaw[:2], strict=True):
            along = 0.11 * np.array([np.sin(yaw), np.cos(yaw)])
            across = 0.11 * np.array([np.cos(yaw), -np.sin(yaw)])
            for way in (along, -along):  # the table is green, what has no model is not
                page.until(lambda at=place + way: np.diff(page.colour_at(*at)[:2])[0] < 0)
            for way in (across, -across):
                assert np.diff(page.colour_at(*(place + way))[:2])[0] > 0
        page.close()
