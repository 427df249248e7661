"""Kernels: what an action means, as `actions` decodes it, and what it does."""

from __future__ import annotations

from math import fabs, inf, pi

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.envs.batched.kinds import ActionKind
from farm_ar.envs.batched.state import Batch, Choices, Scenery, Table, Work
from farm_ar.envs.placement import within
from farm_ar.game_logic.physics import trajectory
from farm_ar.game_logic.physics.state import Limits
from farm_ar.geometry.angles import wrap_angle
from farm_ar.geometry.rectangles import length
from farm_ar.kernels import compiled


@compiled(inline="always")
def in_view(b: int, i: int, batch: Batch) -> bool:
    """Whether the camera of an environment saw an object when the table was last read."""
    return bool(batch.pose[b, i, 3] != 0)


@compiled(inline="always")
def true_yaw(b: int, i: int, batch: Batch, choices: Choices) -> float:
    """How an object is turned; with the game in [-pi, pi)."""
    yaw = -batch.bodies[b, i].angle
    return wrap_angle(yaw) if choices.game else yaw


@compiled(inline="always")
def decode(b: int, action: FloatArray, batch: Batch, choices: Choices, scenery: Scenery, work: Work) -> int:
    """Fill in the moves that an action asks for, before the budget; of objects in view.

    Returns:
        How many; -1 to end the turn.
    """
    n = len(scenery.movable)
    if choices.action == ActionKind.OFFSETS:
        return decode_offsets(b, action, batch, choices, scenery, work)
    if choices.action == ActionKind.CONTINUOUS:
        if not decode_continuous(b, action, batch, choices, scenery, work):
            return -1
    elif choices.action == ActionKind.DISPLACEMENT:
        if int(action[0]) == n:
            return -1
        work.asked[0] = batch.number[b, int(action[0])]
        for axis in range(2):
            work.shift[0, axis] = choices.reach_m * scenery.levels[int(action[1 + axis])]
        work.turn[0] = choices.reach_rad * scenery.levels[int(action[3])]
    else:
        return decode_choice(b, action, batch, choices, scenery, work)
    return 1 if in_view(b, work.asked[0], batch) else 0


@compiled(inline="always")
def decode_choice(
    b: int, action: FloatArray, batch: Batch, choices: Choices, scenery: Scenery, work: Work
) -> int:
    """An object, a label of its kind and a share: `slot`, or as one number `discrete`."""
    n, shares = len(scenery.movable), len(scenery.shares)
    which, slot, share = int(action[0]), 0, 0
    if choices.action == ActionKind.SLOT:
        if which < n:
            slot, share = int(action[1]), int(action[2])
    else:
        slot, share = which // shares % choices.most_alike, which % shares
        which = which // (shares * choices.most_alike)
    if which == n:
        return 0 if choices.action == ActionKind.EXCHANGE else -1
    i = batch.number[b, which]
    j, count = label_of(b, i, slot, batch, scenery), 0
    if in_view(b, i, batch):
        towards(b, count, i, j, scenery.shares[share], batch, choices, work)
        count += 1
    if choices.action == ActionKind.EXCHANGE and i != j and in_view(b, j, batch):
        towards(b, count, j, i, scenery.shares[share], batch, choices, work)
        count += 1
    return count


@compiled(inline="always")
def alike(b: int, i: int, batch: Batch, scenery: Scenery) -> tuple[int, int]:
    """Of the movable objects in the agent's order, the first of an object's kind, and how many there are."""
    first, count = 0, 0
    for k in range(len(scenery.movable)):
        if batch.kind[b, k] == scenery.kind[i]:
            if count == 0:
                first = k
            count += 1
    return first, count


@compiled(inline="always")
def label_of(b: int, i: int, slot: int, batch: Batch, scenery: Scenery) -> int:
    """The j-th label of an object's kind in the agent's order; after the last comes the first again."""
    first, count = alike(b, i, batch, scenery)
    return int(batch.number[b, first + slot % count])


