"""Trajectories of a guided hand: straight lines, smooth from rest to rest, that it is corrected along."""

from __future__ import annotations

from math import ceil, fabs, inf

import numpy as np

from farm_ar.game_logic.physics import chipmunk, gripper, lifting, stepping
from farm_ar.game_logic.physics.limits import brake, exceeds
from farm_ar.game_logic.physics.state import TICK, Body, Limits, State
from farm_ar.geometry.rectangles import length
from farm_ar.structs import Struct, Structs, struct_dtype

LONGEST_S = 3600.0
"""How long a guided hand may be on its way, seconds."""

CARRY_SPEED = 0.75
"""Fastest that a hand carries a building by default, metres a second."""

REACH_SPEED = 1.5
"""Fastest that a hand moves above the buildings on its way in and out, metres a second."""

ENTRY = -0.15
"""z at which a hand comes in and leaves, on the player's side of the table, metres."""

# A hand on the table is corrected every so many ticks; it presses on at its goal for so many of these periods
# where something holds it up; a hand that moves less than this in one, metres or radians, has stopped.
_PERIOD = 3
_PATIENCE = 10
_STOPPED = 1.5e-4


class Pose(Struct):
    """Of a hand."""

    x: float
    z: float
    angle: float


class Trajectory(Struct):
    """From where to where a hand goes, and how far it is."""

    start: Pose
    goal: Pose
    before: Pose
    """Where it was a period ago."""
    speed: float
    """Its highest, metres a second."""
    ticks: int
    """So far."""
    periods: int
    """How many it takes: of one tick for a hand that hovers, of `_PERIOD` for one on the table."""
    steps: int
    """Of the simulation in a tick."""
    done: bool


_TRAJECTORY = struct_dtype(Trajectory)


@chipmunk.compiled
def plan(
    states: Structs[State], trajectories: Structs[Trajectory], x: float, z: float, turn: float, speed: float
) -> float:
    """Fill in a trajectory of the hand from where it is.

    Args:
        states: (1,) of the table.
        trajectories: (1,) filled in.
        x: where to, metres.
        z: likewise.
        turn: clockwise, radians.
        speed: the highest on the way, metres a second.

    Returns:
        About how many seconds it takes; it is not planned if that is more than `LONGEST_S`.
    """
    state, trajectory = states[0], trajectories[0]
    start, goal, before = trajectory.start, trajectory.goal, trajectory.before
    start.x, start.z, start.angle = gripper.hand_pose(state)
    goal.x, goal.z, goal.angle = x, z, start.angle - turn
    before.x, before.z, before.angle = start.x, start.z, start.angle
    trajectory.speed, trajectory.ticks, trajectory.steps, trajectory.done = speed, 0, 0, False
    # In its middle smoothstep is one and a half times as fast as on average.
    seconds = 1.5 * max(length(x - start.x, z - start.z) / speed, fabs(turn) / gripper.MAX_TWIST)
    if not seconds <= LONGEST_S:
        return inf
    trajectory.periods = max(1, ceil(seconds / TICK))
    if not state.hand.raised:
        trajectory.periods = ceil(trajectory.periods / _PERIOD)
    return seconds


@chipmunk.compiled
def pose_at(trajectory: Trajectory, time: float) -> tuple[float, float, float]:
    """The pose after a share `time` of the time, by smoothstep."""
    start, goal = trajectory.start, trajectory.goal
    share = time * time * (3 - 2 * time)
    return (
        start.x + share * (goal.x - start.x),
        start.z + share * (goal.z - start.z),
        start.angle + share * (goal.angle - start.angle),
    )


@chipmunk.compiled
def follow(
    states: Structs[State],
    bodies: Structs[Body],
    trajectories: Structs[Trajectory],
    limits: Structs[Limits],
    ticks: int,
) -> None:
    """Go on along the one planned trajectory for so many ticks, or until it is done."""
    state, trajectory = states[0], trajectories[0]
    for _ in range(ticks):
        if trajectory.done:
            return
        if state.hand.raised:
            glide_tick(state, bodies, trajectory)
        else:
            drag_tick(state, bodies, trajectory, limits[0])


@chipmunk.compiled
def glide_tick(state: State, bodies: Structs[Body], trajectory: Trajectory) -> None:
    """A tick of a guided hand that hovers."""
    hand = state.hand
    trajectory.ticks += 1
    trajectory.done = trajectory.ticks >= trajectory.periods
    x, z, angle = trajectory.goal.x, trajectory.goal.z, trajectory.goal.angle
    if not trajectory.done:
        x, z, angle = pose_at(trajectory, trajectory.ticks / trajectory.periods)
    vx, vz, spin = (x - hand.x) / TICK, (z - hand.z) / TICK, (angle - hand.angle) / TICK
    hand.x, hand.z, hand.angle = x, z, angle
    if hand.gripped >= 0:
        lifting.follow(state, bodies)
    if trajectory.done:
        vx = vz = spin = 0.0
    hand.velocity_x, hand.velocity_z, hand.spin = vx, vz, spin
    stepping.step(state, bodies, 1, stepping.GUIDED_STEPS)


