"""Lifted and tilted objects: `spatial-3d`, and what files and records keep of heights and tilts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from farm_ar.geometry import planar_pose, rotation_matrix, tilt_of
from farm_ar.reid import SpatialReid, identify
from farm_ar.reid.costs import orientation_cost, rotation_cost
from farm_ar.reid.fusion import track
from farm_ar.reid.spatial_space import SpatialSpaceReid
from farm_ar.scenes import (
    Camera,
    Detections,
    FieldOfView,
    Layout,
    LayoutNoise,
    Scene,
    Snapshot,
    SnapshotBatch,
    World,
    builtin_scene,
    from_poses,
    observe,
)
from farm_ar.scenes.json_files import scene_from_dict, scene_to_dict, snapshot_from_dict, snapshot_to_dict
from farm_ar.testing import check_reidentifier

ANGLE = st.floats(-3.1, 3.1)
UPWARDS = st.floats(-1.5, 1.5)
CAMERA = Camera([0.0, -2.0], 0.0, FieldOfView(1.2, 1.2, 10.0))


@given(ANGLE, UPWARDS, ANGLE)
def test_heading_pitch_and_roll_are_a_rotation_and_back(yaw, pitch, roll):
    turn = rotation_matrix(np.array(yaw), np.array([pitch, roll]))
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    pose = np.eye(4)
    pose[:3, :3] = turn
    assert np.cos(planar_pose(pose).yaw - yaw) == pytest.approx(1.0)
    np.testing.assert_allclose(np.cos(tilt_of(turn) - [pitch, roll]), 1.0, atol=1e-9)
    forward, right = turn[:, 2], turn[:, 0]
    assert forward[1] == pytest.approx(np.sin(pitch)), "pitch lifts what is ahead"
    assert right[1] == pytest.approx(np.cos(pitch) * np.sin(roll)), "roll lifts the right-hand side"


@given(st.lists(st.tuples(ANGLE, UPWARDS, ANGLE), min_size=2, max_size=5))
def test_the_cost_is_the_sine_of_half_the_angle_between_two_orientations(poses):
    values = np.array(poses)
    turns = rotation_matrix(values[:, 0], values[:, 1:])
    cost = orientation_cost(turns, turns)
    for i in range(len(poses)):
        for j in range(len(poses)):
            angle = Rotation.from_matrix(turns[i].T @ turns[j]).magnitude()
            assert cost[i, j] == pytest.approx(np.sin(angle / 2), abs=1e-7)


@given(st.lists(ANGLE, min_size=1, max_size=5), st.lists(ANGLE, min_size=1, max_size=5))
def test_of_upright_objects_it_is_equation_5(detected, known):
    a, b = np.array([*detected, np.nan]), np.array(known)
    np.testing.assert_allclose(
        orientation_cost(rotation_matrix(a), rotation_matrix(b)), rotation_cost(a, b), atol=1e-12
    )


def test_on_one_level_it_answers_as_the_papers_method(rng):
    for name in ("M1", "H1"):
        scene = builtin_scene(name)
        for _ in range(6):
            moved = LayoutNoise.of(0.3, 30).disturb(scene.layout, scene.size, rng)
            snapshot, _ = observe(moved, scene.camera_path.cameras(9).at(int(rng.integers(9))))
            mine, its = SpatialSpaceReid(scene).identify(snapshot), SpatialReid(scene).identify(snapshot)
            assert mine.labels == its.labels
            np.testing.assert_allclose(mine.cost, its.cost, atol=1e-12)
            np.testing.assert_allclose(mine.margin, its.margin, atol=1e-9)


def shelf(tilt=None, elevation=(0.3, 1.1), category=("box", "box")):
    layout = Layout(("low", "high"), category, [(0.0, 0.0), (0.0, 0.0)], np.zeros(2), np.full((2, 3), 0.3),
                    elevation, tilt=tilt)  # fmt: skip
    return Scene("shelf", None, layout)


def test_heights_decide_where_places_on_the_plane_are_the_same():
    seen = Detections(
        ("box",) * 2, [(0.02, 0.0), (-0.01, 0.0)], np.zeros(2), np.full((2, 3), 0.3), [1.0, 0.35]
    )
    answer = identify(shelf(), Snapshot(CAMERA, seen), "spatial-3d")
    assert answer.labels == ("high", "low")
    metre = 0.36 * np.sqrt(shelf().area) / shelf().diagonal
    assert answer.cost == pytest.approx([metre * np.hypot(0.02, 0.1), metre * np.hypot(0.01, 0.05)])


def test_tilts_decide_where_places_and_headings_are_the_same():
    """One lies on its side; both stand at the same height, and headings say nothing."""
    scene = shelf(tilt=[(0.0, 0.0), (0.0, np.pi / 2)], elevation=(0.0, 0.0))
    seen = Detections(("box",) * 2, [(0.0, 0.0), (0.0, 0.0)], np.zeros(2), np.full((2, 3), 0.3),
                      tilt=[(0.1, 1.4), (0.0, 0.1)])  # fmt: skip
    assert SpatialSpaceReid(scene).identify(Snapshot(CAMERA, seen)).labels == ("high", "low")


def test_categories_are_kept_apart():
    seen = Detections(
        ("lamp", "box"), [(0.0, 0.0), (0.0, 0.0)], np.zeros(2), np.full((2, 3), 0.3), [0.3, 1.1]
    )
    answer = SpatialSpaceReid(shelf(category=("box", "lamp"))).identify(Snapshot(CAMERA, seen))
    assert answer.labels == ("high", "low")


def test_it_keeps_the_contract():
    check_reidentifier(SpatialSpaceReid)


@given(ANGLE, UPWARDS, ANGLE)
def test_files_keep_heights_and_tilts(yaw, pitch, roll):
    scene = shelf(tilt=[(pitch, roll), (0.0, 0.0)])
    scene = Scene("shelf", None, scene.layout.with_poses(scene.layout.position, [yaw, 0.5]))
    back = scene_from_dict(scene_to_dict(scene)).layout
    again = rotation_matrix(back.yaw, back.tilt)
    np.testing.assert_allclose(again, rotation_matrix(scene.layout.yaw, scene.layout.tilt), atol=1e-9)
    np.testing.assert_allclose(back.elevation, [0.3, 1.1])
    snapshot, _ = observe(scene.layout, CAMERA)
    read = snapshot_from_dict(snapshot_to_dict(snapshot)).detections
    seen = snapshot.detections
    again = rotation_matrix(read.yaw, read.tilt)
    np.testing.assert_allclose(again, rotation_matrix(seen.yaw, seen.tilt), atol=1e-9)


def test_a_box_on_its_side_is_so_in_every_frame():
    """Turned by 90 degrees about the axis ahead: in ROS that is x, in OpenXR z backwards."""
    half = np.sqrt(0.5)
    written = {"unity": (0, 0, half, half), "ros": (-half, 0, 0, half), "openxr": (0, 0, half, half)}
    for frame, quaternion in written.items():
        poses = World(frame).read(np.zeros((1, 3)), quaternion=[quaternion])
        np.testing.assert_allclose(np.abs(poses.tilt), [[0.0, np.pi / 2]], atol=1e-9)
        sides = rotation_matrix(poses.yaw, poses.tilt)[0]
        assert abs(sides[1, 0]) == pytest.approx(1.0), "its right-hand side points up or down"
    assert World("unity").read(np.zeros((1, 3)), quaternion=[(0, 1, 0, 0)]).tilt is None


def test_batches_selections_and_fusion_keep_tilts(rng):
    scene = shelf(tilt=[(0.2, 0.1), (0.0, 1.0)], elevation=(0.0, 0.6))
    assert from_poses(["a"], [(0, 0, 0)], quaternion=[(0, 0, 1, 0)]).layout.tilt is not None
    np.testing.assert_allclose(scene.layout.subset([1]).tilt, [(0.0, 1.0)])
    snapshot, _ = observe(scene.layout, CAMERA)
    batch = SnapshotBatch.stack([snapshot, snapshot])
    np.testing.assert_allclose(batch.snapshot(1).detections.tilt, snapshot.detections.tilt)
    fused = track(SpatialSpaceReid(scene), [snapshot, snapshot])
    np.testing.assert_allclose(fused.objects.tilt, snapshot.detections.tilt)
    many = SpatialSpaceReid(scene).identify_many(batch)
    assert [scene.layout.labels[j] for j in many.label[0]] == list(
        SpatialSpaceReid(scene).identify(snapshot).labels
    )


def test_a_tilt_of_the_wrong_shape_is_refused():
    with pytest.raises(ValueError, match="tilt"):
        shelf(tilt=[(0.0, 0.0, 0.0)] * 2)
    with pytest.raises(ValueError, match="tilt"):
        Detections(("box",), [(0.0, 0.0)], [0.0], np.ones((1, 3)), tilt=[(np.nan, 0.0)])
