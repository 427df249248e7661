"""95% intervals of means, and of paired differences between methods, by resampling layouts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
    def text(self) -> str:
        """The mean with its interval, as text."""
        return f"{self.mean:.3f}" + (f" ({self.ends})" if self.ends else "")

    @property
    def signed(self) -> str:
        """A difference with its interval, as text."""
        if np.isnan(self.low):
            return f"{self.mean:+.3f}"
        return f"{self.mean:+.3f} ({self.low:+.3f} to {self.high:+.3f})"


class Sums(NamedTuple):
    """What was counted in each of L layouts: (L,) the total, and (L,) of how many."""

    total: FloatArray
    number: FloatArray


def sums_of(values: FloatArray) -> Sums:
    """Sums of values (L, P) over each layout, NaN where nothing was detected; or of (L,) means."""
    each = values.reshape(len(values), -1)
    known = np.isfinite(each)
    return Sums(np.where(known, each, 0.0).sum(axis=1), known.sum(axis=1).astype(np.float64))


def interval_of_mean(strata: Sequence[Sums], rng: np.random.Generator) -> Interval:
    """The mean of the means of several scenes or settings, layouts being drawn anew in each of them.

    Layouts are drawn with replacement, each with all of its snapshots, which are alike (Davison and Hinkley
    1997, section 3.8). Strata without any value are left out.
    """
    means, drawn, unknown = [], [], False
    for total, number in strata:
        layouts = len(total)
        if not number.any():
            continue
        means.append(total.sum() / number.sum())
        if layouts < 2:
            unknown = True
            continue
        times = rng.multinomial(layouts, np.full(layouts, 1 / layouts), size=RESAMPLES)
        with np.errstate(invalid="ignore"):
            drawn.append((times @ total) / (times @ number))
    mean = float(np.mean(means)) if means else np.nan
    if unknown or not drawn:
        return Interval(mean, np.nan, np.nan)
    every = np.mean(drawn, axis=0)
    low, high = np.quantile(every[np.isfinite(every)], [0.025, 0.975])
    return Interval(mean, float(low), float(high))


def interval_of(values: FloatArray, rng: np.random.Generator) -> Interval:
    """The mean of all values that are not NaN, its interval by drawing layouts with replacement.

    Args:
        values: (L, P) of P snapshots in each of L layouts, NaN where nothing was detected; or (L,) means.
        rng: draws the resamples.
    """
    return interval_of_mean([sums_of(values)], rng)


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
