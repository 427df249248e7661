"""Placing in turn: compiled and in plain Python."""

import numpy as np
import pytest

from farm_ar.envs import placement
from farm_ar.envs.placement import Clearance, Placement, Strewing, pose_of, strew
from farm_ar.geometry import deepest_overlap, wrap

AS_DRAWN = Strewing(
    False, np.zeros((2, 2)), np.zeros(2), np.full((2, 2), -100.0), np.ones(2), (1.0, 1.0), 1.0
)
"""Numbers are poses."""


@pytest.mark.parametrize("place", [strew, strew.py_func], ids=["compiled", "plain"])
def test_each_gets_the_first_pose_that_keeps_clear_of_those_before_it(place):
    tries = np.array([[[0.5, 0.5, 0.0], [9.0, 9.0, 0.0]], [[0.55, 0.5, 0.3], [0.8, 0.5, 0.3]]])
    position, yaw = np.zeros((2, 2)), np.zeros(2)
    placed, clear = np.zeros(2, dtype=bool), np.ones((2, 2), dtype=bool)
    room = Clearance(np.full((2, 3), 0.1), clear, 0.01, 0.0)
    assert place(np.arange(2), tries, AS_DRAWN, Placement(position, yaw, placed), room)
    np.testing.assert_array_equal(position, [[0.5, 0.5], [0.8, 0.5]])
    assert yaw[1] == 0.3
    assert placed.all()


@pytest.mark.parametrize("place", [strew, strew.py_func], ids=["compiled", "plain"])
def test_where_no_pose_keeps_clear_it_says_so_and_leaves_the_object(place):
    tries = np.array([[[0.5, 0.5, 0.0]], [[0.55, 0.5, 0.0]]])
    position, yaw, placed = np.zeros((2, 2)), np.zeros(2), np.zeros(2, dtype=bool)
    apart = (np.zeros((2, 2), dtype=bool), 0.1)  # footprints may overlap, centres must be apart
    room = Clearance(np.full((2, 3), 0.1), apart[0], 0.0, apart[1])
    assert not place(np.arange(2), tries, AS_DRAWN, Placement(position, yaw, placed), room)
    assert placed.tolist() == [True, False]
    np.testing.assert_array_equal(position[1], (0, 0))


def test_footprints_that_are_turned_keep_clear_as_far_as_their_gap(rng):
    size, clear = rng.uniform(0.05, 0.3, (9, 3)), np.ones((9, 9), dtype=bool)
    how = Strewing(True, np.zeros((9, 2)), np.zeros(9), np.zeros((9, 2)), np.ones(2), (0.0, 0.0), 3.0)
    found = 0
    for _ in range(40):
        position, yaw, placed = np.zeros((9, 2)), np.zeros(9), np.zeros(9, dtype=bool)
        so_far, room = Placement(position, yaw, placed), Clearance(size, clear, 0.02, 0.0)
        found += strew(rng.permutation(9), rng.random((9, 40, 3)), how, so_far, room)
        for i, j in zip(*np.triu_indices(9, 1), strict=True):
            if placed[i] and placed[j]:
                wide = size[[i, j]] + [[0.028, 0, 0.028], [0, 0, 0]]  # by the gap at a corner
                assert deepest_overlap(position[[i, j]], yaw[[i, j]], wide) < 1e-9
    assert found


@pytest.fixture(params=["compiled", "plain"])
def drawing(request, monkeypatch):
    """Makes (K, T, 3) poses of numbers that were drawn for objects."""
    one = pose_of
    if request.param == "plain":
        for name in ("wrap_angle", "within"):
            monkeypatch.setattr(placement, name, getattr(placement, name).py_func)
        one = pose_of.py_func

    def poses(turns, drawn, how):
        return np.array(
            [[one(int(i), *three, how) for three in row] for i, row in zip(turns, drawn, strict=True)]
        )

    return poses


def test_poses_nearby_are_normal_about_the_own_ones_inside_and_near_0_where_that_is(drawing, rng):
    home, heading = rng.uniform(0, 1, (4, 2)), np.array([0.1, -0.4, 3.1, 6.0])
    turns, drawn, edge = np.array([2, 0, 3, 1]), rng.normal(size=(4, 30, 3)), np.full((4, 2), 0.07)
    how = Strewing(False, home, heading, edge, np.array([1.0, 0.8]), (0.05, 0.3), 0.5)
    pose = drawing(turns, drawn, how)
    place = np.clip(home[turns, None] + 0.05 * drawn[..., :2], 0.07, [0.93, 0.73])
    np.testing.assert_allclose(pose[..., :2], place, rtol=0, atol=1e-15)
    turned = wrap(heading[turns, None] + 0.3 * drawn[..., 2])
    near = [False, True, True, True]  # 6.0 is nearly a full turn
    turned[near] = np.clip(turned[near], -0.5, 0.5)
    np.testing.assert_allclose(pose[..., 2], turned, rtol=0, atol=1e-12)
    assert (np.abs(pose[..., 2]) <= np.pi).all()


def test_poses_anywhere_fill_the_room_that_is_left_to_them(drawing):
    drawn = np.array([[[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.5, 0.25, 0.5]]])
    nothing = np.zeros((2, 2)), np.zeros(2)
    how = Strewing(True, *nothing, np.full((2, 2), 0.1), np.array([1.0, 0.8]), (0.0, 0.0), 0.5)
    pose = drawing(np.array([1]), drawn, how)
    expected = [[[0.1, 0.1, -0.5], [0.9, 0.7, 0.5], [0.5, 0.2, 0.0]]]
    np.testing.assert_allclose(pose, expected, rtol=0, atol=1e-15)
