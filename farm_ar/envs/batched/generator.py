"""Kernels: how episodes and visits begin, as `generator` draws them."""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.batched import streams
from farm_ar.envs.batched.kinds import Draw
from farm_ar.envs.batched.numpy_functions import arctan2
from farm_ar.envs.batched.state import Batch, Choices, Given, Herds, Scenery, Table, Work
from farm_ar.envs.batched.streams import Stream
from farm_ar.envs.generator import RESTARTS, TRIES
from farm_ar.envs.placement import Clearance, Placement, Strewing, strew
from farm_ar.envs.table import Objects, introduce, line_up
from farm_ar.game_logic.animals.routes import PATH_SPREAD_M
from farm_ar.geometry.angles import wrap_angle
from farm_ar.geometry.camera import Eye
from farm_ar.kernels import compiled

_FEW_TRIES = 6
"""So many numbers are kept of the `TRIES` that are drawn: they nearly always do."""


@compiled
def aim(eye: Eye, yaw: float) -> None:
    """Turn a camera, as `visibility.eyes_of` does."""
    eye.yaw = yaw
    eye.sine, eye.cosine = sin(yaw), cos(yaw)
    eye.left_sine, eye.left_cosine = sin(yaw - eye.left), cos(yaw - eye.left)
    eye.right_sine, eye.right_cosine = sin(yaw + eye.right), cos(yaw + eye.right)


@compiled
def draw_numbers(stream: Stream, numbers: FloatArray, anywhere: bool) -> None:
    """Draw (K, TRIES, 3) numbers, and fill in the first (K, T, 3)."""
    if not anywhere:
        streams.draw_normals(stream, numbers, TRIES)
        return
    for k in range(len(numbers)):
        for t in range(TRIES):
            for axis in range(3):
                drawn = streams.uniform(stream)
                if t < numbers.shape[1]:
                    numbers[k, t, axis] = drawn


@compiled
def draw_layout(stream: Stream, choices: Choices, scenery: Scenery, work: Work) -> None:
    """Fill in positions and yaws of a starting layout, as `StartingLayouts.draw` does."""
    few = np.empty((len(scenery.movable), _FEW_TRIES, 3))
    anywhere = choices.layouts == Draw.ANYWHERE
    again = work.streams[0]
    for restart in range(RESTARTS):
        turns = scenery.movable.copy()
        streams.shuffle(stream, turns)
        apart = choices.apart_m * 0.9 ** (restart // 10) if anywhere else 0.0
        room = Clearance(scenery.size, scenery.keeps_clear, choices.gap_m, apart)
        keep(stream, again)
        draw_numbers(stream, few, anywhere)
        if place(turns, few, choices, room, scenery, work):
            return
        keep(again, stream)
        many = np.empty((len(turns), TRIES, 3))
        draw_numbers(stream, many, anywhere)
        if place(turns, many, choices, room, scenery, work):
            return
    work.position[:], work.yaw[:] = scenery.position, scenery.yaw


@compiled
def keep(stream: Stream, other: Stream) -> None:
    """Have another stream stand where a stream stands."""
    other.high, other.low = stream.high, stream.low
    other.step_high, other.step_low = stream.step_high, stream.step_low
    other.kept, other.half = stream.kept, stream.half


@compiled
def place(
    turns: IntArray, drawn: FloatArray, choices: Choices, room: Clearance, scenery: Scenery, work: Work
) -> bool:
    """Place objects one after the other, from the scene's own layout on."""
    work.position[:], work.yaw[:] = scenery.position, scenery.yaw
    how = Strewing(
        choices.layouts == Draw.ANYWHERE,
        scenery.position,
        scenery.yaw,
        scenery.edge,
        scenery.room,
        (choices.spread_m, choices.spread_rad),
        choices.yaw_limit,
    )
    return strew(turns, drawn, how, Placement(work.position, work.yaw, scenery.fixed.copy()), room)


@compiled
def draw_camera(stream: Stream, eye: Eye, choices: Choices, scenery: Scenery, work: Work) -> None:
    """Aim a camera that is like all others anew, as `VisitCameras.draw` does."""
    if choices.cameras == Draw.ON_PATH:
        k = streams.below(stream, len(scenery.path))
        eye.x, eye.z = scenery.path[k, 0], scenery.path[k, 1]
        aim(eye, scenery.path[k, 2])
        return
    width, depth = choices.width, choices.depth
    x = width * between(stream, 0.25, 0.75)
    z = depth * between(stream, -0.5, -0.3125)
    dx = width * between(stream, 1 / 12, 11 / 12) - x
    dz = depth * between(stream, 0.375, 0.75) - z
    eye.x, eye.z = x, z
    aim(eye, arctan2(dx, dz, work.tan, work.tan_places, work.tan_data))
    ahead = sqrt(dx * dx + dz * dz)
    eye.pitch = -arctan2(choices.eye_height_m, ahead, work.tan, work.tan_places, work.tan_data)


@compiled
def between(stream: Stream, low: float, high: float) -> float:
    """`Generator.uniform`."""
    return low + (high - low) * streams.uniform(stream)


@compiled(inline="always")
def objects_of(b: int, batch: Batch) -> Objects:
    """The objects of one environment in the agent's order."""
    return Objects(batch.number[b], batch.kind[b], batch.fixed[b], batch.rivals[b])


@compiled(inline="always")
def begin(
    b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, given: Given, work: Work
) -> None:
    """Begin an episode, up to the animals, as `FarmToTableEnv.reset` does."""
    table, eye, m = batch.tables[b], batch.eyes[b], len(scenery.kind)
    if given.has[0]:
        work.position[:], work.yaw[:] = given.position, given.yaw
    elif choices.layouts == Draw.STILL:
        work.position[:], work.yaw[:] = scenery.position, scenery.yaw
    else:
        draw_layout(table.stream, choices, scenery, work)
    if given.has[1]:
        batch.eyes[b] = given.eyes[0]
    else:
        batch.eyes[b] = scenery.eyes[0]
        draw_camera(table.stream, eye, choices, scenery, work)
    for i in range(m):
        body = batch.bodies[b, i]
        body.x, body.z = work.position[i, 0], work.position[i, 1]
        body.angle = -(wrap_angle(work.yaw[i]) if choices.game else work.yaw[i])
        batch.believed[b, i, 0], batch.believed[b, i, 1] = body.x, body.z
        batch.facing[b, i], batch.holder[b, i] = work.yaw[i], i
    if choices.game:
        for k in range(herds.spread.shape[1]):
            for i in range(herds.spread.shape[2]):
                herds.spread[b, k, i] = PATH_SPREAD_M * streams.normal(table.stream)
        herds.clocks[b].astray = 0
        herds.start[b], herds.start_yaw[b] = work.position, work.yaw
    line_up(eye, work.position, scenery.kind, scenery.fixed, np.empty(m), work.order)
    introduce(work.order, scenery.kind, scenery.fixed, objects_of(b, batch))
    batch.pose[b] = np.nan
    state = batch.states[b]
    state.metres, state.radians, state.changes, state.ticks = 0.0, 0.0, 0, 0
    table.visits_left, table.accuracy, table.over, table.wrong = choices.visits, 1.0, False, 0
    begin_visit(table, choices)


@compiled(inline="always")
def begin_visit(table: Table, choices: Choices) -> None:
    """A whole budget and all moves."""
    table.metres, table.radians, table.effort = choices.budget_m, choices.budget_rad, choices.budget
    table.moves_left = choices.moves
