"""Compiled kernels: pruning, costs and assignment of many snapshots at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.margins import find_margins
from farm_ar.reid.pruning import SUM_TOLERANCE
from farm_ar.scenes import UNKNOWN


class Seen(NamedTuple):
    """The detections of B snapshots, rows padded to K, and where each was taken from.

    Args:
        number: (B,) detections in each snapshot.
        camera: (B, 2) metres.
        position: (B, K, 2) metres.
        yaw: (B, K) radians.
        sides: (B, K, 3) sorted logarithms of the sides.
        category: (B, K) codes, `UNKNOWN` where not known.
        order: (B or 1, K) the order in which the detections are given labels, which settles ties.
    """

    number: IntArray
    camera: FloatArray
    position: FloatArray
    yaw: FloatArray
    sides: FloatArray
    category: IntArray
    order: IntArray


class Known(NamedTuple):
    """The M labels of U different sizes, and the S sites.

    Args:
        position: (M, 2) metres.
        yaw: (M,) radians.
        category: (M,) codes, from 0.
        kind: (M,) index into `sides`.
        sides: (U, 3) sorted logarithms of the sides.
        site: (M,) the site of each label.
        sites: (S, 2) centres, metres; (0, 2) for no pruning.
        order: (B or 1, M) the order in which the labels are tried, which settles ties.
    """

    position: FloatArray
    yaw: FloatArray
    category: IntArray
    kind: IntArray
    sides: FloatArray
    site: IntArray
    sites: FloatArray
    order: IntArray


class Rule(NamedTuple):
    """How labels are given to detections.

    Args:
        translation_weight: w_t divided by the room's diagonal.
        rotation_weight: w_r.
        compare_sizes: whether the dimension cost counts.
        gate: whether a label must be of the detection's category, where that is known.
        threshold: of the sites' cumulative probability, 0 to 1.
    """

    translation_weight: float
    rotation_weight: float
    compare_sizes: bool
    gate: bool
    threshold: float


class Answer(NamedTuple):
    """What is found out of B snapshots.

    Args:
        label: (B, K) index of the label of each detection, `UNKNOWN` for none.
        cost: (B, K) its cost, NaN for none.
        candidates: (B,) labels considered.
        widened: (B,) whether sites were added because there were fewer candidates than detections.
        margin: (B or 0, K) rise of the total cost if the detection must give up its label, NaN for none.
        runner_up: (B or 0, K) the label it then has, `UNKNOWN` for none.
    """

    label: IntArray
    cost: FloatArray
    candidates: IntArray
    widened: BoolArray
    margin: FloatArray
    runner_up: IntArray


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
    row_of = np.full(m, -1, dtype=np.int64)
    distance = np.empty(m)
    previous = np.empty(m, dtype=np.int64)
    order = np.empty(m, dtype=np.int64)
    column_of[:] = -1
    column_dual[:] = 0.0
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

    Where not all can, each row is offered n columns more, at a cost that no assignment is worth.

    Args:
        cost: (n, m) costs; what is not finite cannot be assigned.
        column_of: (n,) filled with the column of each row, -1 for none.
        row_dual: (n,) filled with the optimal duals of the rows.
        column_dual: (m + n,) filled with the optimal duals of the columns.
    """
    n, m = cost.shape
    highest, all_finite = 0.0, True
    for i in range(n):
        for j in range(m):
            if np.isfinite(cost[i, j]):
                highest = max(highest, cost[i, j])
            else:
                all_finite = False
    if n <= m and all_finite:
        assign(cost, column_of, row_dual, column_dual[:m])
        return
    prohibitive = (n + 1) * (highest + 1.0)
    widened = np.full((n, m + n), prohibitive)
    for i in range(n):
        for j in range(m):
            widened[i, j] = cost[i, j] if np.isfinite(cost[i, j]) else 2 * prohibitive
    assign(widened, column_of, row_dual, column_dual)
    for i in range(n):
        if column_of[i] >= m:
            column_of[i] = UNKNOWN


@compiled
def sites_kept(camera: FloatArray, sites: FloatArray, threshold: float, order: IntArray) -> int:
    """What `sites_by_probability` says of one camera: how many sites the threshold keeps.

    Args:
        camera: (2,) metres.
        sites: (K, 2) centres, distinct, metres.
        threshold: 0 to 1.
        order: (K,) filled with the sites in falling probability (Eq. 3), which is rising distance.
    """
    k = len(sites)
    distance = np.empty(k)
    for s in range(k):
        dx, dz = camera[0] - sites[s, 0], camera[1] - sites[s, 1]
        distance[s] = np.sqrt(dx * dx + dz * dz)
        place = s
        while place > 0 and distance[order[place - 1]] > distance[s]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = s
    if threshold >= 1.0:
        return k
    total = 0.0
    for place in range(1, k):
        total += 1.0 / distance[order[place]]
    kept, reached = 1, 0.0
    while kept < k and reached < (threshold - SUM_TOLERANCE) * total:
        reached += 1.0 / distance[order[kept]]
        kept += 1
    return kept


@compiled
def enough(detected: IntArray, offered: IntArray, gate: bool) -> bool:
    """Whether every detection can have a label of its own.

    Args:
        detected: (C + 1,) detections of each category, those of none last.
        offered: (C + 1,) candidate labels of each category; the last entry is 0.
        gate: whether a label must be of the detection's category, where that is known.
    """
    if gate:
        for c in range(len(detected) - 1):
            if detected[c] > offered[c]:
                return False
    return bool(detected.sum() <= offered.sum())


