"""Evidence of sizes among look-alikes, when both the known and the seen ones were measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import FloatArray, IntArray, read_only
from farm_ar.scenes import UNKNOWN

_EXACT = 1e-6
"""SD of the logarithm of a side below which all look-alikes are taken to be of one size."""

_OUTLIERS = 0.03
"""Share of measured sides that carry no information."""

_BETWEEN_KINDS = 0.05
"""Least SD of the logarithm of a side by which categories are distinguished."""


@dataclass(frozen=True, eq=False)
class SizeModel:
    """The sizes of M labels: how they spread within each category.

    Look-alikes share a size, about which those of a category spread: because they differ, or because each
    was measured with an error, or both. Seen sizes spread likewise. The information of a label's known
    side about the side of its detection is one number, their correlation: 0 if all is error, 1 if nothing
    is. It is a hypothesis.

    Args:
        category: (M,) codes.
        deviation: (M, 3) of the logarithms of the sides from the category's mean; NaN where not known.
        mean: (C, 3) of each category.
        variance: (C, 3) about it; 0 where it cannot be estimated.
    """

    category: IntArray
    deviation: FloatArray
    mean: FloatArray
    variance: FloatArray

    @classmethod
    def of(cls, sides: FloatArray, category: IntArray) -> SizeModel:
        """Of (M, 3) sorted logarithms of the sides."""
        count = int(category.max()) + 1
        mean, variance = np.full((count, 3), np.nan), np.zeros((count, 3))
        for c in range(count):
            own = sides[category == c]
            own = own[np.isfinite(own).all(axis=1)]
            if len(own):
                mean[c] = own.mean(axis=0)
            if len(own) > 1:
                variance[c] = ((own - mean[c]) ** 2).sum(axis=0) / (len(own) - 1)
        variance = np.where(variance > _EXACT**2, variance, 0.0)
        return cls(
            read_only(category, np.int64),
            read_only(sides - mean[category], np.float64),
            read_only(mean, np.float64),
            read_only(variance, np.float64),
        )

    def likeness(
        self, sides: FloatArray, codes: IntArray, i: IntArray, j: IntArray, correlations: Sequence[float]
    ) -> FloatArray:
        """How much likelier the sizes of pairs are than of any two of the category, for each correlation.

        Args:
            sides: (N, 3) sorted logarithms of the detected sides; NaN where not known.
            codes: (N,) of the categories of the detections, `UNKNOWN` where not known.
            i: (P,) the detection of each pair.
            j: (P,) its label.
            correlations: W of them.

        Returns:
            (W, P) factors, or (1, P) where sizes carry no information.
        """
        kind = self.category[j]
        own = sides[i] - self.mean[kind]
        factor = self._kinds(sides, codes, i, kind)
        if not self.variance.any() or not len(i):
            return factor[None]
        spread = self._spread(sides, codes)
        told = (self.variance[kind] > 0) & np.isfinite(own) & np.isfinite(self.deviation[j])
        variance = np.where(told, self.variance[kind], 1.0)
        x = np.where(told, own / np.sqrt(spread[kind]), 0.0)
        y = np.where(told, self.deviation[j] / np.sqrt(variance), 0.0)
        result = np.empty((len(correlations), len(i)))
        for w, rho in enumerate(correlations):
            rest = 1.0 - rho * rho
            log_ratio = 0.5 * x * x - 0.5 * (x - rho * y) ** 2 / rest - 0.5 * np.log(rest)
            ratio = _OUTLIERS + (1 - _OUTLIERS) * np.exp(np.clip(log_ratio, -50.0, 50.0))
            result[w] = np.where(told, ratio, 1.0).prod(axis=1) * factor
        return result

    def _spread(self, sides: FloatArray, codes: IntArray) -> FloatArray:
        """(C, 3) variance of what is seen about what is known of each category."""
        spread = np.where(self.variance > 0, self.variance, 1.0)
        for c in range(len(spread)):
            own = sides[codes == c] - self.mean[c]
            own = own[np.isfinite(own).all(axis=1)]
            spread[c] = ((own**2).sum(axis=0) + spread[c]) / (len(own) + 1)
        return spread

    def _kinds(self, sides: FloatArray, codes: IntArray, i: IntArray, kind: IntArray) -> FloatArray:
        """(P,) how much likelier a detection's size is for the category, where its own is not known."""
        result = np.ones(len(i))
        unknown = codes == UNKNOWN
        if not unknown.any() or len(self.mean) == 1:
            return result
        pooled = np.maximum(self.variance, _BETWEEN_KINDS**2)
        gap = sides[:, None] - self.mean
        log_like = (-0.5 * gap**2 / pooled - 0.5 * np.log(pooled)).sum(axis=-1)
        log_like = np.where(np.isfinite(log_like), log_like, np.nan)
        for n in np.flatnonzero(unknown & np.isfinite(sides).all(axis=1)):
            known = np.isfinite(log_like[n])
            if not known.any():
                continue
            top = log_like[n][known].max()
            like = np.where(known, np.exp(np.where(known, log_like[n], top) - top), 1.0)
            like = _OUTLIERS + (1 - _OUTLIERS) * like / like.mean()
            own = i == n
            result[own] = like[kind[own]]
        return result
