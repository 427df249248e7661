"""Compiled: the hand, which an arm of limited force moves: how it grips, lifts, goes low and is steered."""

from __future__ import annotations

from math import fabs, pi

from farm_ar.arrays import FloatArray
from farm_ar.game_logic import chipmunk, nearness, plane, resting
from farm_ar.game_logic.plane import Addresses
from farm_ar.geometry.angles import wrap_angle

# What the arm can do at most, newtons and newton metres. An arm without limits shoots away what it squeezes
# against an edge; one of 50 N now and then wedges a box into a gap too narrow for it.
_FORCE, _TORQUE = 30.0, 3.0

_TURNS = 1000  # more than a hand makes in half an hour

HAND_RADIUS = 0.03
"""Radius of the disc, metres."""

HAND_ROOM = 0.5
"""How far beyond the table a hand may go, metres."""

MAX_HAND_SPEED = 1.5
"""Fastest that a hand is moved, metres a second."""

MAX_TWIST = pi
"""Fastest that a hand is turned, radians a second."""


@chipmunk.compiled
def hand_pose(handle: Addresses, state: FloatArray) -> tuple[float, float, float]:
    """Where the hand is, metres, and its angle, radians."""
    if state[plane.RAISED] != 0:
        return state[plane.X], state[plane.Z], state[plane.ANGLE]
    x, z = chipmunk.local_to_world(handle[plane.MOVED], state[plane.POINT_X], state[plane.POINT_Z])
    return x, z, chipmunk.get_angle(handle[plane.MOVED]) + state[plane.TURN]


@chipmunk.compiled
def hand_motion(handle: Addresses, state: FloatArray) -> tuple[float, float, float]:
    """How the hand moves, metres a second, and turns, radians a second."""
    if state[plane.RAISED] != 0:
        return state[plane.VELOCITY_X], state[plane.VELOCITY_Z], state[plane.SPIN]
    vx, vz = chipmunk.get_velocity_at(handle[plane.MOVED], state[plane.POINT_X], state[plane.POINT_Z])
    return vx, vz, chipmunk.get_spin(handle[plane.MOVED])


@chipmunk.compiled
def look_at_hand(handle: Addresses, state: FloatArray, hand: FloatArray) -> None:
    """Fill in the hand's (6,) x, z, angle, velocity along x and z, and spin."""
    hand[0], hand[1], hand[2] = hand_pose(handle, state)
    hand[3], hand[4], hand[5] = hand_motion(handle, state)


@chipmunk.compiled
def yaw_of(angle: float) -> float:
    """The yaw in [-pi, pi) of an angle of Chipmunk's.

    Some turns are taken off one by one, as ever: digests of episodes have what that rounds to.
    """
    yaw = -angle
    if fabs(yaw) > _TURNS * 2 * pi:
        return wrap_angle(yaw)
    while yaw >= pi:
        yaw -= 2 * pi
    while yaw < -pi:
        yaw += 2 * pi
    return yaw


@chipmunk.compiled
def move_arm(handle: Addresses, state: FloatArray, vx: float, vz: float, spin: float) -> None:
    """Steer the hand from now on."""
    if vx != state[plane.VELOCITY_X] or vz != state[plane.VELOCITY_Z] or spin != state[plane.SPIN]:
        state[plane.VELOCITY_X], state[plane.VELOCITY_Z], state[plane.SPIN] = vx, vz, spin
        chipmunk.set_velocity(handle[plane.ARM], vx, vz)
        chipmunk.set_spin(handle[plane.ARM], spin)


@chipmunk.compiled
def join(handle: Addresses, state: FloatArray, moved: int) -> None:
    """Have the arm move a body by the point where the hand is."""
    x, z, angle = hand_pose(handle, state)
    handle[plane.MOVED] = moved
    state[plane.POINT_X], state[plane.POINT_Z] = chipmunk.world_to_local(moved, x, z)
    state[plane.TURN] = angle - chipmunk.get_angle(moved)
    pull = chipmunk.new_pivot_joint(
        handle[plane.ARM], moved, 0.0, 0.0, state[plane.POINT_X], state[plane.POINT_Z]
    )
    twist = chipmunk.new_gear_joint(handle[plane.ARM], moved, 0.0, 1.0)
    handle[plane.PULL], handle[plane.TWIST] = pull, twist
    chipmunk.set_max_force(pull, _FORCE)
    chipmunk.set_max_bias(pull, 0.0)
    chipmunk.set_max_force(twist, _TORQUE)
    chipmunk.set_max_bias(twist, 0.0)
    chipmunk.add_constraint(handle[plane.SPACE], pull)
    chipmunk.add_constraint(handle[plane.SPACE], twist)
    state[plane.RAISED] = 0.0
    move_arm(handle, state, 0.0, 0.0, 0.0)


