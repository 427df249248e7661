"""The order in which objects are met: compiled and in plain Python."""

import numpy as np
import pytest

from farm_ar.envs import table as ordering
from farm_ar.envs.table import Objects, introduce, line_up, meeting_order
from farm_ar.game_logic import visibility
from farm_ar.game_logic.headset import random_camera
from farm_ar.geometry import bearing
from farm_ar.geometry.camera import bearing_to
from farm_ar.scenes import builtin_scene

FARM = builtin_scene("farm")
LAYOUT = FARM.layout


@pytest.mark.parametrize("plain", [False, True])
def test_those_that_move_come_first_then_by_kind_then_from_left_to_right(plain, rng, monkeypatch):
    for _ in range(20):
        camera = random_camera(FARM, FARM.fov, rng)
        angle = bearing(camera.position, camera.yaw, LAYOUT.position)
        expected = np.lexsort((angle, LAYOUT.category_code, LAYOUT.fixed))
        if plain:
            order = np.empty(len(LAYOUT), dtype=np.int64)
            place = (LAYOUT.position, LAYOUT.category_code, LAYOUT.fixed)
            monkeypatch.setattr(ordering, "bearing_to", getattr(bearing_to, "py_func", bearing_to))
            line_up.py_func(visibility.eye_of(camera), *place, np.empty(len(LAYOUT)), order)
        else:
            order = meeting_order(LAYOUT, camera)
        np.testing.assert_array_equal(order, expected)


@pytest.mark.parametrize("kernel", [introduce, introduce.py_func], ids=["compiled", "plain"])
def test_each_is_introduced_with_those_of_its_kind_in_the_same_order(kernel):
    order, kind = np.array([3, 1, 0, 2]), np.array([1, 0, 1, 0])
    objects = Objects(
        *np.zeros((2, 4), dtype=np.int64), np.zeros(4, dtype=bool), np.zeros((4, 3), dtype=np.int64)
    )
    kernel(order, kind, np.array([False, False, True, False]), objects)
    assert objects.number.tolist() == [3, 1, 0, 2]
    assert objects.kind.tolist() == [0, 0, 1, 1]
    assert objects.fixed.tolist() == [False, False, False, True]
    assert objects.rivals.tolist() == [[3, 1, -1], [3, 1, -1], [0, 2, -1], [0, 2, -1]]
