import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from farm_ar.arrays import FloatArray
from farm_ar.geometry import (
    bearing,
    camera_frame,
    direction,
    distance,
    in_vertical_view,
    in_view,
    pose_matrix,
    view_polygon,
)

coordinate = st.floats(-3, 3)
places = st.tuples(coordinate, coordinate).map(np.array)
points3 = st.tuples(coordinate, coordinate, coordinate).map(np.array)
yaws = st.floats(-7, 7)
side = st.floats(0, 5)

ORIGIN = np.zeros(2)
QUARTER = np.pi / 2
ROUND_ABOUT = np.array(
    [[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]]
)  # ahead, right, behind, left at yaw 0


def test_bearings_are_positive_to_the_right_and_behind_is_minus_pi() -> None:
    np.testing.assert_allclose(bearing(ORIGIN, 0.0, ROUND_ABOUT), [0, QUARTER, -np.pi, -QUARTER])
    np.testing.assert_allclose(bearing(ORIGIN, QUARTER, ROUND_ABOUT), [-QUARTER, 0, QUARTER, -np.pi])


@given(places, yaws, places)
def test_going_the_distance_along_the_bearing_leads_to_the_point(
    camera: FloatArray, yaw: float, point: FloatArray
) -> None:
    angle = bearing(camera, yaw, point[None])
    assert np.all((-np.pi <= angle) & (angle < np.pi))
    reached = camera + distance(camera, point[None])[:, None] * direction(yaw + angle)
    np.testing.assert_allclose(reached, point[None], atol=1e-9)


def test_the_ends_of_the_view_and_its_range_are_in_view() -> None:
    points = np.array([[1.0, 1.0], [-1.0, 1.0], [1.01, 1.0], [-1.01, 1.0], [0.0, 2.0], [0.0, 2.01]])
    seen = in_view(points, ORIGIN, 0.0, np.pi / 4, np.pi / 4, 2.0)
    np.testing.assert_array_equal(seen, [True, True, False, False, True, False])


def test_a_lopsided_view_sees_farther_on_its_wide_side() -> None:
    ahead = direction(np.deg2rad([-50.0, -40.0, 60.0, 80.0]))
    seen = in_view(ahead, ORIGIN, 0.0, np.deg2rad(45), np.deg2rad(70), 2.0)
    np.testing.assert_array_equal(seen, [False, True, True, False])


def test_a_point_at_the_camera_is_in_view_wherever_it_looks() -> None:
    assert in_view(np.array([[1.0, 2.0]]), np.array([1.0, 2.0]), 2.5, 0.1, 0.1, 0.0).all()


@pytest.mark.parametrize(("left", "right"), [(np.pi, np.pi), (0.0, 2 * np.pi), (5.0, 1.5), (9.0, 9.0)])
def test_a_view_of_a_full_turn_sees_all_round(left: float, right: float) -> None:
    points = direction(np.linspace(-np.pi, np.pi, 721))
    assert in_view(points, ORIGIN, 0.3, left, right, 2.0).all()
    assert not in_view(points, ORIGIN, 0.3, left, right, 0.9).any()


def test_one_side_of_a_view_may_be_more_than_half_a_turn() -> None:
    points = direction(np.array([3.0, 2.0, -2.0, -3.0]))
    to_the_left = in_view(points, ORIGIN, 0.0, 4.0, 0.1, 2.0)
    np.testing.assert_array_equal(to_the_left, [True, False, True, True])
    to_the_right = in_view(points, ORIGIN, 0.0, 0.1, 4.0, 2.0)
    np.testing.assert_array_equal(to_the_right, [True, True, False, True])


def test_directly_behind_is_the_end_of_a_view_of_half_a_turn_to_the_right() -> None:
    behind = np.array([[0.0, -1.0]])
    assert in_view(behind, ORIGIN, 0.0, 0.0, np.pi, 2.0).all()
    assert in_view(behind, ORIGIN, 0.0, np.pi, 0.0, 2.0).all()
    assert not in_view(behind, ORIGIN, 0.0, 3.14, 3.14, 2.0).any()


@given(places, yaws, side, side, places)
def test_in_view_is_lying_clockwise_of_the_left_end_by_at_most_the_whole_field(
    camera: FloatArray, yaw: float, left: float, right: float, point: FloatArray
) -> None:
    x, z = point - camera
    from_left_end = (math.atan2(x, z) - (yaw - left)) % math.tau
    reach = 2.0
    clear = [from_left_end, math.tau - from_left_end, from_left_end - left - right, math.hypot(x, z) - reach]
    assume(min(map(abs, clear)) > 1e-9)
    assume(math.hypot(x, z) > 0)
    expected = from_left_end <= left + right and math.hypot(x, z) <= reach
    assert in_view(point[None], camera, yaw, left, right, reach) == [expected]


def test_each_camera_of_a_batch_sees_its_own_points() -> None:
    rng = np.random.default_rng(3)
    cameras, cameras_yaw = rng.uniform(-1, 1, (2, 3, 2)), rng.uniform(-3, 3, (2, 3))
    points = rng.uniform(-2, 2, (2, 3, 20, 2))
    left, right, reach = rng.uniform(0.2, 2, (3, 2, 3))
    seen = in_view(points, cameras, cameras_yaw, left, right, reach)
    assert seen.shape == (2, 3, 20)
    assert seen.any()
    for index in np.ndindex(2, 3):
        alone = in_view(
            points[index], cameras[index], cameras_yaw[index], left[index], right[index], reach[index]
        )
        np.testing.assert_array_equal(seen[index], alone)


