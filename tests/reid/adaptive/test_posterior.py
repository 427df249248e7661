"""The average over hypotheses against sums over all ways of giving labels out, by SciPy's densities."""

import itertools

import numpy as np
import pytest
from scipy import stats
from scipy.special import i0e

from farm_ar.reid import AdaptiveReid
from farm_ar.reid.adaptive.detection_model import detection_model_of, motion_prior
from farm_ar.reid.adaptive.hypotheses import hypotheses, scales_for
from farm_ar.reid.adaptive.inference import exact_evidence, infer
from farm_ar.reid.adaptive.records import (
    Profile,
    Sparse,
)
from farm_ar.reid.adaptive.screening import evidence_bound, weigh
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot

FULL = FieldOfView(np.pi, np.pi, 50.0)


def chairs(seed, labels=4, detections=3, shift=0.3):
    """Chairs on a field, some of them seen again."""
    rng = np.random.default_rng(seed)
    position, yaw = rng.random((labels, 2)) * 3, rng.uniform(-np.pi, np.pi, labels)
    layout = Layout(tuple("abcdefgh"[:labels]), ("chair",) * labels, position, yaw, np.ones((labels, 3)))
    seen = rng.permutation(labels)[:detections]
    found = Detections(
        ("chair",) * detections,
        position[seen] + rng.normal(0, shift, (detections, 2)),
        yaw[seen] + rng.normal(0, 0.4, detections),
        np.ones((detections, 3)),
    )
    return Scene("field", (3.0, 3.0), layout), Snapshot(Camera(np.array([1.5, 1.5]), 0.0, FULL), found)


def shift_density(kind, length, width, shift, heading):
    """Density in the plane of a shift (2,), given the mean heading (2,)."""
    r = np.hypot(*shift)
    if kind == Profile.GAUSSIAN:
        return stats.multivariate_normal(np.zeros(2), length**2).pdf(shift)
    if kind == Profile.EXPONENTIAL:
        return stats.gamma(2, scale=length).pdf(r) / (2 * np.pi * r)
    if kind == Profile.STUDENT:
        return stats.multivariate_t(np.zeros(2), length**2 * np.eye(2), df=2).pdf(shift)
    if kind == Profile.AHEAD:
        return stats.multivariate_normal(length * heading, (width * length) ** 2).pdf(shift)
    if kind == Profile.RAY:
        bulk = stats.halfnorm(scale=length).pdf(0) / (2 * np.pi * max(r, 0.05 * length))
        even = 1 / (np.pi * (r**2 + 0.02**2) * np.log1p((length / 0.02) ** 2))
        return (bulk + even) / 2 * np.exp(-((r / length) ** 2) / 2)
    assert kind == Profile.RING
    far = max(r, 0.1 * length)
    return stats.lognorm(width, scale=length).pdf(far) / (2 * np.pi * far)


def by_enumeration(reid, snapshot, problem, every, detecting, prior):
    """(N, M + 1) marginals: the sum over all hypotheses but shared motions, and over all ways."""
    known, layout, seen = reid._known, reid.scene.layout, snapshot.detections
    unit, angles, motions = known.spacing, every.angles, every.motions
    n, m = len(seen), len(layout)
    steps = (seen.position[:, None] - layout.position) / unit
    turns = seen.yaw[:, None] - layout.yaw
    mean = np.stack(
        [np.sin(seen.yaw)[:, None] + np.sin(layout.yaw), np.cos(seen.yaw)[:, None] + np.cos(layout.yaw)], -1
    )
    mean /= np.linalg.norm(mean, axis=-1, keepdims=True)
    r = np.linalg.norm(steps, axis=-1)
    points = np.concatenate([seen.position, layout.position]) / unit
    area = 2 * np.pi * (((points - points.mean(axis=0)) ** 2).sum(axis=1).mean() + 1)
    by_ratio = 1 / (np.pi * (r**2 + 0.02**2) * np.log1p(area / np.pi / 0.02**2))
    loose = stats.vonmises(angles.turn[2]).pdf(turns) * (1 - angles.outliers) + angles.outliers / 2 / np.pi
    far = 0.5 * by_ratio * (0.25 / np.pi + 0.5 * loose) + 0.5 / area / (2 * np.pi)
    ways = [
        way
        for way in itertools.product(range(m + 1), repeat=n)
        if len({j for j in way if j < m}) == sum(j < m for j in way)
    ]
    total, shifts = np.zeros((n, m + 1)), {}
    for h in np.flatnonzero(every.profiles.kind[motions.profile] < Profile.TOGETHER):
        p, t, c = motions.profile[h], motions.heading[h], motions.course[h]
        turn = np.full((n, m), 1 / (2 * np.pi))
        if angles.turn[t] > 0:
            turned = stats.vonmises(angles.turn[t]).pdf(angles.fold[t] * turns)
            turn = (1 - angles.outliers) * turned + angles.outliers * turn
        if angles.anyone[t]:  # the heading of any of the things, with a turn
            turn = np.broadcast_to(turn.mean(axis=1, keepdims=True), turn.shape)
        for one in (p, motions.beyond[h]):
            if one >= 0 and one not in shifts:
                parts = every.profiles.kind[one], every.profiles.length[one], every.profiles.width[one]
                pairs = itertools.product(range(n), range(m))
                near = [
                    1 / area if parts[0] == Profile.EVEN else shift_density(*parts, steps[i, j], mean[i, j])
                    for i, j in pairs
                ]
                shifts[one] = np.reshape(near, (n, m))
        near = shifts[p]
        if c >= 0:
            cosine = (steps * mean).sum(axis=-1) / np.maximum(r, 1e-12)
            # Where hardly anything has moved its direction means less: as in the method.
            less = r**2 / (r**2 + 0.02**2)
            kappa = angles.course[c]
            course = np.sqrt(less) * np.exp(kappa * less * (cosine - 1)) / i0e(kappa)
            near = near * (angles.astray + (1 - angles.astray) * course)
        beyond = motions.beyond[h]
        moved = far if beyond < 0 else shifts[beyond] / (2 * np.pi)
        density = (1 - motions.far[h]) * near * turn + motions.far[h] * moved
        near_by = (1 - motions.far[h]) * detecting.in_view[motions.scale[h]]
        view = near_by + motions.far[h] * detecting.anywhere
        for q, (gone, new) in enumerate(zip(detecting.unseen, detecting.new, strict=True)):
            unseen = 1 - (1 - gone) * view
            weight = np.hstack([density * (1 - gone) / unseen, (new * detecting.none)[:, None]])
            scale = np.exp(prior[h] + detecting.log_rates[q] - new) * unseen.prod()
            for way in ways:
                value = scale * np.prod(weight[np.arange(n), way])
                total[np.arange(n), way] += value
    return total / total.sum(axis=1, keepdims=True)


