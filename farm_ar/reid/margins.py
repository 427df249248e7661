"""How far an assignment is from changing: what each detection's second-best label would cost in all."""

from __future__ import annotations

import numba
import numpy as np

from farm_ar.arrays import FloatArray, IntArray


def margins(cost: FloatArray, column: IntArray) -> FloatArray:
    """The rise of the least total cost when a row must give up the column it has.

    Found by one all-pairs shortest path over the rows and a sink, without solving again.

    Args:
        cost: (N, M) costs, infinite where a label is not allowed.
        column: (N,) the column of each row in an optimal assignment, below 0 for none.

    Returns:
        (N,) rises, not negative; infinite where the row can have no other column, NaN where it has none.
    """
    result = np.full(len(cost), np.nan)
    rows = np.flatnonzero(column >= 0)
    if rows.size:
        reordered = np.ascontiguousarray(cost[rows])
        result[rows] = margins_of_assigned(reordered, column[rows])
    return result


@numba.njit(cache=True, nogil=True)
def margins_of_assigned(cost: FloatArray, column: IntArray) -> FloatArray:
    """`margins` of rows that all have a column.

    Nodes are the rows and one sink that stands for the columns nobody has. An arc from one row to another
    is the former taking the latter's column; an arc from the sink frees a column. The arcs carry plain cost
    differences: an optimal assignment has no negative cycle, so Floyd and Warshall's method needs no duals.
    """
    n, m = cost.shape
    taken = np.zeros(m, dtype=np.bool_)
    for i in range(n):
        taken[column[i]] = True
    length = np.full((n + 1, n + 1), np.inf)
    for i in range(n):
        own = cost[i, column[i]]
        for k in range(n):
            if k != i:
                length[i, k] = cost[i, column[k]] - own
        for j in range(m):
            if not taken[j]:
                length[i, n] = min(length[i, n], cost[i, j] - own)
        length[n, i] = 0.0
    direct = length.copy()
    for k in range(n + 1):
        for i in range(n + 1):
            for j in range(n + 1):
                length[i, j] = min(length[i, j], length[i, k] + length[k, j])
    result = np.full(n, np.inf)
    for i in range(n):
        for k in range(n + 1):
            if k != i:
                result[i] = min(result[i], direct[i, k] + length[k, i])
        result[i] = max(result[i], 0.0)
    return result
