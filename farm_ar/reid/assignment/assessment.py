"""The paper's method, compiled: costs, assignment and margins of one snapshot or many. The only copy.

`costs` has the same equations in NumPy, to read and to test against.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.borrowing import borrowed
from farm_ar.kernels import compiled
from farm_ar.reid.assignment.optimum import assign_most_in, find_margins_in
from farm_ar.reid.assignment.problem import Answer, CostModel, Known, Seen
from farm_ar.reid.assignment.workspace import Workspace, workspace_for
from farm_ar.reid.pruning import choose_candidates, sites_kept
from farm_ar.scenes import UNKNOWN


def assess(seen: Seen, known: Known, model: CostModel, margins: bool = False, costs: bool = False) -> Answer:
    """What the paper's method makes of B snapshots: costs, labels and, on request, margins (Eqs. 3 to 8).

    Args:
        seen: the detections; `seen_at` makes them of poses.
        known: the labels; `known_at` makes them of poses.
        model: weights and options.
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
    assess_batch(Seen(*map(_writable, seen)), Known(*map(_writable, known)), model, answer)
    return answer


_NO_COSTS: FloatArray = np.empty((0, 0, 0))
_NO_MARGINS: tuple[FloatArray, IntArray] = np.empty((0, 0)), np.empty((0, 0), dtype=np.int64)
"""Costs, and margins with runners-up, where they are not asked for."""


def labels_of_one(seen: Seen, known: Known, model: CostModel) -> tuple[IntArray, FloatArray]:
    """`assess` of one snapshot, whose arrays can be written to: the (N,) labels and their costs."""
    answer = _of_one(seen, known, model, _NO_MARGINS)
    return answer.label[0], answer.cost[0]


def margins_of_one(seen: Seen, known: Known, model: CostModel) -> tuple[FloatArray, IntArray]:
    """`assess` of one snapshot, whose arrays can be written to: the (N,) margins and runners-up."""
    margin, runner_up = np.empty(seen.yaw.shape), np.empty(seen.yaw.shape, dtype=np.int64)
    margin.fill(np.nan)
    runner_up.fill(UNKNOWN)
    _of_one(seen, known, model, (margin, runner_up))
    return margin[0], runner_up[0]


def _of_one(seen: Seen, known: Known, model: CostModel, margins: tuple[FloatArray, IntArray]) -> Answer:
    label, cost = np.empty(seen.yaw.shape, dtype=np.int64), np.empty(seen.yaw.shape)
    label.fill(UNKNOWN)
    cost.fill(np.nan)
    candidates, widened = np.empty(1, dtype=np.int64), np.empty(1, dtype=np.bool_)
    answer = Answer(label, cost, candidates, widened, *margins, _NO_COSTS)
    assess_batch(seen, known, model, answer)
    return answer


