"""Compiled kernels of the tabletop: ticks of physics, the hand's steering, its grip, and its guided ways.

They work on three arrays of one plane, so that a call costs little:

* `handle`: addresses of Chipmunk's objects, as named by `SPACE` to `FIRST`; from `FIRST` on the boxes'
bodies.
* `state`: numbers that change, as named by `TICKS` to `STATES`.
* `box`: a row for each box, its columns named by `BOX_X` to `COLUMNS`.

Only `math` is used, not NumPy, so that they give the same bytes where they are not compiled.
"""

from __future__ import annotations

from math import ceil, cos, fabs, inf, pi, sin, sqrt

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray
from farm_ar.game_logic import chipmunk

Addresses = npt.NDArray[np.int64]

TICK = 1 / 60
"""Length of a tick, seconds."""

SPACE, ARM, DISC, DISC_SHAPE, PULL, TWIST, MOVED, FIRST = range(8)
"""Places in `handle`. `MOVED` is the body that the arm moves."""

(
    TICKS,
    STILL,
    QUIET,
    PRESENT,
    RAISED,
    GOES_LOW,
    GRIPPED,
    X,
    Z,
    ANGLE,
    VELOCITY_X,
    VELOCITY_Z,
    SPIN,
    POINT_X,
    POINT_Z,
    TURN,
    WIDTH,
    DEPTH,
    METRES,
    RADIANS,
    CHANGES,
    STATES,
) = range(22)
"""Places in `state`: ticks so far; whether all is still, and for how many ticks nothing was touched; whether
there is a hand, it hovers, is to go down, and which box it holds (-1 for none); where it hovers; how it is
steered; the point of the moved body that it is at, and how it is turned against that; the plane's extent;
the way and the turns of all boxes so far; how often poses have changed; how many places there are."""

BOX_X, BOX_Z, BOX_ANGLE, HALF_WIDTH, HALF_DEPTH, MOVABLE, OLD_X, OLD_Z, OLD_ANGLE, ELEVATION, COLUMNS = range(
    11
)
"""Columns of `box`: its pose; half its sides; 1 if it can be moved; its pose when it was last compared;
how high its pivot is."""

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

# At rest: from the sixth tick after the last touch on, nothing gets on by more than 3 mm/s, or 30 mrad/s, in
# three ticks. Places are compared because what pushes overlapping boxes apart does not show in their
# velocities, over three ticks because a wedged box trembles.
_WINDOW = 3
_STILL_METRES, _STILL_RADIANS = 3e-3 * _WINDOW * TICK, 3e-2 * _WINDOW * TICK

# What the arm can do at most, newtons and newton metres. An arm without limits shoots away what it squeezes
# against an edge; one of 50 N now and then wedges a box into a gap too narrow for it.
_FORCE, _TORQUE = 30.0, 3.0

HAND_RADIUS = 0.03
"""Radius of the disc, metres."""

HAND_ROOM = 0.5
"""How far beyond the table a hand may go, metres."""

MAX_HAND_SPEED = 1.5
"""Fastest that a hand is moved, metres a second."""

MAX_TWIST = pi
"""Fastest that a hand is turned, radians a second."""

# Steps of the simulation in a tick. A hand faster than `_FAST`, metres a second, moves too far in a whole
# tick for clean bumps. A guided hand presses, and with fewer steps it now and then wedges a box in. While
# nothing is near what moves, and nothing else moves by more than `_SLOW`, one step does.
_FAST = 0.75
_SLOW = 0.05
_FAST_STEPS, GUIDED_STEPS = 2, 3
_NEAR = 0.004

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

# By how much a limit may be exceeded before the hand stops: nothing that is moved keeps its heading to the
# last bit.
_SLACK_METRES, _SLACK_RADIANS = 1e-3, 1e-2


@chipmunk.compiled
def length(x: float, z: float) -> float:
    """Of a vector; `hypot` is not the same to the last bit everywhere."""
    return sqrt(x * x + z * z)


