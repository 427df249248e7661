"""Compiled inference of `AdaptiveReid`: which hypotheses count, and the average over them.

A hypothesis is a motion, a reliability of sizes and rates. There are thousands, of which few matter: all
motions are screened first; what is left is tried with all reliabilities and rates; and the marginals are
found of what is left of these.
"""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.adaptive.common import find_common, free_share
from farm_ar.reid.adaptive.densities import LOOSELY, tabulate
from farm_ar.reid.adaptive.records import (
    Concentrations,
    DetectionModel,
    Motions,
    Pairs,
    Profiles,
    Sparse,
    Table,
)
from farm_ar.reid.adaptive.screening import (
    FEW_ROUNDS,
    SCREENED,
    density_of,
    evidence_bound,
    falling,
    freedom_of,
    screen,
    weigh,
)
from farm_ar.reid.adaptive.sparse import add_marginals, exact_evidence, propagate

COUNTS = 1e-3
"""Share of the best hypothesis's probability below which a hypothesis does not count."""

MOST_ROUNDS = 40
CHEAP = 6
"""Detections up to which the exact sum is as quick as belief propagation."""

LEAST_KEPT, KEPT_PAIRS = 60, 30_000
"""Motions that are kept of the screened, and hypotheses in the end: so many, or more where pairs are few."""

WORK = 1e7
"""Additions that are spent on exact marginals, for a snapshot."""

_compile = compiled(error_model="numpy")


@_compile
def tabulated(pairs: Pairs, profiles: Profiles, angles: Concentrations) -> Table:
    """The densities of all pairs; those about shared motions are still to be filled in."""
    count = len(pairs.label)
    table = Table(
        np.empty((len(profiles.kind), count)),
        np.empty((len(angles.turn), count)),
        np.empty((len(angles.course), count)),
        np.empty(count),
        np.zeros(len(profiles.kind)),
        np.zeros((len(profiles.kind), 3)),
        angles,
    )
    tabulate(pairs, profiles, angles, table.shift, table.turn, table.course, table.far)
    return table


@_compile
def log_prior_of(h: int, w: int, q: int, motions: Motions, detecting: DetectionModel, table: Table) -> float:
    """Log of the prior of a hypothesis, with what a shared motion's freedom costs."""
    motion = motions.log_prior[h] + freedom_of(h, motions, table)
    return float(motion + detecting.log_sizes[w] + detecting.log_rates[q])


