"""Numbers about many cases: shares with their intervals, medians where some are infinite, calibration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import beta

from farm_ar.arrays import FloatArray


class Share(NamedTuple):
    """A share k of n with its two-sided 95% interval."""

    value: float
    low: float
    high: float


def clopper_pearson(k: int, n: int, level: float = 0.95) -> Share:
    """The exact binomial interval of k successes in n (Clopper and Pearson 1934); 0 to 1 where n is 0."""
    if n == 0:
        return Share(float("nan"), 0.0, 1.0)
    tail = (1 - level) / 2
    low = float(beta.ppf(tail, k, n - k + 1)) if k > 0 else 0.0
    high = float(beta.ppf(1 - tail, k + 1, n - k)) if k < n else 1.0
    return Share(k / n, low, high)


def median(values: Sequence[float | None]) -> float:
    """The middle value, those that are None counted as infinite; NaN of nothing.

    Of an even number it is the mean of the middle two, infinite if one of them is.
    """
    ordered = np.sort([np.inf if value is None else value for value in values])
    if not ordered.size:
        return float("nan")
    low, high = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
    return float(low) if low == high else float((low + high) / 2)


def broken_within(least: Sequence[float | None], efforts: FloatArray) -> FloatArray:
    """(E,) share of the cases that fail within each effort; None has not failed."""
    values = np.array([np.inf if value is None else value for value in least])
    return (values[:, None] <= efforts).mean(axis=0) if values.size else np.zeros(len(efforts))


class Calibration(NamedTuple):
    """How far confidence is from what is right, in tenths of confidence.

    Args:
        confidence: (10,) mean confidence in each tenth, NaN where there is none.
        right: (10,) share of right answers.
        answers: (10,) how many.
        error: mean distance of the two, weighted by the answers (expected calibration error); NaN of nothing.
    """

    confidence: FloatArray
    right: FloatArray
    answers: FloatArray
    error: float


def calibrate(pairs: Sequence[tuple[float, bool]]) -> Calibration:
    """The calibration of answers, each with its confidence and whether it was right."""
    sure = np.array([p for p, _ in pairs], dtype=np.float64)
    right = np.array([r for _, r in pairs], dtype=np.float64)
    tenth = np.minimum((sure * 10).astype(np.int64), 9)
    count = np.bincount(tenth, minlength=10).astype(np.float64)
    with np.errstate(invalid="ignore"):
        mean = np.bincount(tenth, sure, 10) / count
        share = np.bincount(tenth, right, 10) / count
    error = float(np.nansum(count * np.abs(mean - share)) / count.sum()) if len(pairs) else float("nan")
    return Calibration(mean, share, count, error)
