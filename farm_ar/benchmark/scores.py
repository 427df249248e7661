"""Scores of answers: accuracy, calibration, selective accuracy, and paired differences with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.benchmark.worlds.base import Truth
from farm_ar.reid import Identification

RIGHT, WRONG, NONE, NAMED, FAILED = "rwnfx"
"""Outcomes of a detection: right; a wrong label; none though it has one; a label though it has none; and no
answer at all, because the method failed."""

BINS, RESAMPLES, CALIBRATED_DRAWS = 20, 2000, 200
"""Bins of confidence; resamples of snapshots; draws of what a calibrated method would get right."""

CONFIDENT = 0.9
"""The stated confidence from which on answers count for selective accuracy."""


class Scored(NamedTuple):
    """D detections one after another, as answered by one method.

    Args:
        snapshot: (D,) which snapshot each belongs to.
        outcome: D letters.
        confidence: (D,) of each answer; NaN where the method does not say.
        brier: (D,) sum of squared differences between probabilities and truth; NaN where it does not say.
    """

    snapshot: IntArray
    outcome: str
    confidence: FloatArray
    brier: FloatArray

    @property
    def right(self) -> FloatArray:
        """(D,) 1 where the answer is right, else 0."""
        return np.array([letter == RIGHT for letter in self.outcome], dtype=np.float64)

    @classmethod
    def joined(cls, parts: Sequence[Scored]) -> Scored:
        """The detections of several parts, whose snapshots are all different ones."""
        first, snapshot = 0, []
        for part in parts:
            snapshot.append(part.snapshot + first)
            first += int(part.snapshot.max(initial=-1)) + 1
        nothing = [np.zeros(0)]
        return cls(
            np.concatenate(snapshot or [np.zeros(0, dtype=np.int64)]),
            "".join(part.outcome for part in parts),
            np.concatenate([part.confidence for part in parts] or nothing),
            np.concatenate([part.brier for part in parts] or nothing),
        )


def outcomes(labels: Sequence[str | None], truth: Truth) -> str:
    """The outcome of each of N answers."""
    letters = []
    for given, true in zip(labels, truth, strict=True):
        wrong = NAMED if true is None else NONE if given is None else WRONG
        letters.append(RIGHT if given == true else wrong)
    return "".join(letters)


def brier_scores(found: Identification, truth: Truth, labels: Sequence[str]) -> FloatArray:
    """(N,) Brier score of each detection over all labels and none, from 0 (best) to 2.

    Where a method gives the probability of its answer only, what is left to 1 is spread evenly over all other
    labels and none. Brier 1950, in its original form.

    Args:
        found: the answer, with confidence or with probabilities.
        truth: N true labels.
        labels: all labels of the scene.
    """
    if found.probability is not None:
        column = {name: j for j, name in enumerate(found.candidates)} | {None: len(found.candidates)}
        scores = [
            float(np.sum(p**2) - 2 * p[column[true]] + 1) if true in column else float(np.sum(p**2) + 1)
            for p, true in zip(found.probability, truth, strict=True)
        ]
        return np.array(scores)
    return brier_of_confidence(found.confidence, outcomes(found.labels, truth), len(labels))


def brier_of_confidence(confidence: FloatArray, outcome: str, labels: int) -> FloatArray:
    """(N,) the same from the confidence of each answer alone, in a scene of so many labels."""
    right = np.array([letter == RIGHT for letter in outcome], dtype=bool)
    rest = (1 - confidence) / max(labels, 1)  # each of the others, none among them
    whole = confidence**2 + labels * rest**2
    scores: FloatArray = whole - 2 * np.where(right, confidence, rest) + 1
    return scores


class Interval(NamedTuple):
    """A value with its two-sided 95% interval."""

    value: float
    low: float
    high: float


class Calibration(NamedTuple):
    """How far confidence is from the share that is right.

    Args:
        answers: (BINS,) how many answers there are in each bin of confidence.
        confidence: (BINS,) their mean confidence, NaN where there are none.
        right: (BINS,) the share that is right.
        error: expected calibration error (ECE); NaN of nothing.
        expected: what it would be on average if the confidences were exactly right.
    """

    answers: FloatArray
    confidence: FloatArray
    right: FloatArray
    error: float
    expected: float

    @property
    def excess(self) -> float:
        """ECE less its expectation under calibration."""
        return self.error - self.expected


def calibration(scored: Scored, rng: np.random.Generator) -> Calibration:
    """The calibration of all answers whose confidence is known.

    Args:
        scored: the answers.
        rng: draws what would be right if the confidences were.
    """
    known = np.isfinite(scored.confidence)
    confidence, right = scored.confidence[known], scored.right[known]
    index = np.minimum((confidence * BINS).astype(np.int64), BINS - 1)
    count = np.bincount(index, minlength=BINS).astype(np.float64)
    stated = np.bincount(index, confidence, BINS)
    correct = np.bincount(index, right, BINS)
    if not len(confidence):
        nothing = np.full(BINS, np.nan)
        return Calibration(count, nothing, nothing, float("nan"), float("nan"))
    drawn = [
        np.abs(np.bincount(index, rng.random(len(index)) < confidence, BINS) - stated).sum() / len(index)
        for _ in range(CALIBRATED_DRAWS)
    ]
    with np.errstate(invalid="ignore"):
        error = float(np.abs(correct - stated).sum() / len(index))
        return Calibration(count, stated / count, correct / count, error, float(np.mean(drawn)))


class Selective(NamedTuple):
    """The answers of high confidence: share of all detections, and the share of those right."""

    coverage: float
    right: float


def selective(scored: Scored, confident: float = CONFIDENT) -> Selective:
    """The answers of at least so much confidence; NaN where the method states none."""
    if not np.isfinite(scored.confidence).any():
        return Selective(float("nan"), float("nan"))
    chosen = scored.confidence >= confident
    right = float(scored.right[chosen].mean()) if chosen.any() else float("nan")
    return Selective(float(chosen.mean()), right)


def coverage_curve(scored: Scored) -> tuple[FloatArray, FloatArray]:
    """Coverage and accuracy of the most confident answers, for each number of them; empty without any."""
    known = np.flatnonzero(np.isfinite(scored.confidence))
    order = known[np.argsort(-scored.confidence[known], kind="stable")]
    number = np.arange(1, len(order) + 1)
    return number / max(len(scored.outcome), 1), np.cumsum(scored.right[order]) / number


def per_snapshot(scored: Scored, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(S,) sums of a value of each detection over its snapshot, and (S,) how many detections that has."""
    number = int(scored.snapshot.max(initial=-1)) + 1
    count = np.bincount(scored.snapshot, minlength=number).astype(np.float64)
    return np.bincount(scored.snapshot, values, number).astype(np.float64), count


