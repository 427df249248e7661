"""How far objects of a place move, learnt from answers that were confirmed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from farm_ar.arrays import FloatArray, Record, read_only
from farm_ar.errors import SceneError
from farm_ar.reid.adaptive.hypotheses import FAMILIES, FOLDS, MOST_SCALES, Hypotheses
from farm_ar.reid.adaptive.options import AdaptiveOptions

FORGOTTEN = 0.9
"""What is left of the evidence of earlier snapshots at each later one."""

BELIEVED = 0.5
"""How much of the evidence counts: objects do not move equally far every time."""

EARLIER_MOTIONS, LIKE_EARLIER = ((16, 6, 32), (19, 8, 32)), (0, 1, 2, 2, 3, 4, 5, 5)
"""Shapes of what was learnt of motions with families and headings that are still the first ones; and which of
the six rates of then each of today's is most like.
"""

DOUBT = 0.1
"""Share of the prior that stays as it was before anything was learnt."""


@dataclass(frozen=True, eq=False)
class Disorder(Record):
    """The evidence of confirmed snapshots for each hypothesis, natural logarithms; lengths in spacings.

    Args:
        snapshots: how many there were.
        motion: (F, T, A) of each family, SD of turns and scale.
        rates: (Q,) of each pair of rates.
        sizes: (W,) of each reliability of sizes.

    Raises:
        SceneError: an array has not the shape that the options of the method give it.
    """

    snapshots: int
    motion: FloatArray
    rates: FloatArray
    sizes: FloatArray

    def __post_init__(self) -> None:
        for name in ("motion", "rates", "sizes"):
            value = read_only(getattr(self, name), np.float64)
            if not np.isfinite(value).all():
                raise SceneError(f"disorder.{name}", "must be finite", value)
            object.__setattr__(self, name, value)

    @classmethod
    def unknown(cls, options: AdaptiveOptions) -> Disorder:
        """That of a place of which nothing is known."""
        turns = len(options.turn_sds) + 1 + len(FOLDS) + len(options.shared_sds) + len(options.anyone_sds)
        shape = (len(FAMILIES), turns, MOST_SCALES)
        return cls(0, np.zeros(shape), np.zeros(len(options.rates)), np.zeros(len(options.reliabilities)))

    def fitting(self, options: AdaptiveOptions) -> Disorder:
        """Itself, if it was learnt under such options; of what was not known earlier it had least evidence.

        Raises:
            SceneError: it was not.
        """
        blank, motion, rates = Disorder.unknown(options), self.motion, self.rates
        if motion.shape in EARLIER_MOTIONS and blank.motion.size > motion.size:
            more = [(0, new - old) for new, old in zip(blank.motion.shape, motion.shape, strict=True)]
            motion = np.pad(motion, more, constant_values=motion.min())
        if len(rates) == max(LIKE_EARLIER) + 1 and len(blank.rates) == len(LIKE_EARLIER):
            rates = rates[list(LIKE_EARLIER)]
        result = Disorder(self.snapshots, motion, rates, self.sizes)
        for name in ("motion", "rates", "sizes"):
            shape = getattr(blank, name).shape
            if getattr(result, name).shape != shape:
                raise SceneError(f"disorder.{name}", f"must have shape {shape}", getattr(self, name).shape)
        return result

    def to_json(self) -> dict[str, Any]:
        """As JSON values; arrays to a thousandth."""
        arrays = {name: np.round(getattr(self, name), 3).tolist() for name in ("motion", "rates", "sizes")}
        return {"snapshots": self.snapshots, **arrays}

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Disorder:
        """What `to_json` gave.

        Raises:
            SceneError: something is missing or is no array of numbers.
        """
        try:
            arrays = [np.asarray(values[name], dtype=np.float64) for name in ("motion", "rates", "sizes")]
            return cls(int(values["snapshots"]), *arrays)
        except (KeyError, TypeError, ValueError) as problem:
            raise SceneError("disorder", "must be what Disorder.to_json gives", str(problem)) from None

    def after(self, motion: FloatArray, rates: FloatArray, sizes: FloatArray) -> Disorder:
        """With the log evidence of one more snapshot, kept to a thousandth as in files."""
        new = (
            np.round(FORGOTTEN * old + more - (FORGOTTEN * old + more).max(), 3)
            for old, more in ((self.motion, motion), (self.rates, rates), (self.sizes, sizes))
        )
        return Disorder(self.snapshots + 1, *new)

    def motion_prior(self, every: Hypotheses, log_prior: FloatArray) -> FloatArray:
        """(H,) log prior of the motions in the light of what was learnt.

        Args:
            every: the motions.
            log_prior: (H,) before that.
        """
        if not self.snapshots:
            return log_prior
        motions = every.motions
        return _sharpened(log_prior, self.motion[every.family, motions.heading, motions.scale])


def _sharpened(log_prior: FloatArray, evidence: FloatArray) -> FloatArray:
    before = np.exp(log_prior - log_prior.max())
    before /= before.sum()
    learnt = before * np.exp(BELIEVED * (evidence - evidence.max()))
    learnt /= learnt.sum()
    result: FloatArray = np.log(DOUBT * before + (1 - DOUBT) * learnt)
    return result


def sharpened(disorder: Disorder, name: str, shares: FloatArray) -> FloatArray:
    """Log of the prior shares of `rates` or `sizes`, in the light of what was learnt."""
    log_prior = np.log(shares / shares.sum())
    return _sharpened(log_prior, getattr(disorder, name)) if disorder.snapshots else log_prior
