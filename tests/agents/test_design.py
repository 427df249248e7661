"""Designed layouts: clear, on the table, and hard to confuse."""

import numpy as np
import pytest

from farm_ar.agents import design as module
from farm_ar.agents.attacks import Analytic, QueryOracle
from farm_ar.agents.cases import draw_case
from farm_ar.agents.design import certified_radius, described, design, with_objects
from farm_ar.errors import OptionError
from farm_ar.geometry import deepest_overlap, footprint_corners
from farm_ar.reid import REIDENTIFIERS
from farm_ar.scenes import builtin_scene


@pytest.fixture(scope="module")
def designed():
    return design(builtin_scene("farm"), np.random.default_rng(0), steps=6000, restarts=2)


def test_a_design_is_at_least_twice_as_clear_as_the_farm(designed):
    assert designed.radius > 2 * certified_radius(builtin_scene("farm"))
    assert designed.radius == certified_radius(designed.scene)


def test_a_design_keeps_to_the_rules(designed):
    farm, layout = builtin_scene("farm"), designed.scene.layout
    corners = footprint_corners(layout.position, layout.yaw, layout.size)[layout.movable]
    assert np.all((corners >= -0.005) & (corners <= np.array(farm.size) + 0.005))
    assert deepest_overlap(layout.position, layout.yaw, layout.size) == 0.0
    assert np.all(np.abs(layout.yaw[layout.movable]) <= np.deg2rad(30.0))
    shed = layout.index("shed")
    np.testing.assert_array_equal(layout.position[shed], farm.layout.position[shed])


def test_a_design_takes_more_to_break(designed):
    least = []
    for scene in (builtin_scene("farm"), designed.scene):
        case = draw_case(scene, 0, 0)
        oracle = QueryOracle(case, REIDENTIFIERS["spatial"](case.scene), 300, 3.0)
        Analytic()(oracle, np.random.default_rng(0))
        least.append(oracle.least)
    assert least[1] > 1.5 * least[0]


def test_the_same_seed_gives_the_same_design():
    first, second = (design(builtin_scene("farm"), np.random.default_rng(1), steps=500) for _ in range(2))
    np.testing.assert_array_equal(first.scene.layout.position, second.scene.layout.position)


def test_a_radius_is_half_of_the_least_distance_within_a_kind():
    scene = builtin_scene("lab")
    layout, weights = scene.layout, scene.cost_weights
    least = min(
        weights.translation * np.linalg.norm(layout.position[i] - layout.position[j]) / scene.diagonal
        + weights.rotation * abs(np.sin((layout.yaw[i] - layout.yaw[j]) / 2))
        for i in range(len(layout))
        for j in range(i)
    )
    found = described(scene)
    assert found.radius == pytest.approx(least / 2)
    assert found.metres == pytest.approx(found.radius * scene.diagonal / weights.translation)
    assert np.sin(np.deg2rad(found.degrees) / 2) == pytest.approx(found.radius / weights.rotation)


def test_as_many_objects_as_asked_for_are_placed():
    scene = with_objects(builtin_scene("farm"), {"coop": 3, "hutch": 1})
    assert scene.layout.labels == ("coop-1", "coop-2", "coop-3", "hutch-1", "shed")
    assert scene.layout.fixed.tolist() == [False] * 4 + [True]
    found = design(scene, np.random.default_rng(0), steps=2000, restarts=1)
    assert found.radius > 0.3


@pytest.mark.parametrize(
    ("counts", "message"),
    [
        ({"barn": 1}, "must be of the categories coop, hutch"),
        ({"coop": -1}, "negative"),
        ({"coop": 0}, "at least one"),
    ],
)
def test_objects_that_cannot_be_placed_are_refused(counts, message):
    with pytest.raises(OptionError, match=message):
        with_objects(builtin_scene("farm"), counts)


def test_a_room_that_is_too_full_is_refused():
    scene = with_objects(builtin_scene("farm"), {"coop": 150})
    with pytest.raises(OptionError, match="few enough"):
        design(scene, np.random.default_rng(0), steps=200, restarts=1)


def test_a_yaw_limit_beyond_half_a_turn_is_refused():
    with pytest.raises(OptionError, match="yaw_limit_deg: must be from 0 to 180"):
        design(builtin_scene("farm"), np.random.default_rng(0), yaw_limit_deg=181.0)


def test_the_kernels_say_the_same_uncompiled(monkeypatch):
    expected = design(builtin_scene("lab"), np.random.default_rng(0), steps=60, restarts=2)
    monkeypatch.setattr(module, "_nearness", module._nearness.py_func)
    monkeypatch.setattr(module, "_spread_out", module._spread_out.py_func)
    again = design(builtin_scene("lab"), np.random.default_rng(0), steps=60, restarts=2)
    np.testing.assert_allclose(again.scene.layout.position, expected.scene.layout.position)
