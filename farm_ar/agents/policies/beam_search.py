"""The beam search for plans of visits, compiled: which object goes how far towards which label's place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.agents.policies.plan_steps import SHARES, Allowance, Table, Terms, is_clear, target
from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.features import MARGIN_SCALE
from farm_ar.geometry.camera import Eye, sees
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import CostModel, assess_objects, known_objects
from farm_ar.structs import Structs

AMBIGUITY_SHARE = 0.5
"""Weight of a unit of ambiguity, a wrong label being 1, while a plan is unfinished."""

SLACK = 0.05
"""By how much less than the best one a plan may gain, if its steps are to be tried in another order."""

ROUNDING = 1e-9
"""Metres and radians that make no difference."""

GRAIN = 1e6
"""Poses differ where they do after rounding to one part in so many of a metre or a radian."""


class Task(NamedTuple):
    """What plans are made for.

    Args:
        table: as it stands.
        eyes: (1,) the camera of the snapshot.
        terms: prices and reaches.
        allowed: what is left of the budget.
        seen: (M,) objects that are in view before the first step: those that can be moved.
        before: how many labels would be wrong without a step.
    """

    table: Table
    eyes: Structs[Eye]
    terms: Terms
    allowed: Allowance
    seen: BoolArray
    before: int


class Plans(NamedTuple):
    """P unfinished plans, and what follows from each; C kinds.

    Args:
        ways: (P, moves, 3) mover, label and number of the share of each step.
        position: (P, M, 2) where objects then stand, metres.
        yaw: (P, M) radians.
        shown: (P, M) which of them are in view.
        spent: (P, 2) metres and radians.
        wrong: (P, C) labels of each kind that a snapshot makes wrong.
        doubt: (P, C) ambiguity of what moves of it.
        key: (P,) the same for the same steps in any order.
        kind_key: (P, C) the same for the same poses of a kind.
    """

    ways: IntArray
    position: FloatArray
    yaw: FloatArray
    shown: BoolArray
    spent: FloatArray
    wrong: IntArray
    doubt: FloatArray
    key: IntArray
    kind_key: IntArray


class Steps(NamedTuple):
    """Steps by which plans may go on.

    Args:
        plan: (S,) which plan.
        step: (S, 3) mover, label and number of the share.
        gain: (S,) wrong labels that the plan then adds, less the price of its effort.
        promise: (S,) by which it is compared with other unfinished plans.
    """

    plan: IntArray
    step: IntArray
    gain: FloatArray
    promise: FloatArray


@compiled
def search(
    table: Table,
    eyes: Structs[Eye],
    terms: Terms,
    allowed: Allowance,
    beam: int,
    steps: IntArray,
    worth: FloatArray,
) -> int:
    """The plan after which the paper's method would give most wrong labels, less the price of the effort.

    Plans grow step by step; of those of one length the most promising are kept.

    Args:
        table: as it stands.
        eyes: (1,) the camera of the snapshot.
        terms: prices and reaches.
        allowed: what is left of the budget.
        beam: how many unfinished plans are kept.
        steps: (allowed.moves, 3) filled with mover, label and number of the share of each step.
        worth: (M, M, shares) filled with what can be gained from each step on that could come first; minus
            infinity for the others. Plans that gain much less than the best count for the step alone that
            they begin with.

    Returns:
        How many steps the best plan has.
    """
    plans = _no_steps(table, eyes[0], terms, allowed.moves)
    task = Task(table, eyes, terms, allowed, plans.shown[0].copy(), plans.wrong[0].sum())
    judged = {0: (0, 0.0)}  # what is known of poses of a kind, by key
    most = beam * len(table.yaw) ** 2 * len(SHARES)
    tried = Steps(
        np.empty(most, dtype=np.int64), np.empty((most, 3), dtype=np.int64), np.empty(most), np.empty(most)
    )
    worth[:] = -np.inf
    best, length = 0.0, 0
    for depth in range(allowed.moves):
        found = _go_on(task, plans, depth, judged, best - SLACK, tried, worth)
        if found == 0:
            break
        top = np.argmax(tried.gain[:found])
        if tried.gain[top] > best:
            best, length = tried.gain[top], depth + 1
            steps[:depth], steps[depth] = plans.ways[tried.plan[top], :depth], tried.step[top]
        kept = np.argsort(-tried.promise[:found], kind="mergesort")[:beam]
        plans = _longer(task, plans, depth, tried.plan[kept], tried.step[kept])
    return length


@compiled
def _no_steps(table: Table, eye: Eye, terms: Terms, moves: int) -> Plans:
    """The one plan without a step."""
    m, kinds = len(table.yaw), table.category.max() + 1
    position, yaw, shown = np.empty((1, m, 2)), np.empty((1, m)), np.empty((1, m), dtype=np.bool_)
    position[0], yaw[0] = table.position, table.yaw
    for i in range(m):
        shown[0, i] = sees(eye, table.position[i, 0], table.elevation[i], table.position[i, 1])
    wrong, doubt = np.empty((1, kinds), dtype=np.int64), np.empty((1, kinds))
    for code in range(kinds):
        wrong[0, code], doubt[0, code] = _judge(code, table, terms, shown[0], position[0], yaw[0])
    ways, spent = np.zeros((1, moves, 3), dtype=np.int64), np.zeros((1, 2))
    key, kind_key = np.zeros(1, dtype=np.int64), np.zeros((1, kinds), dtype=np.int64)
    return Plans(ways, position, yaw, shown, spent, wrong, doubt, key, kind_key)


@compiled
def _go_on(
    task: Task,
    plans: Plans,
    depth: int,
    judged: dict[int, tuple[int, float]],
    least: float,
    tried: Steps,
    worth: FloatArray,
) -> int:
    """Try every step that plans may go on by, and note its score.

    Args:
        task: what the plans are for.
        plans: of `depth` steps each.
        depth: how many steps these have.
        judged: what is known of poses of a kind; added to.
        least: what a plan must gain to be tried in another order.
        tried: filled.
        worth: as in `search`.

    Returns:
        How many steps there are.
    """
    table, terms, allowed = task.table, task.terms, task.allowed
    m, found, known = len(table.yaw), 0, {np.int64(0)}
    for b in range(len(plans.key)):
        place, turned, spent, way = plans.position[b], plans.yaw[b], plans.spent[b], plans.ways[b]
        wrong, doubt = plans.wrong[b].sum() - task.before, plans.doubt[b].sum()
        for i in range(m):
            if not (table.movable[i] and task.seen[i]) or _among(way[:depth], i):
                continue
            code = table.category[i]
            for j in range(m):
                if j == i or table.category[j] != code or not table.movable[j]:
                    continue
                for share in range(len(SHARES)):
                    key = plans.key[b] + _step_key(m, i, j, share)
                    if key in known:
                        continue
                    x, z, heading, metres, radians = target(table, terms, allowed, spent, i, j, share)
                    if metres + radians <= 0.0:
                        continue
                    if not is_clear(table, terms, place, turned, i, x, z, heading):
                        continue
                    known.add(key)
                    fooled, unsure = _look_ahead(task, plans, b, i, (x, z, heading), judged)
                    price = terms.effort_metre * (spent[0] + metres)
                    price += terms.effort_radian * (spent[1] + radians)
                    gain = wrong - plans.wrong[b, code] + fooled - price
                    ambiguity = doubt - plans.doubt[b, code] + unsure
                    tried.plan[found], tried.gain[found] = b, gain
                    tried.promise[found] = gain + AMBIGUITY_SHARE * ambiguity
                    tried.step[found, 0], tried.step[found, 1], tried.step[found, 2] = i, j, share
                    way[depth] = tried.step[found]
                    _credit(worth, way[: depth + 1], gain, least, table, terms, allowed)
                    found += 1
    return found


@compiled(inline="always")
def _look_ahead(
    task: Task,
    plans: Plans,
    b: int,
    i: int,
    pose: tuple[float, float, float],
    judged: dict[int, tuple[int, float]],
) -> tuple[int, float]:
    """`_judge` of object i's kind if it stood in a pose, x, z and yaw, after plan b."""
    table, (x, z, heading), code = task.table, pose, task.table.category[i]
    key = plans.kind_key[b, code] + _pose_key(i, x, z, heading)
    if key in judged:
        return judged[key]
    place, turned, view = plans.position[b], plans.yaw[b], plans.shown[b]
    old_x, old_z, old_yaw, old_view = place[i, 0], place[i, 1], turned[i], view[i]
    place[i, 0], place[i, 1], turned[i] = x, z, heading
    view[i] = sees(task.eyes[0], x, table.elevation[i], z)
    judged[key] = _judge(code, table, task.terms, view, place, turned)
    place[i, 0], place[i, 1], turned[i], view[i] = old_x, old_z, old_yaw, old_view
    return judged[key]


