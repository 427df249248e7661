"""The k best assignments, for a user interface that offers alternatives (Murty 1968)."""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import OptionError
from farm_ar.reid.solvers import UNASSIGNED


class Assignment(NamedTuple):
    """One assignment: the column of each row, `UNASSIGNED` for none, and the sum of the costs."""

    column: IntArray
    total: float


class _Part(NamedTuple):
    """A part of all assignments and the best one in it; `turn` settles ties, so no arrays are compared."""

    total: float
    turn: int
    column: IntArray
    cost: FloatArray
    settled: int


def k_best(cost: FloatArray, k: int) -> list[Assignment]:
    """The k assignments of least total cost, the best first; fewer where there are not so many.

    Every one assigns as many rows as can be. Of the set of all assignments the best is taken out, and what is
    left is split by the first row that differs from it; so on with the part that holds the next best.

    Args:
        cost: (N, M) costs; what is not finite cannot be assigned.
        k: how many.

    Raises:
        OptionError: k is below 1.
    """
    if k < 1:
        raise OptionError("k", "must be a whole number from 1 on", k)
    n, m = cost.shape
    if n == 0:
        return [Assignment(np.zeros(0, dtype=np.int64), 0.0)]
    allowed = cost[np.isfinite(cost)]
    spread = float(np.ptp(allowed)) if allowed.size else 0.0
    prohibitive = (n + 1) * (spread + 1.0) + (float(np.abs(allowed).max()) if allowed.size else 0.0)
    # A row that gets no column gets one of its own, at a cost that no other assignment is worth.
    own = np.where(np.eye(n, dtype=bool), prohibitive, np.inf)
    whole = np.hstack([np.where(np.isfinite(cost), cost, np.inf), own])
    count = 0
    waiting: list[_Part] = []
    _push(waiting, whole, 0, count)
    found: list[Assignment] = []
    most_assigned = -1
    while waiting and len(found) < k:
        best = heapq.heappop(waiting)
        assigned = best.column < m
        most_assigned = max(most_assigned, int(assigned.sum()))
        if assigned.sum() < most_assigned:
            break
        column = np.where(assigned, best.column, UNASSIGNED)
        total = float(cost[np.flatnonzero(assigned), column[assigned]].sum())
        found.append(Assignment(column, total))
        rest = best.cost.copy()
        for row in range(best.settled, n):
            part = rest.copy()
            part[row, best.column[row]] = np.inf
            count += 1
            _push(waiting, part, row, count)
            keep = rest[row, best.column[row]]
            rest[row] = np.inf
            rest[:, best.column[row]] = np.inf
            rest[row, best.column[row]] = keep
    return found


def _push(waiting: list[_Part], cost: FloatArray, settled: int, count: int) -> None:
    """Add a part, if there is any assignment in it."""
    try:
        rows, column = linear_sum_assignment(cost)
    except ValueError:
        return
    total = float(cost[rows, column].sum())
    heapq.heappush(waiting, _Part(total, count, column.astype(np.int64), cost, settled))