def in_parts(assessed: Callable[[slice], Answer], count: int, costs: int) -> Answer:
    """The answer to many snapshots, of which parts are assessed by as many threads as Numba may use.

    Args:
        assessed: gives the answer to those of a slice; it is called by several threads.
        count: how many there are.
        costs: how many there are of each.
    """
    step = max(1, _PART // max(costs, 1))
    parts = [slice(k, min(k + step, count)) for k in range(0, count, step)] or [slice(0, 0)]
    threads = min(numba.config.NUMBA_NUM_THREADS, len(parts))  # type: ignore[attr-defined]
    if threads == 1 or multiprocessing.parent_process() is not None:  # whose siblings have the processors
        answers = [assessed(part) for part in parts]
    else:
        with ThreadPoolExecutor(threads) as pool:
            answers = list(pool.map(assessed, parts))
    return answers[0] if len(answers) == 1 else Answer(*map(np.concatenate, zip(*answers, strict=True)))


_PART = 400_000
"""Costs of the snapshots that one thread assesses at once."""


def _writable(array: NDArray[Any]) -> NDArray[Any]:
    """The array, or a copy that can be written to: for others the kernels would be compiled once more."""
    return array if array.flags.writeable else array.copy()


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
    if np.isnan(turn):  # a heading that is not known
        turn = 0.0
    return float(translation_weight * np.sqrt(dx * dx + dz * dz) + rotation_weight * turn)


@compiled
def size_factor(sides: FloatArray, label_sides: FloatArray) -> float:
    """By how much a difference of sizes multiplies a cost (Eq. 6), of sorted logarithms of the sides (3,)."""
    factor = np.exp(
        abs(sides[0] - label_sides[0]) + abs(sides[1] - label_sides[1]) + abs(sides[2] - label_sides[2])
    )
    return 1.0 if np.isnan(factor) else float(factor)  # a size that is not known


@compiled
def cost_of_moving(
    dx: float,
    dz: float,
    half: tuple[float, float],
    label_half: tuple[float, float],
    translation_weight: float,
    rotation_weight: float,
) -> float:
    """Cost of a way and a turn (Eqs. 4 and 5), of sine and cosine of half of both yaws."""
    turn = abs(half[0] * label_half[1] - half[1] * label_half[0])
    if np.isnan(turn):
        turn = 0.0
    return float(translation_weight * np.sqrt(dx * dx + dz * dz) + rotation_weight * turn)


@compiled(inline="always")
def halve_yaws(yaw: FloatArray, space: Workspace) -> None:
    """Fill in sine and cosine of half of the yaws (M,) of labels."""
    for label in range(len(yaw)):
        half = yaw[label] / 2
        space.half_sine[label], space.half_cosine[label] = np.sin(half), np.cos(half)


@compiled(inline="always")
def fill_costs(
    seen: Seen,
    known: Known,
    model: CostModel,
    b: int,
    rows: IntArray,
    columns: IntArray,
    cost: FloatArray,
    space: Workspace,
) -> None:
    """Fill in what it costs to give labels to detections of one snapshot (Eqs. 4 to 7).

    Args:
        seen: the detections.
        known: the labels.
        model: the weights and terms.
        b: the snapshot.
        rows: (n,) indices of the detections.
        columns: (m,) indices of the labels.
        cost: (n, m) filled; infinite where categories must agree and do not.
        space: knows sine and cosine of half of the labels' yaws.
    """
    dimension = space.dimension
    dimension[: len(known.sides)] = 1.0
    place = known.position[b % len(known.position)]
    sides, codes = seen.sides[b % len(seen.sides)], seen.category[b % len(seen.category)]
    for row in range(len(rows)):
        i = rows[row]
        x, z = seen.position[b, i, 0], seen.position[b, i, 1]
        half = (np.sin(seen.yaw[b, i] / 2), np.cos(seen.yaw[b, i] / 2))
        if model.compare_sizes:
            for u in range(len(known.sides)):
                dimension[u] = size_factor(sides[i], known.sides[u])
        gate = model.gate and codes[i] != UNKNOWN
        for k in range(len(columns)):
            j = columns[k]
            if gate and known.category[j] != codes[i]:
                cost[row, k] = np.inf
                continue
            label_half = (space.half_sine[j], space.half_cosine[j])
            moved = cost_of_moving(
                x - place[j, 0],
                z - place[j, 1],
                half,
                label_half,
                model.translation_weight,
                model.rotation_weight,
            )
            cost[row, k] = dimension[known.kind[j]] * moved


@compiled(inline="always")
def give_labels(
    cost: FloatArray, b: int, rows: IntArray, columns: IntArray, answer: Answer, space: Workspace
) -> None:
    """Solve (Eq. 8) for some detections and labels of one snapshot, with their margins where asked for.

    Args:
        cost: (n, m) costs.
        b: the snapshot.
        rows: (n,) indices of the detections.
        columns: (m,) indices of the labels.
        answer: filled.
        space: to work in.
    """
    n, column_of = len(cost), space.column_of
    assign_most_in(cost, space)
    for row in range(n):
        if column_of[row] != UNKNOWN:
            answer.label[b, rows[row]] = columns[column_of[row]]
            answer.cost[b, rows[row]] = cost[row, column_of[row]]
    if len(answer.margin):
        find_margins_in(cost, space)
        for row in range(n):
            other = space.runner_up[row]
            answer.margin[b, rows[row]] = space.margin[row]
            answer.runner_up[b, rows[row]] = UNKNOWN if other == UNKNOWN else columns[other]


@compiled
def assess_batch(seen: Seen, known: Known, model: CostModel, answer: Answer) -> None:
    """`assess`: prune (Eq. 3), costs (Eqs. 4 to 7), assignment (Eq. 8). Fills the answer.

    Where all categories are known and kept apart, each is solved by itself.
    """
    k_max, m_total = seen.yaw.shape[1], len(known.category)
    others = max(len(known.sites), len(known.sides))
    for code in known.category:
        others = max(others, code + 1)
    space = workspace_for(k_max, m_total, len(answer.margin) > 0, others)
    assess_all(seen, known, model, answer, space)


@compiled
def assess_all(seen: Seen, known: Known, model: CostModel, answer: Answer, space: Workspace) -> None:
    """`assess_batch`, in a workspace for the detections and labels of one snapshot."""
    seen, known, answer, space = borrowed(seen), borrowed(known), borrowed(answer), borrowed(space)
    for b in range(len(seen.yaw)):
        assess_one(b, seen, known, model, answer, space)


@compiled
def assess_one(b: int, seen: Seen, known: Known, model: CostModel, answer: Answer, space: Workspace) -> None:
    """`assess_batch` of one snapshot, after those before it, in a workspace for detections and labels."""
    k_max, m_total, s_total = seen.yaw.shape[1], len(known.category), len(known.sites)
    categories = 0
    for code in known.category:
        categories = max(categories, code + 1)
    if b == 0 or len(known.yaw) > 1:
        halve_yaws(known.yaw[b % len(known.yaw)], space)
    rows, columns, chosen = space.rows, space.columns, space.chosen
    detected, offered = space.detected[: categories + 1], space.offered[: categories + 1]
    turns, codes = seen.order[b % len(seen.order)], seen.category[b % len(seen.category)]
    n = seen.number[b]
    detected[:] = 0
    for row in range(n):
        detected[codes[turns[row]]] += 1
    kept, rank = 1, space.site_rank[: max(s_total, 1)]
    rank[0] = 0
    if s_total:
        order = space.site_order
        kept = sites_kept(seen.camera[b % len(seen.camera)], known.sites, model.threshold, order)
        for place in range(s_total):
            rank[order[place]] = place
    m, answer.widened[b] = choose_candidates(known, b, detected, model.gate, rank, kept, chosen, offered)
    answer.candidates[b] = m
    apart = model.gate and detected[categories] == 0
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
        cost = space.cost[: height * width].reshape(height, width)
        fill_costs(seen, known, model, b, rows[:height], columns[:width], cost, space)
        give_labels(cost, b, rows[:height], columns[:width], answer, space)
    if len(answer.costs):
        every = space.every
        fill_costs(seen, known, model, b, every[:k_max], every[:m_total], answer.costs[b], space)


@compiled(inline="always")
def known_objects(
    position: FloatArray, yaw: FloatArray, category: IntArray, kind: IntArray, sides: FloatArray
) -> Known:
    """Labels by their poses, (M, 2) metres and (M,) radians, for `assess_objects`; the rest as in `Known`."""
    m = len(yaw)
    return Known(
        position.reshape(1, m, 2),
        yaw.reshape(1, m),
        category,
        kind,
        sides,
        np.zeros(m, dtype=np.int64),
        np.empty((0, 2)),
        np.arange(m).reshape(1, m),
    )


@compiled(inline="always")
def assess_objects(
    position: FloatArray, yaw: FloatArray, detected: IntArray, known: Known, model: CostModel, costs: bool
) -> Answer:
    """`assess` with margins, for kernels: one snapshot of the labels' own objects, one a label.

    Args:
        position: (M, 2) metres.
        yaw: (M,) radians.
        detected: (n,) which of them are detected.
        known: the labels, of B = 1.
        model: weights and options.
        costs: whether all costs are given.
    """
    m, number, sides = len(yaw), np.empty(1, dtype=np.int64), np.empty((1, len(yaw), 3))
    number[0] = len(detected)
    for i in range(m):
        for axis in range(3):
            sides[0, i, axis] = known.sides[known.kind[i], axis]
    seen = Seen(
        number,
        np.empty((1, 2)),
        position.reshape(1, m, 2),
        yaw.reshape(1, m),
        sides,
        known.category.reshape(1, m),
        detected.reshape(1, len(detected)),
    )
    label, runner_up = np.empty((1, m), dtype=np.int64), np.empty((1, m), dtype=np.int64)
    cost, margin = np.empty((1, m)), np.empty((1, m))
    for i in range(m):
        label[0, i], runner_up[0, i], cost[0, i], margin[0, i] = UNKNOWN, UNKNOWN, np.nan, np.nan
    candidates, widened = np.empty(1, dtype=np.int64), np.empty(1, dtype=np.bool_)
    every = np.empty((1 if costs else 0, m, m))
    answer = Answer(label, cost, candidates, widened, margin, runner_up, every)
    assess_batch(seen, known, model, answer)
    return answer
