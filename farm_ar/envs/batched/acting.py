"""Kernels: what an action means, as `actions` decodes it, and what it does."""

from __future__ import annotations

from math import fabs, inf, pi

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.envs.batched.state import (
    CONTINUOUS,
    DISPLACEMENT,
    OFFSETS,
    Batch,
    Choices,
    Scenery,
    Table,
    Work,
)
from farm_ar.envs.placement import within
from farm_ar.game_logic.physics import chipmunk, trajectory
from farm_ar.game_logic.physics.state import Limits
from farm_ar.geometry.angles import wrap_angle
from farm_ar.geometry.camera import sees
from farm_ar.geometry.rectangles import length


@chipmunk.compiled
def in_view(b: int, i: int, batch: Batch, scenery: Scenery) -> bool:
    """Whether the camera of an environment sees an object."""
    body = batch.bodies[b, i]
    return sees(batch.eyes[b], body.x, scenery.elevation[i], body.z)


@chipmunk.compiled
def true_yaw(b: int, i: int, batch: Batch, choices: Choices) -> float:
    """How an object is turned; with the game in [-pi, pi)."""
    yaw = -batch.bodies[b, i].angle
    return wrap_angle(yaw) if choices.game else yaw


@chipmunk.compiled
def decode(b: int, action: FloatArray, batch: Batch, choices: Choices, scenery: Scenery, work: Work) -> int:
    """Fill in the moves that an action asks for, before the budget; of things in view.

    Returns:
        How many; -1 to end the turn.
    """
    n = len(scenery.movable)
    if choices.action == OFFSETS:
        return decode_offsets(b, action, batch, choices, scenery, work)
    work.asked[0] = -1
    if choices.action == CONTINUOUS:
        if not decode_continuous(b, action, batch, choices, scenery, work):
            return -1
    else:
        which = int(action[0])
        if which == n:
            return -1
        work.asked[0] = batch.number[b, which]
        if choices.action == DISPLACEMENT:
            for axis in range(2):
                work.shift[0, axis] = choices.reach_m * scenery.levels[int(action[1 + axis])]
            work.turn[0] = choices.reach_rad * scenery.levels[int(action[3])]
        else:
            decode_slot(b, int(action[1]), scenery.shares[int(action[2])], batch, choices, scenery, work)
    return 1 if in_view(b, work.asked[0], batch, scenery) else 0


@chipmunk.compiled
def decode_slot(
    b: int, slot: int, share: float, batch: Batch, choices: Choices, scenery: Scenery, work: Work
) -> None:
    """Towards the believed place of the j-th label of the object's kind, as `SlotAction` has it."""
    i, count = work.asked[0], 0
    for k in range(len(scenery.movable)):
        if batch.kind[b, k] == scenery.kind[i]:
            count += 1
    left = slot % count
    for k in range(len(scenery.movable)):
        if batch.kind[b, k] == scenery.kind[i]:
            if left == 0:
                j = batch.number[b, k]
                body = batch.bodies[b, i]
                work.shift[0, 0] = share * (batch.believed[b, j, 0] - body.x)
                work.shift[0, 1] = share * (batch.believed[b, j, 1] - body.z)
                turn = wrap_angle(batch.facing[b, j] - true_yaw(b, i, batch, choices))
                work.turn[0] = share * turn
                return
            left -= 1


@chipmunk.compiled
def decode_continuous(
    b: int, action: FloatArray, batch: Batch, choices: Choices, scenery: Scenery, work: Work
) -> bool:
    """Pick what is nearest to a point, as `ContinuousAction` has it; whether anything is near enough."""
    x = (within(action[0], -1.0, 1.0) + 1) / 2 * choices.width
    z = (within(action[1], -1.0, 1.0) + 1) / 2 * choices.depth
    least = inf
    for k in range(len(scenery.movable)):
        i = batch.number[b, k]
        if in_view(b, i, batch, scenery):
            away = length(batch.bodies[b, i].x - x, batch.bodies[b, i].z - z)
            if away < least:
                work.asked[0], least = i, away
    if not least <= choices.pick_m:
        return False
    work.shift[0, 0] = choices.reach_m * within(action[2], -1.0, 1.0)
    work.shift[0, 1] = choices.reach_m * within(action[3], -1.0, 1.0)
    work.turn[0] = choices.reach_rad * within(action[4], -1.0, 1.0)
    return True


@chipmunk.compiled
def decode_offsets(
    b: int, action: FloatArray, batch: Batch, choices: Choices, scenery: Scenery, work: Work
) -> int:
    """An offset for every object, as `OffsetsAction` has it."""
    count = 0
    for k in range(len(scenery.movable)):
        i = batch.number[b, k]
        x, z, turn = action[3 * k], action[3 * k + 1], action[3 * k + 2]
        if (x != 0 or z != 0 or turn != 0) and in_view(b, i, batch, scenery):
            work.asked[count] = i
            work.shift[count, 0] = choices.reach_m * within(x, -1.0, 1.0)
            work.shift[count, 1] = choices.reach_m * within(z, -1.0, 1.0)
            work.turn[count] = choices.reach_rad * within(turn, -1.0, 1.0)
            count += 1
    return count