@chipmunk.compiled
def read(handle: Addresses, state: FloatArray, box: FloatArray) -> None:
    """Bring the boxes' poses up to date, and add up how far they have been moved and turned."""
    changed = False
    for i in range(len(box)):
        if box[i, MOVABLE] > 0:
            x, z = chipmunk.get_position(handle[FIRST + i])
            angle = chipmunk.get_angle(handle[FIRST + i])
            dx, dz, turn = x - box[i, BOX_X], z - box[i, BOX_Z], angle - box[i, BOX_ANGLE]
            if dx != 0 or dz != 0 or turn != 0:
                changed = True
                state[METRES] += length(dx, dz)
                state[RADIANS] += fabs(turn)
                box[i, BOX_X], box[i, BOX_Z], box[i, BOX_ANGLE] = x, z, angle
    if changed:
        state[CHANGES] += 1


@chipmunk.compiled
def wake(state: FloatArray) -> None:
    """Something was touched."""
    state[STILL] = 0.0
    state[QUIET] = 0.0


@chipmunk.compiled
def drives(state: FloatArray) -> bool:
    """Whether the hand moves, or tries to move, something in the space."""
    if state[PRESENT] == 0 or state[RAISED] != 0:
        return False
    return bool(state[VELOCITY_X] != 0 or state[VELOCITY_Z] != 0 or state[SPIN] != 0)


@chipmunk.compiled
def come_to_rest(handle: Addresses, state: FloatArray, box: FloatArray) -> None:
    """After a tick in which nobody moved anything: see whether all is still by now."""
    state[QUIET] += 1
    if state[QUIET] % _WINDOW != 0:
        return
    still = True
    for i in range(len(box)):
        if box[i, MOVABLE] > 0:
            if (
                fabs(box[i, BOX_X] - box[i, OLD_X]) > _STILL_METRES
                or fabs(box[i, BOX_Z] - box[i, OLD_Z]) > _STILL_METRES
                or fabs(box[i, BOX_ANGLE] - box[i, OLD_ANGLE]) > _STILL_RADIANS
            ):
                still = False
            box[i, OLD_X], box[i, OLD_Z], box[i, OLD_ANGLE] = box[i, BOX_X], box[i, BOX_Z], box[i, BOX_ANGLE]
    if still and state[QUIET] > _WINDOW:
        state[STILL] = 1.0
        for i in range(len(box)):
            if box[i, MOVABLE] > 0:
                vx, vz = chipmunk.get_velocity(handle[FIRST + i])
                if vx != 0 or vz != 0 or chipmunk.get_spin(handle[FIRST + i]) != 0:
                    chipmunk.set_velocity(handle[FIRST + i], 0.0, 0.0)
                    chipmunk.set_spin(handle[FIRST + i], 0.0)


@chipmunk.compiled
def let_pass(handle: Addresses, state: FloatArray, box: FloatArray, ticks: int, steps: int) -> None:
    """Let ticks pass, each in a number of steps, while the hand moves as it was steered."""
    driven = drives(state)
    state[TICKS] += ticks
    if driven:
        wake(state)
    for _ in range(ticks):
        if state[STILL] != 0:
            return
        for _ in range(steps):
            chipmunk.step_space(handle[SPACE], TICK / steps)
        read(handle, state, box)
        if not driven:
            come_to_rest(handle, state, box)


@chipmunk.compiled
def distance(box: FloatArray, i: int, x: float, z: float) -> float:
    """From a point to a box's footprint, metres; 0 inside."""
    sine, cosine = sin(box[i, BOX_ANGLE]), cos(box[i, BOX_ANGLE])
    dx, dz = x - box[i, BOX_X], z - box[i, BOX_Z]
    across = max(fabs(cosine * dx + sine * dz) - box[i, HALF_WIDTH], 0.0)
    ahead = max(fabs(cosine * dz - sine * dx) - box[i, HALF_DEPTH], 0.0)
    return length(across, ahead)


@chipmunk.compiled
def nearest(box: FloatArray, x: float, z: float, reach: float, fixed: bool) -> int:
    """The movable box, or with `fixed` the box, nearest to a point and nearer than `reach`; -1 for none."""
    found, least = -1, reach
    for i in range(len(box)):
        if fixed or box[i, MOVABLE] > 0:
            # Cheap: farther away than its corners reach, it cannot be the nearest.
            far = least + box[i, HALF_WIDTH] + box[i, HALF_DEPTH]
            if fabs(x - box[i, BOX_X]) < far and fabs(z - box[i, BOX_Z]) < far:
                away = distance(box, i, x, z)
                if away < least:
                    found, least = i, away
    return found


