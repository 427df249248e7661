"""What a perturbation has to keep to, against the geometry package."""

import numpy as np
import pytest

from farm_ar.agents.validity import Constraints, are_valid, outside_by, settle

SIZE = np.array([[0.1, 0.1, 0.2], [0.15, 0.1, 0.1], [0.2, 0.1, 0.2]])
BEFORE = np.array([[0.2, 0.2], [0.5, 0.5], [0.8, 0.8]])


def check(
    position, yaw, kernel=are_valid, fixed=(False, False, False), inside=(True, True, True), clear=True
):
    keeps_clear = np.full((3, 3), clear) & ~np.eye(3, dtype=bool)
    limits = Constraints(
        BEFORE, np.zeros(3), SIZE / 2, np.array(fixed), keeps_clear, np.array(inside), np.ones(2)
    )
    return kernel(np.array([position]), np.array([yaw]), limits)[0]


@pytest.mark.parametrize(
    ("x", "whole", "beyond"), [(0.5, True, 0.0), (0.97, True, 0.02), (0.97, False, 0.0), (-0.1, False, 0.1)]
)
def test_objects_or_their_pivots_stay_in_the_room(x, whole, beyond):
    for kernel in (outside_by, outside_by.py_func):
        assert kernel(x, 0.5, 0.0, SIZE[0] / 2, 1.0, 1.0, whole) == pytest.approx(beyond)


def test_what_is_allowed_and_what_is_not():
    still, apart = BEFORE.tolist(), [[0.2, 0.2], [0.5, 0.3], [0.8, 0.8]]
    onto, outside = [[0.2, 0.2], [0.3, 0.2], [0.8, 0.8]], [[0.2, 0.2], [0.5, 0.99], [0.8, 0.8]]
    straight = [0.0, 0.0, 0.0]
    for kernel in (are_valid, are_valid.py_func):
        assert check(still, straight, kernel)
        assert check(apart, straight, kernel)
        assert not check(onto, straight, kernel)
        assert check(onto, straight, kernel, clear=False)
        assert not check(outside, straight, kernel)
        assert check(outside, straight, kernel, inside=(True, False, True))
        assert not check(apart, straight, kernel, fixed=(False, True, False))
        assert not check(still, [0.0, 0.1, 0.0], kernel, fixed=(False, True, False))


def test_not_a_number_is_not_allowed():
    assert not check([[0.2, 0.2], [np.nan, 0.5], [0.8, 0.8]], [0.0, 0.0, 0.0])


def test_what_would_stand_in_something_or_outside_stays_where_it_was():
    wanted = [[0.25, 0.2], [0.27, 0.2], [0.8, 1.2]]
    for kernel in (settle, settle.py_func):
        position, yaw = np.array([wanted]), np.full((1, 3), 0.1)
        keeps_clear = ~np.eye(3, dtype=bool)
        yes = np.full(3, True)
        kernel(position, yaw, Constraints(BEFORE, np.zeros(3), SIZE / 2, ~yes, keeps_clear, yes, np.ones(2)))
        assert position[0].tolist() == [wanted[0], BEFORE[1].tolist(), BEFORE[2].tolist()]
        assert yaw[0].tolist() == [0.1, 0.0, 0.0]
        assert check(position[0], yaw[0])
