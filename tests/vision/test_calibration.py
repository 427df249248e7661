"""Calibration: what was planted is found again."""

import numpy as np
import pytest

from farm_ar.vision.calibration import PLAIN, Calibration, Evidence, fit_logistic, fit_spread


def evidence(count, rng):
    return Evidence(
        heat=rng.uniform(0.1, 0.99, count),
        visible=rng.uniform(0.2, 1, count),
        flipped=rng.uniform(0, 0.5, count),
        spread=np.exp(rng.uniform(-7, -3, (count, 2))),
        away=rng.uniform(0.4, 1.5, count),
        gain=rng.uniform(0, 10, count),
        seen=rng.uniform(0.2, 1, count),
        moved=rng.uniform(0, 0.01, count),
        flip=np.where(rng.random(count) < 0.5, np.nan, rng.uniform(-0.2, 0.2, count)),
    )


def test_probabilities_are_those_with_which_things_happened():
    rng = np.random.default_rng(0)
    known = evidence(4000, rng)
    columns = known.for_score()
    weights = np.linspace(-0.5, 0.7, columns.shape[1])
    right = rng.random(4000) < 1 / (1 + np.exp(-columns @ weights))
    fitted = Calibration.of(
        {"refined": {"score": fit_logistic(columns, right, np.array(PLAIN["score"]))}}, True
    )
    score = fitted.score(known)
    for low in (0.0, 0.25, 0.5, 0.75):
        here = (score >= low) & (score < low + 0.25)
        assert abs(right[here].mean() - score[here].mean()) < 0.05 or here.sum() < 100


def test_covariances_are_those_of_errors_in_the_direction_of_the_ray():
    rng = np.random.default_rng(1)
    known = evidence(6000, rng)
    columns = known.for_spread()
    weights = np.array([-1.0, 0.5, 0.2, -0.4] + [0.0] * (columns.shape[1] - 4))
    error = np.exp(columns @ weights) * rng.laplace(0, np.sqrt(0.5), 6000)
    fitted = fit_spread(columns, error, np.array(PLAIN["along"]))
    told = Calibration.of(
        {"unrefined": {"along": fitted, "across": [-20.0] + [0.0] * (columns.shape[1] - 1)}}, False
    )
    toward = rng.uniform(-np.pi, np.pi, 6000)
    covariance = told.covariance(known, toward)
    ray = np.column_stack([np.sin(toward), np.cos(toward)])
    along = np.einsum("ni,nij,nj->n", ray, covariance[:, :2, :2], ray)
    ratio = error**2 / along
    assert np.median(ratio) == pytest.approx(np.log(2) ** 2 / 2, rel=0.15)  # of Laplace's distribution
    assert np.mean(ratio) == pytest.approx(1, rel=0.15)
    assert np.linalg.eigvalsh(covariance).min() > 0


def test_no_refinement_scores_more_than_is_said_before():
    rng, n = np.random.default_rng(3), 400
    for _ in range(5):
        weights = {"score": rng.normal(0, 2, 5).tolist()}
        calibration = Calibration.of({"refined": weights}, True)
        heat, visible, spread = rng.random(n), rng.random(n), rng.uniform(0.001, 0.1, (n, 2))
        gain, moved = rng.uniform(-5, 20, n), rng.exponential(0.05, n)
        nothing = np.zeros(n)
        seen = Evidence(heat, visible, nothing, spread, nothing + 1, gain, nothing, moved, nothing)
        assert (calibration.score(seen) <= calibration.most(heat, visible) + 1e-12).all()
