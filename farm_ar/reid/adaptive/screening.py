"""Compiled weights of hypotheses of `AdaptiveReid`, and the screening of all motions."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.adaptive.common import free_share
from farm_ar.reid.adaptive.densities import blend, turn_freedom, turned_together
from farm_ar.reid.adaptive.records import (
    DetectionModel,
    Motions,
    Pairs,
    Sparse,
    Table,
)
from farm_ar.reid.adaptive.sparse import propagate

SCREENED = 9.0
"""By how much, in logarithms, a motion may fall short of the best one with middling rates."""

NEGLIGIBLE = 1e-9
"""Share of a detection's largest weight below which a label is as good as impossible."""

UNLIKELY = -7.0
"""Log of the prior of the highest rates below which motions are not screened with them."""

FEW_ROUNDS = 4

_compile = compiled(error_model="numpy")
_inlined = compiled(error_model="numpy", inline="always")
"""For what is called thousands of times: handing over the records costs more than short sums."""


@_inlined
def missed_by(h: int, q: int, detecting: DetectionModel, motions: Motions, factor: FloatArray) -> float:
    """The log of no label being given under motion h and rates q; fills (M,) factors of those given."""
    scale, far, unseen_rate = motions.scale[h], motions.far[h], detecting.unseen[q]
    total, product = 0.0, 1.0
    for j in range(len(factor)):
        view = (1.0 - far) * detecting.in_view[scale, j] + far * detecting.anywhere[j]
        unseen = max(1.0 - (1.0 - unseen_rate) * view, 1e-9)
        product *= unseen
        if product < 1e-200:
            total += math.log(product)
            product = 1.0
        factor[j] = (1.0 - unseen_rate) / unseen
    return total + math.log(product)


@_inlined
def weigh(
    h: int,
    q: int,
    pairs: Pairs,
    detecting: DetectionModel,
    motions: Motions,
    density: FloatArray,
    some: Sparse,
    factor: FloatArray,
) -> float:
    """Fill in the weights that are not negligible, each detection's relative to its largest.

    Args:
        h: index of the motion.
        q: index of the rates.
        pairs: the pairs.
        detecting: what is known of detecting.
        motions: of which h is one.
        density: (P,) of the pairs.
        some: filled.
        factor: (M,) filled, of the labels.

    Returns:
        The log of what the weights are relative to.
    """
    n = len(detecting.none)
    new: float = detecting.new[q]
    total = missed_by(h, q, detecting, motions, factor) - new
    count = 0
    for i in range(n):
        none = new * detecting.none[i]
        largest = none
        for p in range(pairs.start[i], pairs.start[i + 1]):
            weight = density[p] * factor[pairs.label[p]]
            if weight > largest:
                largest = weight
        largest = max(largest, 1e-300)
        some.start[i] = count
        least = NEGLIGIBLE * largest
        over = 1.0 / largest
        for p in range(pairs.start[i], pairs.start[i + 1]):
            weight = density[p] * factor[pairs.label[p]]
            if weight > least:
                some.label[count] = pairs.label[p]
                some.pair[count] = p
                some.weight[count] = weight * over
                count += 1
        some.none[i] = max(none * over, 1e-30)
        total += math.log(largest)
    some.start[n] = count
    return total


@_inlined
def evidence_bound(
    h: int,
    q: int,
    pairs: Pairs,
    detecting: DetectionModel,
    motions: Motions,
    density: FloatArray,
    factor: FloatArray,
) -> float:
    """The log of an upper bound of the evidence: as if labels could be given twice.

    Args:
        h: index of the motion.
        q: index of the rates.
        pairs: the pairs.
        detecting: what is known of detecting.
        motions: of which h is one.
        density: (P,) of the pairs.
        factor: (M,) filled, of the labels.
    """
    new: float = detecting.new[q]
    total, product = missed_by(h, q, detecting, motions, factor) - new, 1.0
    for i in range(len(detecting.none)):
        start, end = pairs.start[i], pairs.start[i + 1]
        first, second, third, fourth = new * detecting.none[i], 0.0, 0.0, 0.0
        p = start
        while p + 3 < end:  # sums that do not wait for one another
            first += density[p] * factor[pairs.label[p]]
            second += density[p + 1] * factor[pairs.label[p + 1]]
            third += density[p + 2] * factor[pairs.label[p + 2]]
            fourth += density[p + 3] * factor[pairs.label[p + 3]]
            p += 4
        while p < end:
            first += density[p] * factor[pairs.label[p]]
            p += 1
        reach = max((first + second) + (third + fourth), 1e-300)
        if not 1e-150 < reach < 1e150:
            total += math.log(reach)
            continue
        product *= reach
        if not 1e-150 < product < 1e150:
            total += math.log(product)
            product = 1.0
    return total + math.log(product)


@_compile
def falling(value: FloatArray) -> IntArray:
    """The order of the values from the greatest down; equal ones in the order in which they stand."""
    return np.argsort(-value, kind="mergesort")


