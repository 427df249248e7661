"""Nearest places under the certificates' conditions, against a fine grid."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.agents.certificates import nearest
from farm_ar.agents.certificates.nearest import advance_distance, detour, holds
from farm_ar.agents.certificates.regions import clip, distance_to, room_polygon, seen_polygon, way_out
from farm_ar.scenes import Camera, FieldOfView, Layout, visible

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
GRID = np.stack(np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201)), axis=-1).reshape(-1, 2)
NOTHING = np.empty((0, 2))

place = st.tuples(st.floats(-0.5, 1.5), st.floats(-0.5, 1.5)).map(np.array)


def test_the_way_to_the_bisector_is_half_the_distance():
    assert advance_distance(SQUARE, np.array([0.2, 0.5]), np.array([0.8, 0.5]), 0.0) == pytest.approx(0.3)


def test_what_must_be_nearer_by_more_than_the_distance_cannot_be():
    assert advance_distance(SQUARE, np.array([0.2, 0.5]), np.array([0.8, 0.5]), 0.61) == np.inf


def test_what_need_not_be_nearer_stays():
    assert advance_distance(SQUARE, np.array([0.2, 0.5]), np.array([0.8, 0.5]), -0.7) == 0.0


def test_behind_a_wall_the_way_leads_along_it():
    assert advance_distance(SQUARE, np.array([0.5, 0.5]), np.array([1.5, 1.5]), 0.0) == pytest.approx(
        0.5**0.5
    )
    assert advance_distance(SQUARE, np.array([0.5, 0.5]), np.array([2.0, 0.5]), 0.0) == np.inf


@given(place, place, st.floats(-1.0, 1.0))
def test_no_place_of_a_grid_is_nearer(home, goal, ahead):
    found = advance_distance(SQUARE, home, goal, ahead)
    to_home, to_goal = np.linalg.norm(GRID - home, axis=1), np.linalg.norm(GRID - goal, axis=1)
    least = to_home[to_home - to_goal >= ahead].min(initial=np.inf)
    assert found <= least + 1e-9
    if np.isfinite(found):
        # Some place of the square within rounding of the condition is as near as that.
        near_enough = to_home[to_home - to_goal >= ahead - 0.012].min(initial=np.inf)
        assert near_enough <= found + 0.012


@given(place, place)
def test_no_place_of_a_grid_makes_a_shorter_detour(home, goal):
    found = detour(SQUARE, home, goal)
    ways = np.linalg.norm(GRID - home, axis=1) + np.linalg.norm(GRID - goal, axis=1)
    assert found <= ways.min() + 1e-9
    assert ways.min() <= found + 0.01


def test_an_empty_polygon_has_no_places():
    home, goal = np.zeros(2), np.ones(2)
    assert advance_distance(NOTHING, home, goal, 0.0) == detour(NOTHING, home, goal) == np.inf
    assert distance_to(NOTHING, home) == np.inf
    assert not holds(NOTHING, 0.0, 0.0)


@pytest.mark.parametrize(
    ("home", "goal", "ahead"),
    [((0.2, 0.3), (0.9, 0.4), 0.1), ((0.5, 0.5), (1.4, 1.2), -0.2), ((-0.3, 0.2), (1.2, 0.2), 0.0),
     ((0.2, 0.2), (0.2, 0.2), -0.5), ((0.5, -0.2), (0.5, -0.4), -0.2)],
)  # fmt: skip
def test_the_kernels_say_the_same_uncompiled(home, goal, ahead, monkeypatch):
    expected = [advance_distance(SQUARE, np.array(home), np.array(goal), ahead)]
    expected.append(detour(SQUARE, np.array(home), np.array(goal)))
    monkeypatch.setattr(nearest, "holds", nearest.holds.py_func)
    monkeypatch.setattr(nearest, "_roots", nearest._roots.py_func)
    assert advance_distance.py_func(SQUARE, np.array(home), np.array(goal), ahead) == pytest.approx(
        expected[0]
    )
    assert detour.py_func(SQUARE, np.array(home), np.array(goal)) == pytest.approx(expected[1])


def test_roots_of_what_has_none_or_one():
    roots = nearest._roots.py_func
    assert np.isnan(roots(0.0, 0.0, 1.0)).all()
    assert roots(0.0, 2.0, -1.0)[0] == 0.5
    assert roots(1.0, -2.0, 1.0 + 1e-15)[0] == pytest.approx(1.0)
    assert sorted(roots(1.0, -3.0, 2.0)) == [1.0, 2.0]


def looking(yaw):
    return Camera(np.array([0.5, -0.2]), np.array(yaw), FieldOfView(0.5, 0.5, 0.9))


@given(st.floats(-1.0, 1.0), place)
def test_every_place_in_view_and_in_the_room_is_in_the_polygon(yaw, where):
    camera = looking(yaw)
    layout = Layout(("a",), ("c",), where[None], np.zeros(1), np.ones((1, 3)))
    if visible(layout, camera)[0] and np.all((where >= 0) & (where <= 1)):
        assert distance_to(seen_polygon(camera, (1.0, 1.0), 0.0), where) <= 1e-9


def test_the_way_out_of_view_is_the_shortest_one():
    camera = looking(0.0)
    # Half a radian to either side: straight ahead at distance .5 a side is .5 sin(.5) away.
    assert way_out(camera, np.array([0.5, 0.3]), (1.0, 1.0), 0.0) == pytest.approx(0.5 * np.sin(0.5))
    # Near the far end it is beyond that.
    assert way_out(camera, np.array([0.5, 0.65]), (1.0, 1.0), 0.0) == pytest.approx(0.05)


def test_a_way_out_that_cannot_be_told_costs_nothing():
    everything = Camera(np.array([0.5, 0.5]), np.array(0.0), FieldOfView(np.pi, np.pi, 9.0))
    assert way_out(everything, np.array([0.5, 0.6]), (1.0, 1.0), 0.0) == 0.0
    low = Camera(
        np.array([0.5, -0.2]),
        np.array(0.0),
        FieldOfView(0.5, 0.5, 0.9, 0.3, 0.3),
        np.array(0.4),
        np.array(-0.4),
    )
    assert way_out(low, np.array([0.5, 0.3]), (1.0, 1.0), 0.0) == 0.0


def test_clipping_cuts_a_square_in_half():
    half = clip(SQUARE, np.array([1.0, 0.0]), 0.5)
    assert sorted(map(tuple, half.tolist())) == [(0, 0), (0, 1), (0.5, 0), (0.5, 1)]
    assert len(clip(SQUARE, np.array([1.0, 0.0]), -1.0)) == 0
    assert len(clip(NOTHING, np.array([1.0, 0.0]), -1.0)) == 0


def test_the_room_is_inset_on_all_sides():
    assert room_polygon((2.0, 1.0), 0.1).min(axis=0).tolist() == [0.1, 0.1]
    assert room_polygon((2.0, 1.0), 0.1).max(axis=0).tolist() == [1.9, 0.9]


def test_the_kernels_know_their_limits_uncompiled():
    home, goal = np.array([0.2, 0.5]), np.array([0.8, 0.5])
    doubled = np.repeat(SQUARE, 2, axis=0)
    for way in (advance_distance, advance_distance.py_func):
        assert way(NOTHING, home, goal, 0.0) == way(SQUARE, home, goal, 0.7) == np.inf
        assert way(SQUARE, home, goal, -0.7) == 0.0
        assert way(doubled, np.array([0.5, 0.5]), np.array([1.5, 1.5]), 0.0) == pytest.approx(0.5**0.5)
    for sum_of_ways in (detour, detour.py_func):
        assert sum_of_ways(NOTHING, home, goal) == np.inf
        # Mirrored at the edge x = 1: the straight way from (1.5, .2) to (.5, .8).
        assert sum_of_ways(doubled, np.array([1.5, 0.2]), np.array([1.5, 0.8])) == pytest.approx(
            np.hypot(1, 0.6)
        )
        assert sum_of_ways(SQUARE, np.array([1.6, 0.0]), np.array([1.4, 0.0])) == pytest.approx(1.0)
    assert holds.py_func(SQUARE, 0.5, 0.5)
    assert not holds.py_func(SQUARE, 1.5, 0.5)
