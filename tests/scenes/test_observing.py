"""Observing a layout: what is in view, what hides what, and what the detector makes of it."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import OptionError
from farm_ar.geometry import bearing, direction, distance
from farm_ar.scenes import (
    PAPER_FIELD_OF_VIEW,
    PERFECT,
    UNKNOWN,
    Camera,
    Detector,
    FieldOfView,
    Layout,
    SnapshotBatch,
    load_scene,
    observe,
    observe_many,
    occluded,
    visible,
    whole_in_view,
)

WIDE = FieldOfView(np.pi / 2, np.pi / 2, 100)


def layout(
    position: Any, size: Any = (0.2, 0.2, 0.2), elevation: Any = None, category: tuple[str, ...] | None = None
) -> Layout:
    n = len(position)
    return Layout(
        tuple(f"label {i}" for i in range(n)),
        ("chair",) * n if category is None else category,
        position,
        np.zeros(n),
        np.broadcast_to(size, (n, 3)),
        elevation,
    )


def at(*polar: tuple[float, float]) -> list[Any]:
    """Places seen from the origin, from (degrees to the right of +z, distance)."""
    return [away * direction(np.deg2rad(angle)) for angle, away in polar]


def ahead(fov: FieldOfView = WIDE, **more: Any) -> Camera:
    """A camera at the origin that looks along +z."""
    return Camera([0.0, 0.0], 0.0, fov, **more)


# --- Field of view ---


def test_the_field_of_view_is_asymmetric_35_degrees_left_and_34_right():
    objects = layout(at((-35.1, 2), (-34.9, 2), (0, 2), (33.9, 2), (34.1, 2), (34.9, 2), (180, 2)))
    seen = visible(objects, ahead(PAPER_FIELD_OF_VIEW))
    assert seen.tolist() == [False, True, True, True, False, False, False]


def test_the_field_of_view_turns_with_the_camera():
    # Looking along +x, +z is to the left.
    objects = layout(at((54.9, 2), (55.1, 2), (123.9, 2), (124.1, 2)))
    seen = visible(objects, Camera([0, 0], np.pi / 2))
    assert seen.tolist() == [False, True, True, False]


def test_the_field_of_view_moves_with_the_camera():
    objects = layout([(0, 2), (10, 12)])
    assert visible(objects, Camera([10, 10], 0.0)).tolist() == [False, True]


def test_what_is_out_of_range_is_not_seen():
    assert visible(layout([(0, 2.99), (0, 3), (0, 3.01)]), ahead(PAPER_FIELD_OF_VIEW)).tolist() == [
        True,
        True,
        False,
    ]


def test_a_field_of_view_all_round_sees_behind():
    assert visible(layout(at((180, 1), (-170, 1), (90, 1))), ahead(FieldOfView(np.pi, np.pi, 2))).all()


# Eyes 1.5 m above the floor, looking 30 degrees down, 10 degrees to the upper and lower edge each: the floor
# is in view from 1.5 / tan(40) = 1.79 m to 1.5 / tan(20) = 4.12 m.
DOWN = {"height": 1.5, "pitch": np.deg2rad(-30)}
NARROW = FieldOfView(1, 1, 100, np.deg2rad(10), np.deg2rad(10))


def test_the_vertical_field_of_view_follows_the_pitch():
    objects = layout([(0, 1.75), (0, 1.85), (0, 4.05), (0, 4.2)])
    assert visible(objects, ahead(NARROW, **DOWN)).tolist() == [False, True, True, False]


def test_the_vertical_field_of_view_may_reach_farther_down_than_up():
    fov = FieldOfView(1, 1, 100, np.deg2rad(10), np.deg2rad(20))  # now from 1.5 / tan(50) = 1.26 m
    objects = layout([(0, 1.2), (0, 1.3), (0, 4.05), (0, 4.2)])
    assert visible(objects, ahead(fov, **DOWN)).tolist() == [False, True, True, False]


def test_the_vertical_field_of_view_minds_how_high_an_object_stands():
    # 3 m away, the view reaches from 1.5 - 3 tan(40) = -1.02 to 1.5 - 3 tan(20) = 0.41 m above the floor.
    objects = layout([(0, 3)] * 4, elevation=[-1.1, -0.95, 0.35, 0.5])
    assert visible(objects, ahead(NARROW, **DOWN)).tolist() == [False, True, True, False]


def test_without_a_height_there_is_no_vertical_limit():
    assert visible(layout([(0, 0.1), (0, 50)]), ahead(NARROW)).all()


def test_without_a_vertical_field_of_view_the_height_does_not_matter():
    assert visible(layout([(0, 0.1), (0, 50)]), ahead(WIDE, **DOWN)).all()


# --- Occlusion ---


def test_an_object_behind_a_nearer_one_is_hidden_and_the_nearer_one_is_not():
    objects = layout([(0, 1), (0, 2), (0.5, 2)])
    assert occluded(objects, ahead()).tolist() == [False, True, False]


def test_without_occlusion_everything_in_the_field_of_view_is_seen():
    assert visible(layout([(0, 1), (0, 2)]), ahead()).all()


def test_with_occlusion_only_what_is_not_hidden_is_seen():
    objects = layout([(0, 1), (0, 2), (0.5, 2), (0, -3)])
    assert visible(objects, ahead(), occlusion=True).tolist() == [True, False, True, False]


def test_what_is_out_of_view_can_still_hide():
    # The near one's pivot lies to the left of the field of view, its right half across the line of sight.
    objects = layout([(-0.9, 1), (0, 2)], size=(2, 1, 0.2))
    assert visible(objects, ahead(FieldOfView(0.5, 0.5, 9)), occlusion=True).tolist() == [False, False]


def test_a_footprint_hides_as_it_is_turned():
    # 2 m wide and thin, 1 m ahead: across the line of sight when facing +z, along it a quarter turn later.
    objects = layout([(-0.5, 1), (0, 2)], size=(2, 1, 0.01))
    assert occluded(objects, ahead()).tolist() == [False, True]
    turned = objects.with_poses(objects.position, [np.pi / 2, 0])
    assert occluded(turned, ahead()).tolist() == [False, False]


def test_a_tall_object_hides_what_stands_behind_it_and_a_low_one_does_not():
    # From eyes 1.5 m high to the middle of the one behind, .25 m high and 2 m away, the line is .81 to .94 m
    # high where the nearer one stands.
    for height, hides in ((1.2, True), (0.95, True), (0.8, False), (0.4, False)):
        objects = layout([(0, 1), (0, 2)], size=[(0.2, height, 0.2), (0.2, 0.5, 0.2)])
        assert occluded(objects, ahead(height=1.5)).tolist() == [False, hides]
        assert occluded(objects, ahead()).tolist() == [False, True]


def test_what_hangs_above_the_line_of_sight_hides_nothing():
    objects = layout([(0, 1), (0, 2)], size=(0.2, 0.5, 0.2), elevation=[1.0, 0.0])
    assert not occluded(objects, ahead(height=1.5)).any()
    lower = layout([(0, 1), (0, 2)], size=(0.2, 0.5, 0.2), elevation=[0.6, 0.0])
    assert occluded(lower, ahead(height=1.5)).tolist() == [False, True]


@pytest.mark.parametrize("height", [None, 0.3])
def test_a_chair_under_a_table_is_not_hidden_by_it_but_one_behind_it_is(height):
    size = [(1.2, 0.7, 1.2), (0.4, 0.9, 0.4), (0.4, 0.9, 0.4)]
    objects = layout([(0, 2), (0, 2.4), (0, 3)], size=size)
    assert occluded(objects, ahead(height=height)).tolist() == [False, False, True]


@pytest.mark.parametrize("height", [None, 0.3, 1.5])
@pytest.mark.parametrize("place", [(0, 0), (0, 0.3), (0.2, -0.1), (0, 2)])
def test_an_object_never_hides_itself(height, place):
    assert not occluded(layout([place], size=(1, 1, 1)), ahead(height=height)).any()


@pytest.mark.parametrize("height", [None, 0.3])
def test_what_the_camera_stands_in_hides_nothing(height):
    objects = layout([(0.2, 0.1), (0, 2)], size=(1, 1, 1))
    assert not occluded(objects, ahead(height=height)).any()


def test_what_the_eye_is_above_hides_what_its_edge_covers():
    # A table 1.4 m deep below eyes 1.5 m high; the line to the far object passes its far edge .98 m high.
    far = (0.2, 0.5, 0.2)
    objects = layout([(0, 0), (0, 1)], size=[(1, 1.1, 1.4), far])
    assert occluded(objects, ahead(height=1.5)).tolist() == [False, True]
    lower = layout([(0, 0), (0, 1)], size=[(1, 0.6, 1.4), far])
    assert not occluded(lower, ahead(height=1.5)).any()


COORDINATE = st.floats(-3, 3)


@given(
    st.lists(st.tuples(COORDINATE, COORDINATE, st.floats(-4, 4)), min_size=1, max_size=6),
    st.sampled_from([None, 0.3, 1.0]),
    st.booleans(),
)
def test_a_batch_is_seen_as_its_members_are_one_by_one(places, height, occlusion):
    rng = np.random.default_rng(len(places))
    single = layout(np.array(places)[:, :2], size=(0.5, 0.5, 0.5))
    position = single.position + rng.normal(0, 0.3, (4, 1, *single.position.shape))
    yaw = rng.normal(0, 1, (4, 1, len(places)))
    many = single.with_poses(position, yaw)
    heights = None if height is None else height + np.array([0.0, 0.1, 0.2])
    fov = FieldOfView(1, 1.2, 3, 0.5, 0.6)
    cameras = Camera(rng.normal(0, 1, (3, 2)), rng.normal(0, 2, 3), fov, heights, [-0.3, 0, 0.1])
    seen, hidden = visible(many, cameras, occlusion), occluded(many, cameras)
    assert seen.shape == hidden.shape == (4, 3, len(places))
    for i in range(4):
        for j in range(3):
            one = single.with_poses(position[i, 0], yaw[i, 0])
            np.testing.assert_array_equal(seen[i, j], visible(one, cameras.at(j), occlusion))
            np.testing.assert_array_equal(hidden[i, j], occluded(one, cameras.at(j)))


@given(st.lists(st.tuples(COORDINATE, COORDINATE), min_size=1, max_size=8), st.sampled_from([None, 0.3]))
def test_what_is_seen_is_in_the_field_of_view_and_not_hidden(places, height):
    objects, camera = layout(places, size=(0.5, 0.5, 0.5)), ahead(PAPER_FIELD_OF_VIEW, height=height)
    expected = visible(objects, camera) & ~occluded(objects, camera)
    np.testing.assert_array_equal(visible(objects, camera, occlusion=True), expected)


# --- Boxes that must be wholly in view ---


def projected(objects: Layout, camera: Camera, i: int) -> Any:
    """(8, 2) corners of an object's box in the picture of a camera at the origin; (8,) their depths."""
    half, yaw = objects.size[i] / 2, float(objects.yaw[i])
    signs = np.array([(a, b, c) for a in (-1, 1) for b in (0, 2) for c in (-1, 1)])
    local = signs * half
    x = objects.position[i, 0] + local[:, 0] * np.cos(yaw) + local[:, 2] * np.sin(yaw)
    z = objects.position[i, 1] - local[:, 0] * np.sin(yaw) + local[:, 2] * np.cos(yaw)
    y = objects.elevation[i] + local[:, 1] - float(camera.height)
    pitch = float(camera.pitch)
    ahead_, up = z * np.cos(pitch) + y * np.sin(pitch), y * np.cos(pitch) - z * np.sin(pitch)
    return np.stack([x / ahead_, up / ahead_], axis=1), ahead_


