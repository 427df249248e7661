"""Bounds of a scene: any simple polygon anywhere, the room from [0, 0], or none."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import SceneError
from farm_ar.scenes import Bounds, CameraPath, Layout, Scene, Site

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


@given(SIDE, SIDE, st.floats(-7, 7), st.floats(-100, 100), st.booleans())
def test_a_rectangle_anywhere_is_moved_into_the_frame_of_its_room(width, depth, yaw, x, reverse):
    share = np.array([(0.1, 0.2), (0.9, 0.3), (0.5, 0.8)])  # of width and depth
    right, ahead = np.array([np.cos(yaw), -np.sin(yaw)]), np.array([np.sin(yaw), np.cos(yaw)])

    def there(places):
        return (x, -x) + places[:, :1] * width * right + places[:, 1:] * depth * ahead

    bounds = Bounds.rectangle(width, depth, (x, -x), yaw)
    if reverse:
        bounds = Bounds(
            np.roll(bounds.corners[::-1], 1, axis=0)
        )  # from the same corner, the other way around
    layout = LAYOUT.with_poses(there(share), np.array([0, 1, 2]) + yaw)
    path = CameraPath(there(np.array([(0.1 * k, 0.1) for k in range(1, 5)])))
    site = Site("S", *there(share[:1])[0])
    room = Scene("hall", None, layout, (site,), path, bounds=bounds).in_room()
    sides = np.array(room.size)
    assert sorted(sides) == pytest.approx(sorted((width, depth)))
    flipped = reverse and sides[0] != pytest.approx(width)
    assert not flipped or np.allclose(sides, (depth, width))
    if sides == pytest.approx([width, depth]) and not reverse:
        near = {"abs": 1e-9 * max(1, abs(x), width, depth)}
        assert room.layout.position == pytest.approx(share * sides, **near)
        assert np.sin(room.layout.yaw - [0, 1, 2]) == pytest.approx(np.zeros(3), abs=1e-9)
        assert room.site_positions == pytest.approx(share[:1] * sides, **near)
        assert room.camera_path.points[:, 1] == pytest.approx(np.full(4, 0.1 * depth), **near)
    before = np.linalg.norm(layout.position[:, None] - layout.position, axis=-1)
    after = np.linalg.norm(room.layout.position[:, None] - room.layout.position, axis=-1)
    assert after == pytest.approx(before)
    assert room.bounds.contains(room.layout.position).all()


def test_a_room_stays_as_it_is_and_other_places_are_refused_in_a_line():
    scene = Scene("room", (4, 3), LAYOUT)
    assert scene.in_room() is scene
    for bounds in (None, Bounds(NOTCHED), Bounds([(0, 0), (4, 0), (5, 3), (1, 3)])):
        with pytest.raises(
            SceneError, match=r"bounds: must be a rectangle here, as size_m, or bounds with a size"
        ):
            Scene("hall", None, LAYOUT, bounds=bounds).in_room()
    blind = LAYOUT.with_poses(LAYOUT.position, [0, np.nan, 0])
    with pytest.raises(SceneError, match=r"objects\[1\]: must have a heading and a size here, got 'b'"):
        Scene("room", (4, 3), blind).in_room()
