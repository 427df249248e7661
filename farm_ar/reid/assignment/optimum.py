"""The best assignment of rows to columns, and the margin of each row: compiled."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.assignment.workspace import Workspace, workspace_for
from farm_ar.scenes import UNKNOWN


@compiled
def assign(cost: FloatArray, column_of: IntArray, row_dual: FloatArray, column_dual: FloatArray) -> None:
    """Give each of n rows a column of its own, n <= m, so that the costs sum to the least.

    Shortest augmenting paths (Jonker and Volgenant 1987, in the rectangular form of Crouse 2016), with the
    columns still free to choose kept packed at the front of a list.

    Args:
        cost: (n, m) finite costs.
        column_of: (n,) filled with the column of each row.
        row_dual: (n,) filled with the optimal duals of the rows.
        column_dual: (m,) filled with the optimal duals of the columns, none positive.
    """
    n, m = cost.shape
    space = workspace_for(n, m, False, 0)
    assign_in(cost, space)
    column_of[:], row_dual[:] = space.column_of[:n], space.row_dual[:n]
    column_dual[:] = space.column_dual[:m]


@compiled
def assign_in(cost: FloatArray, space: Workspace) -> None:
    """`assign`, in a workspace: `column_of`, `row_dual` and `column_dual` of it are filled."""
    n, m = cost.shape
    row_of, previous, order, distance = space.row_of, space.previous, space.order, space.distance
    column_of, row_dual, column_dual = space.column_of, space.row_dual, space.column_dual
    row_of[:m], column_dual[:m], column_of[:n] = -1, 0.0, -1
    for row in range(n):
        best = 0
        for j in range(1, m):
            if cost[row, j] < cost[row, best]:
                best = j
        row_dual[row] = cost[row, best]
        if row_of[best] < 0:
            row_of[best] = row
            column_of[row] = best
    for start in range(n):
        if column_of[start] >= 0:
            continue
        for j in range(m):
            distance[j] = np.inf
            order[j] = j
        done = 0
        i = start
        reached = 0.0
        end = -1
        while end < 0:
            nearest = done
            for k in range(done, m):
                j = order[k]
                along = reached + cost[i, j] - row_dual[i] - column_dual[j]
                if along < distance[j]:
                    distance[j] = along
                    previous[j] = i
                near = distance[order[nearest]]
                if distance[j] < near or (distance[j] == near and row_of[j] < 0):
                    nearest = k
            j = order[nearest]
            reached = distance[j]
            order[nearest] = order[done]
            order[done] = j
            done += 1
            if row_of[j] < 0:
                end = j
            else:
                i = row_of[j]
        row_dual[start] += reached
        for k in range(done):
            j = order[k]
            if j != end:
                row_dual[row_of[j]] += reached - distance[j]
                column_dual[j] -= reached - distance[j]
        j = end
        while True:
            i = previous[j]
            row_of[j] = i
            j, column_of[i] = column_of[i], j
            if i == start:
                break


@compiled
def assign_most(cost: FloatArray, column_of: IntArray, row_dual: FloatArray, column_dual: FloatArray) -> None:
    """`assign` for any n and m, and costs that need not be finite: as many rows as possible get a column.

    Where not all can, each row is offered n columns more, at a cost above that of any assignment.

    Args:
        cost: (n, m) costs; what is not finite cannot be assigned.
        column_of: (n,) filled with the column of each row, -1 for none.
        row_dual: (n,) filled with the optimal duals of the rows.
        column_dual: (m + n,) filled with the optimal duals of the columns.
    """
    n, m = cost.shape
    space = workspace_for(n, m + n, False, 0)
    assign_most_in(cost, space)
    column_of[:], row_dual[:] = space.column_of[:n], space.row_dual[:n]
    column_dual[:] = space.column_dual[: m + n]


@compiled
def assign_most_in(cost: FloatArray, space: Workspace) -> None:
    """`assign_most`, in a workspace for its n rows and m columns."""
    n, m = cost.shape
    highest, all_finite = 0.0, True
    for i in range(n):
        for j in range(m):
            if np.isfinite(cost[i, j]):
                highest = max(highest, cost[i, j])
            else:
                all_finite = False
    if n <= m and all_finite:
        assign_in(cost, space)
        return
    prohibitive = (n + 1) * (highest + 1.0)
    widened = np.empty((n, m + n))
    widened[:] = prohibitive
    for i in range(n):
        for j in range(m):
            widened[i, j] = cost[i, j] if np.isfinite(cost[i, j]) else 2 * prohibitive
    assign_in(widened, space)
    for i in range(n):
        if space.column_of[i] >= m:
            space.column_of[i] = UNKNOWN


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

    Nodes are the rows that have a column, one node for all columns without a row, and one for the rows
    without a column, where there are any. An arc from one row to another is the former taking the latter's
    column; an arc to the free columns takes one, an arc from them frees the column of a row; an arc to the
    empty rows gives up a column for nothing, an arc from them gives a row's column to the empty row that
    takes it for least. The arcs carry plain cost differences: an optimal assignment has no negative cycle,
    so Floyd and Warshall's method needs no duals.
    """
    n, m = cost.shape
    space = workspace_for(n, m, True, 0)
    space.column_of[:n] = column
    find_margins_in(cost, space)
    return space.margin[:n].copy(), space.runner_up[:n].copy()


@compiled
def find_margins_in(cost: FloatArray, space: Workspace) -> None:
    """`find_margins` of `column_of`, in a workspace: `margin` and `runner_up` of it are filled."""
    height, m = cost.shape
    column, rows, n = space.column_of, space.placed, 0
    for i in range(height):
        if column[i] >= 0:
            rows[n] = i
            n += 1
    free, empty = n, n + 1
    nodes = n + 1 if n == height else n + 2
    taken, nearest, length, direct = space.taken, space.nearest, space.paths[0], space.paths[1]
    taken[:m] = 0
    for a in range(n):
        taken[column[rows[a]]] = 1
    nearest[:n] = UNKNOWN
    for a in range(nodes):
        for b in range(nodes):
            length[a, b] = np.inf
    for a in range(n):
        i = rows[a]
        own = cost[i, column[i]]
        for b in range(n):
            if b != a:
                length[a, b] = cost[i, column[rows[b]]] - own
        for j in range(m):
            if taken[j] == 0 and cost[i, j] - own < length[a, free]:
                length[a, free] = cost[i, j] - own
                nearest[a] = j
        length[free, a] = 0.0
        if nodes > empty:
            length[a, empty] = -own
            for other in range(height):
                if column[other] < 0:
                    length[empty, a] = min(length[empty, a], cost[other, column[i]])
    for a in range(nodes):
        for b in range(nodes):
            direct[a, b] = length[a, b]
    for k in range(nodes):
        for a in range(nodes):
            if length[a, k] == np.inf:
                continue  # no way goes there
            for b in range(nodes):
                length[a, b] = min(length[a, b], length[a, k] + length[k, b])
    space.margin[:height], space.runner_up[:height] = np.nan, UNKNOWN
    for a in range(n):
        rise, other = np.inf, UNKNOWN
        for k in range(nodes):
            if k != a and direct[a, k] + length[k, a] < rise:
                rise = direct[a, k] + length[k, a]
                if k < n:
                    other = column[rows[k]]
                else:
                    other = nearest[a] if k == free else UNKNOWN
        space.margin[rows[a]], space.runner_up[rows[a]] = max(rise, 0.0), other
