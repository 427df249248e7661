"""What a detector knows of its own errors counts: covariances, and second most probable headings."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from farm_ar.errors import SnapshotError
from farm_ar.reid import (
    DetectionNoise,
    LikelihoodOptions,
    LikelihoodReid,
    Motion,
    Rates,
    RelationalReid,
    association_marginals,
    identify,
)
from farm_ar.scenes import Bounds, Camera, Detections, FieldOfView, Layout, Scene, Snapshot, Uncertainty

AWAY = Camera(np.array([100.0, 100.0]), np.array(0.0), FieldOfView(0.3, 0.3, 2.0))
MOTION, USUAL = Motion(1.0, 0.2, 0.3), DetectionNoise(0.01, 0.02)
OPTIONS = LikelihoodOptions(
    noise=(MOTION,), rates=(Rates(1.0, 0.0, 0.0),), gone_rate=0.1, detection=USUAL, walls=False
)


def scene(position, yaw):
    m = len(yaw)
    size = np.tile([0.4, 0.9, 0.5], (m, 1))
    return Scene("chairs", None, Layout(tuple("abcdefgh"[:m]), ("chair",) * m, position, yaw, size))


def snapshot(position, yaw, uncertainty=None, camera=AWAY):
    n = len(yaw)
    size = np.tile([0.4, 0.9, 0.5], (n, 1))
    seen = Detections(("chair",) * n, position, yaw, size, uncertainty=uncertainty)
    return Snapshot(camera, seen)


def uncertain(sds, rival=None, weight=None):
    sds = np.asarray(sds, float)
    nothing = np.full(len(sds), np.nan)
    covariance = np.zeros((len(sds), 3, 3))
    covariance[:, [0, 1, 2], [0, 1, 2]] = sds**2
    return Uncertainty(
        covariance,
        np.ones(len(sds)),
        nothing if rival is None else np.asarray(rival, float),
        nothing if weight is None else np.asarray(weight, float),
    )


def wrapped(turn, sd):
    """Wrapped Gaussian by its definition."""
    return sum(norm.pdf(turn + 2 * np.pi * k, scale=sd) for k in range(-40, 41))


@pytest.mark.parametrize("yaw_sd", [0.001, 0.4, 2.5])
def test_probabilities_are_those_of_the_densities_with_the_detectors_own_errors(yaw_sd):
    rng = np.random.default_rng(5)
    place, heading = rng.uniform(0, 1, (4, 2)), rng.uniform(-3, 3, 4)
    seen, yaw = place[:3] + rng.normal(0, 0.3, (3, 2)), heading[:3] + np.array([0.2, np.pi, -0.4])
    sds = np.array([[0.3, 0.02, yaw_sd], [0.002, 0.5, yaw_sd], [0.1, 0.1, yaw_sd]])
    rival, weight = yaw + np.pi, np.array([0.1, 0.45, 0.0])
    found = LikelihoodReid(scene(place, heading), OPTIONS).identify(
        snapshot(seen, yaw, uncertain(sds, rival, weight))
    )
    # The better known of the two errors never counts: the detector's own, or the usual one.
    along = np.hypot(MOTION.translation_sd, np.maximum(sds[:, :2], USUAL.position_sd))
    about = np.hypot(MOTION.rotation_sd, max(yaw_sd, USUAL.yaw_sd))
    density = np.empty((3, 4))
    for i in range(3):
        for j in range(4):
            here = norm.pdf(seen[i] - place[j], scale=along[i]).prod()
            turns = [wrapped(one - heading[j], about) for one in (yaw[i], rival[i])]
            density[i, j] = here * ((1 - weight[i]) * turns[0] + weight[i] * turns[1])
    # None of the labels is in view; 0.9 of them are still there.
    expected, _, _ = association_marginals(density * 0.9, np.full(3, 1e-300))
    np.testing.assert_allclose(found.probability, expected, atol=2e-3)


def test_what_is_known_better_than_usual_changes_nothing():
    rng = np.random.default_rng(6)
    place, heading = rng.uniform(0, 1, (5, 2)), rng.uniform(-3, 3, 5)
    seen, yaw = place[:4] + 0.1, heading[:4] + 0.3
    for reid in (LikelihoodReid, RelationalReid):
        method = reid(scene(place, heading))
        plain = method.identify(snapshot(seen, yaw))
        told = method.identify(snapshot(seen, yaw, uncertain(np.full((4, 3), 1e-4))))
        assert plain.labels == told.labels
        assert np.array_equal(plain.probability, told.probability)


def test_a_flipped_heading_whose_runner_up_is_right_finds_its_label_and_is_not_doubted():
    place = np.array([[0.0, 0.0], [0.1, 0.0], [1.0, 1.0]])
    heading = np.array([0.0, np.pi, 1.0])
    camera = Camera(np.array([0.5, -2.0]), 0.0, FieldOfView(1.0, 1.0, 10.0))
    seen, yaw = place + np.array([[0.03, 0.0], [-0.03, 0.0], [0.0, 0.0]]), np.array([np.pi, 0.0, 1.0])
    room = scene(place, heading)
    method = LikelihoodReid(room, OPTIONS)
    sharp = replace(OPTIONS, noise=(Motion(1.0, 0.05, 0.1),))
    fooled = identify(room, snapshot(seen, yaw, camera=camera), method)
    assert fooled.labels == ("b", "a", "c")
    flips = uncertain(np.full((3, 3), 0.01), yaw + np.pi, [0.45, 0.45, 0.01])
    found = identify(room, snapshot(seen, yaw, flips, camera), LikelihoodReid(room, sharp))
    assert found.labels == ("a", "b", "c")
    assert not any("no motion" in one for one in found.warnings)
    blamed = identify(room, snapshot(seen, yaw, camera=camera), LikelihoodReid(room, sharp))
    assert blamed.labels != ("a", "b", "c") or min(blamed.confidence) < min(found.confidence)


def test_what_is_known_of_errors_goes_with_its_detection_and_turns_with_the_frame():
    errors = Uncertainty(
        np.array([np.diag([4.0, 1.0, 0.1]), np.diag([1.0, 9.0, 0.2])]),
        [1.0, 0.5],
        [1.0, np.nan],
        [0.3, np.nan],
    )
    assert errors.at(np.array([1])).visible.tolist() == [0.5]
    back = errors.turned(np.pi / 2)
    np.testing.assert_allclose(back.covariance[0], np.diag([1.0, 4.0, 0.1]), atol=1e-12)
    np.testing.assert_allclose(back.runner_up_yaw, [1.0 + np.pi / 2, np.nan])
    # An error along a heading stays along it.
    turn, heading = 0.7, np.array([np.sin(0.4), np.cos(0.4)])
    moved = np.array([np.sin(0.4 + turn), np.cos(0.4 + turn)])
    along = Uncertainty(np.pad(np.outer(heading, heading), (0, 1))[None], [1.0], [np.nan], [np.nan])
    np.testing.assert_allclose(along.turned(turn).covariance[0, :2, :2], np.outer(moved, moved), atol=1e-12)


def test_errors_count_alike_in_a_room_that_is_turned():
    rng, corners = np.random.default_rng(3), np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)])
    place, heading = rng.uniform(1.0, 2.5, (4, 2)), rng.uniform(-1, 1, 4)
    seen, yaw = place + rng.normal(0, 0.3, (4, 2)), heading + rng.normal(0, 0.2, 4)
    errors, found = uncertain(np.tile([0.4, 0.01, 0.1], (4, 1)), yaw + 1.0, [0.3] * 4), []
    for turn in (0.0, 0.6):
        cosine, sine = np.cos(turn), np.sin(turn)
        way = np.array([[cosine, -sine], [sine, cosine]])
        layout = scene(place @ way, heading + turn).layout
        room = Scene("room", None, layout, bounds=Bounds(corners @ way))
        camera = replace(AWAY, position=AWAY.position @ way, yaw=np.array(turn))
        method = LikelihoodReid(room, replace(OPTIONS, walls=True))
        found.append(method.identify(snapshot(seen @ way, yaw + turn, errors.turned(turn), camera)))
    assert found[0].labels == found[1].labels
    np.testing.assert_allclose(found[1].confidence, found[0].confidence, rtol=1e-6)


@pytest.mark.parametrize("metres", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_errors_all_in_one_direction_are_a_covariance_in_any_unit_and_precision(metres, precision):
    rng = np.random.default_rng(0)
    way = (rng.normal(size=(200, 3)) * [metres, metres, 1.0]).astype(precision)
    spread = np.einsum("ni,nj->nij", way, way)
    nothing = np.full(200, np.nan)
    assert len(Uncertainty(spread, np.ones(200), nothing, nothing)) == 200
    for wrong in (np.diag([1.0, 1.0, -0.01]), np.array([[1.0, 0.01, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])):
        with pytest.raises(SnapshotError, match=r"uncertainty\.covariance\[0\]: must be a covariance"):
            Uncertainty(metres**2 * wrong[None], [1.0], [np.nan], [np.nan])


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"covariance": np.full((1, 3, 3), np.nan)}, "uncertainty.covariance"),
        ({"covariance": np.full((1, 3, 3), np.inf)}, "uncertainty.covariance"),
        ({"covariance": -np.eye(3)[None]}, "uncertainty.covariance"),
        ({"visible": [1.2]}, "uncertainty.visible"),
        ({"runner_up_weight": [0.6], "runner_up_yaw": [0.0]}, "uncertainty.runner_up_weight"),
        ({"runner_up_yaw": [0.6]}, "uncertainty.runner_up"),
        ({"covariance": np.eye(3)}, "uncertainty.covariance"),
    ],
)
def test_what_cannot_be_is_refused(change, field):
    right = {
        "covariance": np.eye(3)[None],
        "visible": [1.0],
        "runner_up_yaw": [np.nan],
        "runner_up_weight": [np.nan],
    }
    with pytest.raises(SnapshotError, match=field.replace(".", r"\.")):
        Uncertainty(**right | change)
    with pytest.raises(SnapshotError, match="uncertainty"):
        snapshot(np.zeros((2, 2)), np.zeros(2), Uncertainty(**right))


@pytest.mark.parametrize(
    "covariance",
    [
        np.full((3, 3), np.inf),
        np.diag([np.inf, 1.0, 1.0]),
        np.eye(3) * 1e308,
        -np.eye(3),
        np.eye(3) + np.eye(3, k=1) / 10,
        "abc",
        [[1.0], [1.0, 2.0]],
    ],
)
def test_what_is_no_covariance_is_refused_without_a_word_from_numpy(covariance):
    nan = np.array([np.nan])
    given = covariance if isinstance(covariance, str | list) else covariance[None]
    with pytest.raises(SnapshotError, match=r"uncertainty\.covariance(\[0\])?: must be"):
        Uncertainty(given, np.array([1.0]), nan, nan)


@pytest.mark.parametrize("scale", [1e-8, 1.0, 1e3, 1e6, 1e10])
def test_rounding_in_a_large_covariance_is_not_held_against_it(scale, rng):
    nan = np.full(50, np.nan)
    root = rng.normal(size=(50, 3, 2)) * np.sqrt(scale / 10)  # rank 2: the least eigenvalue is 0
    covariance = root @ root.transpose(0, 2, 1)
    assert len(Uncertainty(covariance, np.ones(50), nan, nan)) == 50
