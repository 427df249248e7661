"""What the game perceives: detections of what is in view, and the hand."""

import numpy as np
import pytest

from farm_ar.game_logic.belief import Tracker
from farm_ar.game_logic.headset import FIELDS_OF_VIEW, look_at
from farm_ar.game_logic.perception import (
    GeometricHandDetector,
    HandDetector,
    HandView,
    OraclePerception,
    Perception,
)
from farm_ar.game_logic.physics.gripper import HandState
from farm_ar.scenes import Detector, builtin_scene, observe_many, visible

FARM = builtin_scene("farm")
CAMERA = look_at(np.array([0.6, -0.3]), np.array([0.33, 0.45]), FIELDS_OF_VIEW["photo"])


def test_the_oracle_sees_the_true_poses_of_what_is_in_view(rng):
    perceived = OraclePerception().perceive(FARM.layout, CAMERA, rng)
    assert sorted(perceived.source) == np.flatnonzero(visible(FARM.layout, CAMERA)).tolist()
    np.testing.assert_array_equal(
        perceived.snapshot.detections.position, FARM.layout.position[perceived.source]
    )


@pytest.mark.parametrize("name", ["photo", "display"])
def test_without_noise_one_snapshot_is_what_snapshots_of_many_layouts_are(name, rng):
    for _ in range(20):
        layout, fov = FARM.layout, FIELDS_OF_VIEW[name]
        truth = layout.with_poses(
            rng.uniform(0, FARM.size, layout.position.shape), rng.uniform(-3, 3, layout.yaw.shape)
        )
        camera = look_at(np.array([rng.uniform(0.2, 1.0), -0.3]), rng.uniform(0.1, 0.7, 2), fov)
        perceived, batch = OraclePerception().perceive(truth, camera, rng), observe_many(truth, camera)
        seen, wanted = perceived.snapshot.detections, batch.snapshot(0).detections
        np.testing.assert_array_equal(perceived.source, batch.truth[0, : batch.count[0]])
        assert (seen.category, seen.ids, seen.track_id) == (wanted.category, wanted.ids, wanted.track_id)
        for part in ("position", "yaw", "size", "elevation", "confidence"):
            np.testing.assert_array_equal(getattr(seen, part), getattr(wanted, part))


def test_an_oracle_with_false_detections_says_that_they_are_nothing(rng):
    perceived = OraclePerception(Detector(false_rate=5.0)).perceive(FARM.layout, CAMERA, rng)
    assert (perceived.source == -1).sum() > 0


def test_the_oracle_and_the_geometric_detector_are_what_the_game_asks_for():
    assert isinstance(OraclePerception(), Perception)
    assert isinstance(GeometricHandDetector(), HandDetector)


def sees(hand, camera):
    """Whether the geometric detector sees a hand at (x, z)."""
    state = HandState(np.array(hand), 0.0, np.zeros(2), None, True)
    return GeometricHandDetector().sees_hand(HandView(camera, state, lambda: pytest.fail("looked at")))


@pytest.mark.parametrize(
    ("hand", "seen"),
    [
        ((0.33, 0.45), True),  # where the player looks
        ((0.6, -0.5), False),  # behind the player's eyes
        ((1.15, 0.1), False),  # far to the right, and so is its forearm
    ],
)
def test_the_hand_is_seen_where_it_is_in_the_view_volume(hand, seen):
    assert sees(hand, CAMERA) is seen


def test_where_there_is_no_hand_none_is_seen():
    assert not GeometricHandDetector().sees_hand(HandView(CAMERA, None, lambda: None))


def test_a_forearm_in_view_gives_a_hand_away_that_is_beyond_it():
    narrow = look_at(np.array([0.6, -0.3]), np.array([0.6, 0.05]), FIELDS_OF_VIEW["display"])
    assert not sees((0.6, -0.44), narrow)
    assert sees((0.6, 0.79), narrow)


def test_a_vertical_field_of_view_that_looks_over_the_hand_does_not_see_it():
    display = FIELDS_OF_VIEW["display"]
    level = look_at(np.array([0.6, -0.3]), np.array([0.6, 40.0]), display)
    assert not sees((0.6, 0.1), level)


def test_a_sighting_without_any_detection_is_right_and_changes_nothing(rng):
    away = look_at(np.array([0.6, -0.3]), np.array([0.6, -3.0]), FIELDS_OF_VIEW["photo"])
    tracker = Tracker(FARM, FARM.layout)
    sighting = tracker.look(FARM.layout, away, rng)
    assert sighting.accuracy == 1.0
    assert len(sighting.identification.labels) == 0
    assert not sighting.changed.any()


def test_a_sighting_scores_what_the_rule_said(rng):
    class Swapper:
        def __init__(self, scene):
            self.scene = scene

        def identify(self, snapshot):
            from farm_ar.reid import Identification

            other = {"coop": "red-coop", "hutch": "brown-hutch", "shed": "shed"}
            return Identification(tuple(other[name] for name in snapshot.detections.category))

    sighting = Tracker(FARM, FARM.layout, Swapper).look(FARM.layout, CAMERA, rng)
    names = [FARM.layout.labels[i] for i in sighting.source]
    right = [name in ("red-coop", "brown-hutch", "shed") for name in names]
    assert sighting.accuracy == pytest.approx(np.mean(right))