@compiled
def choose_candidates(
    known: Known, b: int, detected: IntArray, gate: bool, rank: IntArray, kept: int, chosen: IntArray
) -> tuple[int, bool]:
    """Fill `chosen` with the labels of the first `kept` sites, and of more where those are too few.

    Args:
        known: the labels.
        b: the snapshot.
        detected: (C + 1,) its detections of each category, those of none last.
        gate: whether a label must be of the detection's category, where that is known.
        rank: (S,) place of each site in the order of falling probability.
        kept: how many sites the threshold keeps.
        chosen: (M,) filled from the front.

    Returns:
        How many labels were chosen, and whether that took more sites than `kept`.
    """
    offered = np.zeros_like(detected)
    sites = kept
    while True:
        offered[:] = 0
        m = 0
        for j in known.order[b % len(known.order)]:
            if rank[known.site[j]] < sites:
                chosen[m] = j
                offered[known.category[j]] += 1
                m += 1
        if sites >= len(rank) or enough(detected, offered, gate):
            return m, sites > kept
        sites += 1


@compiled
def fill_costs(
    seen: Seen, known: Known, rule: Rule, b: int, half_turn: FloatArray, chosen: IntArray, cost: FloatArray
) -> None:
    """Fill in what it costs to give each chosen label to each detection of one snapshot (Eqs. 4 to 7).

    Args:
        seen: the detections.
        known: the labels.
        rule: the weights and terms.
        b: the snapshot.
        half_turn: (2, M) sine and cosine of half of each label's yaw.
        chosen: (m,) indices of the labels.
        cost: (n, m) filled, its rows in the order of `seen`; infinite where categories must agree and do not.
    """
    dimension = np.ones(len(known.sides))
    for row in range(len(cost)):
        i = seen.order[b % len(seen.order), row]
        x, z = seen.position[b, i, 0], seen.position[b, i, 1]
        sine, cosine = np.sin(seen.yaw[b, i] / 2), np.cos(seen.yaw[b, i] / 2)
        if rule.compare_sizes:
            for u in range(len(dimension)):
                dimension[u] = np.exp(
                    abs(seen.sides[b, i, 0] - known.sides[u, 0])
                    + abs(seen.sides[b, i, 1] - known.sides[u, 1])
                    + abs(seen.sides[b, i, 2] - known.sides[u, 2])
                )
        category = seen.category[b, i]
        gate = rule.gate and category != UNKNOWN
        for k in range(len(chosen)):
            j = chosen[k]
            dx, dz = x - known.position[j, 0], z - known.position[j, 1]
            turn = abs(sine * half_turn[1, j] - cosine * half_turn[0, j])
            moved = rule.translation_weight * np.sqrt(dx * dx + dz * dz) + rule.rotation_weight * turn
            cost[row, k] = dimension[known.kind[j]] * moved
            if gate and known.category[j] != category:
                cost[row, k] = np.inf


@compiled
def fill_margins(
    seen: Seen, b: int, cost: FloatArray, column_of: IntArray, chosen: IntArray, answer: Answer
) -> None:
    """Fill in the margins and runners-up of one snapshot.

    Args:
        seen: the detections.
        b: the snapshot.
        cost: (n, m) of each chosen label.
        column_of: (n,) the optimal column of each row, `UNKNOWN` for none.
        chosen: (m or more) indices of the labels.
        answer: filled.
    """
    margin, other = find_margins(cost, column_of)
    for row in range(len(cost)):
        if column_of[row] != UNKNOWN:
            i = seen.order[b % len(seen.order), row]
            answer.margin[b, i] = margin[row]
            if other[row] != UNKNOWN:
                answer.runner_up[b, i] = chosen[other[row]]


@compiled
def identify_batch(seen: Seen, known: Known, rule: Rule, answer: Answer) -> None:
    """Identify B snapshots: prune (Eq. 3), costs (Eqs. 4 to 7), assignment (Eq. 8). Fills the answer."""
    b_total, k_max = seen.yaw.shape
    m_total, s_total = len(known.yaw), len(known.sites)
    half_turn = np.stack((np.sin(known.yaw / 2), np.cos(known.yaw / 2)))
    order, rank = np.zeros(s_total, dtype=np.int64), np.zeros(max(s_total, 1), dtype=np.int64)
    chosen = np.empty(m_total, dtype=np.int64)
    detected = np.zeros(known.category.max() + 2, dtype=np.int64)
    costs = np.empty(k_max * m_total)
    column_of = np.empty(k_max, dtype=np.int64)
    row_dual, column_dual = np.empty(k_max), np.empty(m_total + k_max)
    answer.label[:] = UNKNOWN
    answer.cost[:] = np.nan
    for b in range(b_total):
        n = seen.number[b]
        detected[:] = 0
        for i in range(n):
            detected[seen.category[b, i]] += 1
        kept = 1
        if s_total:
            kept = sites_kept(seen.camera[b], known.sites, rule.threshold, order)
            for place in range(s_total):
                rank[order[place]] = place
        m, answer.widened[b] = choose_candidates(known, b, detected, rule.gate, rank, kept, chosen)
        answer.candidates[b] = m
        cost = costs[: n * m].reshape(n, m)
        fill_costs(seen, known, rule, b, half_turn, chosen[:m], cost)
        assign_most(cost, column_of[:n], row_dual[:n], column_dual[: m + n])
        for row in range(n):
            if column_of[row] != UNKNOWN:
                i = seen.order[b % len(seen.order), row]
                answer.label[b, i] = chosen[column_of[row]]
                answer.cost[b, i] = cost[row, column_of[row]]
        if len(answer.margin):
            fill_margins(seen, b, cost, column_of[:n], chosen, answer)
