"""Kernels: the reward of a step, as `rewards.Reward` has it."""

from __future__ import annotations

import numpy as np

from farm_ar.envs.batched.actions import true_yaw
from farm_ar.envs.batched.kinds import RewardKind
from farm_ar.envs.batched.numpy_functions import numpy_sum
from farm_ar.envs.batched.state import Batch, Choices, Herds, Report, Scenery, Table
from farm_ar.envs.features import MARGIN_SCALE
from farm_ar.envs.placement import within
from farm_ar.envs.rewards import MARGIN_SHARE
from farm_ar.geometry.rectangles import length
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import assess_objects, known_objects


@compiled(inline="always")
def measure(b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds) -> float:
    """The first number whose rise is paid for."""
    if choices.reward == RewardKind.MISCOUNT:
        return float(herds.clocks[b].astray)
    if choices.reward == RewardKind.ENDPOINT:
        error = np.empty(len(scenery.kind))
        for i in range(len(error)):
            body = batch.bodies[b, i]
            error[i] = length(batch.believed[b, i, 0] - body.x, batch.believed[b, i, 1] - body.z)
        return numpy_sum(error) / choices.diagonal_m
    return float(batch.tables[b].wrong)


@compiled
def clutter(b: int, batch: Batch, choices: Choices, scenery: Scenery) -> float:
    """What `rewards.clutter` measures."""
    n = len(scenery.movable)
    position, yaw, kind = np.empty((n, 2)), np.empty(n), np.empty(n, dtype=np.int64)
    sides, size_of = np.empty((n, 3)), np.arange(n)
    for k in range(n):
        i = batch.number[b, k]
        position[k, 0], position[k, 1] = batch.bodies[b, i].x, batch.bodies[b, i].z
        yaw[k], kind[k] = true_yaw(b, i, batch, choices), scenery.kind[i]
        for axis in range(3):
            sides[k, axis] = scenery.log_sides[i, axis]
    known = known_objects(position.copy(), yaw.copy(), kind, size_of, sides)
    answer = assess_objects(position, yaw, np.arange(n), known, scenery.clutter_model, False)
    share = np.empty(n)
    for k in range(n):
        margin = answer.margin[0, k]
        share[k] = margin if margin != margin else 1 - within(margin / MARGIN_SCALE, 0.0, 1.0)
    return numpy_sum(share) / 2


@compiled(inline="always")
def foresight(table: Table, choices: Choices) -> float:
    """What the reward predicts of the snapshot to come."""
    return table.ambiguity if choices.reward == RewardKind.MARGIN else table.expected_wrong


@compiled(inline="always")
def begin_step(b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds) -> None:
    """Measure what is paid for, before."""
    table = batch.tables[b]
    table.before[0] = measure(b, batch, choices, scenery, herds)
    table.before[1] = 0.0
    if choices.reward in (RewardKind.MARGIN, RewardKind.SHAPED):
        table.before[1] = foresight(table, choices)
    elif choices.reward == RewardKind.CLUTTER:
        table.before[1] = clutter(b, batch, choices, scenery)


@compiled(inline="always")
def paid(b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, report: Report) -> float:
    """Fill in the terms of the reward, and add them up, as `Reward.paid` does."""
    table = batch.tables[b]
    now = measure(b, batch, choices, scenery, herds)
    report.terms[0] = choices.sign * (now - table.before[0]) if now != table.before[0] else 0.0
    report.terms[1] = 0.0
    if choices.reward in (RewardKind.MARGIN, RewardKind.CLUTTER, RewardKind.SHAPED):
        now = clutter(b, batch, choices, scenery) if choices.reward == RewardKind.CLUTTER else table.foreseen
        if now != table.before[1]:
            scale = 1.0 if choices.reward == RewardKind.SHAPED else MARGIN_SHARE
            report.terms[1] = choices.sign * scale * (now - table.before[1])
    report.effort_cost = -choices.effort_weight * table.moved if table.moved != 0 else 0.0
    total = float(report.terms[0])
    if choices.reward in (RewardKind.MARGIN, RewardKind.CLUTTER, RewardKind.SHAPED):
        total += report.terms[1]
    return total + report.effort_cost