@pytest.mark.parametrize(("seed", "shift"), [(1, 0.1), (2, 0.5), (3, 1.0)])
def test_marginals_are_those_of_all_ways_under_all_hypotheses(seed, shift):
    scene, snapshot = chairs(seed, labels=3, detections=2, shift=shift)
    reid = AdaptiveReid(scene)
    problem = reid._problem(snapshot, None)
    every = hypotheses(reid.options, scales_for(problem.extent))
    detecting, closed = detection_model_of(snapshot, problem, reid._known, every, reid.options, reid.disorder)
    prior = motion_prior(problem, every, reid.disorder, closed)
    alone = np.where(every.profiles.kind[every.motions.profile] >= Profile.TOGETHER, -np.inf, prior)
    found = np.zeros((2, 4))
    infer(
        problem.pairs,
        every.profiles,
        every.angles,
        every.motions._replace(log_prior=alone),
        detecting,
        12,
        found,
    )
    expected = by_enumeration(reid, snapshot, problem, every, detecting, prior)
    np.testing.assert_allclose(found, expected, atol=0.01)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("scale", [1.0, 1e-200, 1e200])
def test_the_bound_is_the_product_of_all_that_each_detection_may_be(seed, scale):
    rng = np.random.default_rng(seed)
    scene, snapshot = chairs(seed)
    reid = AdaptiveReid(scene)
    problem = reid._problem(snapshot, None)
    every = hypotheses(reid.options, scales_for(problem.extent))
    detecting, _ = detection_model_of(snapshot, problem, reid._known, every, reid.options, reid.disorder)
    pairs = problem.pairs
    n, m = len(detecting.none), len(detecting.anywhere)
    density, factor = scale * rng.random(len(pairs.label)) ** 8, np.empty(m)
    some = Sparse(
        np.zeros(n + 1, dtype=np.int64),
        np.empty(len(density), dtype=np.int64),
        np.empty(len(density), dtype=np.int64),
        np.empty(len(density)),
        np.empty(n),
    )
    for h, q in ((0, 0), (40, 3), (len(every.motions.far) - 1, 7)):
        bound = evidence_bound(h, q, pairs, detecting, every.motions, density, factor)
        far = every.motions.far[h]
        view = (1 - far) * detecting.in_view[every.motions.scale[h]] + far * detecting.anywhere
        unseen = np.maximum(1 - (1 - detecting.unseen[q]) * view, 1e-9)
        each = np.append(density * ((1 - detecting.unseen[q]) / unseen)[pairs.label], 0.0)
        sums = np.add.reduceat(each, pairs.start[:-1]) + detecting.new[q] * detecting.none
        expected = np.log(unseen).sum() - detecting.new[q] + np.log(np.maximum(sums, 1e-300)).sum()
        assert bound == pytest.approx(expected, rel=1e-12)
        total = weigh(h, q, pairs, detecting, every.motions, density, some, factor)
        assert total + exact_evidence(some, m) <= bound + 1e-9