@chipmunk.compiled
def lift(handle: Addresses, state: FloatArray) -> None:
    """Let go, and hover."""
    if state[plane.PRESENT] == 0 or state[plane.RAISED] != 0:
        return
    state[plane.X], state[plane.Z], state[plane.ANGLE] = hand_pose(handle, state)
    for joint in (plane.PULL, plane.TWIST):
        chipmunk.remove_constraint(handle[plane.SPACE], handle[joint])
        chipmunk.free_constraint(handle[joint])
        handle[joint] = 0
    if handle[plane.MOVED] == handle[plane.DISC]:
        chipmunk.remove_shape(handle[plane.SPACE], handle[plane.DISC_SHAPE])
        chipmunk.remove_body(handle[plane.SPACE], handle[plane.DISC])
    if state[plane.GRIPPED] >= 0:
        resting.wake(state)
        # What was pressed together was quiet, too: it must not go to sleep before it is apart.
        for i in range(len(handle) - plane.FIRST):
            chipmunk.activate(handle[plane.FIRST + i])
    state[plane.GRIPPED], state[plane.RAISED] = -1.0, 1.0
    move_arm(handle, state, 0.0, 0.0, 0.0)


@chipmunk.compiled
def lower(handle: Addresses, state: FloatArray, vx: float, vz: float, spin: float) -> None:
    """Put the disc on the table, where it bumps into boxes, moving as the hand does."""
    disc = handle[plane.DISC]
    chipmunk.set_position(disc, state[plane.X], state[plane.Z])
    chipmunk.set_angle(disc, state[plane.ANGLE])
    chipmunk.set_velocity(disc, vx, vz)
    chipmunk.set_spin(disc, spin)
    chipmunk.add_body(handle[plane.SPACE], disc)
    chipmunk.add_shape(handle[plane.SPACE], handle[plane.DISC_SHAPE])
    join(handle, state, disc)


@chipmunk.compiled
def grip(handle: Addresses, state: FloatArray, box: FloatArray, i: int, reach: float) -> bool:
    """Hold a box whose footprint is within reach. There is no disc then that could shove anything."""
    if state[plane.PRESENT] == 0 or state[plane.GRIPPED] >= 0 or box[i, plane.MOVABLE] == 0:
        return False
    x, z, _ = hand_pose(handle, state)
    if nearness.distance(box, i, x, z) > reach:
        return False
    lift(handle, state)
    join(handle, state, handle[plane.FIRST + i])
    state[plane.GRIPPED] = i
    resting.wake(state)
    return True


@chipmunk.compiled
def raise_hand(handle: Addresses, state: FloatArray) -> None:
    """Let go, and stay above the boxes from now on."""
    lift(handle, state)
    state[plane.GOES_LOW] = 0.0


@chipmunk.compiled
def bring_hand(handle: Addresses, state: FloatArray, x: float, z: float, raised: bool) -> None:
    """Put a hand in, in place of one that may be there."""
    lift(handle, state)
    state[plane.PRESENT], state[plane.RAISED], state[plane.GRIPPED] = 1.0, 1.0, -1.0
    state[plane.X] = min(max(x, -HAND_ROOM), state[plane.WIDTH] + HAND_ROOM)
    state[plane.Z] = min(max(z, -HAND_ROOM), state[plane.DEPTH] + HAND_ROOM)
    state[plane.ANGLE] = 0.0
    move_arm(handle, state, 0.0, 0.0, 0.0)
    state[plane.GOES_LOW] = 0.0 if raised else 1.0


@chipmunk.compiled
def held_back(place: float, velocity: float, extent: float, seconds: float) -> float:
    """The velocity along one axis that takes a hand no farther than `HAND_ROOM` beyond the table."""
    lowest, highest = (-HAND_ROOM - place) / seconds, (extent + HAND_ROOM - place) / seconds
    return min(max(velocity, lowest), highest)