@chipmunk.compiled
def apart(box: FloatArray, i: int, k: int, room: float) -> bool:
    """Whether two footprints are farther apart than `room` metres along a side of one of them."""
    dx, dz = box[k, BOX_X] - box[i, BOX_X], box[k, BOX_Z] - box[i, BOX_Z]
    turn = box[k, BOX_ANGLE] - box[i, BOX_ANGLE]
    shared_sine, shared_cosine = fabs(sin(turn)), fabs(cos(turn))
    for one, other in ((i, k), (k, i)):
        sine, cosine = sin(box[one, BOX_ANGLE]), cos(box[one, BOX_ANGLE])
        width, depth = box[other, HALF_WIDTH], box[other, HALF_DEPTH]
        across = box[one, HALF_WIDTH] + shared_cosine * width + shared_sine * depth
        ahead = box[one, HALF_DEPTH] + shared_sine * width + shared_cosine * depth
        if fabs(cosine * dx + sine * dz) > across + room or fabs(cosine * dz - sine * dx) > ahead + room:
            return True
    return False


@chipmunk.compiled
def clear(handle: Addresses, state: FloatArray, box: FloatArray, metres: float, radians: float) -> bool:
    """Whether what the hand moves meets nothing within so far a way and turn, and nothing else moves."""
    held = int(state[GRIPPED])
    room = metres + _NEAR
    x, z = 0.0, 0.0
    if held >= 0:
        corner = length(box[held, HALF_WIDTH], box[held, HALF_DEPTH])
        room += radians * corner
        if not (
            corner + room < box[held, BOX_X] < state[WIDTH] - corner - room
            and corner + room < box[held, BOX_Z] < state[DEPTH] - corner - room
        ):
            sine, cosine = fabs(sin(box[held, BOX_ANGLE])), fabs(cos(box[held, BOX_ANGLE]))
            wide = cosine * box[held, HALF_WIDTH] + sine * box[held, HALF_DEPTH] + room
            deep = sine * box[held, HALF_WIDTH] + cosine * box[held, HALF_DEPTH] + room
            if not (
                wide < box[held, BOX_X] < state[WIDTH] - wide
                and deep < box[held, BOX_Z] < state[DEPTH] - deep
            ):
                return False
    else:
        x, z, _ = hand_pose(handle, state)
    for i in range(len(box)):
        if i == held:
            continue
        if held >= 0:
            if not apart(box, held, i, room):
                return False
        elif distance(box, i, x, z) <= HAND_RADIUS + room:
            return False
        if box[i, MOVABLE] > 0:
            vx, vz = chipmunk.get_velocity(handle[FIRST + i])
            if fabs(vx) > _SLOW or fabs(vz) > _SLOW:
                return False
    return True


@chipmunk.compiled
def hand_pose(handle: Addresses, state: FloatArray) -> tuple[float, float, float]:
    """Where the hand is, metres, and its angle, radians."""
    if state[RAISED] != 0:
        return state[X], state[Z], state[ANGLE]
    x, z = chipmunk.local_to_world(handle[MOVED], state[POINT_X], state[POINT_Z])
    return x, z, chipmunk.get_angle(handle[MOVED]) + state[TURN]


@chipmunk.compiled
def hand_motion(handle: Addresses, state: FloatArray) -> tuple[float, float, float]:
    """How the hand moves, metres a second, and turns, radians a second."""
    if state[RAISED] != 0:
        return state[VELOCITY_X], state[VELOCITY_Z], state[SPIN]
    vx, vz = chipmunk.get_velocity_at(handle[MOVED], state[POINT_X], state[POINT_Z])
    return vx, vz, chipmunk.get_spin(handle[MOVED])


@chipmunk.compiled
def look_at_hand(handle: Addresses, state: FloatArray, hand: FloatArray) -> None:
    """Fill in the hand's (6,) x, z, angle, velocity along x and z, and spin."""
    hand[0], hand[1], hand[2] = hand_pose(handle, state)
    hand[3], hand[4], hand[5] = hand_motion(handle, state)


