"""Proofs: how far objects may have moved for an answer to be right (T1); pruning that changes no answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.reid.answers import Certificate
from farm_ar.reid.assignment import UNASSIGNED, assign_most
from farm_ar.reid.costs import rotation_cost, translation_cost
from farm_ar.scenes import Detections, Layout


class PoseMetric(NamedTuple):
    """D, by which the paper compares poses: w_t |shift| / l + w_r |sin(turn / 2)|. It is a metric.

    Args:
        diagonal: `l`, metres.
        translation_weight: w_t.
        rotation_weight: w_r.
    """

    diagonal: float
    translation_weight: float
    rotation_weight: float

    def between(
        self, first: tuple[FloatArray, FloatArray], second: tuple[FloatArray, FloatArray]
    ) -> FloatArray:
        """(..., N, M) from poses to others, given as positions (..., N or M, 2) and yaws (..., N or M)."""
        shift = translation_cost(first[0], second[0], self.diagonal)
        return self.translation_weight * shift + self.rotation_weight * rotation_cost(first[1], second[1])


class Choices(NamedTuple):
    """What the labels of N detections were chosen from.

    Args:
        size_factor: (N, M) C_d of each label for each detection, at least 1.
        possible: (N, M) which labels the method may give to each detection, were all offered.
        offered: (M,) which labels the method considered.
    """

    size_factor: FloatArray
    possible: BoolArray
    offered: BoolArray


def certified_radius(moved: FloatArray, apart: FloatArray, choices: Choices) -> float:
    """The r for which, if every object has moved less than r in D, the optimal assignment is right.

    If an object moved less than half the distance from its old pose to any other label's, no assignment is
    as good as the true one (T1). Which labels are the true ones is not known: but a label that lies r or
    farther from every detection is none of them, and any other must be far enough from its neighbours. Sizes
    that were not measured exactly make a true label dearer by a factor C: then 1 / (1 + C) stands for a half.

    Args:
        moved: (N, M) D from each label's pose to each detection.
        apart: (M, M) D between the labels' poses.
        choices: what the labels were chosen from.

    Returns:
        The radius; 0 where nothing is proven.
    """
    n, m = moved.shape
    if not n or not m:
        return 0.0
    size_factor, possible, offered = choices
    rivals = np.where(np.eye(m, dtype=bool), np.inf, apart)
    radius = np.inf
    nearest_of: dict[bytes, FloatArray] = {}  # there are few different rows: one for each category
    for i in range(n):
        key = possible[i].tobytes()
        if key not in nearest_of:
            nearest_of[key] = np.where(possible[i] & offered, rivals, np.inf).min(axis=1)
        nearest = nearest_of[key]
        proven = np.where(offered, nearest / (1 + size_factor[i]), 0.0)
        limits = np.where(possible[i], np.maximum(moved[i], proven), np.inf)
        radius = min(radius, float(limits.min()))
    return radius if np.isfinite(radius) else 0.0


def certificate(
    detections: Detections, layout: Layout, given: list[int], metric: PoseMetric, choices: Choices
) -> Certificate | None:
    """The certificate of an answer of the paper's method, or None where nothing is proven.

    Args:
        detections: N of them.
        layout: the M labels.
        given: index of the label of each detection, below 0 for none.
        metric: by which poses are compared.
        choices: what the labels were chosen from.
    """
    if not given or min(given) < 0:
        return None
    if np.isnan(detections.yaw).all():
        metric = metric._replace(rotation_weight=0.0)
    elif metric.rotation_weight > 0 and np.isnan([*detections.yaw, *layout.yaw]).any():
        return None  # where some headings are known and others not, D is no metric
    known, seen = (layout.position, layout.yaw), (detections.position, detections.yaw)
    moved = metric.between(seen, known)
    radius = certified_radius(moved, metric.between(known, known), choices)
    if not radius > moved[np.arange(len(given)), given].max():
        return None  # the answer itself has something move as far, so what the proof asks for does not hold
    diagonal, by_shift, by_turn = metric
    metres = radius * diagonal / by_shift if by_shift > 0 else np.inf
    turn = radius / by_turn if by_turn > 0 else 1.0
    degrees = float(np.rad2deg(2 * np.arcsin(min(turn, 1.0))))
    return Certificate(radius, float(metres), degrees, tuple(range(len(given))))


NEAREST = 3
"""How many labels of each detection are tried at first, where nothing else says which."""

_ROUNDING = 1e-12


def nearest_labels(bound: FloatArray, count: int = NEAREST) -> IntArray:
    """Indices, rising, of the labels that are among the `count` of least bound for some detection, (N, M)."""
    n, m = bound.shape
    if not n or m <= count:
        return np.arange(m)
    return np.unique(np.argpartition(bound, count - 1, axis=1)[:, :count]).astype(np.int64)


def solve_certified(
    cost_of: Callable[[IntArray], FloatArray], bound: FloatArray, start: IntArray
) -> tuple[IntArray, FloatArray, IntArray]:
    """The optimal assignment of N detections to all M labels, from as few of their costs as prove it.

    With the duals u of the optimum over some labels, any other label j is of no use if its cost c_ij is at
    least u_i for every detection i. A bound below the cost settles most; the costs of those that it leaves
    in doubt are computed, and labels that fail are added.

    Args:
        cost_of: the (N, K) costs of the labels with K indices.
        bound: (N, M) not above the costs.
        start: indices of the labels to begin with.

    Returns:
        (N,) index of the label of each detection, `UNASSIGNED` for none; (N, K) costs of the labels that were
        considered in the end; (K,) their indices, rising.
    """
    n, m = bound.shape
    chosen = np.unique(start).astype(np.int64)
    while True:
        cost = np.ascontiguousarray(cost_of(chosen))
        column = np.empty(n, dtype=np.int64)
        row_dual = np.empty(n)
        assign_most(cost, column, row_dual, np.empty(len(chosen) + n))
        others = np.setdiff1d(np.arange(m), chosen)
        if n and others.size and (column == UNASSIGNED).any():
            chosen = np.arange(m)
            continue
        limit = row_dual - _ROUNDING * (1 + np.abs(row_dual))
        doubtful = others[(bound[:, others] < limit[:, None]).any(axis=0)]
        if doubtful.size:
            doubtful = doubtful[(cost_of(doubtful) < limit[:, None]).any(axis=0)]
        if not doubtful.size:
            label = np.full(n, UNASSIGNED)
            given = column != UNASSIGNED
            label[given] = chosen[column[given]]
            return label, cost, chosen
        chosen = np.union1d(chosen, doubtful)
