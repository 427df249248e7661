"""Compiled inference of `AdaptiveReid`: which hypotheses count, and the average over them.

A hypothesis is a motion, a reliability of sizes and rates. There are thousands, of which few matter: all
motions are screened with middling rates, by a bound first; what is left is tried with all reliabilities and
rates; and the marginals are found of what is left of these.
"""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.adaptive.common import find_common, free_share
from farm_ar.reid.adaptive.densities import LOOSELY, blend, tabulate
from farm_ar.reid.adaptive.records import (
    Concentrations,
    Motions,
    Pairs,
    Profiles,
    Seeing,
    Sparse,
    Table,
)
from farm_ar.reid.adaptive.sparse import add_marginals, exact_evidence, propagate

SCREENED = 9.0
"""By how much, in logarithms, a motion may fall short of the best one with middling rates."""

COUNTS = 1e-3
"""Share of the best hypothesis's probability below which a hypothesis does not count."""

NEGLIGIBLE = 1e-9
"""Share of a detection's largest weight below which a label is as good as impossible."""

FEW_ROUNDS = 4
MOST_ROUNDS = 40
CHEAP = 6
"""Detections up to which the exact sum is as quick as belief propagation."""

LEAST_KEPT, KEPT_PAIRS = 60, 30_000
"""Motions that are kept of the screened, and hypotheses in the end: so many, or more where pairs are few."""

WORK = 1e7
"""Additions that are spent on exact marginals, for a snapshot."""

_compile = compiled(error_model="numpy")


@_compile
def weigh(
    pairs: Pairs,
    seeing: Seeing,
    density: FloatArray,
    scale: int,
    far: float,
    unseen_rate: float,
    new: float,
    some: Sparse,
    log_unseen: FloatArray,
) -> tuple[float, float]:
    """Fill in the weights that are not negligible, each detection's relative to its largest.

    Args:
        pairs: the pairs.
        seeing: what is known of detecting.
        density: (P,) of the pairs.
        scale: index of the scale of motion.
        far: share that goes anywhere.
        unseen_rate: at which what is in view is missed or gone.
        new: expected detections without a label.
        some: filled.
        log_unseen: (M,) room for the labels' factors.

    Returns:
        The log of what the weights are relative to, and of an upper bound of the evidence.
    """
    n, labels = len(seeing.none), len(seeing.anywhere)
    total, product = 0.0, 1.0
    for j in range(labels):
        view = (1.0 - far) * seeing.in_view[scale, j] + far * seeing.anywhere[j]
        unseen = max(1.0 - (1.0 - unseen_rate) * view, 1e-9)
        product *= unseen
        if product < 1e-200:
            total += math.log(product)
            product = 1.0
        log_unseen[j] = (1.0 - unseen_rate) / unseen
    total += math.log(product)
    total -= new
    bound, count = 0.0, 0
    for i in range(n):
        none = new * seeing.none[i]
        largest, reach = none, none
        for p in range(pairs.start[i], pairs.start[i + 1]):
            weight = density[p] * log_unseen[pairs.label[p]]
            reach += weight
            largest = max(largest, weight)
        largest = max(largest, 1e-300)
        reach = max(reach, 1e-300)
        some.start[i] = count
        least = NEGLIGIBLE * largest
        over = 1.0 / largest
        for p in range(pairs.start[i], pairs.start[i + 1]):
            weight = density[p] * log_unseen[pairs.label[p]]
            if weight > least:
                some.label[count] = pairs.label[p]
                some.pair[count] = p
                some.weight[count] = weight * over
                count += 1
        some.none[i] = max(none * over, 1e-30)
        total += math.log(largest)
        bound += math.log(reach * over)
    some.start[n] = count
    return total, total + bound


@_compile
def falling(value: FloatArray) -> IntArray:
    """The order of the values from the greatest down; equal ones in the order in which they stand."""
    return np.argsort(-value, kind="mergesort")


