"""Placing in turn: compiled and in plain Python."""

import numpy as np
import pytest

from farm_ar.envs import placement
from farm_ar.envs.placement import Clearance, Placement, place_in_turn, poses_anywhere, poses_nearby
from farm_ar.geometry import wrap


@pytest.mark.parametrize("place", [place_in_turn, place_in_turn.py_func], ids=["compiled", "plain"])
def test_each_gets_the_first_pose_that_keeps_clear_of_those_before_it(place):
    tries = np.array([[[0.5, 0.5, 0.0], [9.0, 9.0, 0.0]], [[0.55, 0.5, 0.3], [0.8, 0.5, 0.3]]])
    position, yaw = np.zeros((2, 2)), np.zeros(2)
    placed, clear = np.zeros(2, dtype=bool), np.ones((2, 2), dtype=bool)
    size = np.full((2, 3), 0.1)
    assert place(np.arange(2), tries, Placement(position, yaw, placed), Clearance(size, clear, 0.01, 0.0))
    np.testing.assert_array_equal(position, [[0.5, 0.5], [0.8, 0.5]])
    assert yaw[1] == 0.3
    assert placed.all()


@pytest.mark.parametrize("place", [place_in_turn, place_in_turn.py_func], ids=["compiled", "plain"])
def test_where_no_pose_keeps_clear_it_says_so_and_leaves_the_object(place):
    tries = np.array([[[0.5, 0.5, 0.0]], [[0.55, 0.5, 0.0]]])
    position, yaw, placed = np.zeros((2, 2)), np.zeros(2), np.zeros(2, dtype=bool)
    apart = (np.zeros((2, 2), dtype=bool), 0.1)  # footprints may overlap, centres must be apart
    room = Clearance(np.full((2, 3), 0.1), apart[0], 0.0, apart[1])
    assert not place(np.arange(2), tries, Placement(position, yaw, placed), room)
    assert placed.tolist() == [True, False]
    np.testing.assert_array_equal(position[1], (0, 0))


@pytest.fixture(params=["compiled", "plain"])
def drawing(request, monkeypatch):
    """The kernels that make poses of what was drawn."""
    if request.param == "compiled":
        return poses_nearby, poses_anywhere
    for name in ("wrap_angle", "within"):
        monkeypatch.setattr(placement, name, getattr(placement, name).py_func)
    return poses_nearby.py_func, poses_anywhere.py_func


def test_poses_nearby_are_normal_about_the_own_ones_inside_and_near_0_where_that_is(drawing, rng):
    home, heading = rng.uniform(0, 1, (4, 2)), np.array([0.1, -0.4, 3.1, 6.0])
    turns, drawn, edge = np.array([2, 0, 3, 1]), rng.normal(size=(4, 30, 3)), np.full((4, 2), 0.07)
    pose = drawing[0](turns, drawn, home, heading, edge, np.array([1.0, 0.8]), (0.05, 0.3), 0.5)
    place = np.clip(home[turns, None] + 0.05 * drawn[..., :2], 0.07, [0.93, 0.73])
    np.testing.assert_allclose(pose[..., :2], place, rtol=0, atol=1e-15)
    turned = wrap(heading[turns, None] + 0.3 * drawn[..., 2])
    near = [False, True, True, True]  # 6.0 is nearly a full turn
    turned[near] = np.clip(turned[near], -0.5, 0.5)
    np.testing.assert_allclose(pose[..., 2], turned, rtol=0, atol=1e-12)
    assert (np.abs(pose[..., 2]) <= np.pi).all()


def test_poses_anywhere_fill_the_room_that_is_left_to_them(drawing):
    drawn = np.array([[[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.5, 0.25, 0.5]]])
    pose = drawing[1](np.array([1]), drawn, np.full((2, 2), 0.1), np.array([1.0, 0.8]), 0.5)
    expected = [[[0.1, 0.1, -0.5], [0.9, 0.7, 0.5], [0.5, 0.2, 0.0]]]
    np.testing.assert_allclose(pose, expected, rtol=0, atol=1e-15)
