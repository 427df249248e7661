"""Ways of moving that `adaptive` knows: together and ahead, standing or driving, turned by a half."""

import numpy as np
import pytest
from scipy import stats

from farm_ar.reid import AdaptiveOptions, AdaptiveReid, Disorder, SquaredDistanceReid
from farm_ar.reid.adaptive.common import BEND_SD, best_motion
from farm_ar.reid.adaptive.densities import SWINGS
from farm_ar.reid.adaptive.hypotheses import MOST_SCALES, hypotheses
from farm_ar.reid.adaptive.inference import tabulated
from farm_ar.reid.adaptive.learning import common_of
from farm_ar.reid.adaptive.records import Profile
from farm_ar.reid.adaptive.screening import freedom_of
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot

EVERYWHERE = FieldOfView(np.pi, np.pi, 1e4)


def things(position, yaw):
    n = len(position)
    return Scene(
        "place",
        None,
        Layout(tuple(f"t{i}" for i in range(n)), ("thing",) * n, position, yaw, np.ones((n, 3))),
    )


def seen(position, yaw):
    n = len(position)
    return Snapshot(
        Camera(np.zeros(2), 0.0, EVERYWHERE), Detections(("thing",) * n, position, yaw, np.ones((n, 3)))
    )


def share_right(scene, snapshot):
    answer = AdaptiveReid(scene).identify(snapshot)
    return np.mean([a == b for a, b in zip(answer.labels, scene.layout.labels, strict=True)]), answer


def along(yaw):
    return np.stack([np.sin(yaw), np.cos(yaw)], axis=-1)


def pairs_of(seed, n=9):
    """The pairs of a snapshot of things in random places, and the belief that each is the same as before."""
    rng = np.random.default_rng(seed)
    place, yaw = rng.random((n, 2)) * 3, rng.uniform(-np.pi, np.pi, n)
    later, turned = place + rng.normal(0, 0.4, (n, 2)), yaw + rng.normal(0, 0.2, n)
    pairs = AdaptiveReid(things(place, yaw))._problem(seen(later, turned), None).pairs
    belief = (pairs.label == np.repeat(np.arange(n), n)).astype(float)
    return pairs, belief


@pytest.mark.parametrize("seed", [1, 2])
def test_a_shared_shift_with_a_speed_ahead_is_the_least_squares_one(seed):
    pairs, belief = pairs_of(seed)
    own = belief > 0
    known = np.concatenate([np.stack([pairs.ahead_x[own], np.ones(9), np.zeros(9)], -1),
                            np.stack([pairs.ahead_z[own], np.zeros(9), np.ones(9)], -1)])  # fmt: skip
    wanted = np.concatenate([pairs.shift_x[own], pairs.shift_z[own]])
    (ahead, east, north), *_ = np.linalg.lstsq(known, wanted)
    found = best_motion(pairs, belief, 0.1, Profile.STREAMING)
    if ahead > 0:
        np.testing.assert_allclose([found.ahead, found.east, found.north], [ahead, east, north], atol=1e-9)
    else:
        assert found.ahead == 0