@compiled(inline="always")
def towards(
    b: int, row: int, i: int, j: int, share: float, batch: Batch, choices: Choices, work: Work
) -> None:
    """Ask for an object to go a share of the way and turn to where a label is believed to be."""
    body = batch.bodies[b, i]
    work.asked[row] = i
    work.shift[row, 0] = share * (batch.believed[b, j, 0] - body.x)
    work.shift[row, 1] = share * (batch.believed[b, j, 1] - body.z)
    work.turn[row] = share * wrap_angle(batch.facing[b, j] - true_yaw(b, i, batch, choices))


@compiled(inline="always")
def decode_continuous(
    b: int, action: FloatArray, batch: Batch, choices: Choices, scenery: Scenery, work: Work
) -> bool:
    """Pick what is nearest to a point, as `ContinuousAction` has it; whether anything is near enough."""
    x = (within(action[0], -1.0, 1.0) + 1) / 2 * choices.width
    z = (within(action[1], -1.0, 1.0) + 1) / 2 * choices.depth
    least = inf
    for k in range(len(scenery.movable)):
        i = batch.number[b, k]
        if in_view(b, i, batch):
            away = length(batch.bodies[b, i].x - x, batch.bodies[b, i].z - z)
            if away < least:
                work.asked[0], least = i, away
    if not least <= choices.pick_m:
        return False
    work.shift[0, 0] = choices.reach_m * within(action[2], -1.0, 1.0)
    work.shift[0, 1] = choices.reach_m * within(action[3], -1.0, 1.0)
    work.turn[0] = choices.reach_rad * within(action[4], -1.0, 1.0)
    return True


@compiled(inline="always")
def decode_offsets(
    b: int, action: FloatArray, batch: Batch, choices: Choices, scenery: Scenery, work: Work
) -> int:
    """An offset for every object, as `OffsetsAction` has it."""
    count = 0
    for k in range(len(scenery.movable)):
        i = batch.number[b, k]
        x, z, turn = action[3 * k], action[3 * k + 1], action[3 * k + 2]
        if (x != 0 or z != 0 or turn != 0) and in_view(b, i, batch):
            work.asked[count] = i
            work.shift[count, 0] = choices.reach_m * within(x, -1.0, 1.0)
            work.shift[count, 1] = choices.reach_m * within(z, -1.0, 1.0)
            work.turn[count] = choices.reach_rad * within(turn, -1.0, 1.0)
            count += 1
    return count


@compiled(inline="always")
def share_of(left: float, asked: float) -> float:
    """What share of what is asked for there is."""
    return left / asked if asked > left else 1.0


@compiled(inline="always")
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


@compiled(inline="always")
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


@compiled(inline="always")
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


@compiled(inline="always")
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


@compiled(inline="always")
def spend(table: Table, choices: Choices, metres: float, radians: float) -> None:
    """Take off what was executed."""
    if choices.by_effort:
        table.effort = max(table.effort - (metres / choices.diagonal_m + radians / pi), 0.0)
    else:
        table.metres = max(table.metres - metres, 0.0)
        table.radians = max(table.radians - radians, 0.0)


@compiled(inline="always")
def fill_mask(b: int, batch: Batch, choices: Choices, scenery: Scenery, work: Work, mask: BoolArray) -> None:
    """Which choices make sense, as the discrete actions' `mask` has it."""
    n, shares = len(scenery.movable), len(scenery.shares)
    for k in range(n):
        work.seen[k] = in_view(b, batch.number[b, k], batch)
    mask[:] = True
    if choices.action not in (ActionKind.DISCRETE, ActionKind.EXCHANGE):
        for k in range(n):
            mask[k] = work.seen[k]
        return
    for k in range(n):
        i = batch.number[b, k]
        first, count = alike(b, i, batch, scenery)
        for slot in range(choices.most_alike):
            useful = work.seen[k] and slot < count
            other = first + slot
            if useful and choices.action == ActionKind.EXCHANGE:
                useful = other != k and (k < other or not work.seen[other])
            elif useful:
                j, body = batch.number[b, other], batch.bodies[b, i]
                there = batch.believed[b, j, 0] == body.x and batch.believed[b, j, 1] == body.z
                useful = not (there and batch.facing[b, j] == true_yaw(b, i, batch, choices))
            for share in range(shares):
                mask[(k * choices.most_alike + slot) * shares + share] = useful
