"""Compiled: guided ways of the hand, how it keeps to limits, and how it stops."""

from __future__ import annotations

from math import ceil, fabs, inf, pi

from farm_ar.arrays import FloatArray
from farm_ar.game_logic import arm, chipmunk, plane, resting, ticking
from farm_ar.game_logic.plane import Addresses

(
    WAY_TICKS,
    WAY_PERIODS,
    WAY_DONE,
    FROM_X,
    FROM_Z,
    FROM_ANGLE,
    TO_X,
    TO_Z,
    TO_ANGLE,
    WAY_SPEED,
    BEFORE_X,
    BEFORE_Z,
    BEFORE_ANGLE,
    STEPS,
    LIMIT_METRES,
    LIMIT_RADIANS,
    LIMIT_EFFORT,
    DIAGONAL,
    BEGAN_METRES,
    BEGAN_RADIANS,
    BRAKING,
    WAYS,
) = range(22)
"""Places in `way`, a guided way of the hand."""

# A hand on the table is corrected every so many ticks; it presses on at its goal for so many of these periods
# where something holds it up; a hand that moves less than this in one, metres or radians, has stopped.
_PERIOD = 3
_PATIENCE = 10
_STOPPED = 1.5e-4

# What is let go at 1 m/s slides on for this many metres (space damping of 1e-6); what the arm brakes at 1 m/s
# goes on for this many.
SLIDE = 1 / 13.8
BRAKE = 1 / 50
_BRAKED = 0.02

LONGEST_S = 3600.0
"""How long a guided hand may be on its way, seconds."""

# By how much a limit may be exceeded before the hand stops: nothing that is moved keeps its heading to the
# last bit.
_SLACK_METRES, _SLACK_RADIANS = 1e-3, 1e-2


@chipmunk.compiled
def plan(
    handle: Addresses, state: FloatArray, way: FloatArray, x: float, z: float, turn: float, speed: float
) -> float:
    """Fill in a straight way of the hand from where it is, smooth from rest to rest, without limits.

    Returns:
        About how many seconds it takes; nothing is to be done with the way if that is more than `LONGEST_S`.
    """
    way[:] = 0.0
    way[FROM_X], way[FROM_Z], way[FROM_ANGLE] = arm.hand_pose(handle, state)
    way[TO_X], way[TO_Z], way[TO_ANGLE] = x, z, way[FROM_ANGLE] - turn
    way[BEFORE_X], way[BEFORE_Z], way[BEFORE_ANGLE] = way[FROM_X], way[FROM_Z], way[FROM_ANGLE]
    way[WAY_SPEED] = speed
    # In its middle smoothstep is one and a half times as fast as on average.
    seconds = 1.5 * max(resting.length(x - way[FROM_X], z - way[FROM_Z]) / speed, fabs(turn) / arm.MAX_TWIST)
    if not seconds <= LONGEST_S:
        return inf
    way[WAY_PERIODS] = max(1.0, ceil(seconds / plane.TICK))
    if state[plane.RAISED] == 0:
        way[WAY_PERIODS] = ceil(way[WAY_PERIODS] / _PERIOD)
    way[LIMIT_METRES] = way[LIMIT_RADIANS] = way[LIMIT_EFFORT] = inf
    way[DIAGONAL] = 1.0
    way[BEGAN_METRES], way[BEGAN_RADIANS] = state[plane.METRES], state[plane.RADIANS]
    return seconds


@chipmunk.compiled
def on_the_way(way: FloatArray, time: float) -> tuple[float, float, float]:
    """The pose after a share `time` of the time, by smoothstep."""
    share = time * time * (3 - 2 * time)
    return (
        way[FROM_X] + share * (way[TO_X] - way[FROM_X]),
        way[FROM_Z] + share * (way[TO_Z] - way[FROM_Z]),
        way[FROM_ANGLE] + share * (way[TO_ANGLE] - way[FROM_ANGLE]),
    )


@chipmunk.compiled
def guide(handle: Addresses, state: FloatArray, box: FloatArray, way: FloatArray, ticks: int) -> None:
    """Go on along a planned way for so many ticks, or until `WAY_DONE`."""
    for _ in range(ticks):
        if way[WAY_DONE] != 0:
            return
        if state[plane.RAISED] != 0:
            glide_tick(handle, state, box, way)
        else:
            drag_tick(handle, state, box, way)


@chipmunk.compiled
def glide_tick(handle: Addresses, state: FloatArray, box: FloatArray, way: FloatArray) -> None:
    """A tick of a guided hand that hovers."""
    way[WAY_TICKS] += 1
    done = way[WAY_TICKS] >= way[WAY_PERIODS]
    x, z, angle = way[TO_X], way[TO_Z], way[TO_ANGLE]
    if not done:
        x, z, angle = on_the_way(way, way[WAY_TICKS] / way[WAY_PERIODS])
    vx, vz, spin = (
        (x - state[plane.X]) / plane.TICK,
        (z - state[plane.Z]) / plane.TICK,
        (angle - state[plane.ANGLE]) / plane.TICK,
    )
    state[plane.X], state[plane.Z], state[plane.ANGLE] = x, z, angle
    if done:
        vx = vz = spin = 0.0
        way[WAY_DONE] = 1.0
    state[plane.VELOCITY_X], state[plane.VELOCITY_Z], state[plane.SPIN] = vx, vz, spin
    ticking.let_pass(handle, state, box, 1, ticking.GUIDED_STEPS)