@_compile
def density_of(
    h: int,
    pairs: Pairs,
    motions: Motions,
    table: Table,
    density: FloatArray,
) -> None:
    """Fill (P,) densities of the pairs under motion h, without sizes."""
    c = motions.course[h]
    blend(
        pairs,
        table.shift[motions.profile[h]],
        table.turn[motions.heading[h]],
        table.course[max(c, 0)],
        c >= 0,
        motions.far[h],
        table.far,
        density,
    )
    if len(pairs.vertical):
        rise = pairs.vertical[motions.scale[h]]
        for p in range(len(density)):
            density[p] *= rise[p]


@_compile
def screen(
    pairs: Pairs,
    motions: Motions,
    seeing: Seeing,
    table: Table,
    mean_like: FloatArray,
    some: Sparse,
    evidence: FloatArray,
) -> None:
    """Fill (H,) log evidences of the motions with middling rates; minus infinity where a bound is enough."""
    labels = len(seeing.anywhere)
    density, factor = np.empty(len(pairs.label)), np.empty(labels)
    to_row = np.empty(len(pairs.label))
    rates = len(seeing.unseen)
    bound = np.empty(len(evidence))
    middle = 0
    for q in range(rates):
        if seeing.unseen[q] == seeing.unseen[rates // 2]:
            middle = q
    for h in range(len(evidence)):
        evidence[h] = -np.inf
        bound[h] = -np.inf
        if motions.log_prior[h] == -np.inf:
            continue
        density_of(h, pairs, motions, table, density)
        for p in range(len(density)):
            density[p] *= mean_like[p]
        _, most = weigh(
            pairs,
            seeing,
            density,
            motions.scale[h],
            motions.far[h],
            seeing.unseen[middle],
            seeing.new[middle],
            some,
            factor,
        )
        bound[h] = motions.log_prior[h] + table.penalty[motions.profile[h]] + most
    best = -np.inf
    order = falling(bound)
    for rank in range(len(order)):
        h = order[rank]
        if not bound[h] > best - SCREENED:
            break
        density_of(h, pairs, motions, table, density)
        for p in range(len(density)):
            density[p] *= mean_like[p]
        total, _ = weigh(
            pairs,
            seeing,
            density,
            motions.scale[h],
            motions.far[h],
            seeing.unseen[middle],
            seeing.new[middle],
            some,
            factor,
        )
        to_row[:] = free_share(len(seeing.none), labels)
        prior = motions.log_prior[h] + table.penalty[motions.profile[h]]
        evidence[h] = prior + total + propagate(some, labels, to_row, FEW_ROUNDS, 1e-3)
        best = max(best, evidence[h])


@_compile
def refine(
    pairs: Pairs,
    motions: Motions,
    seeing: Seeing,
    table: Table,
    screened: FloatArray,
    some: Sparse,
) -> tuple[IntArray, FloatArray]:
    """(K, 3) hypotheses that may count, indices of motion, sizes and rates, and their (K,) log evidences."""
    labels, sizes, rates = len(seeing.anywhere), len(pairs.size), len(seeing.unseen)
    density, factor = np.empty(len(pairs.label)), np.empty(labels)
    weighed, to_row = np.empty(len(pairs.label)), np.empty(len(pairs.label))
    top = screened.max()
    kept = 0
    for h in range(len(screened)):
        if screened[h] > top - SCREENED:
            kept += 1
    kept = min(kept, max(LEAST_KEPT, KEPT_PAIRS // max(len(pairs.label), 1)))
    which = np.empty((kept * sizes * rates, 3), dtype=np.int64)
    value = np.empty(kept * sizes * rates)
    count = 0
    best = -np.inf
    for h in falling(screened)[:kept]:
        density_of(h, pairs, motions, table, density)
        for w in range(sizes):
            for p in range(len(density)):
                weighed[p] = density[p] * pairs.size[w, p] * pairs.like[p]
            for q in range(rates):
                total, bound = weigh(
                    pairs,
                    seeing,
                    weighed,
                    motions.scale[h],
                    motions.far[h],
                    seeing.unseen[q],
                    seeing.new[q],
                    some,
                    factor,
                )
                prior = motions.log_prior[h] + table.penalty[motions.profile[h]]
                prior += seeing.log_sizes[w] + seeing.log_rates[q]
                if bound + prior < best - 7.0:
                    continue
                to_row[:] = free_share(len(seeing.none), labels)
                found = prior + total + propagate(some, labels, to_row, FEW_ROUNDS + 2, 1e-3)
                best = max(best, found)
                which[count, 0], which[count, 1], which[count, 2] = h, w, q
                value[count] = found
                count += 1
    return which[:count], value[:count]


@_compile
def infer(
    pairs: Pairs,
    profiles: Profiles,
    angles: Concentrations,
    motions: Motions,
    seeing: Seeing,
    most_exact: int,
    probability: FloatArray,
) -> tuple[IntArray, FloatArray, bool]:
    """Average the marginals over all hypotheses.

    Args:
        pairs: the pairs.
        profiles: of the shifts.
        angles: of turns and courses.
        motions: the motions.
        seeing: what is known of detecting.
        most_exact: detections of a part up to which marginals may be exact.
        probability: (N, M + 1) filled with zeros; gets the probability of each label and of none.

    Returns:
        The (K, 3) hypotheses that count, indices of motion, sizes and rates; the (K,) probability of each;
        and whether the marginals under the most probable one are exact.
    """
    n, labels, count = len(seeing.none), len(seeing.anywhere), len(pairs.label)
    table = Table(
        np.empty((len(profiles.kind), count)),
        np.empty((len(angles.turn), count)),
        np.empty((len(angles.course), count)),
        np.empty(count),
        np.zeros(len(profiles.kind)),
    )
    tabulate(pairs, profiles, angles, table.shift, table.turn, table.course, table.far)
    some = Sparse(
        np.zeros(n + 1, dtype=np.int64),
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.int64),
        np.empty(count),
        np.empty(n),
    )
    mean_like = np.zeros(count)
    for w in range(len(pairs.size)):
        share = math.exp(seeing.log_sizes[w])
        for p in range(count):
            mean_like[p] += share * pairs.size[w, p]
    for p in range(count):
        mean_like[p] *= pairs.like[p]
    likely = np.empty(count)
    loosely = table.turn[LOOSELY]
    for p in range(count):
        likely[p] = mean_like[p] * (0.5 + 0.5 * loosely[p] * 2 * math.pi)
    find_common(pairs, profiles, seeing, likely, some, table.shift, table.penalty)
    screened = np.empty(len(motions.log_prior))
    screen(pairs, motions, seeing, table, mean_like, some, screened)
    which, value = refine(pairs, motions, seeing, table, screened, some)
    order = falling(value)
    best = value[order[0]]
    kept = 0
    most = max(LEAST_KEPT, KEPT_PAIRS // max(count, 1))
    while kept < min(len(order), most) and value[order[kept]] > best + math.log(COUNTS):
        kept += 1
    chosen = which[order[:kept]]
    density, factor = np.empty(count), np.empty(labels)
    evidence = np.empty(kept)
    messages = np.empty((kept, count))
    for k in range(kept):
        h, w, q = chosen[k]
        density_of(h, pairs, motions, table, density)
        for p in range(count):
            density[p] *= pairs.size[w, p] * pairs.like[p]
        total, _ = weigh(
            pairs,
            seeing,
            density,
            motions.scale[h],
            motions.far[h],
            seeing.unseen[q],
            seeing.new[q],
            some,
            factor,
        )
        messages[k] = free_share(n, labels)
        prior = motions.log_prior[h] + table.penalty[motions.profile[h]]
        prior += seeing.log_sizes[w] + seeing.log_rates[q]
        evidence[k] = prior + total + propagate(some, labels, messages[k], MOST_ROUNDS, 1e-5)
        if n <= CHEAP:
            evidence[k] = prior + total + exact_evidence(some, labels)
    best = evidence.max()
    share = np.exp(evidence - best)
    share /= share.sum()
    exact = False
    for k in range(kept):
        h, w, q = chosen[k]
        density_of(h, pairs, motions, table, density)
        for p in range(count):
            density[p] *= pairs.size[w, p] * pairs.like[p]
        weigh(
            pairs,
            seeing,
            density,
            motions.scale[h],
            motions.far[h],
            seeing.unseen[q],
            seeing.new[q],
            some,
            factor,
        )
        whole = add_marginals(some, messages[k], share[k], most_exact, WORK * share[k], probability)
        if evidence[k] == best:
            exact = whole
    return chosen, share, exact
