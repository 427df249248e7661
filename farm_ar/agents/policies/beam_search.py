"""The beam search for plans of visits, compiled: which object goes how far towards which label's place."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.policies.plan_steps import SHARES, Allowance, Table, Terms, is_clear, target
from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.features import MARGIN_SCALE
from farm_ar.geometry.camera import Eye, sees
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import Rule, assess_objects, known_objects
from farm_ar.structs import Structs

AMBIGUITY_SHARE = 0.5
"""What a unit of ambiguity is worth beside a wrong label while a plan is unfinished."""

SLACK = 0.05
"""By how much less than the best one a plan may gain, if its steps are to be tried in another order."""

ROUNDING = 1e-9
"""Metres and radians that make no difference."""

GRAIN = 1e6
"""Poses are told apart to one part in so many of a metre or a radian."""


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
    m, kinds, eye = len(table.yaw), table.category.max() + 1, eyes[0]
    seen = np.empty(m, dtype=np.bool_)
    for i in range(m):
        seen[i] = sees(eye, table.position[i, 0], table.elevation[i], table.position[i, 1])
    pick = seen.copy()
    ways = np.zeros((beam, allowed.moves, 3), dtype=np.int64)
    position, yaw = np.empty((beam, m, 2)), np.empty((beam, m))
    shown, spent = np.empty((beam, m), dtype=np.bool_), np.zeros((beam, 2))
    wrong, doubt = np.empty((beam, kinds), dtype=np.int64), np.empty((beam, kinds))
    keys, kind_keys = np.zeros(beam, dtype=np.int64), np.zeros((beam, kinds), dtype=np.int64)
    judged = {0: (0, 0.0)}
    position[0], yaw[0], shown[0] = table.position, table.yaw, seen
    for code in range(kinds):
        wrong[0, code], doubt[0, code] = _judge(code, table, terms, seen, table.position, table.yaw)
    before, count = wrong[0].sum(), 1
    worth[:] = -np.inf
    best, length = 0.0, 0
    most = beam * m * m * len(SHARES)
    node, pace, gain, promise = (
        np.empty(most, dtype=np.int64),
        np.empty((most, 3), dtype=np.int64),
        np.empty(most),
        np.empty(most),
    )
    for depth in range(allowed.moves):
        found, known = 0, {np.int64(0)}
        for b in range(count):
            place, turned, view = position[b], yaw[b], shown[b]
            for i in range(m):
                if not (table.movable[i] and pick[i]) or _among(ways[b, :depth], i):
                    continue
                code = table.category[i]
                for j in range(m):
                    if j == i or table.category[j] != code or not table.movable[j]:
                        continue
                    for share in range(len(SHARES)):
                        key = keys[b] + _mixed((i * m + j) * len(SHARES) + share)
                        if key in known:
                            continue
                        x, z, heading, metres, radians = target(table, terms, allowed, spent[b], i, j, share)
                        if metres + radians <= 0.0 or not is_clear(
                            table, terms, place, turned, i, x, z, heading
                        ):
                            continue
                        known.add(key)
                        old_x, old_z, old_yaw, old_view = place[i, 0], place[i, 1], turned[i], view[i]
                        place[i, 0], place[i, 1], turned[i] = x, z, heading
                        view[i] = sees(eye, x, table.elevation[i], z)
                        kind_key = kind_keys[b, code] + _posed(i, x, z, heading)
                        if kind_key in judged:
                            fooled, unsure = judged[kind_key]
                        else:
                            fooled, unsure = _judge(code, table, terms, view, place, turned)
                            judged[kind_key] = (fooled, unsure)
                        place[i, 0], place[i, 1], turned[i], view[i] = old_x, old_z, old_yaw, old_view
                        price = terms.effort_metre * (spent[b, 0] + metres)
                        price += terms.effort_radian * (spent[b, 1] + radians)
                        gain[found] = wrong[b].sum() - wrong[b, code] + fooled - before - price
                        ambiguity = doubt[b].sum() - doubt[b, code] + unsure
                        promise[found] = gain[found] + AMBIGUITY_SHARE * ambiguity
                        pace[found, 0], pace[found, 1], pace[found, 2] = i, j, share
                        ways[b, depth] = pace[found]
                        _credit(worth, ways[b, : depth + 1], gain[found], best - SLACK, table, terms, allowed)
                        node[found] = b
                        found += 1
        if found == 0:
            break
        top = np.argmax(gain[:found])
        if gain[top] > best:
            best, length = gain[top], depth + 1
            steps[:depth], steps[depth] = ways[node[top], :depth], pace[top]
        kept = np.argsort(-promise[:found], kind="mergesort")[:beam]
        parent = node[kept]
        ways, position, yaw, shown = ways[parent], position[parent], yaw[parent], shown[parent]
        spent, wrong, doubt, keys = spent[parent], wrong[parent], doubt[parent], keys[parent]
        kind_keys = kind_keys[parent]
        count = len(kept)
        for b in range(count):
            i, j, share = pace[kept[b]]
            x, z, heading, metres, radians = target(table, terms, allowed, spent[b], i, j, share)
            key = _mixed((i * m + j) * len(SHARES) + share)
            ways[b, depth], keys[b] = pace[kept[b]], keys[b] + key
            position[b, i, 0], position[b, i, 1], yaw[b, i] = x, z, heading
            shown[b, i] = sees(eye, x, table.elevation[i], z)
            spent[b, 0], spent[b, 1] = spent[b, 0] + metres, spent[b, 1] + radians
            code = table.category[i]
            kind_keys[b, code] += _posed(i, x, z, heading)
            wrong[b, code], doubt[b, code] = _judge(code, table, terms, shown[b], position[b], yaw[b])
    return length


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
    rule = Rule(terms.metre, terms.turn, False, True, 1.0)  # Numba knows no defaults
    found = assess_objects(position, yaw, rows, known, rule, False)
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
def _posed(i: int, x: float, z: float, heading: float) -> int:
    """Likewise for an object in a pose."""
    place = _mixed(int(x * GRAIN)) ^ _mixed(int(z * GRAIN) + 1)
    return _mixed(place ^ _mixed(int(heading * GRAIN) + i))


@compiled
def _mixed(number: int) -> int:
    """A number whose sums over sets of steps are hardly ever equal for different sets."""
    mixed = np.uint64(number + 1) * np.uint64(0x9E3779B97F4A7C15)
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.int64(mixed ^ (mixed >> np.uint64(31)))  # type: ignore[return-value]
