"""A person who walks with a headset."""

from dataclasses import replace

import numpy as np
import pytest

from farm_ar.experiments.walks import VIEWS, Walk, drifted, wandering
from farm_ar.geometry import wrap
from farm_ar.scenes import LayoutNoise, builtin_scene, whole_in_view
from farm_ar.vision.measured_noise import measured_noise

STILL = LayoutNoise.of(0.0, 0.0)
EXACT = replace(Walk(), drift_m=0.0, drift_rad=0.0, measured=False)


def test_errors_have_the_spread_and_the_memory_that_were_asked_for(rng):
    found = wandering((400, 200), 10.0, rng)
    assert found.std() == pytest.approx(1.0, abs=0.02)
    assert found[:, :5].std() == pytest.approx(1.0, abs=0.06), "from the first step on"
    assert (found[:, :-10] * found[:, 10:]).mean() == pytest.approx(np.exp(-1), abs=0.03)


def test_a_headset_wrong_about_its_pose_sees_the_same_from_there(rng):
    """Bearings and distances from the camera are what it measured; everything has moved along with it."""
    batch = EXACT.through(builtin_scene("cafeteria"), STILL, 1, rng).snapshots
    error = rng.normal(0, [[0.3], [0.3], [0.2]], (3, len(batch)))
    after = drifted(batch, error)
    for b in np.flatnonzero(batch.count)[::15]:
        one, other = batch.snapshot(int(b)), after.snapshot(int(b))
        for snapshot in (one, other):
            assert len(snapshot.detections) == batch.count[b]
        offset, moved = (s.detections.position - s.camera.position for s in (one, other))
        np.testing.assert_allclose(np.hypot(*offset.T), np.hypot(*moved.T))
        turn = float(other.camera.yaw - one.camera.yaw)
        assert turn == pytest.approx(error[2, b])
        bearings = [
            np.arctan2(o[:, 0], o[:, 1]) - float(s.camera.yaw) for o, s in ((offset, one), (moved, other))
        ]
        np.testing.assert_allclose(np.cos(bearings[0] - bearings[1]), 1.0)
        np.testing.assert_allclose(other.detections.yaw - one.detections.yaw, turn)
        np.testing.assert_allclose(other.camera.position - one.camera.position, error[:2, b])


def test_what_a_detector_says_of_its_errors_goes_along_with_the_headset(rng):
    """Along the line of sight and across it they are as they were; only the line is turned."""
    scene = builtin_scene("classroom")
    batch = replace(EXACT, measured=True).through(scene, STILL, 1, rng).snapshots
    after = drifted(batch, np.array([[0.2], [-0.1], [1.0]]) * np.ones(len(batch)))

    def along_and_across(snapshot):
        offset = snapshot.detections.position - snapshot.camera.position
        sight = offset / np.linalg.norm(offset, axis=1)[:, None]
        frame = np.stack([sight, sight @ [[0, -1], [1, 0]]], axis=1)
        place = snapshot.detections.uncertainty.covariance[:, :2, :2]
        return frame @ place @ np.swapaxes(frame, 1, 2)

    for b in np.flatnonzero(batch.count)[::5]:
        one, other = batch.snapshot(int(b)), after.snapshot(int(b))
        shape = along_and_across(one)
        np.testing.assert_allclose(along_and_across(other), shape, atol=1e-9)
        assert not np.allclose(shape[:, 0, 0], shape[:, 1, 1]), "errors along the line of sight are others"
        apart = other.detections.uncertainty.runner_up_yaw - one.detections.uncertainty.runner_up_yaw
        np.testing.assert_allclose(np.cos(apart - 1.0), 1.0)


def test_what_is_detected_is_wholly_in_the_true_cameras_view(rng):
    walked = EXACT.through(builtin_scene("pantry"), LayoutNoise.of(0.3, 30), 2, rng)
    every = walked.layouts.placed(walked.layouts.position[:, None], walked.layouts.yaw[:, None])
    allowed = whole_in_view(every, walked.cameras).reshape(len(walked.snapshots), -1)
    for b in range(len(walked.snapshots)):
        labels = walked.snapshots.true_labels(b, walked.layouts.labels)
        assert all(allowed[b, walked.layouts.labels.index(label)] for label in labels)


