"""How far an assignment is from changing: what each detection's second-best label would cost in all."""

from __future__ import annotations

import numba
import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.scenes import UNKNOWN


def margins(cost: FloatArray, column: IntArray) -> FloatArray:
    """The rise of the least total cost when a row must give up the column it has.

    Args:
        cost: (N, M) costs, infinite where a label is not allowed.
        column: (N,) the column of each row in an optimal assignment, below 0 for none.

    Returns:
        (N,) rises, not negative; infinite where the row can have no other column, NaN where it has none.
    """
    return margins_and_runners_up(cost, column)[0]


def margins_and_runners_up(cost: FloatArray, column: IntArray) -> tuple[FloatArray, IntArray]:
    """`margins`, and the column that each row has in the best assignment without its own.

    Found by one all-pairs shortest path over the rows and a sink, without solving again (T4).

    Returns:
        (N,) rises as in `margins`; (N,) columns, `UNKNOWN` where the row can have no other or has none.
    """
    result, other = np.full(len(cost), np.nan), np.full(len(cost), UNKNOWN, dtype=np.int64)
    rows = np.flatnonzero(column >= 0)
    if rows.size:
        result[rows], other[rows] = find_margins(np.ascontiguousarray(cost[rows]), column[rows])
    return result, other


@numba.njit(cache=True, nogil=True)
def find_margins(cost: FloatArray, column: IntArray) -> tuple[FloatArray, IntArray]:
    """`margins_and_runners_up` of rows that all have a column.

    Nodes are the rows and one sink that stands for the columns nobody has. An arc from one row to another
    is the former taking the latter's column; an arc from the sink frees a column. The arcs carry plain cost
    differences: an optimal assignment has no negative cycle, so Floyd and Warshall's method needs no duals.
    """
    n, m = cost.shape
    taken = np.zeros(m, dtype=np.bool_)
    for i in range(n):
        taken[column[i]] = True
    length = np.full((n + 1, n + 1), np.inf)
    free = np.full(n, UNKNOWN, dtype=np.int64)
    for i in range(n):
        own = cost[i, column[i]]
        for k in range(n):
            if k != i:
                length[i, k] = cost[i, column[k]] - own
        for j in range(m):
            if not taken[j] and cost[i, j] - own < length[i, n]:
                length[i, n] = cost[i, j] - own
                free[i] = j
        length[n, i] = 0.0
    direct = length.copy()
    for k in range(n + 1):
        for i in range(n + 1):
            for j in range(n + 1):
                length[i, j] = min(length[i, j], length[i, k] + length[k, j])
    result, other = np.full(n, np.inf), np.full(n, UNKNOWN, dtype=np.int64)
    for i in range(n):
        for k in range(n + 1):
            if k != i and direct[i, k] + length[k, i] < result[i]:
                result[i] = direct[i, k] + length[k, i]
                other[i] = column[k] if k < n else free[i]
        result[i] = max(result[i], 0.0)
    return result, other
