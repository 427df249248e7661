"""95% intervals of means, and of paired differences between methods, by resampling layouts."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray

RESAMPLES = 2000


class Interval(NamedTuple):
    """A mean with the ends of its 95% interval; these are NaN where there is one layout only."""

    mean: float
    low: float
    high: float

    @property
    def ends(self) -> str:
        """The interval as text; nothing where it is not known."""
        return "" if np.isnan(self.low) else f"{self.low:.3f} to {self.high:.3f}"

    @property
    def signed(self) -> str:
        """A difference with its interval, as text."""
        if np.isnan(self.low):
            return f"{self.mean:+.3f}"
        return f"{self.mean:+.3f} ({self.low:+.3f} to {self.high:+.3f})"


def interval_of(values: FloatArray, rng: np.random.Generator) -> Interval:
    """The mean of all values that are not NaN, its interval by drawing layouts with replacement.

    A layout is drawn with all of its snapshots, which are alike (Davison and Hinkley 1997, section 3.8).

    Args:
        values: (L, P) of P snapshots in each of L layouts, NaN where nothing was detected; or (L,) means.
        rng: draws the resamples.
    """
    each = values.reshape(len(values), -1)
    known = np.isfinite(each)
    total, count = np.where(known, each, 0.0).sum(axis=1), known.sum(axis=1).astype(np.float64)
    mean = float(total.sum() / count.sum()) if count.any() else np.nan
    layouts = len(each)
    if layouts < 2 or not count.any():
        return Interval(mean, np.nan, np.nan)
    drawn = rng.multinomial(layouts, np.full(layouts, 1 / layouts), size=RESAMPLES)
    totals, counts = drawn @ total, drawn @ count
    seen = counts > 0
    low, high = np.quantile(totals[seen] / counts[seen], [0.025, 0.975])
    return Interval(mean, float(low), float(high))


def resampled(
    values: FloatArray, statistic: Callable[[FloatArray], float], rng: np.random.Generator
) -> Interval:
    """Any statistic of the values (L, P), NaN where nothing was detected, its interval by drawing layouts."""
    layouts, found = len(values), statistic(values)
    if layouts < 2:
        return Interval(found, np.nan, np.nan)
    drawn = [statistic(values[rng.integers(layouts, size=layouts)]) for _ in range(RESAMPLES // 4)]
    low, high = np.quantile(drawn, [0.025, 0.975])
    return Interval(found, float(low), float(high))


def difference_of(ours: FloatArray, theirs: FloatArray, rng: np.random.Generator) -> Interval:
    """Mean difference of two methods on the same snapshots, (L, P) or (L,), and its interval."""
    return interval_of(ours - theirs, rng)