@chipmunk.compiled
def move_arm(handle: Addresses, state: FloatArray, vx: float, vz: float, spin: float) -> None:
    """Steer the hand from now on."""
    if vx != state[VELOCITY_X] or vz != state[VELOCITY_Z] or spin != state[SPIN]:
        state[VELOCITY_X], state[VELOCITY_Z], state[SPIN] = vx, vz, spin
        chipmunk.set_velocity(handle[ARM], vx, vz)
        chipmunk.set_spin(handle[ARM], spin)


@chipmunk.compiled
def join(handle: Addresses, state: FloatArray, moved: int) -> None:
    """Have the arm move a body by the point where the hand is."""
    x, z, angle = hand_pose(handle, state)
    handle[MOVED] = moved
    state[POINT_X], state[POINT_Z] = chipmunk.world_to_local(moved, x, z)
    state[TURN] = angle - chipmunk.get_angle(moved)
    pull = chipmunk.new_pivot_joint(handle[ARM], moved, 0.0, 0.0, state[POINT_X], state[POINT_Z])
    twist = chipmunk.new_gear_joint(handle[ARM], moved, 0.0, 1.0)
    handle[PULL], handle[TWIST] = pull, twist
    chipmunk.set_max_force(pull, _FORCE)
    chipmunk.set_max_bias(pull, 0.0)
    chipmunk.set_max_force(twist, _TORQUE)
    chipmunk.set_max_bias(twist, 0.0)
    chipmunk.add_constraint(handle[SPACE], pull)
    chipmunk.add_constraint(handle[SPACE], twist)
    state[RAISED] = 0.0
    move_arm(handle, state, 0.0, 0.0, 0.0)


@chipmunk.compiled
def lift(handle: Addresses, state: FloatArray) -> None:
    """Let go, and hover."""
    if state[PRESENT] == 0 or state[RAISED] != 0:
        return
    state[X], state[Z], state[ANGLE] = hand_pose(handle, state)
    for joint in (PULL, TWIST):
        chipmunk.remove_constraint(handle[SPACE], handle[joint])
        chipmunk.free_constraint(handle[joint])
        handle[joint] = 0
    if handle[MOVED] == handle[DISC]:
        chipmunk.remove_shape(handle[SPACE], handle[DISC_SHAPE])
        chipmunk.remove_body(handle[SPACE], handle[DISC])
    if state[GRIPPED] >= 0:
        wake(state)
        # What was pressed together was quiet, too: it must not go to sleep before it is apart.
        for i in range(len(handle) - FIRST):
            chipmunk.activate(handle[FIRST + i])
    state[GRIPPED], state[RAISED] = -1.0, 1.0
    move_arm(handle, state, 0.0, 0.0, 0.0)


@chipmunk.compiled
def lower(handle: Addresses, state: FloatArray, vx: float, vz: float, spin: float) -> None:
    """Put the disc on the table, where it bumps into boxes, moving as the hand does."""
    disc = handle[DISC]
    chipmunk.set_position(disc, state[X], state[Z])
    chipmunk.set_angle(disc, state[ANGLE])
    chipmunk.set_velocity(disc, vx, vz)
    chipmunk.set_spin(disc, spin)
    chipmunk.add_body(handle[SPACE], disc)
    chipmunk.add_shape(handle[SPACE], handle[DISC_SHAPE])
    join(handle, state, disc)


@chipmunk.compiled
def grip(handle: Addresses, state: FloatArray, box: FloatArray, i: int, reach: float) -> bool:
    """Hold a box whose footprint is within reach. There is no disc then that could shove anything."""
    if state[PRESENT] == 0 or state[GRIPPED] >= 0 or box[i, MOVABLE] == 0:
        return False
    x, z, _ = hand_pose(handle, state)
    if distance(box, i, x, z) > reach:
        return False
    lift(handle, state)
    join(handle, state, handle[FIRST + i])
    state[GRIPPED] = i
    wake(state)
    return True


@chipmunk.compiled
def raise_hand(handle: Addresses, state: FloatArray) -> None:
    """Let go, and stay above the boxes from now on."""
    lift(handle, state)
    state[GOES_LOW] = 0.0


