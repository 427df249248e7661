"""The oracle with measured noise errs as the file says."""

import json

import numpy as np
import pytest
from scipy.stats import chi2

from farm_ar.geometry import wrap
from farm_ar.vision.measured_noise import (
    FILE,
    MeasuredPerception,
    in_picture,
    measured_noise,
    moments_of,
)


def test_errors_are_as_large_and_as_frequent_as_was_measured(farm):
    noise = measured_noise()
    rng = np.random.default_rng(0)
    rows, seen, found, false = [], 0, 0, 0
    moments = moments_of(farm, 40, 5)
    for _ in range(12):
        for truth, camera in moments:
            perceived = MeasuredPerception().perceive(truth, camera, rng)
            detections, source = perceived.snapshot.detections, perceived.source
            there = in_picture(truth, camera)
            seen, found, false = seen + there.sum(), found + (source >= 0).sum(), false + (source < 0).sum()
            real = source >= 0
            away = np.linalg.norm(truth.position[source[real]] - camera.position, axis=1)
            turn = wrap(detections.yaw[real] - truth.yaw[source[real]])
            shift = np.linalg.norm(detections.position[real] - truth.position[source[real]], axis=1)
            rows += np.column_stack([away, shift, turn]).tolist()
    away, shift, turn = np.array(rows).T
    kind = np.searchsorted(noise.edges, away)
    share = np.bincount(kind, minlength=len(noise.miss)) / len(kind)
    assert 1 - found / seen == pytest.approx(noise.miss.mean(), abs=noise.miss.max() + 0.03)
    assert (np.abs(turn) > np.pi / 2).mean() == pytest.approx(share @ noise.flip, abs=0.02)
    for k in range(len(noise.miss)):
        here = kind == k
        if here.sum() > 200:
            wanted = np.trace(noise.covariance[k, :2, :2]) + (noise.bias[k, :2] ** 2).sum()
            assert (shift[here] ** 2).mean() == pytest.approx(wanted, rel=0.35)
    assert false / (12 * len(moments)) == pytest.approx(noise.false_rate, abs=0.1)


def test_what_is_said_of_the_errors_is_so(farm):
    rng, inside, flipped, rescued, real = np.random.default_rng(1), [], 0.0, 0, []
    for truth, camera in 10 * moments_of(farm, 30, 6):
        perceived = MeasuredPerception().perceive(truth, camera, rng)
        seen, source = perceived.snapshot.detections, perceived.source
        real += (source >= 0).tolist()
        assert np.all(seen.confidence == measured_noise().precision)
        for k in np.flatnonzero(source >= 0):
            turn = wrap(seen.yaw[k] - truth.yaw[source[k]])
            flipped += seen.uncertainty.runner_up_weight[k]
            if abs(turn) > np.pi / 2:
                rescued += abs(wrap(seen.uncertainty.runner_up_yaw[k] - truth.yaw[source[k]])) < np.pi / 2
                continue
            error = np.append(seen.position[k] - truth.position[source[k]], turn)
            spread = seen.uncertainty.covariance[k] + 1e-12 * np.eye(3)
            inside.append(error @ np.linalg.solve(spread, error) < chi2.isf(0.1, 3))
    assert np.mean(inside) == pytest.approx(0.9, abs=0.05)
    assert rescued == pytest.approx(flipped, rel=0.3)
    assert np.mean(real) == pytest.approx(measured_noise().precision, abs=0.01)


def test_the_file_is_plain_data_that_says_how_it_was_made():
    document = json.loads(FILE.read_text())
    assert {"edges", "miss", "flip", "bias", "covariance", "false_rate", "pictures", "things"} <= set(
        document
    )