@chipmunk.compiled
def glide(
    states: Structs[State],
    bodies: Structs[Body],
    trajectories: Structs[Trajectory],
    x: float,
    z: float,
    turn: float,
    speed: float,
) -> bool:
    """Plan a trajectory of a hand that hovers, and go all of it at once: what `follow` does tick by tick.

    Nothing else may move meanwhile. Arguments are those of `plan`.

    Returns:
        Whether it takes no longer than a hand may be on its way.
    """
    if not plan(states, trajectories, x, z, turn, speed) <= LONGEST_S:
        return False
    state, trajectory = states[0], trajectories[0]
    hand, goal = state.hand, trajectory.goal
    hand.x, hand.z, hand.angle = goal.x, goal.z, goal.angle
    if hand.gripped >= 0:
        lifting.follow(state, bodies)
        state.changes += trajectory.periods - 1
    hand.velocity_x = hand.velocity_z = hand.spin = 0.0
    state.ticks += trajectory.periods
    trajectory.ticks, trajectory.done = trajectory.periods, True
    return True


@chipmunk.compiled
def lift_over(
    states: Structs[State],
    bodies: Structs[Body],
    limits: Structs[Limits],
    i: int,
    x: float,
    z: float,
    turn: float,
    speed: float,
) -> bool:
    """Carry a body where the hand lifts: reach over, take it, carry it, set it down, leave.

    Args:
        states: (1,) of the table, on which there is no hand.
        bodies: likewise.
        limits: (1,) that are kept.
        i: the body, which can be moved.
        x: where to, metres.
        z: likewise.
        turn: clockwise, radians.
        speed: the highest on the way, metres a second.

    Returns:
        Whether all of it took no longer than a hand may be on its way; otherwise it waits where it is.
    """
    state, from_x, from_z = states[0], bodies[i].x, bodies[i].z
    ways: Structs[Trajectory] = np.zeros(1, _TRAJECTORY)  # type: ignore[assignment]
    gripper.bring_hand(state, bodies, from_x, ENTRY, True)
    if not glide(states, bodies, ways, from_x, from_z, 0.0, REACH_SPEED):
        return False
    lifting.take(state, bodies, i, gripper.REACH)
    if not glide(states, bodies, ways, x, z, turn, speed):
        return False
    lifting.set_down_within(state, bodies, limits[0])
    if not glide(states, bodies, ways, from_x, ENTRY, 0.0, REACH_SPEED):
        return False
    state.hand.present = False
    return True


@chipmunk.compiled
def drag_tick(state: State, bodies: Structs[Body], trajectory: Trajectory, limits: Limits) -> None:
    """A tick of a guided hand that is low or holds a body; at its goal it presses on where it is held up."""
    if limits.braking != 0 or exceeds(state, bodies, limits):
        gripper.move_arm(state, 0.0, 0.0, 0.0)
        stepping.step(state, bodies, 1, stepping.GUIDED_STEPS)
        brake(state, bodies, limits)
        trajectory.done = limits.halted
        return
    if trajectory.ticks % _PERIOD == 0:
        correct(state, bodies, trajectory)
    stepping.step(state, bodies, 1, trajectory.steps)
    trajectory.ticks += 1
    if trajectory.ticks % _PERIOD == 0:
        x, z, angle = gripper.hand_pose(state)
        before = trajectory.before
        moved = max(fabs(x - before.x), max(fabs(z - before.z), fabs(angle - before.angle)))
        before.x, before.z, before.angle = x, z, angle
        period = trajectory.ticks // _PERIOD
        stopped = period > trajectory.periods and moved < _STOPPED
        if stopped or period >= trajectory.periods + _PATIENCE:
            gripper.move_arm(state, 0.0, 0.0, 0.0)
            trajectory.done = True


@chipmunk.compiled
def correct(state: State, bodies: Structs[Body], trajectory: Trajectory) -> None:
    """Steer a hand on the table to where it has to be a period later."""
    period = trajectory.ticks // _PERIOD + 1
    seconds = _PERIOD * TICK
    x, z, angle = gripper.hand_pose(state)
    to_x, to_z, to_angle = trajectory.goal.x, trajectory.goal.z, trajectory.goal.angle
    if period < trajectory.periods:
        to_x, to_z, to_angle = pose_at(trajectory, period / trajectory.periods)
    now_x, now_z, now_spin = gripper.hand_motion(state)
    fastest = max(trajectory.speed, length(now_x, now_z))
    turning = fabs(now_spin) + gripper.MAX_TWIST if to_angle != angle else fabs(now_spin)
    clear = stepping.is_clear(state, bodies, fastest * seconds, turning * seconds)
    trajectory.steps = 1 if clear else stepping.GUIDED_STEPS
    # It first goes on as it does now, for as long as a step takes.
    delay = TICK / trajectory.steps
    vx = (to_x - x - now_x * delay) / seconds
    vz = (to_z - z - now_z * delay) / seconds
    spin = (to_angle - angle - now_spin * delay) / seconds
    fast = max(1.0, length(vx, vz) / trajectory.speed)
    twist = min(max(spin, -gripper.MAX_TWIST), gripper.MAX_TWIST)
    gripper.move_arm(state, vx / fast, vz / fast, twist)
