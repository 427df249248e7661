"""What `LikelihoodReid` assumes, and the same as arrays for its kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError
from farm_ar.reid.likelihood.motions import (
    MOSTLY_RELIABLE,
    DetectionNoise,
    Motion,
    NoisePrior,
    Rates,
    heading_log_density,
)
from farm_ar.reid.likelihood.records import Models
from farm_ar.reid.marginals import MOST_EXACT
from farm_ar.reid.place import Lengths
from farm_ar.reid.registration import concentration_of

_POINTS = 32
"""How many places stand for where an object that is not seen may be; even."""

_TURNS = 721
"""How many turns from 0 to half a period the headings' densities are tabulated at."""

_GOLDEN_ANGLE = float(np.pi * (3 - np.sqrt(5)))


@dataclass(frozen=True)
class LikelihoodOptions:
    """What is assumed of how objects move and how they are seen.

    Args:
        noise: the motions, as a mixture whose shares sum to 1, where they are known; else a prior over them.
        rates: of misses and of detections without a label; several are averaged over.
        gone_rate: probability that a label's object is gone.
        detection: noise of detected poses; None for 5 mm and half a degree in a scene of the usual length.
        size_sd: noise of each detected side, as a share of it.
        confusion: probability that a detected category is wrong; 0 for categories that are always right.
        walls: whether nothing leaves the scene's bounds, where these are a rectangle.
        occlusion: whether what stands behind a detection counts as not in view: as `Detector.occlusion`, True
            for a real headset, False for the paper's synthetic experiments.
        min_confidence: a label less probable than this is not given.
        most_exact: detections of one component up to which probabilities are exact.

    Raises:
        OptionError: a value is out of its limits.
    """

    noise: NoisePrior | Sequence[Motion] = field(default_factory=NoisePrior)
    rates: Sequence[Rates] = tuple(MOSTLY_RELIABLE)
    gone_rate: float = 0.005
    detection: DetectionNoise | None = None
    size_sd: float = 0.05
    confusion: float = 0.0
    walls: bool = True
    occlusion: bool = False
    min_confidence: float = 0.0
    most_exact: int = MOST_EXACT

    def __post_init__(self) -> None:
        if not isinstance(self.noise, NoisePrior):
            object.__setattr__(self, "noise", tuple(self.noise))
            total = sum(motion.share for motion in self.noise)
            if abs(total - 1) > 1e-6:
                raise OptionError("noise", "must be motions whose shares sum to 1", total)
        object.__setattr__(self, "rates", tuple(self.rates))
        if not self.rates:
            raise OptionError("rates", "must be at least one", self.rates)
        if not 0 < self.size_sd < np.inf:
            raise OptionError("size_sd", "must be a positive number", self.size_sd)
        for name in ("gone_rate", "confusion"):
            if not 0 <= getattr(self, name) < 1:
                raise OptionError(name, "must be from 0 to below 1", getattr(self, name))
        if not 0 <= self.min_confidence <= 1:
            raise OptionError("min_confidence", "must be from 0 to 1", self.min_confidence)
        if not 0 <= self.most_exact <= 20:
            raise OptionError("most_exact", "must be from 0 to 20", self.most_exact)


def category_table(categories: int, confusion: float) -> FloatArray:
    """(C + 1, C) probability of each detected category, the last row that of none, for each true one."""
    table = np.full((categories + 1, categories), confusion / max(categories - 1, 1))
    np.fill_diagonal(table, 1 - confusion if categories > 1 else 1.0)
    table[-1] = 1.0
    return table


def model_arrays(
    lengths: Lengths, options: LikelihoodOptions, kinds: FloatArray
) -> tuple[Models, list[tuple[Motion, ...]]]:
    """The models as arrays, in a scene of such lengths; the motions of each."""
    given, detection = options.noise, options.detection or DetectionNoise.usual(lengths.fine)
    mixtures = (
        [(1.0, tuple(given))]
        if not isinstance(given, NoisePrior)
        else given.models(lengths.scene, lengths.fine)
    )
    every = [(share, motions, rates) for share, motions in mixtures for rates in options.rates]
    # The first scale is that of what never moves.
    shifts = [0.0, *sorted({motion.translation_sd for _, motions in mixtures for motion in motions})]
    turns = [0.0, *sorted({motion.rotation_sd for _, motions in mixtures for motion in motions})]
    parts = max(len(motions) for _, motions in mixtures)
    part, share = np.zeros((len(every), parts, 2), dtype=np.int64), np.zeros((len(every), parts))
    for k, (_, motions, _) in enumerate(every):
        for p, motion in enumerate(motions):
            part[k, p] = shifts.index(motion.translation_sd, 1), turns.index(motion.rotation_sd, 1)
            share[k, p] = motion.share
    angles = [np.linspace(0.0, (period or 2 * np.pi) / 2, _TURNS) for period in kinds]
    sds = np.hypot(turns, detection.yaw_sd)
    heading = [
        [np.exp(heading_log_density(angle, period, sd)) for angle, period in zip(angles, kinds, strict=True)]
        for sd in sds
    ]
    prior = np.array([chance * rates.probability for chance, _, rates in every])
    arrays = Models(
        translation_sd=np.array(shifts),
        part=part,
        share=share,
        log_prior=np.log(prior / prior.sum()),
        detect_rate=np.array([1 - rates.miss_rate for _, _, rates in every]),
        none_rate=np.array([float(rates.none_rate) for _, _, rates in every]),
        heading=np.array(heading),
        turn_sd=sds,
        sharpness=concentration_of(sds),
        offset=_equally_probable(_POINTS),
    )
    return arrays, [motions for _, motions, _ in every]


def _equally_probable(points: int) -> FloatArray:
    """(points, 2) places that stand for the standard normal distribution: a spiral and its mirror image."""
    order = np.arange(points // 2) + 0.5
    radius, angle = np.sqrt(-2 * np.log(1 - 2 * order / points)), order * _GOLDEN_ANGLE
    x, z = radius * np.sin(angle), radius * np.cos(angle)
    return np.concatenate([np.stack([x, z], axis=1), np.stack([-x, z], axis=1)])
