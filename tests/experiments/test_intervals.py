"""Intervals by resampling layouts."""

import numpy as np
import pytest

from farm_ar.experiments.intervals import (
    Sums,
    difference_of,
    interval_of,
    interval_of_mean,
    resampled,
    sums_of,
)


def test_the_mean_is_over_all_snapshots_and_missing_ones_do_not_count(rng):
    values = np.array([[1.0, 0.0, np.nan], [0.5, np.nan, np.nan]])
    assert interval_of(values, rng).mean == pytest.approx(0.5)
    assert interval_of(np.array([0.2, np.nan, 0.4]), rng).mean == pytest.approx(0.3)


def test_one_layout_has_a_mean_without_an_interval(rng):
    found = interval_of(np.array([[0.5, 1.0]]), rng)
    assert found.mean == 0.75
    assert np.isnan([found.low, found.high]).all()
    assert (found.ends, found.signed) == ("", "+0.750")


def test_snapshots_of_a_layout_are_drawn_together(rng):
    """A thousand equal snapshots of each of 30 layouts say no more than one each."""
    each = rng.normal(0.8, 0.05, 30)
    once, often = interval_of(each, rng), interval_of(np.repeat(each[:, None], 1000, axis=1), rng)
    assert (often.low, often.high) == pytest.approx((once.low, once.high), abs=0.003)
    half = 1.96 * each.std(ddof=1) / np.sqrt(30)
    assert once.high - once.low == pytest.approx(2 * half, rel=0.15)


def test_about_95_of_100_intervals_hold_the_true_mean(rng):
    found = [interval_of(rng.normal(0.3, 0.1, (40, 1)), rng) for _ in range(200)]
    inside = sum(one.low <= 0.3 <= one.high for one in found)
    assert 178 <= inside <= 199


def test_a_difference_is_paired(rng):
    """What the two share, however varied, does not widen the interval."""
    shared = rng.normal(0.5, 0.3, (25, 8))
    found = difference_of(shared + 0.1, shared, rng)
    assert (found.mean, found.low, found.high) == pytest.approx((0.1, 0.1, 0.1))
    assert found.signed == "+0.100 (+0.100 to +0.100)"


def test_a_mean_of_scenes_varies_less_than_each_of_them(rng):
    """Of independent scenes, as the mean of independent means does, however many values each has."""
    scenes = [rng.normal(level, 0.1, (30, size)) for level, size in ((0.2, 1), (0.5, 1), (0.8, 1), (0.9, 1))]
    scenes[3] = np.repeat(scenes[3], 50, axis=1)
    found = interval_of_mean([sums_of(one) for one in scenes], rng)
    assert found.mean == pytest.approx(np.mean([one.mean() for one in scenes]))
    half = 1.96 * np.sqrt(sum(one.mean(axis=1).var(ddof=1) / 30 for one in scenes)) / 4
    assert found.high - found.low == pytest.approx(2 * half, rel=0.15)


def test_layouts_with_more_detections_weigh_more(rng):
    right, seen = np.array([0.0, 9.0, 1.0]), np.array([1.0, 9.0, 0.0])
    found = interval_of_mean([Sums(right[:2], seen[:2])], rng)
    assert found.mean == pytest.approx(0.9)
    assert (found.low, found.high) == (0.0, 1.0)


def test_a_scene_of_one_layout_leaves_the_mean_without_an_interval(rng):
    one, more = sums_of(np.array([[0.4]])), sums_of(np.array([[0.6], [0.8]]))
    found = interval_of_mean([one, more], rng)
    assert found.mean == pytest.approx(0.55)
    assert found.text == "0.550"


def test_any_statistic_is_resampled_by_layouts():
    values = np.repeat(np.random.default_rng(0).normal(size=(50, 1)), 9, axis=1)
    found = resampled(values, lambda drawn: float(drawn.mean()), np.random.default_rng(1))
    assert found.mean == values.mean()
    assert found.high - found.low == pytest.approx(2 * 1.96 * values[:, 0].std() / 50**0.5, rel=0.25)