@_compile
def refine(
    pairs: Pairs,
    motions: Motions,
    detecting: DetectionModel,
    table: Table,
    screened: FloatArray,
    some: Sparse,
) -> IntArray:
    """(K, 3) hypotheses that may count, indices of motion, sizes and rates, the likeliest first."""
    labels, sizes, rates = len(detecting.anywhere), len(pairs.size), len(detecting.unseen)
    density, factor = np.empty(len(pairs.label)), np.empty(labels)
    weighed, to_row = np.empty(len(pairs.label)), np.empty(len(pairs.label))
    top, kept = -np.inf, 0
    for h in range(len(screened)):
        if motions.beyond[h] < 0:
            top = max(top, screened[h])
    for h in range(len(screened)):
        if screened[h] > top - SCREENED:
            kept += 1
    most = max(LEAST_KEPT, KEPT_PAIRS // max(len(pairs.label), 1))
    kept = min(kept, most)
    which = np.empty((kept * sizes * rates, 3), dtype=np.int64)
    value = np.empty(kept * sizes * rates)
    count = 0
    best = -np.inf
    for h in falling(screened)[:kept]:
        density_of(h, pairs, motions, table, pairs.like, density)
        for w in range(sizes):
            for p in range(len(density)):
                weighed[p] = density[p] * pairs.size[w, p]
            for q in range(rates):
                prior = log_prior_of(h, w, q, motions, detecting, table)
                if evidence_bound(h, q, pairs, detecting, motions, weighed, factor) + prior < best - 7.0:
                    continue
                total = weigh(h, q, pairs, detecting, motions, weighed, some, factor)
                to_row[:] = free_share(len(detecting.none), labels)
                found = prior + total + propagate(some, labels, to_row, FEW_ROUNDS + 2, 1e-3)
                if motions.beyond[h] < 0:
                    best = max(best, found)
                which[count, 0], which[count, 1], which[count, 2] = h, w, q
                value[count] = found
                count += 1
    order = falling(value[:count])
    end = 0
    while end < min(count, most) and value[order[end]] > best + math.log(COUNTS):
        end += 1
    return which[order[:end]]


@_compile
def posterior(
    chosen: IntArray, pairs: Pairs, motions: Motions, detecting: DetectionModel, table: Table, some: Sparse
) -> tuple[FloatArray, FloatArray]:
    """(K,) probabilities of (K, 3) hypotheses, and the (K, P) messages of belief propagation under each."""
    labels, n = len(detecting.anywhere), len(detecting.none)
    density, factor = np.empty(len(pairs.label)), np.empty(labels)
    evidence = np.empty(len(chosen))
    messages = np.full((len(chosen), len(pairs.label)), free_share(n, labels))
    for k in range(len(chosen)):
        h, w, q = chosen[k]
        density_of(h, pairs, motions, table, pairs.size[w] * pairs.like, density)
        total = weigh(h, q, pairs, detecting, motions, density, some, factor)
        evidence[k] = log_prior_of(h, w, q, motions, detecting, table) + total
        bethe = propagate(some, labels, messages[k], MOST_ROUNDS, 1e-5)
        evidence[k] += exact_evidence(some, labels) if n <= CHEAP else bethe
    share = np.exp(evidence - evidence.max())
    return share / share.sum(), messages


@_compile
def infer(
    pairs: Pairs,
    profiles: Profiles,
    angles: Concentrations,
    motions: Motions,
    detecting: DetectionModel,
    most_exact: int,
    probability: FloatArray,
) -> tuple[IntArray, FloatArray, bool]:
    """Average the marginals over all hypotheses.

    Args:
        pairs: the pairs.
        profiles: of the shifts.
        angles: of turns and courses.
        motions: the motions.
        detecting: what is known of detecting.
        most_exact: detections of a part up to which marginals may be exact.
        probability: (N, M + 1) filled with zeros; gets the probability of each label and of none.

    Returns:
        The (K, 3) hypotheses that count, indices of motion, sizes and rates; the (K,) probability of each;
        and whether the marginals under the most probable one are exact.
    """
    n, count = len(detecting.none), len(pairs.label)
    table = tabulated(pairs, profiles, angles)
    some = Sparse(
        np.zeros(n + 1, dtype=np.int64),
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.int64),
        np.empty(count),
        np.empty(n),
    )
    like = np.zeros(count)
    for w in range(len(pairs.size)):
        like += math.exp(detecting.log_sizes[w]) * pairs.size[w] * pairs.like
    find_common(
        pairs,
        profiles,
        detecting,
        like * (0.5 + 0.5 * table.turn[LOOSELY] * 2 * math.pi),
        some,
        table.shift,
        table.penalty,
        table.swing,
    )
    screened = np.empty(len(motions.log_prior))
    screen(pairs, motions, detecting, table, like, some, screened)
    chosen = refine(pairs, motions, detecting, table, screened, some)
    share, messages = posterior(chosen, pairs, motions, detecting, table, some)
    density, factor = np.empty(count), np.empty(len(detecting.anywhere))
    exact = False
    for k in range(len(chosen)):
        h, w, q = chosen[k]
        density_of(h, pairs, motions, table, pairs.size[w] * pairs.like, density)
        weigh(h, q, pairs, detecting, motions, density, some, factor)
        whole = add_marginals(some, messages[k], share[k], most_exact, WORK * share[k], probability)
        if share[k] == share.max():
            exact = whole
    return chosen, share, exact
