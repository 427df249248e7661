"""Placing in turn: compiled and in plain Python."""

import numpy as np
import pytest

from farm_ar.envs.placing import boxes_overlap, place_in_turn
from farm_ar.geometry import footprints_overlap


@pytest.mark.parametrize("place", [place_in_turn, place_in_turn.py_func], ids=["compiled", "plain"])
def test_each_gets_the_first_pose_that_keeps_clear_of_those_before_it(place):
    tries = np.array([[[0.5, 0.5, 0.0], [9.0, 9.0, 0.0]], [[0.55, 0.5, 0.3], [0.8, 0.5, 0.3]]])
    position, yaw = np.zeros((2, 2)), np.zeros(2)
    placed, clear = np.zeros(2, dtype=bool), np.ones((2, 2), dtype=bool)
    size = np.full((2, 3), 0.1)
    assert place(np.arange(2), tries, position, yaw, size, placed, clear, 0.01, 0.0)
    np.testing.assert_array_equal(position, [[0.5, 0.5], [0.8, 0.5]])
    assert yaw[1] == 0.3
    assert placed.all()


@pytest.mark.parametrize("place", [place_in_turn, place_in_turn.py_func], ids=["compiled", "plain"])
def test_where_no_pose_keeps_clear_it_says_so_and_leaves_the_object(place):
    tries = np.array([[[0.5, 0.5, 0.0]], [[0.55, 0.5, 0.0]]])
    position, yaw, placed = np.zeros((2, 2)), np.zeros(2), np.zeros(2, dtype=bool)
    apart = (np.zeros((2, 2), dtype=bool), 0.1)  # footprints may overlap, centres must be apart
    assert not place(
        np.arange(2), tries, position, yaw, np.full((2, 3), 0.1), placed, apart[0], 0.0, apart[1]
    )
    assert placed.tolist() == [True, False]
    np.testing.assert_array_equal(position[1], (0, 0))


def test_plain_and_compiled_overlap_agree_with_the_separating_axes_of_geometry(rng):
    for _ in range(300):
        place, yaw = rng.uniform(0, 0.3, (2, 2)), rng.uniform(-3, 3, 2)
        size = rng.uniform(0.02, 0.2, (2, 3))
        expected = bool(footprints_overlap(place[0], yaw[0], size[0], place[1], yaw[1], size[1]))
        (dx, dz), half = place[1] - place[0], size / 2
        for overlap in (boxes_overlap, boxes_overlap.py_func):
            assert overlap(dx, dz, yaw[0], yaw[1], half[0], half[1]) == expected