@compiled
def _longer(task: Task, plans: Plans, depth: int, parent: IntArray, step: IntArray) -> Plans:
    """Plans (P,) of those given, each with a step (P, 3) more after `depth`."""
    table, m, eye = task.table, len(task.table.yaw), task.eyes[0]
    longer = Plans(
        plans.ways[parent],
        plans.position[parent],
        plans.yaw[parent],
        plans.shown[parent],
        plans.spent[parent],
        plans.wrong[parent],
        plans.doubt[parent],
        plans.key[parent],
        plans.kind_key[parent],
    )
    for b in range(len(parent)):
        i, j, share = step[b]
        spent, place, yaw, shown = longer.spent[b], longer.position[b], longer.yaw[b], longer.shown[b]
        x, z, heading, metres, radians = target(table, task.terms, task.allowed, spent, i, j, share)
        place[i, 0], place[i, 1], yaw[i] = x, z, heading
        shown[i] = sees(eye, x, table.elevation[i], z)
        spent[0], spent[1] = spent[0] + metres, spent[1] + radians
        longer.ways[b, depth] = step[b]
        longer.key[b] += _step_key(m, i, j, share)
        code = table.category[i]
        longer.kind_key[b, code] += _pose_key(i, x, z, heading)
        longer.wrong[b, code], longer.doubt[b, code] = _judge(code, table, task.terms, shown, place, yaw)
    return longer


