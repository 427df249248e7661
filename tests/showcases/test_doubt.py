"""Wrong poses that lead to wrong labels are told from labels that are wrong in any case."""

from dataclasses import replace

import numpy as np

from farm_ar.drawing.game.floating_labels import brightened
from farm_ar.game_logic.headset import field_of_view, look_at
from farm_ar.game_logic.perception import OraclePerception
from farm_ar.reid.registry import load_reid
from farm_ar.scenes import Detections, Layout, Scene, Snapshot
from farm_ar.showcases.doubt import METHODS, RED, picture, table, visits
from farm_ar.vision import PoseEstimates, PoseEstimator
from farm_ar.vision.perception import PixelPerception

HOMES = Layout(
    ("left", "right"),
    ("coop", "coop"),
    np.array([[0.45, 0.4], [0.75, 0.4]]),
    np.array([0.0, np.pi]),
    np.tile([0.1, 0.08, 0.09], (2, 1)),
)
SCENE = Scene("two coops", (1.2, 0.8), HOMES)
CAMERA = look_at(np.array([0.6, -0.3]), np.array([0.6, 0.4]), field_of_view("photo"), 0.45)


class Turned(PoseEstimator):
    """The true poses, with the headings off by an angle that the estimator takes to be possible."""

    def __init__(self, truth, angle):
        self.seen = OraclePerception().perceive(truth, CAMERA, np.random.default_rng(0)).snapshot.detections
        self.angle = angle

    def estimate(self, image, camera, meshes):
        n, yaw = len(self.seen), self.seen.yaw + self.angle
        seen = Detections.trusted(**vars(self.seen) | {"yaw": yaw})
        covariance = np.tile(np.diag([1e-6, 1e-6, 1e-4]), (n, 1, 1))
        return PoseEstimates(seen, covariance, np.ones(n), yaw + np.pi, np.full(n, 0.45))


def seen_with(truth, angle):
    perception = PixelPerception(SCENE, Turned(truth, angle))
    found = list(visits(SCENE, perception, (truth, CAMERA), np.random.default_rng(0)))
    assert tuple(one.method for one in found) == METHODS
    return found


def test_a_wrong_heading_that_leads_to_a_wrong_label_is_blamed_and_drawn_in_red():
    between = HOMES.placed(np.array([[0.6, 0.33], [0.6, 0.47]]), HOMES.yaw)  # headings alone can tell
    for right, misled in zip(seen_with(between, 0.0), seen_with(between, np.pi), strict=True):
        assert not right.wrong.any()
        assert misled.wrong.all()
        assert misled.misled.all()
        np.testing.assert_allclose(misled.turned, np.pi)
        drawn = picture(misled, 0)
        assert drawn.shape == (760, 1280, 3)
        assert (np.abs(drawn.astype(int) - brightened(RED)).max(axis=2) < 12).sum() > 200
    # Knowing that the headings may be the opposite, they are less confident than they would be otherwise.
    for one in seen_with(between, np.pi):
        blind = replace(one.seen, uncertainty=None)
        certain = load_reid(one.method)(SCENE).identify(Snapshot(CAMERA, blind))
        assert one.answer.confidence.max() < 0.7 < certain.confidence.min(), one.method


def test_a_label_that_true_poses_do_not_give_either_is_not_blamed_on_the_pose():
    swapped = HOMES.placed(HOMES.position[::-1].copy(), HOMES.yaw[::-1].copy())
    for one in seen_with(swapped, 0.5):
        assert one.wrong.all()
        assert not one.misled.any()


def test_the_table_has_a_row_for_each_kind_of_answer_and_its_quartiles():
    trials = [{"visit": 0, "method": METHODS[0], "label": "right", "confidence": c} for c in (0.5, 0.75, 1.0)]
    (row,) = table(trials)
    assert row["number"] == 3
    assert row["confidence, quartiles"] == "62% / 75% / 88%"