def test_the_person_looks_down_at_the_nearest_table_ahead():
    scene, walk = builtin_scene("classroom"), Walk()
    along = scene.camera_path.cameras(40)
    yaw, pitch = walk.gaze(along, scene.site_positions)
    for p in range(40):
        offset = scene.site_positions - along.position[p]
        away = np.hypot(*offset.T)
        ahead = offset @ [np.sin(along.yaw[p]), np.cos(along.yaw[p])] > 0
        some = np.flatnonzero(ahead & (away > walk.nearest_m))
        if not len(some):
            assert yaw[p] == along.yaw[p]
            continue
        table = some[away[some].argmin()]
        assert np.hypot(*offset[table]) * np.array([np.sin(yaw[p]), np.cos(yaw[p])]) == pytest.approx(
            offset[table]
        )
        assert np.tan(pitch[p]) == pytest.approx((0.45 - 1.65) / away[table])


def test_the_person_may_look_at_the_middle_of_the_room_instead():
    scene, walk = builtin_scene("classroom"), Walk(look="middle", nearest_m=3.0)
    along = scene.camera_path.cameras(40)
    yaw, pitch = walk.gaze(along, scene.site_positions)
    offset = scene.site_positions.mean(axis=0) - along.position
    away = np.hypot(*offset.T)
    far = away > walk.nearest_m
    assert 0 < far.sum() < 40
    toward = away[:, None] * np.column_stack([np.sin(yaw), np.cos(yaw)])
    np.testing.assert_allclose(toward[far], offset[far])
    np.testing.assert_allclose(np.tan(pitch[far]), (0.45 - 1.65) / away[far])
    assert (yaw[~far] == along.yaw[~far]).all()


def test_the_display_shows_fewer_chairs_than_the_camera(rng):
    scene = builtin_scene("classroom")
    counts = [
        replace(EXACT, fov=VIEWS[view])
        .through(scene, STILL, 1, np.random.default_rng(0))
        .snapshots.count.mean()
        for view in ("display", "camera")
    ]
    assert 0 < counts[0] < counts[1]


def test_chairs_have_the_errors_that_were_measured_of_buildings_that_look_as_large():
    """A room is a farm some six times as large: distances and errors along with it, headings as they are."""
    scene = builtin_scene("classroom")
    sides = np.log(builtin_scene("farm").layout.size[builtin_scene("farm").layout.movable]).mean()
    times = np.exp(np.log(scene.layout.size).mean() - sides)
    assert times > 4
    noise, walk = measured_noise(), replace(EXACT, measured=True)
    exact, erring = (w.through(scene, STILL, 12, np.random.default_rng(1)).snapshots for w in (EXACT, walk))
    rows, missed = [], 0
    for b in range(len(exact)):
        true = dict(zip(exact.truth[b, : exact.count[b]].tolist(), range(exact.count[b]), strict=True))
        found = erring.truth[b, : erring.count[b]].tolist()
        assert set(found) <= set(true)
        missed += len(true) - len(found)
        for k, label in enumerate(found):
            i = true[label]
            offset = exact.position[b, i] - exact.camera.position[b]
            error = erring.position[b, k] - exact.position[b, i]
            away = np.hypot(*offset)
            rows.append((away, error @ offset / away, float(wrap(erring.yaw[b, k] - exact.yaw[b, i]))))
        angle = np.arctan2(*(erring.position[b, : len(found)] - exact.camera.position[b]).T)
        assert (np.diff(wrap(angle - exact.camera.yaw[b])) >= 0).all(), "from left to right"
    away, along, turn = np.array(rows).T
    kind = np.searchsorted(noise.edges * times, away)
    assert 0 < missed < 0.02 * len(rows)
    for k in range(5):
        here = (kind == k) & (np.abs(turn) < np.pi / 2)
        assert here.sum() > 100
        assert along[here].std() == pytest.approx(times * np.sqrt(noise.covariance[k, 0, 0]), rel=0.25)
        assert turn[here].std() == pytest.approx(np.sqrt(noise.covariance[k, 2, 2]), rel=0.25)
        flipped = np.mean(np.abs(turn[kind == k]) > np.pi / 2)
        assert flipped == pytest.approx(noise.flip[k], abs=0.02)
