from itertools import permutations

import numpy as np
import pymunk
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from farm_ar.arrays import FloatArray
from farm_ar.geometry import (
    FRAMES,
    convert_points,
    convert_pose,
    footprint_corners,
    from_pymunk,
    planar_pose,
    pose_matrix,
    to_pymunk,
)

PAIRS = list(permutations(FRAMES, 2))
QUARTER = np.pi / 2

coordinate = st.floats(-10, 10)
places = arrays(np.float64, (3, 2), elements=coordinate)
points = arrays(np.float64, (5, 3), elements=coordinate)
angles = arrays(np.float64, 3, elements=st.floats(-3.1, 3.1))
pitches = arrays(np.float64, 3, elements=st.floats(-1.5, 1.5))
rotations = arrays(np.float64, 3, elements=st.floats(-3, 3)).map(
    lambda v: Rotation.from_rotvec(v).as_matrix()
)


@st.composite
def rigid_poses(draw: st.DrawFn) -> FloatArray:
    pose = np.eye(4)
    pose[:3, :3] = draw(rotations)
    pose[:3, 3] = draw(arrays(np.float64, 3, elements=coordinate))
    return pose


def test_only_our_frame_is_left_handed() -> None:
    handedness = {name: round(np.linalg.det(matrix)) for name, matrix in FRAMES.items()}
    assert handedness == {"unity": 1, "opencv": -1, "ros": -1, "openxr": -1}


@pytest.mark.parametrize(
    ("frame", "expected"),
    [("unity", [1, 2, 3]), ("opencv", [1, -2, 3]), ("ros", [3, -1, 2]), ("openxr", [1, 2, -3])],
)
def test_one_right_two_up_three_forward(frame: str, expected: list[float]) -> None:
    np.testing.assert_array_equal(convert_points(np.array([1.0, 2.0, 3.0]), "unity", frame), expected)


def test_an_opencv_camera_point_in_the_axes_of_a_robot() -> None:
    # 1 to the right, 2 down, 3 ahead: 3 forward, -1 left, -2 up.
    np.testing.assert_array_equal(convert_points(np.array([[1.0, 2.0, 3.0]]), "opencv", "ros"), [[3, -1, -2]])


@pytest.mark.parametrize(("source", "target"), PAIRS)
@given(points=points)
def test_points_come_back_exactly(source: str, target: str, points: FloatArray) -> None:
    there = convert_points(points, source, target)
    np.testing.assert_array_equal(convert_points(there, target, source), points)