@chipmunk.compiled
def bring_hand(handle: Addresses, state: FloatArray, x: float, z: float, raised: bool) -> None:
    """Put a hand in, in place of one that may be there."""
    lift(handle, state)
    state[PRESENT], state[RAISED], state[GRIPPED] = 1.0, 1.0, -1.0
    state[X] = min(max(x, -HAND_ROOM), state[WIDTH] + HAND_ROOM)
    state[Z] = min(max(z, -HAND_ROOM), state[DEPTH] + HAND_ROOM)
    state[ANGLE] = 0.0
    move_arm(handle, state, 0.0, 0.0, 0.0)
    state[GOES_LOW] = 0.0 if raised else 1.0


@chipmunk.compiled
def held_back(place: float, velocity: float, extent: float, seconds: float) -> float:
    """The velocity along one axis that takes a hand no farther than `HAND_ROOM` beyond the table."""
    lowest, highest = (-HAND_ROOM - place) / seconds, (extent + HAND_ROOM - place) / seconds
    return min(max(velocity, lowest), highest)


@chipmunk.compiled
def tick(
    handle: Addresses, state: FloatArray, box: FloatArray, vx: float, vz: float, spin: float, count: int
) -> None:
    """Let ticks pass while the hand is moved at vx and vz, turning at Chipmunk's rate `spin`."""
    speed = length(vx, vz)
    if speed > MAX_HAND_SPEED:
        vx, vz = vx * MAX_HAND_SPEED / speed, vz * MAX_HAND_SPEED / speed
    spin = min(max(spin, -MAX_TWIST), MAX_TWIST)
    steps = 1
    if state[PRESENT] != 0:
        if state[GRIPPED] < 0:
            x, z, _ = hand_pose(handle, state)
            vx = held_back(x, vx, state[WIDTH], count * TICK)
            vz = held_back(z, vz, state[DEPTH], count * TICK)
            if state[RAISED] != 0 and state[GOES_LOW] != 0 and nearest(box, x, z, HAND_RADIUS, True) < 0:
                lower(handle, state, vx, vz, spin)
        move_arm(handle, state, vx, vz, spin)
        if state[RAISED] != 0:
            state[X] += vx * count * TICK
            state[Z] += vz * count * TICK
            state[ANGLE] += spin * count * TICK
        elif speed > _FAST:
            way, turn = speed * count * TICK, fabs(spin) * count * TICK
            if state[GRIPPED] < 0 or not clear(handle, state, box, way, turn):
                steps = _FAST_STEPS
    let_pass(handle, state, box, count, steps)


@chipmunk.compiled
def settle(handle: Addresses, state: FloatArray, box: FloatArray, most: int) -> None:
    """Let ticks pass, with the hand held where it is, until everything is at rest."""
    for _ in range(most):
        if state[STILL] != 0:
            return
        if state[PRESENT] != 0:
            move_arm(handle, state, 0.0, 0.0, 0.0)
        let_pass(handle, state, box, 1, GUIDED_STEPS)


@chipmunk.compiled
def plan(
    handle: Addresses, state: FloatArray, way: FloatArray, x: float, z: float, turn: float, speed: float
) -> None:
    """Fill in a straight way of the hand from where it is, smooth from rest to rest, without limits."""
    way[:] = 0.0
    way[FROM_X], way[FROM_Z], way[FROM_ANGLE] = hand_pose(handle, state)
    way[TO_X], way[TO_Z], way[TO_ANGLE] = x, z, way[FROM_ANGLE] - turn
    way[BEFORE_X], way[BEFORE_Z], way[BEFORE_ANGLE] = way[FROM_X], way[FROM_Z], way[FROM_ANGLE]
    way[WAY_SPEED] = speed
    # In its middle smoothstep is one and a half times as fast as on average.
    seconds = 1.5 * max(length(x - way[FROM_X], z - way[FROM_Z]) / speed, fabs(turn) / MAX_TWIST)
    way[WAY_PERIODS] = max(1.0, ceil(seconds / TICK))
    if state[RAISED] == 0:
        way[WAY_PERIODS] = ceil(way[WAY_PERIODS] / _PERIOD)
    way[LIMIT_METRES] = way[LIMIT_RADIANS] = way[LIMIT_EFFORT] = inf
    way[DIAGONAL] = 1.0
    way[BEGAN_METRES], way[BEGAN_RADIANS] = state[METRES], state[RADIANS]


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
        if state[RAISED] != 0:
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
    vx, vz, spin = (x - state[X]) / TICK, (z - state[Z]) / TICK, (angle - state[ANGLE]) / TICK
    state[X], state[Z], state[ANGLE] = x, z, angle
    if done:
        vx = vz = spin = 0.0
        way[WAY_DONE] = 1.0
    state[VELOCITY_X], state[VELOCITY_Z], state[SPIN] = vx, vz, spin
    let_pass(handle, state, box, 1, GUIDED_STEPS)


