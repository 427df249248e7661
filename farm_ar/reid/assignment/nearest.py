"""The best assignment of few detections to very many labels, from the nearest labels alone, and proven."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.kernels import compiled

FIRST = 16
"""Nearest labels of each detection that are tried first."""

_ROUNDING = 1e-9


class Near(NamedTuple):
    """The nearest labels of each of N detections.

    Args:
        label: (N, K) indices of labels, the nearest first; -1 where there are no more.
        beyond: (N,) what any other label costs a detection at least; infinite where there is none.
    """

    label: IntArray
    beyond: FloatArray


def solve_nearest(
    nearest: Callable[[IntArray, int], Near], costs: Callable[[IntArray, IntArray], FloatArray], n: int
) -> tuple[IntArray, FloatArray, IntArray] | None:
    """The optimal assignment of N detections to all labels, from as few of them as prove it.

    With the duals of the optimum over some labels, any label that costs detection i at least its dual u_i is
    of no use to it. So where what lies beyond the nearest may cost less than u_i, twice as many are tried.

    Args:
        nearest: gives so many nearest labels of those detections.
        costs: (R, K) of labels (R, K), -1 for none, to those R detections; infinite where not allowed.
        n: how many detections there are.

    Returns:
        (N,) index of the label of each detection; (N,) its cost; (K,) the labels that were considered,
        rising. None where not every detection can have a label.
    """
    count, every = np.full(n, FIRST), np.arange(n)
    lists: list[tuple[IntArray, FloatArray]] = [(np.empty(0, dtype=np.int64), np.empty(0))] * n
    beyond = np.zeros(n)
    wider, known, column, cost = every, every[:0], every[:0], beyond[:0]
    place, dual = np.empty(n, dtype=np.int64), np.empty(n)
    while len(wider):
        for k in np.unique(count[wider]).tolist():
            rows = wider[count[wider] == k]
            near = nearest(rows, k)
            beyond[rows] = near.beyond
            for i, label, price in zip(rows.tolist(), near.label, costs(rows, near.label), strict=True):
                there = np.isfinite(price)
                lists[i] = label[there], price[there]
        sizes = np.array([len(label) for label, _ in lists])
        start = np.concatenate([[0], np.cumsum(sizes)])
        known, column = np.unique(np.concatenate([label for label, _ in lists]), return_inverse=True)
        cost = np.concatenate([cost for _, cost in lists])
        stuck = assign_listed(start, column.astype(np.int64), cost, len(known), place, dual)
        doubtful = stuck if stuck.any() else beyond < dual - _ROUNDING * (1 + np.abs(dual))
        if stuck.any() and not np.isfinite(beyond[stuck]).any():
            return None
        wider = every[doubtful & np.isfinite(beyond)]
        count[wider] *= 2
    return known[column[place]], cost[place], known


@compiled
def assign_listed(
    start: IntArray, column: IntArray, cost: FloatArray, columns: int, place: IntArray, row_dual: FloatArray
) -> BoolArray:
    """`assign`, where each row may have the columns of its own list only.

    Args:
        start: (N + 1,) where the list of each row begins, and the last ends.
        column: (L,) columns of the lists.
        cost: (L,) finite costs.
        columns: how many columns there are.
        place: (N,) filled with the place of each row's column in the lists.
        row_dual: (N,) filled with the optimal duals of the rows.

    Returns:
        (N,) rows that share fewer columns than they are; none of them if all rows have a column.
    """
    n = len(place)
    stuck = np.zeros(n, dtype=np.bool_)
    column_dual, distance = np.zeros(columns), np.full(columns, np.inf)
    row_of, previous = np.full(columns, -1), np.empty(columns, dtype=np.int64)
    done = np.zeros(columns, dtype=np.bool_)
    touched = np.empty(columns, dtype=np.int64)
    place[:] = -1
    for row in range(n):
        best = start[row]
        for k in range(start[row], start[row + 1]):
            if cost[k] < cost[best]:
                best = k
        if start[row] < start[row + 1]:
            row_dual[row] = cost[best]
            if row_of[column[best]] < 0:
                row_of[column[best]], place[row] = row, best
    for first in range(n):
        if place[first] >= 0:
            continue
        count, i, reached, end = 0, first, 0.0, -1
        while end < 0:
            for k in range(start[i], start[i + 1]):
                j = column[k]
                along = reached + cost[k] - row_dual[i] - column_dual[j]
                if not done[j] and along < distance[j]:
                    if distance[j] == np.inf:
                        touched[count] = j
                        count += 1
                    distance[j], previous[j] = along, k
            nearest = -1
            for c in range(count):
                j = touched[c]
                if not done[j] and (nearest < 0 or distance[j] < distance[nearest]):
                    nearest = j
            if nearest < 0:
                break
            done[nearest], reached = True, distance[nearest]
            if row_of[nearest] < 0:
                end = nearest
            else:
                i = row_of[nearest]
        if end < 0:
            stuck[first] = True
            for c in range(count):
                stuck[row_of[touched[c]]] = True
            return stuck
        row_dual[first] += reached
        for c in range(count):
            j = touched[c]
            if done[j] and j != end:
                row_dual[row_of[j]] += reached - distance[j]
                column_dual[j] -= reached - distance[j]
        j = end
        while j >= 0:
            k = previous[j]
            i = np.searchsorted(start, k, side="right") - 1
            row_of[j] = i
            before = place[i]
            place[i] = k
            j = column[before] if i != first else -1
        for c in range(count):
            distance[touched[c]], done[touched[c]] = np.inf, False
    return stuck
