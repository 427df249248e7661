"""The attack that looks for most wrong labels: plans of many objects' moves, found by a beam search."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.agents.attacks.base import Attack, QueryOracle
from farm_ar.agents.attacks.cost_model import model_of, worth_of
from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry import wrap

SHARES = (0.52, 0.6, 0.8, 1.0)
"""How much of the way to a label's place an object may go."""

ASIDE = (-1.0, 0.0, 1.0)
"""By how many own widths it may stand beside that way, so that two can pass."""

BEAM = 24
"""Unfinished plans that are kept."""

AMBIGUITY_SHARE = 0.5
"""Weight of an object on the verge of being misread, a wrong label being 1, while a plan is unfinished."""

DISTANCE_SHARE = 0.5
"""What a unit of distance takes from that."""

CARRIED_ON = (1.0, 1.05, 1.15, 1.3)
"""How far a plan is carried on, for methods that need more than the paper's."""

DRAWN_BACK = 8
"""Shorter ways in a batch of queries, while a plan is made cheaper."""

BATCH = 32
"""Further steps in a batch of queries."""

STALE = 4
"""After how many fruitless batches the search ends."""


class Steps(NamedTuple):
    """What an object may do: S objects and the (S, 2) and (S,) poses that they may take."""

    mover: IntArray
    position: FloatArray
    yaw: FloatArray


class Plans(NamedTuple):
    """B unfinished plans: (B, N, 2) and (B, N) poses, (B, N) who has moved."""

    position: FloatArray
    yaw: FloatArray
    done: BoolArray

    def at(self, rows: IntArray | slice) -> Plans:
        """Those of some rows."""
        return Plans(self.position[rows], self.yaw[rows], self.done[rows])