def paired_difference(
    ours: FloatArray, theirs: FloatArray, scored: Scored, rng: np.random.Generator
) -> Interval:
    """Mean difference of a value per detection, its interval by resampling snapshots.

    Args:
        ours: (D,) the value of one method.
        theirs: (D,) of the other, of the same detections.
        scored: which snapshots these belong to.
        rng: draws the resamples.
    """
    difference, count = per_snapshot(scored, ours - theirs)
    return resampled(difference, count, rng)


def resampled(total: FloatArray, count: FloatArray, rng: np.random.Generator) -> Interval:
    """A ratio of sums over S snapshots, its interval by drawing S of them with replacement."""
    if not count.sum():
        return Interval(float("nan"), float("nan"), float("nan"))
    number = len(count)
    drawn = rng.multinomial(number, np.full(number, 1 / number), size=RESAMPLES)
    low, high = np.quantile(drawn @ total / np.maximum(drawn @ count, 1e-12), [0.025, 0.975])
    return Interval(float(total.sum() / count.sum()), float(low), float(high))


@dataclass(frozen=True)
class Score:
    """One method on one row, or over all rows.

    Args:
        method: its name.
        row: the row's name; "all" for the mean over the rows.
        detections: how many.
        accuracy: share of right answers.
        wrongly_none: share of detections answered none though they have a label.
        wrongly_named: share answered with a label though they have none.
        failed: share without any answer, because the method failed.
        calibration_error: ECE less its expectation under calibration; NaN without confidence.
        brier: mean Brier score; NaN without confidence.
        coverage: share of answers stated to be right with .9 or more.
        coverage_right: the share of those that is right.
        simple: the best simple method of the row.
        difference: accuracy less that of the best simple method, paired by snapshot.
        milliseconds: median time of a snapshot, making the method for its scene included.
    """

    method: str
    row: str
    detections: int
    accuracy: float
    wrongly_none: float
    wrongly_named: float
    failed: float
    calibration_error: float
    brier: float
    coverage: float
    coverage_right: float
    simple: str
    difference: Interval
    milliseconds: float


def score(
    method: str,
    row: str,
    scored: Scored,
    simple: Mapping[str, Scored],
    seconds: Sequence[float],
    rng: np.random.Generator,
) -> Score:
    """The score of one method on one row.

    Args:
        method: its name.
        row: the row's name.
        scored: its answers.
        simple: the answers of the simple methods to the same snapshots.
        seconds: time of each snapshot.
        rng: for resampling.
    """
    best = max(simple, key=lambda name: simple[name].right.mean()) if simple else method
    against = simple.get(best, scored)
    number = max(len(scored.outcome), 1)
    sure = selective(scored)
    return Score(
        method=method,
        row=row,
        detections=len(scored.outcome),
        accuracy=scored.outcome.count(RIGHT) / number,
        wrongly_none=scored.outcome.count(NONE) / number,
        wrongly_named=scored.outcome.count(NAMED) / number,
        failed=scored.outcome.count(FAILED) / number,
        calibration_error=calibration(scored, rng).excess,
        brier=float(scored.brier.mean()) if len(scored.brier) else float("nan"),
        coverage=sure.coverage,
        coverage_right=sure.right,
        simple=best,
        difference=paired_difference(scored.right, against.right, scored, rng),
        milliseconds=1000 * float(np.median(seconds)) if len(seconds) else float("nan"),
    )


def mean_score(method: str, scores: Sequence[Score], everything: Scored, rng: np.random.Generator) -> Score:
    """The mean over rows, each counting alike; calibration and selection are of all answers together.

    The interval of the mean difference adds the variances of the rows.
    """

    def mean(name: str) -> float:
        return float(np.mean([getattr(one, name) for one in scores]))

    half = [(one.difference.high - one.difference.low) / 2 for one in scores]
    middle = float(np.mean([one.difference.value for one in scores]))
    wide = float(np.sqrt(np.sum(np.square(half)))) / len(scores)
    sure = selective(everything)
    return Score(
        method=method,
        row="all",
        detections=sum(one.detections for one in scores),
        accuracy=mean("accuracy"),
        wrongly_none=mean("wrongly_none"),
        wrongly_named=mean("wrongly_named"),
        failed=mean("failed"),
        calibration_error=calibration(everything, rng).excess,
        brier=mean("brier"),
        coverage=sure.coverage,
        coverage_right=sure.right,
        simple="best of each row",
        difference=Interval(middle, middle - wide, middle + wide),
        milliseconds=mean("milliseconds"),
    )
