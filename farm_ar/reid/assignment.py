"""The paper's method, compiled: costs, assignment and margins of one snapshot or many. The only copy.

`costs` has the same equations in NumPy, to read and to test against.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray, read_only
from farm_ar.kernels import compiled
from farm_ar.reid.pruning import choose_candidates, sites_kept
from farm_ar.scenes import UNKNOWN


class Seen(NamedTuple):
    """The detections of B snapshots, rows padded to K, and where each was taken from.

    Args:
        number: (B,) detections in each snapshot: the first so many of `order`.
        camera: (B or 1, 2) metres; for pruning only.
        position: (B, K, 2) metres.
        yaw: (B, K) radians.
        sides: (B or 1, K, 3) sorted logarithms of the sides.
        category: (B or 1, K) codes, `UNKNOWN` where not known.
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
        position: (B or 1, M, 2) metres.
        yaw: (B or 1, M) radians.
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
    compare_sizes: bool = False
    gate: bool = True
    threshold: float = 1.0


class Answer(NamedTuple):
    """What is found out of B snapshots.

    Args:
        label: (B, K) index of the label of each detection, `UNKNOWN` for none.
        cost: (B, K) its cost, NaN for none.
        candidates: (B,) labels considered.
        widened: (B,) whether sites were added because there were fewer candidates than detections.
        margin: (B or 0, K) rise of the total cost if the detection must give up its label, NaN for none.
        runner_up: (B or 0, K) the label it then has, `UNKNOWN` for none.
        costs: (B or 0, K, M) of every label for every row, detected or not; infinite across known categories
            where these are kept apart.
    """

    label: IntArray
    cost: FloatArray
    candidates: IntArray
    widened: BoolArray
    margin: FloatArray
    runner_up: IntArray
    costs: FloatArray


def seen_at(
    position: FloatArray,
    yaw: FloatArray,
    category: IntArray,
    present: BoolArray | None = None,
    sides: FloatArray | None = None,
) -> Seen:
    """Detections of B snapshots by their poses, for `assess`.

    Args:
        position: (B, K, 2) metres.
        yaw: (B, K) radians.
        category: (K,) or (B, K) codes, `UNKNOWN` where not known.
        present: (B, K) which of them are detected; all by default.
        sides: (K, 3) or (B, K, 3) sorted logarithms of the sides (`sorted_log_sides`); not needed where sizes
            do not count.
    """
    b, k = yaw.shape
    present = np.ones((b, k), dtype=bool) if present is None else present
    sides = np.zeros((1, k, 3)) if sides is None else sides if sides.ndim == 3 else sides[None]
    return Seen(
        read_only(present.sum(axis=1), np.int64),
        read_only(np.zeros((1, 2)), np.float64),
        read_only(position, np.float64),
        read_only(yaw, np.float64),
        read_only(sides, np.float64),
        read_only(category if category.ndim == 2 else category[None], np.int64),
        read_only(np.argsort(~present, axis=1, kind="stable"), np.int64),
    )


def known_at(
    position: FloatArray, yaw: FloatArray, category: IntArray, sides: FloatArray | None = None
) -> Known:
    """Labels by their poses, for `assess`: all are considered.

    Args:
        position: (M, 2) metres, or (B, M, 2) where each snapshot has its own.
        yaw: (M,) or (B, M) radians.
        category: (M,) codes, from 0.
        sides: (M, 3) sorted logarithms of the sides; not needed where sizes do not count.
    """
    m = len(category)
    return Known(
        read_only(position if position.ndim == 3 else position[None], np.float64),
        read_only(yaw if yaw.ndim == 2 else yaw[None], np.float64),
        read_only(category, np.int64),
        read_only(np.zeros(m) if sides is None else np.arange(m), np.int64),
        read_only(np.zeros((1, 3)) if sides is None else sides, np.float64),
        read_only(np.zeros(m), np.int64),
        read_only(np.zeros((0, 2)), np.float64),
        read_only(np.arange(m)[None], np.int64),
    )


def assess(seen: Seen, known: Known, rule: Rule, margins: bool = False, costs: bool = False) -> Answer:
    """What the paper's method makes of B snapshots: costs, labels and, on request, margins (Eqs. 3 to 8).

    Args:
        seen: the detections; `seen_at` makes them of poses.
        known: the labels; `known_at` makes them of poses.
        rule: weights and options.
        margins: whether margins and runners-up are found.
        costs: whether all costs are given.
    """
    b, k = seen.yaw.shape
    rises, every = (b if margins else 0), (b if costs else 0)
    answer = Answer(
        label=np.full((b, k), UNKNOWN),
        cost=np.full((b, k), np.nan),
        candidates=np.empty(b, dtype=np.int64),
        widened=np.empty(b, dtype=np.bool_),
        margin=np.full((rises, k), np.nan),
        runner_up=np.full((rises, k), UNKNOWN),
        costs=np.empty((every, k if costs else 0, len(known.category) if costs else 0)),
    )
    assess_batch(seen, known, rule, answer)
    return answer


@compiled
def pose_cost(
    x: float,
    z: float,
    yaw: float,
    position: FloatArray,
    label_yaw: float,
    translation_weight: float,
    rotation_weight: float,
) -> float:
    """Cost of taking a label at a position (2,) and yaw to a pose, sizes apart (Eqs. 4, 5 and 7)."""
    dx, dz = x - position[0], z - position[1]
    turn = abs(np.sin((yaw - label_yaw) / 2))
    return float(translation_weight * np.sqrt(dx * dx + dz * dz) + rotation_weight * turn)


