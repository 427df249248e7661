"""Pruning that never changes the answer: few labels at first, more until the optimum is proven the same."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.reid.assignment import assign_most
from farm_ar.reid.solvers import UNASSIGNED

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