def test_many_cameras_share_one_set_of_points() -> None:
    seen = in_view(ROUND_ABOUT, np.zeros((4, 2)), np.arange(4) * QUARTER, 0.1, 0.1, 1.0)
    np.testing.assert_array_equal(seen, np.eye(4))


def test_pitch_is_positive_upwards() -> None:
    eye = np.array([0.0, 1.0, 0.0])
    ahead = np.array([[0.0, 1.0, 2.0]])
    np.testing.assert_allclose(camera_frame(ahead, eye, 0.0, np.deg2rad(30)), [[0, -1, np.sqrt(3)]])
    np.testing.assert_allclose(camera_frame(ahead, eye, 0.0, np.deg2rad(-30)), [[0, 1, np.sqrt(3)]])


def test_a_camera_that_looks_to_the_right_has_forward_on_its_left() -> None:
    np.testing.assert_allclose(
        camera_frame(np.array([[0.0, 0.5, 1.0], [3.0, 0.0, 0.0]]), np.zeros(3), QUARTER, 0.0),
        [[-1, 0.5, 0], [0, 0, 3]],
        atol=1e-15,
    )


@given(points3, points3, yaws, yaws)
def test_the_camera_frame_is_the_inverse_of_the_cameras_pose(
    point: FloatArray, eye: FloatArray, yaw: float, pitch: float
) -> None:
    pose = pose_matrix(eye[[0, 2]], yaw, eye[1], pitch)
    expected = np.linalg.solve(pose, np.append(point, 1.0))[:3]
    np.testing.assert_allclose(camera_frame(point[None], eye, yaw, pitch), expected[None], atol=1e-9)


def test_the_vertical_view_follows_the_pitch() -> None:
    eye = np.array([0.0, 1.0, 0.0])
    tilt = np.deg2rad([-50, -40, -20, 0, 10, 20])
    points = eye + np.stack([np.zeros(6), np.sin(tilt), np.cos(tilt)], axis=1)
    level = in_vertical_view(points, eye, 0.0, 0.0, np.deg2rad(15), np.deg2rad(30))
    np.testing.assert_array_equal(level, [False, False, True, True, True, False])
    down = in_vertical_view(points, eye, 0.0, np.deg2rad(-30), np.deg2rad(15), np.deg2rad(15))
    np.testing.assert_array_equal(down, [False, True, True, False, False, False])


def test_the_vertical_view_ends_at_the_edges_of_a_flat_picture() -> None:
    # Off to the side a point at 45 degrees above in the picture is less than 45 degrees above the horizon.
    points = np.array([[5.0, 0.99, 1.0], [5.0, 1.01, 1.0]])
    seen = in_vertical_view(points, np.zeros(3), 0.0, 0.0, np.pi / 4, np.pi / 4)
    np.testing.assert_array_equal(seen, [True, False])


def test_the_upper_and_lower_edges_are_in_the_vertical_view() -> None:
    points = np.array([[0.0, 1.0, 1.0], [0.0, -1.0, 1.0]])
    assert in_vertical_view(points, np.zeros(3), 0.0, 0.0, np.pi / 4, np.pi / 4).all()


def test_behind_and_straight_above_a_camera_nothing_is_in_the_vertical_view() -> None:
    points = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    seen = in_vertical_view(points, np.zeros(3), 0.0, 0.0, 3.0, 3.0)
    np.testing.assert_array_equal(seen, [False, False, True, True])


def test_vertical_views_of_a_batch_of_cameras() -> None:
    pitch = np.array([-0.5, 0.0, 0.5])
    points = np.array([[0.0, -1.0, 2.0], [0.0, 0.0, 2.0], [0.0, 1.0, 2.0]])
    seen = in_vertical_view(points, np.zeros((3, 3)), np.zeros(3), pitch, 0.1, 0.1)
    np.testing.assert_array_equal(seen, np.eye(3))


def area(polygon: FloatArray) -> float:
    x, z = polygon.T
    return abs(float(x @ np.roll(z, -1) - z @ np.roll(x, -1))) / 2


def test_the_outline_of_a_view_is_its_sector() -> None:
    camera, yaw, left, right, reach = np.array([1.0, 2.0]), 2.0, 0.4, 0.9, 3.0
    outline = view_polygon(camera, yaw, left, right, reach, arc_points=200)
    assert outline.shape == (201, 2)
    np.testing.assert_array_equal(outline[0], camera)
    np.testing.assert_allclose(distance(camera, outline[1:]), reach)
    np.testing.assert_allclose(bearing(camera, yaw, outline[1:])[[0, -1]], [-left, right])
    assert area(outline) == pytest.approx((left + right) / 2 * reach**2, rel=1e-4)


def test_the_outline_of_a_view_all_round_is_a_circle() -> None:
    outline = view_polygon(np.array([1.0, 2.0]), 2.0, np.pi, np.pi, 3.0, arc_points=400)
    assert outline.shape == (400, 2)
    assert len(np.unique(outline.round(9), axis=0)) == 400
    assert area(outline) == pytest.approx(np.pi * 9, rel=1e-3)
