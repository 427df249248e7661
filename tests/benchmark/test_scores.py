"""Scores against counts by hand and against what probability says."""

import numpy as np
import pytest

from farm_ar.benchmark.scores import (
    Scored,
    brier_of_confidence,
    brier_scores,
    calibration,
    coverage_curve,
    outcomes,
    paired_difference,
    resampled,
    score,
    selective,
)
from farm_ar.reid import Identification
from farm_ar.reid.answers import Assurance


def scored(outcome: str, confidence: object = None, each: int = 1) -> Scored:
    n = len(outcome)
    stated = np.full(n, np.nan) if confidence is None else np.asarray(confidence, dtype=float)
    return Scored(np.arange(n) // each, outcome, stated, np.full(n, np.nan))


def test_every_kind_of_answer_has_its_letter():
    assert outcomes(("a", "b", None, "c", None), ("a", "c", "d", None, None)) == "rwnfr"


def test_the_brier_score_is_zero_for_the_sure_truth_and_two_for_the_sure_opposite():
    probability = np.array([[1.0, 0, 0], [1.0, 0, 0], [0.5, 0.25, 0.25]])
    found = Identification(
        ("a", "a", "a"), candidates=("a", "b"), assurance=Assurance(probability=probability)
    )
    assert brier_scores(found, ("a", "b", None), ("a", "b")).tolist() == [0, 2, 0.25 + 0.0625 + 0.75**2]


def test_a_true_label_that_was_no_candidate_counts_as_given_no_probability():
    found = Identification(("a",), candidates=("a",), assurance=Assurance(probability=np.array([[0.6, 0.4]])))
    assert brier_scores(found, ("z",), ("a", "z"))[0] == pytest.approx(0.36 + 0.16 + 1)


def test_confidence_alone_is_scored_as_if_the_rest_were_spread_evenly():
    # Two labels and none: .7 on the answer, .15 on each of the others.
    right, wrong = brier_of_confidence(np.array([0.7, 0.7]), "rw", 2)
    assert right == pytest.approx(0.3**2 + 2 * 0.15**2)
    assert wrong == pytest.approx(0.7**2 + 0.85**2 + 0.15**2)


def test_a_calibrated_method_has_no_error_beyond_chance_and_an_overconfident_one_has_its_excess():
    rng = np.random.default_rng(1)
    confidence = rng.uniform(0.3, 1.0, 4000)
    draw = rng.random(4000)
    honest = calibration(
        scored("".join("r" if d < c else "w" for d, c in zip(draw, confidence, strict=True)), confidence), rng
    )
    vain = calibration(
        scored(
            "".join("r" if d < c - 0.2 else "w" for d, c in zip(draw, confidence, strict=True)), confidence
        ),
        rng,
    )
    assert abs(honest.excess) < 0.005
    assert honest.error > 0.01  # by chance alone
    assert vain.excess == pytest.approx(0.19, abs=0.02)


def test_answers_stated_to_be_sure_are_counted_apart():
    found = selective(scored("rrwrn", [0.95, 0.9, 0.99, 0.5, 0.89]))
    assert found.coverage == pytest.approx(3 / 5)
    assert found.right == pytest.approx(2 / 3)
    assert all(np.isnan(value) for value in selective(scored("rw")))


def test_the_curve_begins_with_the_most_confident_answer():
    coverage, right = coverage_curve(scored("wrr", [0.2, 0.9, 0.5]))
    assert coverage.tolist() == pytest.approx([1 / 3, 2 / 3, 1])
    assert right.tolist() == pytest.approx([1, 1, 2 / 3])


def test_the_interval_is_that_of_the_snapshots_not_of_their_detections():
    rng = np.random.default_rng(0)
    per_snapshot = rng.normal(0.1, 0.3, 400)
    value = np.repeat(per_snapshot, 10)
    found = paired_difference(value, np.zeros(4000), scored("r" * 4000, each=10), rng)
    half = 1.96 * per_snapshot.std() / np.sqrt(400)
    assert found.value == pytest.approx(per_snapshot.mean())
    assert (found.high - found.low) / 2 == pytest.approx(half, rel=0.1)


def test_a_ratio_weighs_snapshots_by_their_detections():
    found = resampled(np.array([1.0, 0.0]), np.array([1.0, 3.0]), np.random.default_rng(0))
    assert found.value == 0.25


def test_a_method_is_compared_with_the_best_simple_one_of_the_row():
    simple = {"near": scored("rrww"), "far": scored("rrrw")}
    found = score("mine", "row", scored("rrnf"), simple, [0.002, 0.004, 0.009], np.random.default_rng(0))
    assert (found.simple, found.accuracy, found.difference.value) == ("far", 0.5, -0.25)
    assert (found.wrongly_none, found.wrongly_named, found.failed) == (0.25, 0.25, 0)
    assert found.milliseconds == 4
    assert np.isnan(found.brier)
    assert np.isnan(found.calibration_error)


def test_joined_parts_keep_their_snapshots_apart():
    both = Scored.joined([scored("rr", each=2), scored("wn")])
    assert both.outcome == "rrwn"
    assert both.snapshot.tolist() == [0, 0, 1, 2]