@_inlined
def density_by(
    h: int,
    turn: FloatArray,
    course: FloatArray,
    pairs: Pairs,
    motions: Motions,
    table: Table,
    like: FloatArray,
    density: FloatArray,
) -> None:
    """Fill (P,) weights of the pairs under motion h, with other densities of turns and courses."""
    use_course = motions.course[h] >= 0
    shift, far, beyond = table.shift[motions.profile[h]], motions.far[h], motions.beyond[h]
    anywhere = table.far if beyond < 0 else table.shift[beyond] / (2 * math.pi)
    blend(pairs, shift, turn, course, use_course, far, anywhere, density)
    for p in range(len(density)):
        density[p] *= like[p]
    if len(pairs.vertical):
        rise = pairs.vertical[motions.scale[h]]
        for p in range(len(density)):
            density[p] *= rise[p]


@_inlined
def density_of(
    h: int, pairs: Pairs, motions: Motions, table: Table, like: FloatArray, density: FloatArray
) -> None:
    """Fill (P,) weights of the pairs under motion h: densities times what else is known of them."""
    t, course = motions.heading[h], table.course[max(motions.course[h], 0)]
    turn = table.turn[t]
    if table.angles.shared[t]:
        turn = np.empty(len(density))
        turned_together(pairs, table.angles, t, table.swing[motions.profile[h]], turn)
    density_by(h, turn, course, pairs, motions, table, like, density)


@_compile
def freedom_of(h: int, motions: Motions, table: Table) -> float:
    """Log of the share of the prior of a shared motion under motion h that counts."""
    result, t = table.penalty[motions.profile[h]], motions.heading[h]
    if table.angles.shared[t]:
        result += turn_freedom(table.angles.turn[t], table.swing[motions.profile[h]])
    return float(result)


@_compile
def highest(values: FloatArray) -> FloatArray:
    """(P,) the greatest of (K, P) values; ones where there are none."""
    result = np.ones(values.shape[1])
    for k in range(len(values)):
        for p in range(len(result)):
            result[p] = values[k, p] if k == 0 else max(result[p], values[k, p])
    return result


@_compile
def screen(
    pairs: Pairs,
    motions: Motions,
    detecting: DetectionModel,
    table: Table,
    like: FloatArray,
    some: Sparse,
    evidence: FloatArray,
) -> None:
    """Fill (H,) log evidences of the motions; minus infinity where a bound is enough.

    Rates are middling, or those at which most comes and goes, whichever explain more. A bound of a whole
    group, with the highest density that headings could give each pair, excludes most. That all went anywhere
    excludes none: it does not say which label is likelier.

    Args:
        pairs: the pairs.
        motions: the motions.
        detecting: what is known of detecting.
        table: densities of the pairs.
        like: (P,) weight of what does not depend on motions.
        some: room for weights.
        evidence: filled.
    """
    labels, groups = len(detecting.anywhere), len(motions.group) - 1
    density, factor, to_row = np.empty(len(like)), np.empty(labels), np.empty(len(like))
    best_turn, best_course, turn = highest(table.turn), highest(table.course), np.empty(len(like))
    rates = np.array([len(detecting.unseen) // 2, len(detecting.unseen) - 1])
    chance = np.array([0.0, detecting.log_rates[-1]])
    tried = 2 if chance[1] > UNLIKELY else 1
    bound = np.full(groups, -np.inf)
    evidence[:] = -np.inf
    for g in range(groups):
        h = motions.group[g]
        prior = motions.log_prior[h : motions.group[g + 1]].max() + table.penalty[motions.profile[h]]
        if prior == -np.inf:
            continue
        best = best_turn
        for k in range(h, motions.group[g + 1]):
            t = motions.heading[k]
            if table.angles.shared[t] and motions.log_prior[k] > -np.inf:
                turned_together(pairs, table.angles, t, table.swing[motions.profile[h]], turn)
                best = np.maximum(best, turn)
        density_by(h, best, best_course, pairs, motions, table, like, density)
        for k in range(tried):
            most = evidence_bound(h, rates[k], pairs, detecting, motions, density, factor)
            bound[g] = max(bound[g], prior + chance[k] + most)
    top = -np.inf
    for g in falling(bound):
        if not bound[g] > top - SCREENED:
            break
        for h in range(motions.group[g], motions.group[g + 1]):
            prior = motions.log_prior[h] + freedom_of(h, motions, table)
            if prior == -np.inf:
                continue
            density_of(h, pairs, motions, table, like, density)
            for k in range(tried):
                most = evidence_bound(h, rates[k], pairs, detecting, motions, density, factor)
                if prior + chance[k] + most > top - SCREENED:
                    total = weigh(h, rates[k], pairs, detecting, motions, density, some, factor)
                    to_row[:] = free_share(len(detecting.none), labels)
                    found = total + propagate(some, labels, to_row, FEW_ROUNDS, 1e-3)
                    evidence[h] = max(evidence[h], prior + chance[k] + found)
                    if motions.beyond[h] < 0:
                        top = max(top, evidence[h])
