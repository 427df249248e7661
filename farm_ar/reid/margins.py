"""How far an assignment is from changing: what each detection's second-best label would cost in all."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.scenes import UNKNOWN


def margins(cost: FloatArray, column: IntArray) -> FloatArray:
    """The rise of the least total cost when a row must give up the column it has.

    As many rows as before keep a column: a row gives its own up for another one, or stays empty so that a row
    that is empty now has a column instead.

    Args:
        cost: (N, M) costs, infinite where a label is not allowed.
        column: (N,) the column of each row in an optimal assignment, below 0 for none.

    Returns:
        (N,) rises, not negative; infinite where no other assignment has as many rows, NaN where a row has no
        column.
    """
    return margins_and_runners_up(cost, column)[0]


def margins_and_runners_up(cost: FloatArray, column: IntArray) -> tuple[FloatArray, IntArray]:
    """`margins`, and the column that each row has in the best assignment without its own.

    Found by one all-pairs shortest path over the rows and two nodes more, without solving again (T4).

    Returns:
        (N,) rises as in `margins`; (N,) columns, `UNKNOWN` where the row then has none.
    """
    result, other = find_margins(np.ascontiguousarray(cost), np.ascontiguousarray(column))
    return result, other


@compiled
def find_margins(cost: FloatArray, column: IntArray) -> tuple[FloatArray, IntArray]:
    """`margins_and_runners_up`, compiled.

    Nodes are the rows that have a column, one node for the columns nobody has, and one for the rows without a
    column, where there are any. An arc from one row to another is the former taking the latter's column; an
    arc to the free columns takes one, an arc from them frees the column of a row; an arc to the empty rows
    gives up a column for nothing, an arc from them gives a row's column to the empty row that takes it
    for least. The arcs carry plain cost differences: an optimal assignment has no negative cycle, so Floyd
    and Warshall's method needs no duals.
    """
    m = cost.shape[1]
    rows = np.flatnonzero(column >= 0)
    n = len(rows)
    free, empty = n, n + 1
    nodes = n + 1 if n == len(cost) else n + 2
    taken = np.zeros(m, dtype=np.bool_)
    for a in range(n):
        taken[column[rows[a]]] = True
    length = np.full((nodes, nodes), np.inf)
    nearest = np.full(n, UNKNOWN, dtype=np.int64)
    for a in range(n):
        i = rows[a]
        own = cost[i, column[i]]
        for b in range(n):
            if b != a:
                length[a, b] = cost[i, column[rows[b]]] - own
        for j in range(m):
            if not taken[j] and cost[i, j] - own < length[a, free]:
                length[a, free] = cost[i, j] - own
                nearest[a] = j
        length[free, a] = 0.0
        if nodes > empty:
            length[a, empty] = -own
            for other in range(len(cost)):
                if column[other] < 0:
                    length[empty, a] = min(length[empty, a], cost[other, column[i]])
    direct = length.copy()
    for k in range(nodes):
        for a in range(nodes):
            for b in range(nodes):
                length[a, b] = min(length[a, b], length[a, k] + length[k, b])
    result, runner_up = np.full(len(cost), np.nan), np.full(len(cost), UNKNOWN, dtype=np.int64)
    for a in range(n):
        rise = np.inf
        for k in range(nodes):
            if k != a and direct[a, k] + length[k, a] < rise:
                rise = direct[a, k] + length[k, a]
                if k < n:
                    runner_up[rows[a]] = column[rows[k]]
                else:
                    runner_up[rows[a]] = nearest[a] if k == free else UNKNOWN
        result[rows[a]] = max(rise, 0.0)
    return result, runner_up