@compiled
def fill_costs(
    seen: Seen,
    known: Known,
    rule: Rule,
    b: int,
    half_turn: FloatArray,
    rows: IntArray,
    columns: IntArray,
    cost: FloatArray,
) -> None:
    """Fill in what it costs to give labels to detections of one snapshot (Eqs. 4 to 7).

    Args:
        seen: the detections.
        known: the labels.
        rule: the weights and terms.
        b: the snapshot.
        half_turn: (2, M) sine and cosine of half of each label's yaw.
        rows: (n,) indices of the detections.
        columns: (m,) indices of the labels.
        cost: (n, m) filled; infinite where categories must agree and do not.
    """
    dimension = np.ones(len(known.sides))
    place = known.position[b % len(known.position)]
    sides, codes = seen.sides[b % len(seen.sides)], seen.category[b % len(seen.category)]
    for row in range(len(rows)):
        i = rows[row]
        x, z = seen.position[b, i, 0], seen.position[b, i, 1]
        sine, cosine = np.sin(seen.yaw[b, i] / 2), np.cos(seen.yaw[b, i] / 2)
        if rule.compare_sizes:
            for u in range(len(dimension)):
                dimension[u] = np.exp(
                    abs(sides[i, 0] - known.sides[u, 0])
                    + abs(sides[i, 1] - known.sides[u, 1])
                    + abs(sides[i, 2] - known.sides[u, 2])
                )
        gate = rule.gate and codes[i] != UNKNOWN
        for k in range(len(columns)):
            j = columns[k]
            dx, dz = x - place[j, 0], z - place[j, 1]
            turn = abs(sine * half_turn[1, j] - cosine * half_turn[0, j])
            moved = rule.translation_weight * np.sqrt(dx * dx + dz * dz) + rule.rotation_weight * turn
            cost[row, k] = dimension[known.kind[j]] * moved
            if gate and known.category[j] != codes[i]:
                cost[row, k] = np.inf


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


@compiled
def give_labels(cost: FloatArray, b: int, rows: IntArray, columns: IntArray, answer: Answer) -> None:
    """Solve (Eq. 8) for some detections and labels of one snapshot, with their margins where asked for.

    Args:
        cost: (n, m) costs.
        b: the snapshot.
        rows: (n,) indices of the detections.
        columns: (m,) indices of the labels.
        answer: filled.
    """
    n, m = cost.shape
    column_of = np.empty(n, dtype=np.int64)
    assign_most(cost, column_of, np.empty(n), np.empty(m + n))
    for row in range(n):
        if column_of[row] != UNKNOWN:
            answer.label[b, rows[row]] = columns[column_of[row]]
            answer.cost[b, rows[row]] = cost[row, column_of[row]]
    if len(answer.margin):
        margin, other = find_margins(cost, column_of)
        for row in range(n):
            answer.margin[b, rows[row]] = margin[row]
            answer.runner_up[b, rows[row]] = UNKNOWN if other[row] == UNKNOWN else columns[other[row]]


@compiled
def assess_batch(seen: Seen, known: Known, rule: Rule, answer: Answer) -> None:
    """`assess`: prune (Eq. 3), costs (Eqs. 4 to 7), assignment (Eq. 8). Fills the answer.

    Where all categories are known and kept apart, each is solved by itself.
    """
    b_total, k_max = seen.yaw.shape
    m_total, s_total = len(known.category), len(known.sites)
    order, rank = np.zeros(s_total, dtype=np.int64), np.zeros(max(s_total, 1), dtype=np.int64)
    chosen, columns = np.empty(m_total, dtype=np.int64), np.empty(m_total, dtype=np.int64)
    rows, all_rows = np.empty(k_max, dtype=np.int64), np.arange(k_max)
    categories = 0
    for code in known.category:
        categories = max(categories, code + 1)
    detected = np.zeros(categories + 1, dtype=np.int64)
    costs = np.empty(k_max * m_total)
    half_turn = np.empty((2, m_total))
    for b in range(b_total):
        if b == 0 or len(known.yaw) > 1:
            half = known.yaw[b % len(known.yaw)] / 2
            half_turn[0], half_turn[1] = np.sin(half), np.cos(half)
        turns, codes = seen.order[b % len(seen.order)], seen.category[b % len(seen.category)]
        n = seen.number[b]
        detected[:] = 0
        for row in range(n):
            detected[codes[turns[row]]] += 1
        kept = 1
        if s_total:
            kept = sites_kept(seen.camera[b % len(seen.camera)], known.sites, rule.threshold, order)
            for place in range(s_total):
                rank[order[place]] = place
        m, answer.widened[b] = choose_candidates(known, b, detected, rule.gate, rank, kept, chosen)
        answer.candidates[b] = m
        apart = rule.gate and detected[categories] == 0
        for code in range(categories if apart else 1):
            height, width = 0, 0
            for row in range(n):
                if not apart or codes[turns[row]] == code:
                    rows[height] = turns[row]
                    height += 1
            if height == 0:
                continue
            for k in range(m):
                if not apart or known.category[chosen[k]] == code:
                    columns[width] = chosen[k]
                    width += 1
            cost = costs[: height * width].reshape(height, width)
            fill_costs(seen, known, rule, b, half_turn, rows[:height], columns[:width], cost)
            give_labels(cost, b, rows[:height], columns[:width], answer)
        if len(answer.costs):
            fill_costs(seen, known, rule, b, half_turn, all_rows, np.arange(m_total), answer.costs[b])
