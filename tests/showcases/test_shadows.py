"""Shadows fall where they belong: worked out by hand from the sun's direction."""

import numpy as np
import pytest

from farm_ar.rendering import Instance, Intrinsics, Renderer, View
from farm_ar.scenes import builtin_scene
from farm_ar.showcases.shadows import (
    FLAG_M,
    MOVED,
    SUN,
    VIRTUAL,
    flag,
    game_before,
    move_building,
    picture,
    shaded_box,
    show_shadows,
    table,
    virtual_instances,
)

FARM = builtin_scene("farm")
CLOTH = np.array([0.025, FLAG_M - 0.02, 0.0])
"""The middle of a flag's cloth."""

ABOVE = View(Intrinsics.of_view(600, 600, np.deg2rad(60.0)), np.array([0.6, 1.2, 0.4]), 0.0, -np.pi / 2)


def cast(point):
    """Where the shadow of a point falls on the table: along the sun's direction."""
    toward = SUN.toward
    return np.array(
        [point[0] - toward[0] / toward[1] * point[1], point[2] - toward[2] / toward[1] * point[1]]
    )


def shaded_ground(place):
    """(P, 2) points of the table that a flag at a place keeps the sun from."""
    renderer = Renderer(table(FARM), SUN, shaded=shaded_box(FARM))
    one = Instance(flag((200, 40, 40)), np.array([place[0], 0.0, place[1]]), 0.0, VIRTUAL)
    lit, dark = renderer.draw(ABOVE), renderer.draw(ABOVE, [one])
    less = (dark.ids == 99) & (dark.rgb.sum(axis=-1, dtype=int) < 0.8 * lit.rgb.sum(axis=-1, dtype=int))
    rows, columns = np.nonzero(less)
    lens, depth = ABOVE.intrinsics, dark.depth[less]
    local = np.stack([(columns - lens.cx) / lens.fx, (rows - lens.cy) / lens.fy, np.ones(len(rows))], axis=1)
    points = (local * depth[:, None]) @ ABOVE.rotation + ABOVE.eye
    return points[:, [0, 2]]


def from_segment(points, a, b):
    share = np.clip(((points - a) @ (b - a)) / ((b - a) @ (b - a)), 0.0, 1.0)
    return np.linalg.norm(points - a - share[:, None] * (b - a), axis=1)


@pytest.mark.parametrize("place", [(0.4, 0.3), (0.7, 0.5)])
def test_a_shadow_lies_where_the_sun_s_direction_puts_it(place):
    points, foot = shaded_ground(place), np.array([place[0], 0.0, place[1]])
    middle = cast(foot + CLOTH)
    assert np.linalg.norm(points - middle, axis=1).min() < 0.004
    pole = from_segment(points, cast(foot), cast(foot + np.array([0.0, FLAG_M, 0.0])))
    cloth = np.linalg.norm(points - middle, axis=1)
    assert np.all((pole < 0.008) | (cloth < 0.05))  # nothing else is dark
    assert len(points) > 100


def test_a_shadow_moves_with_the_virtual_thing():
    first, second = shaded_ground((0.4, 0.3)), shaded_ground((0.55, 0.38))
    assert np.allclose(second.mean(axis=0) - first.mean(axis=0), [0.15, 0.08], atol=0.003)


def test_after_a_snapshot_the_shadow_of_a_flag_is_where_its_building_stands_now(monkeypatch):
    game = game_before()
    before = {one.number: one.position for one in virtual_instances(game)}
    number = VIRTUAL + game.truth.index(MOVED)
    truth = game.truth.position[game.truth.index(MOVED)].copy()
    move_building(game)
    after = {one.number: one.position for one in virtual_instances(game)}
    moved = game.truth.position[game.truth.index(MOVED)] - truth
    step = (after[number] - before[number])[[0, 2]]
    assert np.linalg.norm(moved) > 0.1
    assert np.linalg.norm(step - moved) < 0.05  # the flag turns about its building, too
    flags = [one for one in virtual_instances(game) if one.number == number]
    darker = picture(game, []).astype(int) - picture(game, flags).astype(int)
    assert (darker.sum(axis=-1) > 40).sum() > 200


def test_the_picture_is_written(tmp_path):
    shown = show_shadows(tmp_path, 1, 0, True, lambda what, share: None)
    assert shown.paths[0].stat().st_size > 10_000