@chipmunk.compiled
def to_come(handle: Addresses, state: FloatArray, box: FloatArray) -> tuple[float, float]:
    """How far all boxes will still slide, and turn, if the hand brakes now; metres and radians."""
    metres = radians = 0.0
    held = int(state[plane.GRIPPED])
    for i in range(len(box)):
        if box[i, plane.MOVABLE] > 0:
            vx, vz = chipmunk.get_velocity(handle[plane.FIRST + i])
            speed, spin = resting.length(vx, vz), fabs(chipmunk.get_spin(handle[plane.FIRST + i]))
            if i == held:
                metres += BRAKE * speed * speed
            else:
                metres += SLIDE * speed
                radians += SLIDE * spin
    return metres, radians


@chipmunk.compiled
def exceeds(handle: Addresses, state: FloatArray, box: FloatArray, way: FloatArray) -> bool:
    """Whether going on would move or turn the boxes by more than a way's limits."""
    if way[LIMIT_METRES] == inf and way[LIMIT_RADIANS] == inf and way[LIMIT_EFFORT] == inf:
        return False
    metres = radians = 0.0
    if state[plane.STILL] == 0:
        metres, radians = to_come(handle, state, box)
    metres += state[plane.METRES] - way[BEGAN_METRES]
    radians += state[plane.RADIANS] - way[BEGAN_RADIANS]
    effort = metres / way[DIAGONAL] + radians / pi
    slack = _SLACK_METRES / way[DIAGONAL] + _SLACK_RADIANS / pi
    return bool(
        metres > way[LIMIT_METRES] + _SLACK_METRES
        or radians > way[LIMIT_RADIANS] + _SLACK_RADIANS
        or effort > way[LIMIT_EFFORT] + slack
    )


@chipmunk.compiled
def drag_tick(handle: Addresses, state: FloatArray, box: FloatArray, way: FloatArray) -> None:
    """A tick of a guided hand that is low or holds a box; at its goal it presses on where it is held up."""
    if way[BRAKING] != 0 or exceeds(handle, state, box, way):
        brake_tick(handle, state, box, way)
        return
    ticks = int(way[WAY_TICKS])
    if ticks % _PERIOD == 0:
        period = ticks // _PERIOD + 1
        seconds = _PERIOD * plane.TICK
        x, z, angle = arm.hand_pose(handle, state)
        to_x, to_z, to_angle = way[TO_X], way[TO_Z], way[TO_ANGLE]
        if period < way[WAY_PERIODS]:
            to_x, to_z, to_angle = on_the_way(way, period / way[WAY_PERIODS])
        now_x, now_z, now_spin = arm.hand_motion(handle, state)
        fastest = max(way[WAY_SPEED], resting.length(now_x, now_z))
        turning = fabs(now_spin) + arm.MAX_TWIST if to_angle != angle else fabs(now_spin)
        way[STEPS] = ticking.GUIDED_STEPS
        if ticking.clear(handle, state, box, fastest * seconds, turning * seconds):
            way[STEPS] = 1.0
        # It first goes on as it does now, for as long as a step takes.
        delay = plane.TICK / way[STEPS]
        vx = (to_x - x - now_x * delay) / seconds
        vz = (to_z - z - now_z * delay) / seconds
        spin = (to_angle - angle - now_spin * delay) / seconds
        fast = max(1.0, resting.length(vx, vz) / way[WAY_SPEED])
        arm.move_arm(handle, state, vx / fast, vz / fast, min(max(spin, -arm.MAX_TWIST), arm.MAX_TWIST))
    ticking.let_pass(handle, state, box, 1, int(way[STEPS]))
    way[WAY_TICKS] += 1
    ticks += 1
    if ticks % _PERIOD == 0:
        x, z, angle = arm.hand_pose(handle, state)
        moved = max(fabs(x - way[BEFORE_X]), max(fabs(z - way[BEFORE_Z]), fabs(angle - way[BEFORE_ANGLE])))
        way[BEFORE_X], way[BEFORE_Z], way[BEFORE_ANGLE] = x, z, angle
        period = ticks // _PERIOD
        stopped = period > way[WAY_PERIODS] and moved < _STOPPED
        if stopped or period >= way[WAY_PERIODS] + _PATIENCE:
            arm.move_arm(handle, state, 0.0, 0.0, 0.0)
            way[WAY_DONE] = 1.0


@chipmunk.compiled
def brake_tick(handle: Addresses, state: FloatArray, box: FloatArray, way: FloatArray) -> None:
    """A tick of a hand that stops where it is; the way is done when it has."""
    arm.move_arm(handle, state, 0.0, 0.0, 0.0)
    ticking.let_pass(handle, state, box, 1, ticking.GUIDED_STEPS)
    braked(handle, state, way)


@chipmunk.compiled
def braked(handle: Addresses, state: FloatArray, way: FloatArray) -> None:
    """After a tick of braking: a hand that has stopped lets go and touches nothing any more."""
    way[BRAKING] += 1
    vx, vz, _ = arm.hand_motion(handle, state)
    if resting.length(vx, vz) < _BRAKED or way[BRAKING] > _PATIENCE:
        arm.raise_hand(handle, state)
        way[WAY_DONE] = 1.0
