"""Marginals over the ways of giving labels out (T6), of few weights among many pairs.

The same sums as in `marginals`, of which only pairs that are not negligible are kept.
"""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.adaptive.records import Sparse
from farm_ar.reid.marginals import exact_marginals

FREE = 20.0
"""How quickly Bethe's approximation gets better with the number of labels that are left."""

_compile = compiled(error_model="numpy")


@_compile
def propagate(some: Sparse, labels: int, to_row: FloatArray, most_rounds: int, tolerance: float) -> float:
    """Belief propagation; returns the log of Bethe's approximation of the evidence, corrected.

    Bethe's approximation of the sum over all ways to give n labels to n detections, all alike, is too low by
    the square root of 2 pi n / e; with labels to spare it is right. In between the correction was found by
    comparing with exact sums.

    Args:
        some: the weights.
        labels: how many there are.
        to_row: (P,) the labels' messages, filled with where they ended. Where to start from.
        most_rounds: after which it stops in any case.
        tolerance: change of a message below which it has converged.
    """
    n, pairs = len(some.none), some.start[len(some.none)]
    to_column = np.empty(pairs)
    crowd = np.empty(labels)
    for _ in range(most_rounds):
        crowd[:] = 1.0
        for i in range(n):
            reach = some.none[i]
            for p in range(some.start[i], some.start[i + 1]):
                reach += some.weight[p] * to_row[p]
            least = max(1e-15 * reach, 1e-300)
            for p in range(some.start[i], some.start[i + 1]):
                message = some.weight[p] / max(reach - some.weight[p] * to_row[p], least)
                to_column[p] = message
                crowd[some.label[p]] += message
        change = 0.0
        for p in range(pairs):
            message = 1.0 / max(crowd[some.label[p]] - to_column[p], 1.0)
            change = max(change, abs(message - to_row[p]))
            to_row[p] = message
        if change < tolerance:
            break
    evidence, unsure = 0.0, 0.0
    taken = np.zeros(labels)
    for j in range(labels):
        evidence += math.log(crowd[j])
    for i in range(n):
        reach = some.none[i]
        product = 1.0
        for p in range(some.start[i], some.start[i + 1]):
            reach += some.weight[p] * to_row[p]
            product *= 1.0 + to_column[p] * to_row[p]
            if product > 1e200:
                evidence -= math.log(product)
                product = 1.0
        evidence += math.log(reach) - math.log(product)
        squares = (some.none[i] / reach) ** 2
        for p in range(some.start[i], some.start[i + 1]):
            belief = some.weight[p] * to_row[p] / reach
            squares += belief * belief
            taken[some.label[p]] += belief
        unsure += 1.0 - squares
    free = 0.0
    for j in range(labels):
        free += max(taken[j] * (1.0 - taken[j]), 0.0)
    return evidence + 0.5 * math.log(1.0 + 2 * math.pi / math.e * unsure / (1.0 + FREE * free))


@_compile
def add_beliefs(some: Sparse, to_row: FloatArray, share: float, i: int, probability: FloatArray) -> None:
    """Add `share` of the marginals of detection i, by the messages, to (N, M + 1) probabilities."""
    reach = some.none[i]
    for p in range(some.start[i], some.start[i + 1]):
        reach += some.weight[p] * to_row[p]
    for p in range(some.start[i], some.start[i + 1]):
        probability[i, some.label[p]] += share * some.weight[p] * to_row[p] / reach
    probability[i, probability.shape[1] - 1] += share * some.none[i] / reach


@_compile
def parts_of(some: Sparse, labels: int, part: IntArray) -> int:
    """Number the detections so that those with a common label are of one part; returns how many parts."""
    n = len(some.none)
    first = np.full(labels, -1)
    root = np.arange(n)
    for i in range(n):
        for p in range(some.start[i], some.start[i + 1]):
            j = some.label[p]
            if first[j] < 0:
                first[j] = i
                continue
            a, b = i, first[j]
            while root[a] != a:
                a = root[a]
            while root[b] != b:
                b = root[b]
            if a < b:
                root[b] = a
            else:
                root[a] = b
    number = 0
    for i in range(n):
        a = i
        while root[a] != a:
            a = root[a]
        if a == i:
            part[i] = number
            number += 1
        else:
            part[i] = part[a]
    return number


@_compile
def dense_part(
    some: Sparse, part: IntArray, number: int, rows: IntArray, columns: IntArray
) -> tuple[FloatArray, FloatArray]:
    """The weights of a part as (R, C) and (R,); `rows` and `columns` say which detections and labels."""
    place = np.full(len(columns), -1)
    height, width = 0, 0
    for i in range(len(some.none)):
        if part[i] == number:
            rows[height] = i
            height += 1
            for p in range(some.start[i], some.start[i + 1]):
                j = some.label[p]
                if place[j] < 0:
                    place[j] = width
                    columns[width] = j
                    width += 1
    weight, none = np.zeros((height, width)), np.empty(height)
    for a in range(height):
        none[a] = some.none[rows[a]]
        for p in range(some.start[rows[a]], some.start[rows[a] + 1]):
            weight[a, place[some.label[p]]] = some.weight[p]
    return weight, none


@_compile
def exact_evidence(some: Sparse, labels: int) -> float:
    """The log of the exact sum over all ways, of few detections; minus infinity where there is none."""
    n = len(some.none)
    rows, columns = np.empty(n, dtype=np.int64), np.empty(labels, dtype=np.int64)
    weight, none = dense_part(some, np.zeros(n, dtype=np.int64), 0, rows, columns)
    total = exact_marginals(weight, none, np.empty((n, weight.shape[1] + 1)))
    return math.log(total) if total > 0.0 else -np.inf


@_compile
def add_marginals(
    some: Sparse, to_row: FloatArray, share: float, most_exact: int, work: float, probability: FloatArray
) -> bool:
    """Add `share` of the marginals to (N, M + 1) probabilities; exact where that is not too much work.

    Args:
        some: the weights.
        to_row: (P,) messages of belief propagation.
        share: of the hypothesis.
        most_exact: detections of a part up to which it may be exact.
        work: additions that are not too many.
        probability: added to.

    Returns:
        Whether all is exact.
    """
    n, labels = len(some.none), probability.shape[1] - 1
    part = np.empty(n, dtype=np.int64)
    number = parts_of(some, labels, part)
    size = np.zeros(number, dtype=np.int64)
    for i in range(n):
        size[part[i]] += 1
    rows, columns = np.empty(n, dtype=np.int64), np.empty(labels, dtype=np.int64)
    exact = True
    for c in range(number):
        # A tree, for which the messages are exact.
        if size[c] > 1:
            if size[c] <= most_exact and 2.0 ** size[c] * size[c] <= work:
                weight, none = dense_part(some, part, c, rows, columns)
                if weight.shape[1] * 2.0 ** size[c] * size[c] <= work:
                    found = np.empty((weight.shape[0], weight.shape[1] + 1))
                    if exact_marginals(weight, none, found) > 0.0:
                        for a in range(len(weight)):
                            for b in range(weight.shape[1]):
                                probability[rows[a], columns[b]] += share * found[a, b]
                            probability[rows[a], labels] += share * found[a, weight.shape[1]]
                        continue
            exact = False
        for i in range(n):
            if part[i] == c:
                add_beliefs(some, to_row, share, i, probability)
    return exact
