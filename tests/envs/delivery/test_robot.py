"""The delivery robot: its frames, its wheels, its camera, and its ways around obstacles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.envs.delivery import Room
from farm_ar.envs.delivery.planner import KEEP_M, Grid, length_of
from farm_ar.envs.delivery.rgbd import DepthCamera
from farm_ar.envs.delivery.robot import MOST_M_S, Pose, Robot, Twist
from farm_ar.geometry import convert_pose, deepest_overlap, footprint_corners, pose_matrix
from farm_ar.scenes import Layout, LayoutNoise, builtin_scene

ANGLES = st.floats(-3.1, 3.1)
PLACES = st.floats(-10.0, 10.0)
POSES = st.builds(Pose, PLACES, PLACES, ANGLES)


def boxes(*places, size=(0.45, 0.84, 0.5), yaw=0.0):
    return Layout(
        labels=tuple(str(i) for i in range(len(places))),
        category=("chair",) * len(places),
        position=np.array(places),
        yaw=np.full(len(places), yaw),
        size=np.tile(size, (len(places), 1)),
    )


def matrix(pose):
    c, s = np.cos(pose.angle), np.sin(pose.angle)
    return np.array([[c, -s, pose.x], [s, c, pose.y], [0, 0, 1]])


@given(POSES, POSES)
def test_poses_are_composed_as_their_matrices_are(first, second):
    assert np.allclose(matrix(first.after(second)), matrix(first) @ matrix(second), atol=1e-9)
    assert np.allclose(matrix(first.inverse()), np.linalg.inv(matrix(first)), atol=1e-9)


@given(PLACES, PLACES, ANGLES)
def test_the_map_is_the_ros_frame_of_the_package(x, z, yaw):
    ros = convert_pose(pose_matrix(np.array([x, z]), yaw), "unity", "ros")
    pose = Pose.of(np.array([x, z]), yaw)
    assert np.allclose(ros[:2, 3], [pose.x, pose.y])
    assert np.allclose(ros[:2, 0], [np.cos(pose.angle), np.sin(pose.angle)])
    assert np.allclose(pose.place, [x, z])


def test_it_drives_ahead_and_turns_to_the_left(rng):
    robot = Robot(boxes(), (6.0, 5.0), Pose(2.5, -3.0, 0.0))
    robot.drive(Twist(ahead=0.2), 120, rng)
    assert robot.truth.x > 2.8
    assert robot.truth.y == pytest.approx(-3.0)
    robot.drive(Twist(left=1.0), 60, rng)
    assert robot.truth.angle > 0.5  # anticlockwise from above: to the left, REP 103
    assert robot.truth.yaw < 0


def test_a_chair_and_a_wall_stop_it_and_each_touch_counts(rng):
    robot = Robot(boxes((3.0, 3.0)), (6.0, 5.0), Pose(2.0, -3.0, 0.0))
    robot.drive(Twist(ahead=MOST_M_S), 300, rng)
    assert robot.touches == 1
    assert robot.truth.x <= 3.0 - 0.25 - 0.177 + 0.01
    robot.drive(Twist(ahead=-MOST_M_S), 600, rng)
    assert robot.touches == 2
    assert robot.truth.x >= 0.177 - 0.01


def test_odometry_goes_on_smoothly_while_the_map_jumps(rng):
    robot = Robot(boxes(), (6.0, 5.0), Pose(2.0, -3.0, 0.3))
    robot.drive(Twist(ahead=0.4, left=0.3), 300, rng)
    odom = robot.odom
    drift = np.hypot(robot.believed.x - robot.truth.x, robot.believed.y - robot.truth.y)
    robot.localise(rng)
    assert robot.odom == odom
    assert 0 < drift < 0.3
    errors = []
    for _ in range(400):
        robot.localise(rng)
        errors.append([robot.believed.x - robot.truth.x, robot.believed.y - robot.truth.y])
    assert np.std(errors) == pytest.approx(0.02, rel=0.15)


def test_the_camera_sees_what_is_in_its_range_and_before_it_and_not_hidden(rng):
    camera = DepthCamera()
    things = boxes((2.6, 2.4), (3.0, 4.6), (3.3, 1.9), (1.0, 1.0), (3.6, 2.8))
    seen = np.ones(len(things), dtype=bool)
    here = Pose.of(np.array([3.0, 1.0]), 0.0)
    _, found = camera.look(things, seen, here, here, rng)
    assert found.tolist() == [0, 2]  # the second is too far, the fourth behind the edge, the last one hidden
    _, found = camera.look(boxes((3.0, 1.25), size=(0.1, 0.84, 0.1)), seen[:1], here, here, rng)
    assert found.tolist() == []  # nearer than 0.3 m
    low = boxes((3.0, 1.6), size=(0.1, 0.1, 0.1))
    _, found = camera.look(low, seen[:1], here, here, rng)
    assert found.tolist() == []  # 40 degrees below the camera, which sees 29
    _, found = camera.look(low.with_poses([[3.0, 2.2]], [0.0]), seen[:1], here, here, rng)
    assert found.tolist() == [0]


def test_depths_are_as_exact_as_a_stereo_camera_s(rng):
    camera, things = DepthCamera(), boxes((3.0, 3.5))
    here = Pose.of(np.array([3.0, 1.0]), 0.0)
    one = np.ones(1, dtype=bool)
    places = [camera.look(things, one, here, here, rng)[0].detections.position[0] for _ in range(600)]
    focal = 848 / 2 / np.tan(np.deg2rad(43.5))
    assert np.std(places, axis=0)[1] == pytest.approx(2.5**2 * 0.08 / (focal * 0.05), rel=0.12)
    assert np.std(places, axis=0)[0] == pytest.approx(2.5 * 8 / focal, rel=0.12)
    assert np.allclose(np.mean(places, axis=0), [3.0, 3.5], atol=0.01)


def test_an_error_of_where_the_robot_is_moves_all_that_it_detects(rng):
    camera, things = DepthCamera(pixel=0.0, subpixel=0.0, yaw_sd=0.0), boxes((3.0, 2.5), (2.5, 2.8))
    here, taken = Pose.of(np.array([3.0, 1.0]), 0.0), Pose.of(np.array([3.4, 1.2]), np.pi / 2)
    snapshot, found = camera.look(things, np.ones(2, dtype=bool), here, taken, rng)
    offset = things.position[found] - [3.0, 1.0]
    turned = np.stack([offset[:, 1], -offset[:, 0]], axis=1)  # a quarter to the right: ahead becomes right
    assert np.allclose(snapshot.detections.position, turned + np.array([3.4, 1.2]))
    assert np.allclose(snapshot.detections.yaw, np.pi / 2)


def test_a_scan_measures_to_the_faces_of_what_is_ahead(rng):
    camera = DepthCamera(subpixel=0.0)
    angle, distance = camera.scan(boxes((3.0, 3.0)), (6.0, 5.0), Pose.of(np.array([3.0, 1.0]), 0.0), 45, rng)
    assert angle[22] == pytest.approx(0.0)
    assert distance[22] == pytest.approx(2.0 - 0.25)
    assert np.isinf(distance[0])  # the wall there is farther than 3 m
    _, near = camera.scan(boxes(), (6.0, 5.0), Pose.of(np.array([3.0, 4.0]), 0.0), 45, rng)
    assert near[22] == pytest.approx(1.0)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_a_way_keeps_away_from_everything_and_is_no_shorter_than_a_straight_line(seed):
    rng = np.random.default_rng(seed)
    things = boxes(*rng.uniform(0.5, 4.5, (8, 2)), yaw=rng.uniform(0, 3))
    grid = Grid((5.0, 5.0))
    grid.add_boxes(things)
    free = (np.argwhere(grid.clearance > KEEP_M) + 0.5) * 0.05
    start, goal = free[rng.integers(len(free), size=2)]
    way = grid.way(start, goal, 0.1)
    if way is None:
        return
    assert np.linalg.norm(way[-1] - goal) <= 0.1 + 0.05
    assert length_of(way) >= np.linalg.norm(way[-1] - start) - 1e-9
    assert min(grid.clearance_at(point) for point in way[1:]) >= KEEP_M - 1e-9


def test_a_way_on_an_empty_floor_is_as_short_as_eight_directions_allow():
    grid = Grid((5.0, 5.0))
    start, goal = np.array([1.025, 1.025]), np.array([3.025, 2.025])
    way = grid.way(start, goal, 0.01)
    assert length_of(way) == pytest.approx(np.sqrt(2) * 1.0 + 1.0)  # a metre slanting, a metre straight
    assert np.allclose(way[-1], goal)


def test_there_is_no_way_through_a_wall_of_chairs():
    grid = Grid((5.0, 5.0))
    grid.add_boxes(boxes(*[(x, 2.5) for x in np.arange(0.2, 5.0, 0.45)]))
    assert grid.way(np.array([2.5, 1.0]), np.array([2.5, 4.0]), 0.3) is None


@pytest.mark.parametrize("scene", ["lab", "pantry", "cafeteria"])
def test_rearranged_rooms_have_nothing_that_overlaps_or_leaves(scene, rng):
    room = Room(builtin_scene(scene))
    for _ in range(5):
        chairs = room.rearranged(LayoutNoise.of(0.6, 120.0), rng)
        things = room.furnished(chairs)
        assert deepest_overlap(things.position, things.yaw, things.size) == 0
        corners = footprint_corners(chairs.position, chairs.yaw, chairs.size)
        assert np.all(corners >= 0)
        assert np.all(corners <= room.scene.size)
