"""Whether the likeliest hypothesis of `AdaptiveReid` explains what is seen; where it does not, doubt."""

from __future__ import annotations

import numpy as np
from scipy.special import bdtr, chdtrc, ndtr

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.reid.adaptive.common import best_motion, left_over
from farm_ar.reid.adaptive.densities import FREEDOM, folded
from farm_ar.reid.adaptive.hypotheses import Hypotheses
from farm_ar.reid.adaptive.records import (
    Pairs,
    Profile,
)

MISFIT = 1e-3
"""Predictive p-value below which the answer is doubted."""

DOUBTED = 0.5
"""Power to which probabilities are then taken."""

_LEAST = 1e-12


def predictive_p_value(pairs: Pairs, chosen: IntArray, every: Hypotheses, motion: int) -> float:
    """How often shifts and turns as large as those of the answer, or larger, come about under a motion.

    The probability of a larger shift, or turn, than each one is even from 0 to 1 if the motion is right;
    those of shifts and those of turns are combined by Fisher's method. Where objects look the same turned by
    a half or a quarter, how many are turned counts, too. The least value is multiplied by their number.

    Args:
        pairs: of the snapshot.
        chosen: (K,) the pairs of the answer.
        every: the motions.
        motion: index of the likeliest.
    """
    still = ~pairs.stays[chosen]
    index = chosen[still]
    if not len(index):
        return 1.0
    far = float(every.motions.far[motion])
    shift = np.maximum(far + (1 - far) * _shift_tail(pairs, index, every, motion), _LEAST)
    heading = every.motions.heading[motion]
    told = index[pairs.turned[index] & ~every.angles.anyone[heading]]
    if len(pairs.errors.turn):
        # A heading that may be another carries too little information.
        told = told[pairs.errors.rival_weight[told] == 0.0]
    cosine = pairs.turn[told]
    if every.angles.shared[heading]:
        sine = pairs.turn_sine[told]
        cosine = np.cos(np.arctan2(sine, cosine) - np.arctan2(sine.sum(), cosine.sum()))
    fold = int(every.angles.fold[heading])
    angle = np.arccos(np.clip([folded(c, fold) for c in cosine.tolist()], -1.0, 1.0))
    # What has gone anywhere is turned anyhow.
    less = 1.0
    if len(pairs.errors.turn):
        kappa = float(every.angles.turn[heading])
        less = np.sqrt(1 + kappa * fold**2 * pairs.errors.turn[told])
    tail = far * (1 - angle / np.pi) + (1 - far) * _turn_tail(angle / less, every, motion)
    both = [chdtrc(2 * len(u), -2 * np.log(u).sum()) for u in (shift, np.maximum(tail, _LEAST)) if len(u)]
    if fold > 1:
        # As few as stand as they did, or fewer.
        both.append(bdtr((cosine > np.cos(np.pi / fold)).sum(), len(cosine), 1 / fold))
    return float(min(1.0, len(both) * min(both)))


def _shift_tail(pairs: Pairs, index: IntArray, every: Hypotheses, motion: int) -> FloatArray:
    """(K,) probability of a longer shift."""
    profile = int(every.motions.profile[motion])
    kind, length = int(every.profiles.kind[profile]), float(every.profiles.length[profile])
    width = float(every.profiles.width[profile])
    distance = pairs.distance[index]
    if len(pairs.errors.wide) and kind != Profile.EVEN:
        distance = distance / np.sqrt(1 + pairs.errors.wide[index] / length**2)
    if kind == Profile.EXPONENTIAL:
        return np.asarray((1 + distance / length) * np.exp(-distance / length))
    if kind == Profile.STUDENT:
        return np.asarray((1 + (distance / length) ** 2 / FREEDOM) ** (-FREEDOM / 2))
    if kind == Profile.RING:
        return np.asarray(2 * ndtr(-np.abs(np.log(np.maximum(distance, 0.1 * length) / length)) / width))
    if kind == Profile.AHEAD:
        rest = distance**2 - 2 * distance * length * pairs.course[index] + length**2
        return np.asarray(np.exp(-0.5 * rest / (width * length) ** 2))
    if kind == Profile.RAY:
        return np.asarray(2 * ndtr(-distance / length))
    if kind >= Profile.TOGETHER:
        belief = np.zeros(len(pairs.label))
        belief[index] = 1.0
        common = best_motion(pairs, belief, length, kind)
        rest = np.array([left_over(pairs, int(p), common) for p in index])
        return np.asarray(np.exp(-0.5 * rest / length**2))
    if kind == Profile.EVEN:
        return np.ones(len(index))
    assert kind == Profile.GAUSSIAN
    return np.asarray(np.exp(-0.5 * (distance / length) ** 2))


def _turn_tail(angle: FloatArray, every: Hypotheses, motion: int) -> FloatArray:
    """(K,) probability of a larger turn, of angles from 0 to pi."""
    kappa = float(every.angles.turn[every.motions.heading[motion]])
    grid = np.linspace(0, np.pi, 721)
    density = np.exp(kappa * (np.cos(grid) - 1))
    below = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2)])
    tail = 1 - np.interp(angle, grid, below / below[-1])
    return np.asarray((1 - every.angles.outliers) * tail + every.angles.outliers * (1 - angle / np.pi))


def doubted(probability: FloatArray) -> FloatArray:
    """(N, M + 1) probabilities that say the same less surely."""
    less = probability**DOUBTED
    result: FloatArray = less / less.sum(axis=1, keepdims=True)
    return result