@chipmunk.compiled
def share_of(left: float, asked: float) -> float:
    """What share of what is asked for there is."""
    return left / asked if asked > left else 1.0


@chipmunk.compiled
def fit(first: int, end: int, table: Table, choices: Choices, work: Work) -> None:
    """Scale moves down together as far as the budget needs it, as `Budget.fitted` does."""
    metres, radians = 0.0, 0.0
    for k in range(first, end):
        metres += length(work.shift[k, 0], work.shift[k, 1])
        radians += fabs(work.turn[k])
    if choices.by_effort:
        by_way = by_turn = share_of(table.effort, metres / choices.diagonal_m + radians / pi)
    else:
        by_way, by_turn = share_of(table.metres, metres), share_of(table.radians, radians)
    for k in range(first, end):
        work.shift[k, 0], work.shift[k, 1] = by_way * work.shift[k, 0], by_way * work.shift[k, 1]
        work.turn[k] = by_turn * work.turn[k]


@chipmunk.compiled
def set_limits(limits: Limits, table: Table, choices: Choices, metres: float, radians: float) -> None:
    """What is left of the budget, from so many metres and radians on, as `MotionLimit.begin` does."""
    limits.metres = limits.radians = limits.effort = inf
    limits.scene_diagonal = 1.0
    if choices.by_effort:
        limits.effort, limits.scene_diagonal = table.effort, choices.diagonal_m
    else:
        limits.metres, limits.radians = table.metres, table.radians
    limits.began_metres, limits.began_radians = metres, radians
    limits.braking, limits.halted = 0, False


@chipmunk.compiled
def set_pose(
    b: int, i: int, x: float, z: float, turn: float, batch: Batch, choices: Choices
) -> tuple[float, float]:
    """Move an object of a plain scene within the room, as `PlainScene.move` does; metres and radians."""
    body = batch.bodies[b, i]
    before_x, before_z = body.x, body.z
    body.x = within(before_x + x, 0.0, choices.width)
    body.z = within(before_z + z, 0.0, choices.depth)
    body.angle = -(-body.angle + turn)
    return length(body.x - before_x, body.z - before_z), fabs(wrap_angle(turn))


@chipmunk.compiled
def act(
    b: int,
    action: FloatArray,
    batch: Batch,
    choices: Choices,
    scenery: Scenery,
    work: Work,
) -> bool:
    """Carry out an action, as `MoveControl.act` does.

    Returns:
        Whether the visit is over.
    """
    table, states, bodies = batch.tables[b], batch.states[b : b + 1], batch.bodies[b]
    count = decode(b, action, batch, choices, scenery, work)
    metres, radians = 0.0, 0.0
    if count > 0:
        fit(0, count, table, choices, work)
    for k in range(count):
        fit(k, k + 1, table, choices, work)
        i, x, z, turn = work.asked[k], work.shift[k, 0], work.shift[k, 1], work.turn[k]
        if x == 0 and z == 0 and turn == 0:
            continue
        if choices.game:
            state, body, yaw = states[0], bodies[i], true_yaw(b, i, batch, choices)
            before_m, before_r = state.metres, state.radians
            set_limits(work.limits[0], table, choices, before_m, before_r)
            turn = wrap_angle((yaw + turn) - yaw)
            trajectory.lift_over(
                states, bodies, work.limits, i, body.x + x, body.z + z, turn, trajectory.CARRY_SPEED
            )
            way, turned = state.metres - before_m, state.radians - before_r
        else:
            way, turned = set_pose(b, i, x, z, turn, batch, choices)
        spend(table, choices, way, turned)
        metres, radians = metres + way, radians + turned
    table.moved = metres / choices.diagonal_m + radians / pi
    table.moves_left -= 1
    return count < 0 or table.moves_left == 0


@chipmunk.compiled
def spend(table: Table, choices: Choices, metres: float, radians: float) -> None:
    """Take off what was executed."""
    if choices.by_effort:
        table.effort = max(table.effort - (metres / choices.diagonal_m + radians / pi), 0.0)
    else:
        table.metres = max(table.metres - metres, 0.0)
        table.radians = max(table.radians - radians, 0.0)


@chipmunk.compiled
def fill_mask(b: int, batch: Batch, scenery: Scenery, mask: np.ndarray) -> None:
    """Which choices make sense, as the discrete actions' `mask` has it."""
    n = len(scenery.movable)
    for k in range(len(mask)):
        mask[k] = k >= n or in_view(b, batch.number[b, k], batch, scenery)