@given(
    st.lists(st.tuples(COORDINATE, COORDINATE), min_size=1, max_size=6),
    st.floats(-1.0, 0.3),
    st.integers(0, 1000),
)
def test_a_box_is_in_view_when_its_projection_is_inside_the_picture(places, pitch, seed):
    rng = np.random.default_rng(seed)
    flat = layout(places, size=rng.uniform(0.1, 0.8, 3), elevation=rng.uniform(0, 0.5, len(places)))
    objects = flat.with_poses(flat.position, rng.uniform(-4, 4, len(places)))
    camera = ahead(FieldOfView(0.4, 0.5, 3.5, 0.25, 0.3), height=1.5, pitch=pitch)
    expected = []
    for i in range(len(objects)):
        picture, depth = projected(objects, camera, i)
        inside = (-np.tan(0.4) <= picture[:, 0]) & (picture[:, 0] <= np.tan(0.5))
        inside &= (-np.tan(0.3) <= picture[:, 1]) & (picture[:, 1] <= np.tan(0.25)) & (depth > 0)
        half = objects.size[i, [0, 2]] / 2
        turn = np.array([[np.cos(objects.yaw[i]), np.sin(objects.yaw[i])],
                         [-np.sin(objects.yaw[i]), np.cos(objects.yaw[i])]])  # fmt: skip
        corners = [objects.position[i] + turn @ (half * s) for s in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
        expected.append(inside.all() and max(np.linalg.norm(corners, axis=1)) <= 3.5)
    assert whole_in_view(objects, camera).tolist() == expected
    seen = observe(objects, camera, Detector(whole=True))[1]
    assert set(seen) == {
        label for label, all_of_it in zip(objects.labels, expected, strict=True) if all_of_it
    }


def test_one_corner_out_of_view_is_enough_to_miss_an_object_whose_pivot_is_in_view():
    camera = ahead(FieldOfView.symmetric(np.deg2rad(43), 10, np.deg2rad(29)), height=1.6, pitch=-0.35)
    objects = layout([(0, 1.2), (0, 3), (1.3, 3.4)], size=(0.5, 0.9, 0.5))
    assert visible(objects, camera).tolist() == [False, True, True]
    assert whole_in_view(objects, camera).tolist() == [False, True, False]


def test_without_heights_the_footprint_must_be_in_view():
    objects = layout(at((0, 2), (33.5, 2), (0, 2.95)), size=(0.2, 5.0, 0.2))
    assert visible(objects, ahead(PAPER_FIELD_OF_VIEW)).tolist() == [True, True, True]
    assert whole_in_view(objects, ahead(PAPER_FIELD_OF_VIEW)).tolist() == [True, False, False]


def test_what_has_no_known_size_counts_by_its_pivot():
    objects = layout(at((33.5, 2)), size=(np.nan,) * 3)
    assert whole_in_view(objects, ahead(PAPER_FIELD_OF_VIEW)).tolist() == [True]


def test_wholly_in_view_and_not_hidden_go_together():
    objects = layout([(0, 1), (0, 2), (3, 0.5)])
    detector = Detector(occlusion=True, whole=True)
    assert not detector.random
    assert observe(objects, ahead(PAPER_FIELD_OF_VIEW), detector)[1] == ("label 0",)


@given(st.lists(st.tuples(COORDINATE, COORDINATE), min_size=1, max_size=5))
def test_a_batch_of_boxes_is_seen_as_its_members_one_by_one(places):
    rng = np.random.default_rng(len(places))
    single = layout(places, size=(0.5, 0.5, 0.5))
    position = single.position + rng.normal(0, 0.3, (4, 1, *single.position.shape))
    many = single.with_poses(position, rng.normal(0, 1, (4, 1, len(places))))
    cameras = Camera(
        rng.normal(0, 1, (3, 2)), rng.normal(0, 2, 3), FieldOfView(1, 1.2, 3, 0.5, 0.6), 1.0, -0.3
    )
    seen = visible(many, cameras, whole=True)
    for i in range(4):
        for j in range(3):
            one = single.with_poses(position[i, 0], many.yaw[i, 0])
            np.testing.assert_array_equal(seen[i, j], whole_in_view(one, cameras.at(j)))


# --- Snapshots ---


def test_a_perfect_detector_reports_every_object_in_view_exactly_as_it_is():
    objects = Layout(
        ("a", "b", "c"),
        ("chair", "table", "chair"),
        [(0.5, 2), (0, -1), (-0.5, 1)],
        [0.1, 0.2, 0.3],
        [(1, 2, 3), (4, 5, 6), (7, 8, 9)],
        [0.1, 0.2, 0.3],
    )
    snapshot, truth = observe(objects, ahead())
    seen = snapshot.detections
    assert truth == ("c", "a")
    assert seen.category == ("chair", "chair")
    assert seen.position.tolist() == [[-0.5, 1], [0.5, 2]]
    assert seen.yaw.tolist() == [0.3, 0.1]
    assert seen.size.tolist() == [[7, 8, 9], [1, 2, 3]]
    assert seen.elevation.tolist() == [0.3, 0.1]
    assert (seen.confidence == 1).all()
    assert seen.ids == ("0", "1")
    assert snapshot.camera.fov == WIDE


def test_a_snapshot_keeps_its_cameras_height_and_pitch():
    snapshot, _ = observe(layout([(0, 1)]), ahead(height=1.5, pitch=-0.2))
    assert (float(snapshot.camera.height), float(snapshot.camera.pitch)) == (1.5, -0.2)


def test_an_observer_who_minds_occlusion_does_not_report_what_is_hidden():
    objects = layout([(0, 1), (0, 2)])
    assert observe(objects, ahead(), Detector(occlusion=True))[1] == ("label 0",)
    assert observe(objects, ahead())[1] == ("label 0", "label 1")


@given(st.lists(st.tuples(COORDINATE, COORDINATE), max_size=8), st.floats(-4, 4))
def test_detections_stand_from_left_to_right(places, yaw):
    camera = Camera([0.1, 0.2], yaw, FieldOfView(1.5, 1.5, 5))
    objects = layout(np.reshape(places, (-1, 2)))
    snapshot, _ = observe(objects, camera)
    angles = bearing(camera.position, camera.yaw, snapshot.detections.position)
    assert (np.diff(angles) >= 0).all()


def test_the_order_of_detections_is_that_of_their_noisy_positions(rng):
    objects = layout([(0, 1)] * 5)
    snapshot, truth = observe(objects, ahead(), Detector(position_sd=0.3), rng)
    angles = bearing(snapshot.camera.position, snapshot.camera.yaw, snapshot.detections.position)
    assert (np.diff(angles) >= 0).all()
    assert truth != tuple(sorted(truth))


def some_layouts(count: int, n: int = 6) -> Layout:
    rng = np.random.default_rng(count)
    single = layout(np.zeros((n, 2)), category=tuple("chair" if i % 2 else "table" for i in range(n)))
    return single.with_poses(rng.uniform(-3, 3, (count, n, 2)), rng.uniform(-3, 3, (count, n)))


def some_cameras(count: int) -> Camera:
    rng = np.random.default_rng(count)
    return Camera(rng.uniform(-1, 1, (count, 2)), rng.uniform(-3, 3, count), FieldOfView(1, 0.8, 3))


def assert_same_snapshot(batch: SnapshotBatch, index: int, objects: Layout, camera: Camera) -> None:
    snapshot, truth = observe(objects, camera)
    one, other = batch.snapshot(index).detections, snapshot.detections
    assert batch.true_labels(index, objects.labels) == truth
    assert one.category == other.category
    for name in ("position", "yaw", "size", "elevation"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(batch.camera.position[index], camera.position)
    np.testing.assert_array_equal(batch.camera.yaw[index], camera.yaw)


def test_layouts_and_cameras_of_one_batch_shape_go_in_pairs():
    many, cameras = some_layouts(5), some_cameras(5)
    batch = observe_many(many, cameras)
    assert len(batch) == 5
    for i in range(5):
        assert_same_snapshot(batch, i, many.with_poses(many.position[i], many.yaw[i]), cameras.at(i))


def test_layouts_and_cameras_of_crossed_batch_shapes_are_seen_each_from_each():
    many, cameras = some_layouts(4), some_cameras(3)
    crossed = many.with_poses(many.position[:, None], many.yaw[:, None])
    batch = observe_many(crossed, cameras)
    assert len(batch) == 12
    for i in range(4):
        for j in range(3):
            one = many.with_poses(many.position[i], many.yaw[i])
            assert_same_snapshot(batch, 3 * i + j, one, cameras.at(j))


def test_one_layout_may_be_seen_by_many_cameras_and_many_layouts_by_one():
    single, cameras = some_layouts(1).with_poses(some_layouts(1).position[0], np.zeros(6)), some_cameras(4)
    batch = observe_many(single, cameras)
    for i in range(4):
        assert_same_snapshot(batch, i, single, cameras.at(i))
    many, camera = some_layouts(4), some_cameras(1).at(0)
    batch = observe_many(many, camera)
    for i in range(4):
        assert_same_snapshot(batch, i, many.with_poses(many.position[i], many.yaw[i]), camera)


def test_a_batch_is_as_wide_as_its_fullest_snapshot():
    many = layout(np.zeros((2, 2))).with_poses(
        [[(0, 1), (0, -1)], [(0, 1), (0, 2)], [(0, -1), (0, -2)]], np.zeros((3, 2))
    )
    batch = observe_many(many, ahead())
    assert batch.count.tolist() == [1, 2, 0]
    assert batch.position.shape == (3, 2, 2)


def test_the_truth_of_a_batch_indexes_the_labels_of_the_layout(rng):
    many = some_layouts(30)
    batch = observe_many(many, some_cameras(30), Detector(position_sd=1e-9, miss_rate=0.3, false_rate=1), rng)
    for b in range(30):
        for k in range(batch.count[b]):
            label = batch.truth[b, k]
            if label != UNKNOWN:
                np.testing.assert_allclose(batch.position[b, k], many.position[b, label], atol=1e-7)
                assert batch.categories[batch.category[b, k]] == many.category[label]
    assert (batch.truth[np.arange(batch.truth.shape[1]) < batch.count[:, None]] == UNKNOWN).any()


def test_no_cameras_give_no_snapshots(rng):
    nobody = Camera(np.zeros((0, 2)), np.zeros(0))
    for detector in (PERFECT, Detector(occlusion=True), Detector(false_rate=2)):
        batch = observe_many(layout([(0, 1)]), nobody, detector, rng)
        assert len(batch) == 0
        assert batch.position.shape == (0, 0, 2)


@pytest.mark.parametrize("height", [None, 1.5])
def test_no_objects_give_empty_snapshots_even_of_a_detector_that_imagines_things(rng, height):
    nothing = Layout((), (), [], [], [])
    cameras = Camera(np.zeros((3, 2)), np.zeros(3), FieldOfView(1, 1, 3, 1, 1), height)
    for detector in (PERFECT, Detector(occlusion=True, false_rate=5, miss_rate=0.5)):
        batch = observe_many(nothing, cameras, detector, rng)
        assert batch.count.tolist() == [0, 0, 0]
        assert len(batch.snapshot(2).detections) == 0
    assert visible(nothing, cameras, occlusion=True).shape == (3, 0)


@pytest.mark.parametrize(
    ("objects", "camera"),
    [(some_layouts(2), ahead()), (layout([(0, 1)]), some_cameras(1)), (some_layouts(1), some_cameras(1))],
)
def test_one_snapshot_is_of_one_layout_and_one_camera(objects, camera):
    with pytest.raises(
        OptionError, match=r"layout, camera: must be one of each \(for batches: observe_many\)"
    ):
        observe(objects, camera)


# --- What goes wrong ---

MANY = 20_000
MIDDLE = layout([(0, 2)], size=(0.4, 0.8, 1.2))


def many_times(detector: Detector, rng: np.random.Generator, objects: Layout = MIDDLE) -> SnapshotBatch:
    cameras = Camera(np.zeros((MANY, 2)), np.zeros(MANY), PAPER_FIELD_OF_VIEW)
    return observe_many(objects, cameras, detector, rng)


def test_positions_are_detected_with_the_noise_asked_for_and_nothing_else_is(rng):
    batch = many_times(Detector(position_sd=0.05), rng)
    error = batch.position[:, 0] - (0, 2)
    np.testing.assert_allclose(error.mean(axis=0), 0, atol=4 * 0.05 / np.sqrt(MANY))
    np.testing.assert_allclose(error.std(axis=0), 0.05, rtol=4 / np.sqrt(2 * MANY))
    assert abs(np.corrcoef(error.T)[0, 1]) < 4 / np.sqrt(MANY)
    assert (batch.yaw == 0).all()
    assert (batch.size == (0.4, 0.8, 1.2)).all()
    assert (batch.count == 1).all()


def test_headings_are_detected_with_the_noise_asked_for_and_nothing_else_is(rng):
    batch = many_times(Detector(yaw_sd=0.2), rng)
    assert abs(batch.yaw.mean()) < 4 * 0.2 / np.sqrt(MANY)
    assert batch.yaw.std() == pytest.approx(0.2, rel=4 / np.sqrt(2 * MANY))
    assert (batch.position == (0, 2)).all()
    assert (batch.size == (0.4, 0.8, 1.2)).all()


def test_sides_are_detected_with_a_noise_that_is_a_share_of_them_and_nothing_else_is(rng):
    batch = many_times(Detector(size_sd=0.1), rng)
    share = batch.size[:, 0] / (0.4, 0.8, 1.2)
    np.testing.assert_allclose(share.mean(axis=0), 1, atol=4 * 0.1 / np.sqrt(MANY))
    np.testing.assert_allclose(share.std(axis=0), 0.1, rtol=4 / np.sqrt(2 * MANY))
    assert (batch.position == (0, 2)).all()
    assert (batch.yaw == 0).all()


def test_sides_stay_positive_however_much_noise_there_is(rng):
    assert many_times(Detector(size_sd=5), rng).size.min() > 0


def test_objects_are_missed_at_the_rate_asked_for_each_on_its_own(rng):
    objects = layout([(-0.3, 2), (0.3, 2)])
    batch = many_times(Detector(miss_rate=0.3), rng, objects)
    tolerance = 4 * np.sqrt(0.25 / MANY)
    shares = [np.mean(batch.count == seen) for seen in range(3)]
    np.testing.assert_allclose(shares, [0.3**2, 2 * 0.3 * 0.7, 0.7**2], atol=tolerance)
    assert np.mean(batch.truth[batch.count == 1, 0] == 0) == pytest.approx(0.5, abs=2 * tolerance)


def test_a_detector_that_misses_everything_reports_nothing(rng):
    assert not many_times(Detector(miss_rate=1), rng).count.any()


def ghosts(rng: np.random.Generator, rate: float = 2.5) -> tuple[SnapshotBatch, Any]:
    """Snapshots of two objects that are out of view, and which of their entries exist: all are false."""
    objects = layout(
        [(0, -5), (0, -6)],
        size=[(1, 1, 1), (2, 2, 2)],
        elevation=[0.5, 0.7],
        category=("chair", "table"),
    )
    batch = many_times(Detector(false_rate=rate), rng, objects)
    return batch, np.arange(batch.category.shape[1]) < batch.count[:, None]


def test_false_detections_are_as_many_as_a_poisson_distribution_has(rng):
    count = ghosts(rng)[0].count
    assert count.mean() == pytest.approx(2.5, abs=4 * np.sqrt(2.5 / MANY))
    assert count.var() == pytest.approx(2.5, rel=0.05)
    assert np.mean(count == 0) == pytest.approx(np.exp(-2.5), abs=4 * np.sqrt(0.08 / MANY))


def test_false_detections_are_really_nothing(rng):
    batch, exists = ghosts(rng)
    assert (batch.truth[exists] == UNKNOWN).all()
    full = int(np.argmax(batch.count))
    assert batch.true_labels(full, ("a", "b")) == (None,) * batch.count[full]


def test_false_detections_lie_in_view_uniformly_over_its_area(rng):
    batch, exists = ghosts(rng)
    away = distance(batch.camera.position, batch.position)[exists]
    angle = bearing(batch.camera.position, batch.camera.yaw, batch.position)[exists]
    fov = PAPER_FIELD_OF_VIEW
    assert away.max() <= fov.range_m + 1e-9
    assert angle.min() >= -fov.left - 1e-9
    assert angle.max() <= fov.right + 1e-9
    tolerance = 4 / np.sqrt(12 * exists.sum())
    np.testing.assert_allclose(np.mean(away**2) / fov.range_m**2, 0.5, atol=tolerance)
    np.testing.assert_allclose(np.mean((angle + fov.left) / (fov.left + fov.right)), 0.5, atol=tolerance)


def test_false_detections_lie_about_where_the_camera_is(rng):
    camera = Camera([10.0, -7.0], 2.0, FieldOfView(0.3, 0.2, 4))
    snapshot, truth = observe(layout([(0, 0)]), camera, Detector(false_rate=30), rng)
    assert set(truth) == {None}
    assert visible(layout(snapshot.detections.position), camera).all()


def test_false_detections_look_like_objects_of_the_layout_turned_anyhow(rng):
    batch, exists = ghosts(rng)
    category = batch.category[exists]
    like_table = category == batch.categories.index("table")
    assert np.mean(like_table) == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(exists.sum()))
    np.testing.assert_array_equal(batch.size[exists], np.where(like_table, 2, 1)[:, None] * np.ones(3))
    np.testing.assert_array_equal(batch.elevation[exists], np.where(like_table, 0.7, 0.5))
    yaw = batch.yaw[exists]
    assert np.hypot(np.mean(np.sin(yaw)), np.mean(np.cos(yaw))) < 4 / np.sqrt(exists.sum())
    assert yaw.min() < -3
    assert yaw.max() > 3


def test_false_detections_stand_among_the_true_ones_from_left_to_right(rng):
    objects = layout([(0, 2), (0.5, 2)])
    batch = many_times(Detector(false_rate=2), rng, objects)
    angle = bearing(batch.camera.position, batch.camera.yaw, batch.position)
    later_exists = np.arange(1, angle.shape[1]) < batch.count[:, None]
    assert (np.diff(angle, axis=1)[later_exists] >= 0).all()
    assert (batch.truth[:, 0] == UNKNOWN).any()
    assert (batch.truth[:, 0] == 0).any()


def test_categories_are_unknown_at_the_rate_asked_for(rng):
    batch = many_times(Detector(unknown_rate=0.2), rng)
    assert np.mean(batch.category[:, 0] == UNKNOWN) == pytest.approx(0.2, abs=4 * np.sqrt(0.16 / MANY))
    unknown = int(np.argmin(batch.category[:, 0]))
    assert batch.snapshot(unknown).detections.category == (None,)
    assert batch.true_labels(unknown, MIDDLE.labels) == ("label 0",)


def test_the_categories_of_false_detections_are_unknown_at_the_same_rate(rng):
    objects = layout([(0, -5)])
    batch = many_times(Detector(false_rate=1, unknown_rate=0.2), rng, objects)
    exists = np.arange(batch.category.shape[1]) < batch.count[:, None]
    assert np.mean(batch.category[exists] == UNKNOWN) == pytest.approx(
        0.2, abs=4 * np.sqrt(0.16 / exists.sum())
    )


RANDOM = ("position_sd", "yaw_sd", "size_sd", "miss_rate", "false_rate", "unknown_rate")


@pytest.mark.parametrize("name", RANDOM)
def test_a_random_detector_needs_a_generator(name):
    detector = Detector(**{name: 0.1})
    assert detector.random
    with pytest.raises(OptionError, match="rng: must be a numpy random Generator for a detector with noise"):
        observe(MIDDLE, ahead(), detector)


@pytest.mark.parametrize("detector", [PERFECT, Detector(occlusion=True)])
def test_a_detector_without_randomness_needs_no_generator_and_leaves_one_alone(rng, detector):
    assert not detector.random
    state = rng.bit_generator.state
    observe(MIDDLE, ahead(), detector, rng)
    assert rng.bit_generator.state == state


def test_the_same_seed_gives_the_same_snapshots_and_another_seed_does_not():
    detector = Detector(True, 0.1, 0.1, 0.1, 0.1, 1.0, 0.1)

    def seen(seed: int) -> bytes:
        batch = observe_many(some_layouts(9), some_cameras(9), detector, np.random.default_rng(seed))
        return batch.position.tobytes() + batch.yaw.tobytes() + batch.size.tobytes() + batch.truth.tobytes()

    assert seen(1) == seen(1)
    assert seen(1) != seen(2)


@pytest.mark.parametrize("name", ["position_sd", "yaw_sd", "size_sd", "false_rate"])
@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_noise_and_rates_are_not_negative_and_finite(name, value):
    with pytest.raises(OptionError, match=f"{name}: must be a number not below 0, got {value}"):
        Detector(**{name: value})


@pytest.mark.parametrize("name", ["miss_rate", "unknown_rate"])
@pytest.mark.parametrize("value", [-0.1, 1.1, np.nan])
def test_probabilities_are_from_0_to_1(name, value):
    with pytest.raises(OptionError, match=f"{name}: must be a probability, got {value}"):
        Detector(**{name: value})


# --- The paper ---


def test_the_papers_path_of_h1_gives_about_62_snapshots_with_detections_out_of_80(paper_scenes):
    scene = load_scene(paper_scenes / "H1.json")
    batch = observe_many(scene.layout, scene.camera_path.cameras(80, scene.fov))
    assert np.count_nonzero(batch.count) == pytest.approx(62, abs=2)