def test_a_shared_shift_is_the_mean_and_a_shared_turn_that_of_kabsch():
    pairs, belief = pairs_of(3)
    own = belief > 0
    shift = np.stack([pairs.shift_x[own], pairs.shift_z[own]], -1)
    found = best_motion(pairs, belief, 0.1, Profile.TOGETHER)
    np.testing.assert_allclose([found.east, found.north], shift.mean(axis=0))
    place = np.stack([pairs.from_x[own], pairs.from_z[own]], -1)
    u, _, vt = np.linalg.svd((place - place.mean(0)).T @ (place + shift - (place + shift).mean(0)))
    turn = vt.T @ np.diag([1, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    # A scale of next to nothing leaves nothing of the prior of no turn; clockwise from above.
    found = best_motion(pairs, belief, 1e-6, Profile.TURNING)
    np.testing.assert_allclose([[found.xx, found.xz], [found.zx, found.zz]], turn, atol=1e-6)


def test_a_shared_bending_is_that_of_ridge_regression_and_its_freedom_that_of_its_evidence():
    pairs, belief = pairs_of(5)
    own, length = belief > 0, 0.3
    place = np.stack([pairs.from_x[own], pairs.from_z[own]], -1)
    shift = np.stack([pairs.shift_x[own], pairs.shift_z[own]], -1)
    x, y = place - place.mean(axis=0), shift - shift.mean(axis=0)
    bend = np.linalg.solve(x.T @ x / length**2 + np.eye(2) / BEND_SD**2, x.T @ y / length**2).T
    found = best_motion(pairs, belief, length, Profile.BENDING)
    np.testing.assert_allclose([[found.xx, found.xz], [found.zx, found.zz]], np.eye(2) + bend, atol=1e-9)
    # The shifts have a Gaussian evidence in which the bending is integrated out; at the best one it is more.
    spread = length**2 * np.eye(9) + BEND_SD**2 * x @ x.T
    evidence = sum(stats.multivariate_normal(np.zeros(9), spread).logpdf(y[:, k]) for k in range(2))
    best = stats.norm(x @ bend.T, length).logpdf(y).sum()
    assert found.freedom == pytest.approx(evidence - best)


def test_a_shared_turn_costs_what_of_its_prior_the_turns_leave():
    pairs, belief = pairs_of(4)
    own, every = belief > 0, hypotheses(AdaptiveOptions(), MOST_SCALES)
    table = tabulated(pairs, every.profiles, every.angles)
    common_of(pairs, every.profiles, np.flatnonzero(own), table)
    turn = stats.circmean(np.arctan2(pairs.turn_sine[own], pairs.turn[own]))
    prior = 0.5 / (2 * np.pi) + 0.5 * stats.vonmises(SWINGS).pdf(turn)
    shared = 0
    for h, t in enumerate(every.motions.heading):
        cost = freedom_of(h, every.motions, table) - table.penalty[every.motions.profile[h]]
        if every.angles.shared[t]:
            shared += 1
            assert cost == pytest.approx(np.log(np.sqrt(2 * np.pi / (9 * every.angles.turn[t])) * prior))
            assert cost < 0
        else:
            assert cost == 0
    assert shared > 0


def test_headings_of_a_flock_that_all_go_one_way_do_not_tell_who_is_who():
    """All turn anew about one course, so that whoever has the nearest heading is not likelier the same."""
    right, plain = [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        place = rng.random((16, 2)) * 4
        later = place + np.array([1.5, 0.4]) + rng.normal(0, 0.22, (16, 2))
        scene, snapshot = things(place, rng.normal(1.3, 0.2, 16)), seen(later, rng.normal(1.3, 0.2, 16))
        right.append(share_right(scene, snapshot)[0])
        answer = SquaredDistanceReid(scene).identify(snapshot)  # a shared shift changes nothing for it
        plain.append(np.mean([a == b for a, b in zip(answer.labels, scene.layout.labels, strict=True)]))
    assert np.mean(right) > np.mean(plain) - 0.05


def test_what_was_shuffled_anyhow_is_neither_named_with_confidence_nor_called_new():
    none, confidence = [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        place, later = rng.random((2, 24, 2)) * 20
        yaw, turned = rng.uniform(-np.pi, np.pi, (2, 24))
        answer = AdaptiveReid(things(place, yaw)).identify(seen(later[:21], turned[:21]))
        none.append(np.mean([label is None for label in answer.labels]))
        confidence.append(np.where([label is None for label in answer.labels], 0, answer.confidence).mean())
    assert np.mean(none) < 0.15
    assert np.mean(confidence) < 0.25


def test_a_crowd_that_drifts_while_each_goes_ahead_is_followed():
    right = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        place, yaw = rng.random((14, 2)) * 3.5, rng.uniform(-np.pi, np.pi, 14)
        later = place + (1.3, -0.8) + 1.2 * along(yaw) + rng.normal(0, 0.05, (14, 2))
        right.append(share_right(things(place, yaw), seen(later, yaw + rng.normal(0, 0.1, 14)))[0])
    assert np.mean(right) > 0.95


def test_some_stand_and_some_drive_at_any_speed():
    right, none = [], []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        place, yaw = rng.random((16, 2)) * 30, rng.uniform(-np.pi, np.pi, 16)
        speed = np.where(np.arange(16) < 5, 0.0, rng.uniform(1.0, 12.0, 16))
        later = place + speed[:, None] * along(yaw) + rng.normal(0, 0.03, (16, 2))
        share, answer = share_right(things(place, yaw), seen(later, yaw + rng.normal(0, 0.08, 16)))
        right.append(share)
        none.append(np.mean([label is None for label in answer.labels]))
    assert np.mean(right) > 0.95
    assert np.mean(none) < 0.02


@pytest.mark.parametrize("parts", [2, 4])
def test_boxes_turned_by_a_half_or_a_quarter_are_no_misfit(parts):
    """A detector that cannot tell a box's front says its heading up to half a turn."""
    rng = np.random.default_rng(4)
    place = 2.0 * np.array([(x, z) for x in range(5) for z in range(4)])
    yaw = rng.normal(0, 0.03, 20)
    turned = yaw + rng.integers(parts, size=20) * 2 * np.pi / parts + rng.normal(0, 0.03, 20)
    share, answer = share_right(things(place, yaw), seen(place + rng.normal(0, 0.1, (20, 2)), turned))
    assert share == 1
    assert not any("explains" in said for said in answer.warnings)
    assert answer.confidence.min() > 0.95


@pytest.mark.parametrize("shape", [(16, 6, 32), (19, 8, 32)])
def test_what_an_earlier_version_learnt_still_counts(shape):
    motion = np.zeros(shape)
    motion[0, 0] = -np.abs(np.arange(32) - 5.0)
    old = Disorder.from_json(
        {
            "snapshots": 3,
            "motion": (motion - 40).tolist(),
            "rates": [0.0, -1.0, -2.0, -3.0, -4.0, -5.0],
            "sizes": [0.0] * 5,
        }
    )
    scene = things(np.random.default_rng(0).random((5, 2)), np.zeros(5))
    kept = AdaptiveReid(scene, disorder=old).disorder
    assert kept.snapshots == 3
    np.testing.assert_array_equal(kept.motion[: shape[0], : shape[1]], motion - 40)
    assert kept.motion[shape[0] :].max() == old.motion.min()
    np.testing.assert_array_equal(kept.rates, [0, -1, -2, -2, -3, -4, -5, -5])
