"""Bounds of a scene: any simple polygon anywhere, the room from [0, 0], or none."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import SceneError
from farm_ar.scenes import Bounds, Layout, Scene

LAYOUT = Layout(("a", "b", "c"), ("chair",) * 3, [(1, 2), (4, 2), (1, -2)], [0, 1, 2], np.ones((3, 3)))
NOTCHED = [(0, 0), (4, 0), (4, 3), (2, 3), (2, 1), (0, 1)]
SIDE = st.floats(0.1, 100)


@given(SIDE, SIDE, st.floats(-7, 7), st.floats(-1e5, 1e5))
def test_a_rectangle_is_as_large_wherever_it_stands_and_however_it_is_turned(width, depth, yaw, x):
    bounds = Bounds.rectangle(width, depth, origin=(x, -x), yaw=yaw)
    assert bounds.area == pytest.approx(width * depth, rel=1e-6)
    assert bounds.extent == pytest.approx(np.hypot(width, depth), rel=1e-6)
    right, ahead = np.array([np.cos(yaw), -np.sin(yaw)]), np.array([np.sin(yaw), np.cos(yaw)])
    for across, along, inside in [
        (0.5, 0.5, True),
        (0.99, 0.01, True),
        (-0.01, 0.5, False),
        (0.5, 1.01, False),
    ]:
        place = np.array([x, -x]) + across * width * right + along * depth * ahead
        assert bounds.contains(place) == inside


def test_a_size_means_the_room_from_zero():
    scene = Scene("room", (4, 3), LAYOUT)
    assert scene.bounds.corners.tolist() == [[0, 0], [4, 0], [4, 3], [0, 3]]
    assert scene.size == scene.room == (4, 3)
    assert (scene.area, scene.diagonal) == (12, 5)
    assert Scene("room", None, LAYOUT, bounds=Bounds.rectangle(4, 3)).size == (4, 3)
    assert Scene("room", None, LAYOUT, bounds=Bounds([(0, 3), (4, 3), (4, 0), (0, 0)])).size == (4, 3)


@pytest.mark.parametrize(
    "bounds", [None, Bounds(NOTCHED), Bounds.rectangle(4, 3, (1, 0)), Bounds.rectangle(4, 3, yaw=0.1)]
)
def test_other_bounds_have_no_size_and_say_which_would(bounds):
    scene = Scene("room", None, LAYOUT, bounds=bounds)
    assert scene.room is None
    with pytest.raises(SceneError, match=r"bounds: must be a rectangle from \[0, 0\] along the axes here"):
        _ = scene.size


def test_a_polygon_with_a_notch_has_its_own_area_extent_and_inside():
    scene = Scene("hall", None, LAYOUT, bounds=Bounds(NOTCHED))
    assert scene.area == 4 * 3 - 2 * 2
    assert scene.diagonal == 5
    assert scene.bounds.contains([(1, 0.5), (1, 2), (3, 2), (2, 2), (5, 1)]).tolist() == [
        *(True, False, True, True, False)
    ]


def test_without_bounds_the_extent_of_the_layout_counts_however_it_is_turned():
    scene = Scene("somewhere", None, LAYOUT)
    assert scene.diagonal == 5
    assert scene.area == 12.5
    for angle in (0.3, 1.2, 3.0):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        moved = scene.layout.with_poses(LAYOUT.position @ turn + 1000, LAYOUT.yaw)
        assert Scene("somewhere", None, moved).diagonal == pytest.approx(5)
    small = LAYOUT.with_poses(LAYOUT.position / 10, LAYOUT.yaw)
    assert scene.knowing(small).diagonal == 0.5
    one = LAYOUT.subset([0])
    assert Scene("one", None, one).diagonal == pytest.approx(np.sqrt(2))
    assert Scene("one", None, replace(one, size=np.full((1, 3), np.nan))).diagonal == 1


@pytest.mark.parametrize("bounds", [None, Bounds(NOTCHED)])
def test_a_scene_is_copied_pickled_and_changed_with_its_bounds(bounds):
    scene = Scene("room", None, LAYOUT, symmetry={"chair": 1.0}, bounds=bounds)
    for one in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene), replace(scene, name="room")):
        assert (one.bounds is None) == (bounds is None)
        assert dict(one.symmetry) == {"chair": 1.0}
        assert one.diagonal == scene.diagonal
    assert repr(scene).startswith("Scene('room', ")


@pytest.mark.parametrize(
    ("corners", "message"),
    [
        (
            [(0, 0), (1, 0)],
            r"bounds: must be 3 to 1000 corners \(x, z\), an array of shape \(P, 2\), got \(2, 2\)",
        ),
        (
            [(0, 0), (1, 0), (np.nan, 1)],
            r"bounds\[2\]: must be finite, from -1e6 to 1e6 metres, got \[nan, 1.0\]",
        ),
        ([(0, 0), (1, 0), (1, 0), (0, 1)], r"bounds\[1\]: must not be the corner that follows it"),
        (
            [(0, 0), (1, 0), (0, 1), (1, 1)],
            r"bounds: .* whose sides do not meet, got 'sides 1 and 3 that do'",
        ),
        ([(0, 0), (1, 1), (2, 2)], r"bounds: must be the corners of a polygon"),
    ],
)
def test_what_is_no_simple_polygon_is_refused(corners, message):
    with pytest.raises(SceneError, match=message):
        Bounds(corners)


def test_a_size_is_not_given_beside_other_bounds():
    assert replace(Scene("room", (4, 3), LAYOUT), size=(7, 7)).bounds.area == 49
    with pytest.raises(SceneError, match=r"size_m, bounds: must be one of the two"):
        Scene("room", (4, 3), LAYOUT, bounds=Bounds(NOTCHED))