class Planned(Attack):
    """Plan for most wrong labels by the paper's cost, ask, add to the worst failure, make it cheaper.

    Objects go some of the way to the places of other labels of their kind (T3, T5), one after the other, the
    most promising plans of each length being kept. Planning is arithmetic and needs no queries.
    """

    def __call__(self, oracle: QueryOracle, rng: np.random.Generator) -> None:
        """See `Attack`."""
        layout, steps = oracle.case.layout, steps_of(oracle)
        if not len(steps.mover):
            return
        plans = planned_for_most(oracle, steps)
        if len(plans.yaw):
            number = max(oracle.left // (2 * len(CARRIED_ON)), 1)
            for scale in CARRIED_ON:
                position = layout.position + scale * (plans.position[:number] - layout.position)
                oracle.query(position, layout.yaw + scale * (plans.yaw[:number] - layout.yaw))
        add_to_worst(oracle, steps, rng)
        cheapen_worst(oracle, rng)


def steps_of(oracle: QueryOracle) -> Steps:
    """The steps of all movable objects in view."""
    case, layout, model = oracle.case, oracle.case.layout, model_of(oracle)
    code, pairs = layout.category_code, []
    for i in np.flatnonzero(case.in_view & layout.movable):
        like = code == code[i] if model.categories_apart else np.ones(len(code), dtype=bool)
        like[i] = False
        pairs += [(i, j) for j in np.flatnonzero(like)]
    mover, label = np.array(pairs, dtype=np.int64).reshape(-1, 2).repeat(len(SHARES) * len(ASIDE), axis=0).T
    share = np.tile(np.repeat(SHARES, len(ASIDE)), len(pairs))
    aside = np.tile(ASIDE, len(pairs) * len(SHARES))
    way = layout.position[label] - layout.position[mover]
    length = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    across = np.stack([way[:, 1], -way[:, 0]], axis=1) / length * layout.size[mover, :1]
    return Steps(
        mover,
        layout.position[mover] + share[:, None] * way + aside[:, None] * across,
        layout.yaw[mover] + share * wrap(layout.yaw[label] - layout.yaw[mover]),
    )


def planned_for_most(oracle: QueryOracle, steps: Steps) -> Plans:
    """Plans of all lengths, by the paper's cost those with most wrong labels first; of these the cheapest."""
    layout = oracle.case.layout
    untouched = np.zeros((1, len(layout)), dtype=bool)
    plans = Plans(layout.position[None], layout.yaw[None], untouched)
    met: list[tuple[Plans, FloatArray]] = []
    for _ in range(len(np.unique(steps.mover))):
        plans = _grown(oracle, plans, steps)
        if not len(plans.yaw):
            break
        wrong, ambiguity = worth_of(oracle, plans.position, plans.yaw)
        promise = (
            wrong + AMBIGUITY_SHARE * ambiguity - DISTANCE_SHARE * oracle.distance(plans.position, plans.yaw)
        )
        best = np.argsort(-promise, kind="stable")[:BEAM]
        plans = plans.at(best)
        met.append((plans, wrong[best]))
    if not met:
        return plans.at(slice(0))
    every = Plans(
        np.concatenate([plans.position for plans, _ in met]),
        np.concatenate([plans.yaw for plans, _ in met]),
        np.concatenate([plans.done for plans, _ in met]),
    )
    wrong = np.concatenate([wrong for _, wrong in met])
    order = np.lexsort((oracle.distance(every.position, every.yaw), -wrong))
    return every.at(order)


def add_to_worst(oracle: QueryOracle, steps: Steps, rng: np.random.Generator) -> None:
    """Add steps to the failure with most wrong labels while the re-identifier's own answers say it helps."""
    layout, stale = oracle.case.layout, 0
    while oracle.left > 0 and stale < STALE:
        before = oracle.worst
        start = layout if before is None else before
        chosen = rng.integers(len(steps.mover), size=BATCH)
        each, mover = np.arange(BATCH), steps.mover[chosen]
        position = np.repeat(start.position[None], BATCH, axis=0)
        yaw = np.repeat(start.yaw[None], BATCH, axis=0)
        position[each, mover], yaw[each, mover] = steps.position[chosen], steps.yaw[chosen]
        oracle.query(position, yaw)
        stale = 0 if oracle.worst is not before else stale + 1


def cheapen_worst(oracle: QueryOracle, rng: np.random.Generator) -> None:
    """Draw the objects of the failure with most wrong labels back, one by one, while as many stay wrong."""
    layout, stale = oracle.case.layout, 0
    while oracle.left > 0 and stale < 2:
        before = oracle.worst
        if before is None:
            return
        moved = np.any(before.position != layout.position, axis=1) | (before.yaw != layout.yaw)
        for i in rng.permutation(np.flatnonzero(moved)):
            found = oracle.worst
            assert found is not None
            share = (np.arange(DRAWN_BACK) + rng.random(DRAWN_BACK)) / DRAWN_BACK
            share[0] = 0.0
            position = np.repeat(found.position[None], DRAWN_BACK, axis=0)
            yaw = np.repeat(found.yaw[None], DRAWN_BACK, axis=0)
            position[:, i] = layout.position[i] + share[:, None] * (found.position[i] - layout.position[i])
            yaw[:, i] = layout.yaw[i] + share * (found.yaw[i] - layout.yaw[i])
            oracle.query(position, yaw)
        stale = 0 if oracle.worst is not before else stale + 1


def _grown(oracle: QueryOracle, plans: Plans, steps: Steps) -> Plans:
    """Every plan with one more object moved in every way that is allowed, each set of poses once."""
    which, step = np.nonzero(~plans.done[:, steps.mover])
    position, yaw, done = plans.position[which], plans.yaw[which], plans.done[which]
    each, mover = np.arange(len(which)), steps.mover[step]
    position[each, mover], yaw[each, mover] = steps.position[step], steps.yaw[step]
    done[each, mover] = True
    _, first = np.unique(_sum_of(position, yaw), return_index=True)
    kept = np.sort(first)
    kept = kept[oracle.allowed(position[kept], yaw[kept])]
    return Plans(position[kept], yaw[kept], done[kept])


def _sum_of(position: FloatArray, yaw: FloatArray) -> FloatArray:
    """(B,) a number that differs between different poses (but for one chance in a great many)."""
    number = np.arange(yaw.shape[1], dtype=np.float64)
    x, z, turn = (np.sqrt(number + part) for part in (0.1, 0.2, 0.3))
    total: FloatArray = (position[..., 0] * x + position[..., 1] * z + yaw * turn).sum(axis=1)
    return total
