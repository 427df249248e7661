"""Compiled: ticks of physics under a hand that is steered."""

from __future__ import annotations

from math import cos, fabs, sin

from farm_ar.arrays import FloatArray
from farm_ar.game_logic import arm, chipmunk, nearness, plane, resting
from farm_ar.game_logic.plane import Addresses

# Steps of the simulation in a tick. A hand faster than `_FAST`, metres a second, moves too far in a whole
# tick for clean bumps. A guided hand presses, and with fewer steps it now and then wedges a box in. While
# nothing is near what moves, and nothing else moves by more than `_SLOW`, one step does.
_FAST = 0.75
_SLOW = 0.05
_FAST_STEPS, GUIDED_STEPS = 2, 3
_NEAR = 0.004


@chipmunk.compiled
def drives(state: FloatArray) -> bool:
    """Whether the hand moves, or tries to move, something in the space."""
    if state[plane.PRESENT] == 0 or state[plane.RAISED] != 0:
        return False
    return bool(state[plane.VELOCITY_X] != 0 or state[plane.VELOCITY_Z] != 0 or state[plane.SPIN] != 0)


@chipmunk.compiled
def clear(handle: Addresses, state: FloatArray, box: FloatArray, metres: float, radians: float) -> bool:
    """Whether what the hand moves meets nothing within so far a way and turn, and nothing else moves."""
    held = int(state[plane.GRIPPED])
    room = metres + _NEAR
    x, z = 0.0, 0.0
    if held >= 0:
        corner = resting.length(box[held, plane.HALF_WIDTH], box[held, plane.HALF_DEPTH])
        room += radians * corner
        if not (
            corner + room < box[held, plane.BOX_X] < state[plane.WIDTH] - corner - room
            and corner + room < box[held, plane.BOX_Z] < state[plane.DEPTH] - corner - room
        ):
            sine, cosine = fabs(sin(box[held, plane.BOX_ANGLE])), fabs(cos(box[held, plane.BOX_ANGLE]))
            wide = cosine * box[held, plane.HALF_WIDTH] + sine * box[held, plane.HALF_DEPTH] + room
            deep = sine * box[held, plane.HALF_WIDTH] + cosine * box[held, plane.HALF_DEPTH] + room
            if not (
                wide < box[held, plane.BOX_X] < state[plane.WIDTH] - wide
                and deep < box[held, plane.BOX_Z] < state[plane.DEPTH] - deep
            ):
                return False
    else:
        x, z, _ = arm.hand_pose(handle, state)
    for i in range(len(box)):
        if i == held:
            continue
        if held >= 0:
            if not nearness.apart(box, held, i, room):
                return False
        elif nearness.distance(box, i, x, z) <= arm.HAND_RADIUS + room:
            return False
        if box[i, plane.MOVABLE] > 0:
            vx, vz = chipmunk.get_velocity(handle[plane.FIRST + i])
            if fabs(vx) > _SLOW or fabs(vz) > _SLOW:
                return False
    return True


@chipmunk.compiled
def let_pass(handle: Addresses, state: FloatArray, box: FloatArray, ticks: int, steps: int) -> None:
    """Let ticks pass, each in a number of steps, while the hand moves as it was steered."""
    driven = drives(state)
    state[plane.TICKS] += ticks
    if driven:
        resting.wake(state)
    for _ in range(ticks):
        if state[plane.STILL] != 0:
            return
        for _ in range(steps):
            chipmunk.step_space(handle[plane.SPACE], plane.TICK / steps)
        resting.read(handle, state, box)
        if not driven:
            resting.come_to_rest(handle, state, box)


@chipmunk.compiled
def tick(
    handle: Addresses, state: FloatArray, box: FloatArray, vx: float, vz: float, spin: float, count: int
) -> None:
    """Let ticks pass while the hand is moved at vx and vz, turning at Chipmunk's rate `spin`."""
    speed = resting.length(vx, vz)
    if speed > arm.MAX_HAND_SPEED:
        vx, vz = vx * arm.MAX_HAND_SPEED / speed, vz * arm.MAX_HAND_SPEED / speed
    spin = min(max(spin, -arm.MAX_TWIST), arm.MAX_TWIST)
    steps = 1
    if state[plane.PRESENT] != 0:
        if state[plane.GRIPPED] < 0:
            x, z, _ = arm.hand_pose(handle, state)
            vx = arm.held_back(x, vx, state[plane.WIDTH], count * plane.TICK)
            vz = arm.held_back(z, vz, state[plane.DEPTH], count * plane.TICK)
            if (
                state[plane.RAISED] != 0
                and state[plane.GOES_LOW] != 0
                and nearness.nearest(box, x, z, arm.HAND_RADIUS, True) < 0
            ):
                arm.lower(handle, state, vx, vz, spin)
        arm.move_arm(handle, state, vx, vz, spin)
        if state[plane.RAISED] != 0:
            state[plane.X] += vx * count * plane.TICK
            state[plane.Z] += vz * count * plane.TICK
            state[plane.ANGLE] += spin * count * plane.TICK
        elif speed > _FAST:
            way, turn = speed * count * plane.TICK, fabs(spin) * count * plane.TICK
            if state[plane.GRIPPED] < 0 or not clear(handle, state, box, way, turn):
                steps = _FAST_STEPS
    let_pass(handle, state, box, count, steps)


@chipmunk.compiled
def settle(handle: Addresses, state: FloatArray, box: FloatArray, most: int) -> None:
    """Let ticks pass, with the hand held where it is, until everything is at rest."""
    for _ in range(most):
        if state[plane.STILL] != 0:
            return
        if state[plane.PRESENT] != 0:
            arm.move_arm(handle, state, 0.0, 0.0, 0.0)
        let_pass(handle, state, box, 1, GUIDED_STEPS)