@compiled
def _credit(
    worth: FloatArray,
    way: IntArray,
    gain: float,
    least: float,
    table: Table,
    terms: Terms,
    allowed: Allowance,
) -> None:
    """Note what a plan gains: of the step that it begins with, and of others that it could begin with.

    Args:
        worth: (M, M, shares) what is noted.
        way: (n, 3) the plan's steps.
        gain: of the plan.
        least: what it must gain to be tried in another order.
        table: as it stands.
        terms: prices and reaches.
        allowed: what is left of the budget.
    """
    for k in range(len(way)):
        i, j, share = way[k]
        if gain <= worth[i, j, share]:
            continue
        if k == 0 or (gain >= least and _can_begin(table, terms, allowed, way, k)):
            worth[i, j, share] = gain


@compiled
def _can_begin(table: Table, terms: Terms, allowed: Allowance, way: IntArray, k: int) -> bool:
    """Whether a plan comes to the same if its step number k is done first."""
    place, yaw, length = table.position.copy(), table.yaw.copy(), np.empty((len(way), 2))
    spent = np.zeros(2)
    for n in range(len(way)):
        i, j, share = way[n]
        _, _, _, metres, radians = target(table, terms, allowed, spent, i, j, share)
        length[n, 0], length[n, 1] = metres, radians
        spent += length[n]
    spent[:] = 0.0
    for n in range(len(way)):
        step = k if n == 0 else n - 1 if n <= k else n
        i, j, share = way[step]
        x, z, heading, metres, radians = target(table, terms, allowed, spent, i, j, share)
        shortened = abs(metres - length[step, 0]) + abs(radians - length[step, 1]) > ROUNDING
        if shortened or not is_clear(table, terms, place, yaw, i, x, z, heading):
            return False
        place[i, 0], place[i, 1], yaw[i] = x, z, heading
        spent[0], spent[1] = spent[0] + metres, spent[1] + radians
    return True


@compiled
def _judge(
    code: int, table: Table, terms: Terms, seen: BoolArray, position: FloatArray, yaw: FloatArray
) -> tuple[int, float]:
    """How many labels of a kind would be wrong after a snapshot, and the ambiguity of what moves of it."""
    rows = np.flatnonzero(seen & (table.category == code))
    sizes, one_size = np.zeros(len(yaw), dtype=np.int64), np.zeros((1, 3))
    known = known_objects(table.label_position, table.label_yaw, table.category, sizes, one_size)
    model = CostModel(terms.metre, terms.turn, False, True, 1.0)  # Numba knows no defaults
    found = assess_objects(position, yaw, rows, known, model, False)
    wrong, doubt = 0, 0.0
    for j in range(len(yaw)):
        if table.category[j] == code and table.wrong[j]:
            wrong += 1
    for i in rows:
        label, margin = found.label[0, i], found.margin[0, i]
        wrong += int(label != i) - int(table.wrong[label])
        if table.movable[i] and np.isfinite(margin):
            doubt += (1.0 - min(margin / MARGIN_SCALE, 1.0)) / 2
    return wrong, doubt


@compiled
def _among(ways: IntArray, i: int) -> bool:
    return bool(np.any(ways[:, 0] == i))


@compiled
def _step_key(m: int, i: int, j: int, share: int) -> int:
    """What a step of one of m objects adds to the key of a plan."""
    return _mixed((i * m + j) * len(SHARES) + share)


@compiled
def _pose_key(i: int, x: float, z: float, heading: float) -> int:
    """What an object in a pose adds to the key of its kind."""
    place = _mixed(int(x * GRAIN)) ^ _mixed(int(z * GRAIN) + 1)
    return _mixed(place ^ _mixed(int(heading * GRAIN) + i))


@compiled
def _mixed(number: int) -> int:
    """A number whose sums over different sets are hardly ever equal."""
    mixed = np.uint64(number + 1) * np.uint64(0x9E3779B97F4A7C15)
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.int64(mixed ^ (mixed >> np.uint64(31)))  # type: ignore[return-value]
