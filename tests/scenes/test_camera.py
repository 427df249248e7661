"""Cameras: what they see, where they are, and the path they wander."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import SceneError, SnapshotError
from farm_ar.geometry import direction
from farm_ar.scenes import PAPER_FIELD_OF_VIEW, Camera, CameraPath, FieldOfView

# Four cubic Béziers that are a circle of radius 1 about (0, 0) to within 0.03%, clockwise seen from above.
KAPPA = 0.5522847498
CIRCLE = np.array(
    [
        (0, 1), (KAPPA, 1), (1, KAPPA), (1, 0), (1, -KAPPA), (KAPPA, -1), (0, -1),
        (-KAPPA, -1), (-1, -KAPPA), (-1, 0), (-1, KAPPA), (-KAPPA, 1), (0, 1),
    ]
)  # fmt: skip


def test_the_papers_field_of_view_is_35_degrees_left_34_right_and_3_m():
    assert np.rad2deg(PAPER_FIELD_OF_VIEW.left) == pytest.approx(35)
    assert np.rad2deg(PAPER_FIELD_OF_VIEW.right) == pytest.approx(34)
    assert PAPER_FIELD_OF_VIEW.range_m == 3
    assert PAPER_FIELD_OF_VIEW.up is None


def test_a_symmetric_field_of_view_has_half_of_the_angle_on_either_side():
    assert FieldOfView.symmetric(1.0, 2.0) == FieldOfView(0.5, 0.5, 2.0)
    assert FieldOfView.symmetric(1.0, 2.0, 0.6) == FieldOfView(0.5, 0.5, 2.0, 0.3, 0.3)


def test_a_field_of_view_may_reach_all_round_and_straight_up_and_down():
    limits = FieldOfView(np.deg2rad(180), np.pi, 1, np.deg2rad(90), np.pi / 2)
    assert (limits.left, limits.right, limits.up, limits.down) == (np.pi, np.pi, np.pi / 2, np.pi / 2)
    assert FieldOfView(0, 0, 1, 0, 0).left == 0


def test_a_field_of_view_holds_plain_numbers_so_that_errors_and_files_show_them_so():
    fov = FieldOfView(np.float64(1), 1, np.float32(2), np.float64(0.5), 0)
    assert {type(value) for value in (fov.left, fov.right, fov.range_m, fov.up, fov.down)} == {float}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"left": -0.1}, r"fov.left: must be an angle from 0 to 180 degrees, got -0.1"),
        ({"left": 3.2}, r"fov.left: must be an angle from 0 to 180 degrees, got 3.2"),
        ({"right": np.nan}, r"fov.right: must be an angle from 0 to 180 degrees, got nan"),
        ({"range_m": 0}, r"fov.range_m: must be positive metres, from 1e-6 to 1e9, got 0.0"),
        ({"range_m": np.nan}, r"fov.range_m: must be positive metres, from 1e-6 to 1e9, got nan"),
        ({"range_m": np.inf}, r"fov.range_m: must be positive metres, from 1e-6 to 1e9, got inf"),
        ({"up": 0.1}, r"fov.up, fov.down: must be given both or neither, got \(0.1, None\)"),
        ({"down": 0.1}, r"fov.up, fov.down: must be given both or neither, got \(None, 0.1\)"),
        ({"up": 1.6, "down": 0.1}, r"fov.up: must be an angle from 0 to 90 degrees, got 1.6"),
        ({"up": 0.1, "down": -0.1}, r"fov.down: must be an angle from 0 to 90 degrees, got -0.1"),
    ],
)
def test_a_field_of_view_out_of_its_limits_is_refused(change, message):
    with pytest.raises(SnapshotError, match=message):
        FieldOfView(**{"left": 0.5, "right": 0.5, "range_m": 3.0} | change)


def test_a_camera_looks_level_and_has_no_height_unless_said_otherwise():
    camera = Camera([1.0, 2.0], 0.5)
    assert camera.batch_shape == ()
    assert camera.pitch == 0.0
    assert camera.height is None
    assert camera.fov == PAPER_FIELD_OF_VIEW


def test_one_height_and_one_pitch_are_those_of_the_whole_batch():
    camera = Camera(np.zeros((2, 3, 2)), np.zeros((2, 3)), height=1.6, pitch=[0.1, 0.2, 0.3])
    assert camera.batch_shape == (2, 3)
    np.testing.assert_array_equal(camera.height, np.full((2, 3), 1.6))
    np.testing.assert_array_equal(camera.pitch, [[0.1, 0.2, 0.3]] * 2)


def test_no_array_of_a_camera_can_be_written_to_even_after_pickling():
    camera = Camera(np.zeros((2, 2)), np.zeros(2), height=1.6)
    for one in (camera, pickle.loads(pickle.dumps(camera))):
        for name in ("position", "yaw", "height", "pitch"):
            with pytest.raises(ValueError, match="read-only"):
                getattr(one, name)[0] = 1.0


def test_a_camera_of_a_batch_is_the_one_at_the_index():
    camera = Camera(np.arange(6).reshape(3, 2), [0.1, 0.2, 0.3], height=[1, 2, 3], pitch=[0.4, 0.5, 0.6])
    one = camera.at(1)
    assert one.batch_shape == ()
    assert (one.position.tolist(), one.yaw, one.height, one.pitch) == ([2, 3], 0.2, 2, 0.5)
    assert one.fov == camera.fov
    assert camera.at(-1).yaw == 0.3


def test_a_camera_of_a_batch_of_two_dimensions_takes_two_indices_and_one_gives_a_row():
    camera = Camera(np.arange(12).reshape(2, 3, 2), np.arange(6).reshape(2, 3))
    assert camera.at((1, 2)).position.tolist() == [10, 11]
    assert camera.at((1, 2)).batch_shape == ()
    assert camera.at(1).yaw.tolist() == [3, 4, 5]
    assert camera.at(1).height is None


def test_a_batch_may_have_no_cameras():
    assert Camera([], []).batch_shape == (0,)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"position": [np.nan, 0.0]},
            r"camera.position\[0\]: must be finite, from -1e6 to 1e6 metres, got nan",
        ),
        ({"yaw": np.inf}, r"camera.yaw: must be finite, at most 1e6 turns, got inf"),
        ({"height": np.nan}, r"camera.height: must be finite, from -1e6 to 1e6 metres, got nan"),
        ({"pitch": -np.inf}, r"camera.pitch: must be finite, at most 1e6 turns, got -inf"),
        (
            {"position": [0.0, 0.0, 0.0]},
            r"camera.position, camera.yaw: must have shapes \(..., 2\) and \(...\)",
        ),
        ({"yaw": [0.0, 1.0]}, r"camera.position, camera.yaw: must have shapes"),
        ({"height": [1.0, 2.0]}, r"camera.height: must fit the yaw's shape \(\), got \(2,\)"),
        ({"pitch": [0.0, 0.0]}, r"camera.pitch: must fit the yaw's shape \(\), got \(2,\)"),
    ],
)
def test_a_camera_that_cannot_be_is_refused_by_the_name_of_its_field(change, message):
    with pytest.raises(SnapshotError, match=message):
        Camera(**{"position": [0.0, 0.0], "yaw": 0.0} | change)


def test_cameras_on_an_open_path_go_from_end_to_end_at_equal_distances():
    # The controls crowd at the start, so that equal steps of the curve's parameter would not be equal steps.
    path = CameraPath([(0, 0), (0.1, 0), (0.2, 0), (3, 0)])
    camera = path.cameras(4, FieldOfView(1, 1, 1))
    np.testing.assert_allclose(camera.position, [(0, 0), (1, 0), (2, 0), (3, 0)], atol=1e-12)
    np.testing.assert_allclose(camera.yaw, np.pi / 2)
    assert camera.fov == FieldOfView(1, 1, 1)


def test_cameras_on_a_closed_path_stand_at_equal_distances_the_last_before_the_first():
    camera = CameraPath(CIRCLE, closed=True).cameras(12)
    np.testing.assert_allclose(camera.position, direction(np.arange(12) * np.pi / 6), atol=2e-3)


def test_cameras_on_a_path_look_along_it():
    camera = CameraPath(CIRCLE, closed=True).cameras(12)
    tangent = np.arange(12) * np.pi / 6 + np.pi / 2
    np.testing.assert_allclose(direction(camera.yaw), direction(tangent), atol=0.05)


@given(
    st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=7, max_size=7, unique=True),
    st.integers(3, 40),
    st.booleans(),
)
def test_cameras_are_never_farther_apart_than_their_share_of_the_path(points, count, closed):
    path = CameraPath(points, closed)
    position = path.cameras(count).position
    share = path.length / (count if closed else count - 1)
    if closed:
        position = np.vstack([position, position[:1]])
    step = np.hypot(*np.diff(position, axis=0).T)
    assert (step <= share * (1 + 1e-9)).all()


def test_the_way_back_belongs_to_a_closed_path_whose_ends_do_not_meet():
    points = [(0, 0), (1, 0), (2, 0), (3, 0)]
    assert CameraPath(points).length == pytest.approx(3)
    path = CameraPath(points, closed=True)
    assert path.length == pytest.approx(6)
    camera = path.cameras(6)
    np.testing.assert_allclose(camera.position[:, 0], [0, 1, 2, 3, 2, 1], atol=1e-12)
    np.testing.assert_allclose(camera.yaw[-1], -np.pi / 2)


def test_the_polyline_runs_from_the_first_anchor_to_the_last():
    path = CameraPath(CIRCLE[:7])
    np.testing.assert_array_equal(path.polyline[[0, -1]], CIRCLE[[0, 6]])
    np.testing.assert_allclose(np.hypot(*path.polyline.T), 1, atol=1e-3)
    assert not path.polyline.flags.writeable
    assert path.length == pytest.approx(np.pi, rel=1e-3)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (CIRCLE[:5], r"camera_path.bezier_points: must be 4, 7, 10, ... points .*, got \(5, 2\)"),
        (CIRCLE[:1], r"camera_path.bezier_points: must be 4, 7, 10, ... points .*, got \(1, 2\)"),
        ([], r"camera_path.bezier_points: must be 4, 7, 10, ... points .*, got \(0,\)"),
        (np.zeros((4, 3)), r"camera_path.bezier_points: must be 4, 7, 10, ... points .*, got \(4, 3\)"),
        (np.ones((4, 2)), r"camera_path.bezier_points: must not all be the same point, got \[1.0, 1.0\]"),
        (
            [(0, 0), (1, np.nan), (2, 2), (3, 3)],
            r"camera_path.bezier_points\[1\]: must be finite, from -1e6 to 1e6 metres, got \[1.0, nan\]",
        ),
    ],
)
def test_a_path_that_cannot_be_is_refused(points, message):
    with pytest.raises(SceneError, match=message):
        CameraPath(points)