@pytest.mark.parametrize(("source", "target"), PAIRS)
@given(pose=rigid_poses())
def test_poses_come_back_exactly_and_stay_rigid(source: str, target: str, pose: FloatArray) -> None:
    there = convert_pose(pose, source, target)
    np.testing.assert_array_equal(convert_pose(there, target, source), pose)
    np.testing.assert_allclose(there[:3, :3] @ there[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(there[:3, :3]) == pytest.approx(1)


@pytest.mark.parametrize(("source", "target"), PAIRS)
@given(pose=rigid_poses(), points=points)
def test_converting_and_placing_points_commute(
    source: str, target: str, pose: FloatArray, points: FloatArray
) -> None:
    def place(pose: FloatArray, points: FloatArray) -> FloatArray:
        return points @ pose[:3, :3].T + pose[:3, 3]

    in_target = place(convert_pose(pose, source, target), convert_points(points, source, target))
    np.testing.assert_allclose(in_target, convert_points(place(pose, points), source, target), atol=1e-9)


@given(points)
def test_a_way_through_a_third_frame_leads_to_the_same_place(points: FloatArray) -> None:
    by_ros = convert_points(convert_points(points, "opencv", "ros"), "ros", "openxr")
    np.testing.assert_array_equal(convert_points(points, "opencv", "openxr"), by_ros)


@pytest.mark.parametrize(("source", "target"), [("blender", "ros"), ("ros", "blender")])
def test_an_unknown_frame_is_named_beside_the_known_ones(source: str, target: str) -> None:
    expected = "unknown frame 'blender', known are unity, opencv, ros, openxr"
    with pytest.raises(ValueError, match=expected):
        convert_points(np.zeros(3), source, target)
    with pytest.raises(ValueError, match=expected):
        convert_pose(np.eye(4), source, target)


def test_what_is_ahead_of_a_camera_that_looks_right_lies_to_the_right() -> None:
    pose = pose_matrix(np.array([1.0, 2.0]), QUARTER, height=1.5)
    two_ahead_one_up = pose @ [0, 1, 2, 1]
    np.testing.assert_allclose(two_ahead_one_up, [3, 2.5, 2, 1])
    three_to_its_right = pose @ [3, 0, 0, 1]
    np.testing.assert_allclose(three_to_its_right, [1, 1.5, -1, 1], atol=1e-12)


def test_what_is_ahead_of_a_camera_that_looks_up_lies_higher() -> None:
    pose = pose_matrix(np.zeros(2), 0.0, pitch=np.deg2rad(30))
    np.testing.assert_allclose(pose @ [0, 0, 2, 1], [0, 1, np.sqrt(3), 1])


def test_the_top_of_a_camera_that_looks_right_and_up_leans_to_the_left() -> None:
    pose = pose_matrix(np.zeros(2), np.array([0.0, QUARTER]), pitch=np.deg2rad(30))
    two_above = pose @ [0, 2, 0, 1]
    np.testing.assert_allclose(two_above[:, :3], [[0, np.sqrt(3), -1], [-1, np.sqrt(3), 0]], atol=1e-12)


def test_a_robot_that_turns_right_turns_by_a_negative_angle_in_ros() -> None:
    pose = convert_pose(pose_matrix(np.array([1.0, 2.0]), QUARTER, height=0.5), "unity", "ros")
    np.testing.assert_allclose(pose[:3, 3], [2, -1, 0.5])
    np.testing.assert_allclose(Rotation.from_matrix(pose[:3, :3]).as_rotvec(), [0, 0, -QUARTER], atol=1e-12)


def test_a_head_that_turns_right_turns_by_a_negative_angle_in_openxr() -> None:
    pose = convert_pose(pose_matrix(np.array([1.0, 2.0]), QUARTER, height=0.5), "unity", "openxr")
    np.testing.assert_allclose(pose[:3, 3], [1, 0.5, -2])
    np.testing.assert_allclose(Rotation.from_matrix(pose[:3, :3]).as_rotvec(), [0, -QUARTER, 0], atol=1e-12)


def test_a_camera_that_looks_up_turns_by_a_positive_angle_about_opencvs_x() -> None:
    pose = convert_pose(pose_matrix(np.zeros(2), 0.0, pitch=0.3), "unity", "opencv")
    np.testing.assert_allclose(Rotation.from_matrix(pose[:3, :3]).as_rotvec(), [0.3, 0, 0], atol=1e-12)


@given(places, angles, arrays(np.float64, 3, elements=coordinate), pitches)
def test_a_pose_on_the_plane_comes_back(
    position: FloatArray, yaw: FloatArray, height: FloatArray, pitch: FloatArray
) -> None:
    back = planar_pose(pose_matrix(position, yaw, height, pitch))
    np.testing.assert_allclose(back.position, position)
    np.testing.assert_allclose(back.yaw, yaw, atol=1e-9)
    np.testing.assert_allclose(back.height, height)
    np.testing.assert_allclose(back.pitch, pitch, atol=1e-9)


@pytest.mark.parametrize("pitch", [QUARTER, -QUARTER])
def test_looking_straight_up_or_down_keeps_the_heading(pitch: float) -> None:
    back = planar_pose(pose_matrix(np.zeros(2), 0.7, pitch=pitch))
    assert float(back.yaw) == pytest.approx(0.7)
    assert float(back.pitch) == pytest.approx(pitch)


def test_a_tilted_head_still_faces_where_it_looks() -> None:
    pose = pose_matrix(np.zeros(2), 0.7, pitch=-0.2)
    roll = np.eye(4)
    roll[:2, :2] = [[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]]
    back = planar_pose(pose @ roll)
    assert float(back.yaw) == pytest.approx(0.7)
    assert float(back.pitch) == pytest.approx(-0.2)


def test_one_place_takes_many_yaws() -> None:
    poses = pose_matrix(np.array([1.0, 2.0]), np.zeros((2, 3)))
    assert poses.shape == (2, 3, 4, 4)
    assert planar_pose(poses).position.shape == (2, 3, 2)


@given(places, angles)
def test_pymunk_poses_come_back(position: FloatArray, yaw: FloatArray) -> None:
    back, back_yaw = from_pymunk(*to_pymunk(position, yaw))
    np.testing.assert_array_equal(back, position)
    np.testing.assert_array_equal(back_yaw, yaw)


def test_a_pymunk_body_covers_the_footprint() -> None:
    size = np.array([0.4, 0.1, 0.2])
    place, angle = to_pymunk(np.array([1.0, 2.0]), 0.5)
    body = pymunk.Body(1, 1)
    body.position, body.angle = tuple(place), float(angle)
    own = footprint_corners(np.zeros(2), 0.0, size)
    corners = [body.local_to_world(tuple(corner)) for corner in own]
    np.testing.assert_allclose(corners, footprint_corners(np.array([1.0, 2.0]), 0.5, size))