@chipmunk.compiled
def to_come(handle: Addresses, state: FloatArray, box: FloatArray) -> tuple[float, float]:
    """How far all boxes will still slide, and turn, if the hand brakes now; metres and radians."""
    metres = radians = 0.0
    held = int(state[GRIPPED])
    for i in range(len(box)):
        if box[i, MOVABLE] > 0:
            vx, vz = chipmunk.get_velocity(handle[FIRST + i])
            speed, spin = length(vx, vz), fabs(chipmunk.get_spin(handle[FIRST + i]))
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
    if state[STILL] == 0:
        metres, radians = to_come(handle, state, box)
    metres += state[METRES] - way[BEGAN_METRES]
    radians += state[RADIANS] - way[BEGAN_RADIANS]
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
        seconds = _PERIOD * TICK
        x, z, angle = hand_pose(handle, state)
        to_x, to_z, to_angle = way[TO_X], way[TO_Z], way[TO_ANGLE]
        if period < way[WAY_PERIODS]:
            to_x, to_z, to_angle = on_the_way(way, period / way[WAY_PERIODS])
        now_x, now_z, now_spin = hand_motion(handle, state)
        fastest = max(way[WAY_SPEED], length(now_x, now_z))
        turning = fabs(now_spin) + MAX_TWIST if to_angle != angle else fabs(now_spin)
        way[STEPS] = GUIDED_STEPS
        if clear(handle, state, box, fastest * seconds, turning * seconds):
            way[STEPS] = 1.0
        # It first goes on as it does now, for as long as a step takes.
        delay = TICK / way[STEPS]
        vx = (to_x - x - now_x * delay) / seconds
        vz = (to_z - z - now_z * delay) / seconds
        spin = (to_angle - angle - now_spin * delay) / seconds
        fast = max(1.0, length(vx, vz) / way[WAY_SPEED])
        move_arm(handle, state, vx / fast, vz / fast, min(max(spin, -MAX_TWIST), MAX_TWIST))
    let_pass(handle, state, box, 1, int(way[STEPS]))
    way[WAY_TICKS] += 1
    ticks += 1
    if ticks % _PERIOD == 0:
        x, z, angle = hand_pose(handle, state)
        moved = max(fabs(x - way[BEFORE_X]), max(fabs(z - way[BEFORE_Z]), fabs(angle - way[BEFORE_ANGLE])))
        way[BEFORE_X], way[BEFORE_Z], way[BEFORE_ANGLE] = x, z, angle
        period = ticks // _PERIOD
        stopped = period > way[WAY_PERIODS] and moved < _STOPPED
        if stopped or period >= way[WAY_PERIODS] + _PATIENCE:
            move_arm(handle, state, 0.0, 0.0, 0.0)
            way[WAY_DONE] = 1.0


@chipmunk.compiled
def brake_tick(handle: Addresses, state: FloatArray, box: FloatArray, way: FloatArray) -> None:
    """A tick of a hand that stops where it is; the way is done when it has."""
    move_arm(handle, state, 0.0, 0.0, 0.0)
    let_pass(handle, state, box, 1, GUIDED_STEPS)
    braked(handle, state, way)


@chipmunk.compiled
def braked(handle: Addresses, state: FloatArray, way: FloatArray) -> None:
    """After a tick of braking: a hand that has stopped lets go and touches nothing any more."""
    way[BRAKING] += 1
    vx, vz, _ = hand_motion(handle, state)
    if length(vx, vz) < _BRAKED or way[BRAKING] > _PATIENCE:
        raise_hand(handle, state)
        way[WAY_DONE] = 1.0


@chipmunk.compiled
def yaw_of(angle: float) -> float:
    """The yaw in [-pi, pi) of an angle of Chipmunk's."""
    yaw = -angle
    while yaw >= pi:
        yaw -= 2 * pi
    while yaw < -pi:
        yaw += 2 * pi
    return yaw
