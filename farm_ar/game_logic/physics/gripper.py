"""The player's hand: a disc that bumps into buildings while it is low, and that holds one when it grips.

Hovering it is not in the space at all. Low it is a disc, holding it is a point of the building, and an arm of
limited force makes the disc or the building move as it is steered. The arm follows a velocity, not a place:
when something holds it up it presses, but does not make up for it afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import fabs, pi

from farm_ar.arrays import FloatArray
from farm_ar.game_logic.physics import chipmunk, proximity, sleeping
from farm_ar.game_logic.physics.state import Body, State
from farm_ar.geometry.angles import wrap_angle
from farm_ar.geometry.camera import Eye, sees
from farm_ar.structs import Structs

# What the arm can do at most, newtons and newton metres. An arm without limits shoots away what it squeezes
# against an edge; one of 50 N now and then wedges a body into a gap too narrow for it.
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

REACH = 0.06
"""How far from a footprint the middle of a hand may be and still take hold of the building, metres."""


@dataclass(frozen=True, eq=False)
class HandState:
    """A hand as it is now.

    Args:
        position: (2,) middle of the hand (x, z), metres.
        yaw: heading, radians, in [-pi, pi); 0 when it comes in.
        velocity: (2,) how it moves, metres a second.
        gripped: index of the building that it holds, None for none.
        raised: whether it hovers above the buildings and touches none.
    """

    position: FloatArray
    yaw: float
    velocity: FloatArray
    gripped: int | None
    raised: bool


@chipmunk.compiled
def hand_pose(state: State) -> tuple[float, float, float]:
    """Where the hand is, metres, and its angle, radians."""
    hand, moved = state.hand, state.space.moved
    if hand.raised:
        return hand.x, hand.z, hand.angle
    x, z = chipmunk.local_to_world(moved, hand.point_x, hand.point_z)
    return x, z, chipmunk.get_angle(moved) + hand.turn


@chipmunk.compiled
def hand_motion(state: State) -> tuple[float, float, float]:
    """How the hand moves, metres a second, and turns, radians a second."""
    hand, moved = state.hand, state.space.moved
    if hand.raised:
        return hand.velocity_x, hand.velocity_z, hand.spin
    vx, vz = chipmunk.get_velocity_at(moved, hand.point_x, hand.point_z)
    return vx, vz, chipmunk.get_spin(moved)


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
def move_arm(state: State, vx: float, vz: float, spin: float) -> None:
    """Steer the hand from now on."""
    hand = state.hand
    if vx != hand.velocity_x or vz != hand.velocity_z or spin != hand.spin:
        hand.velocity_x, hand.velocity_z, hand.spin = vx, vz, spin
        chipmunk.set_velocity(state.space.arm, vx, vz)
        chipmunk.set_spin(state.space.arm, spin)


@chipmunk.compiled
def join(state: State, moved: int) -> None:
    """Have the arm move a body of Chipmunk's by the point where the hand is."""
    x, z, angle = hand_pose(state)
    hand, space = state.hand, state.space
    space.moved = moved
    hand.point_x, hand.point_z = chipmunk.world_to_local(moved, x, z)
    hand.turn = angle - chipmunk.get_angle(moved)
    space.pull = chipmunk.new_pivot_joint(space.arm, moved, 0.0, 0.0, hand.point_x, hand.point_z)
    space.twist = chipmunk.new_gear_joint(space.arm, moved, 0.0, 1.0)
    chipmunk.set_max_force(space.pull, _FORCE)
    chipmunk.set_max_bias(space.pull, 0.0)
    chipmunk.set_max_force(space.twist, _TORQUE)
    chipmunk.set_max_bias(space.twist, 0.0)
    chipmunk.add_constraint(space.space, space.pull)
    chipmunk.add_constraint(space.space, space.twist)
    hand.raised = False
    move_arm(state, 0.0, 0.0, 0.0)


@chipmunk.compiled
def lift(state: State, bodies: Structs[Body]) -> None:
    """Let go, and hover."""
    hand, space = state.hand, state.space
    if not hand.present or hand.raised:
        return
    hand.x, hand.z, hand.angle = hand_pose(state)
    for joint in (space.pull, space.twist):
        chipmunk.remove_constraint(space.space, joint)
        chipmunk.free_constraint(joint)
    space.pull = space.twist = 0
    if space.moved == space.disc:
        chipmunk.remove_shape(space.space, space.disc_shape)
        chipmunk.remove_body(space.space, space.disc)
    if hand.gripped >= 0:
        sleeping.wake(state)
        # What was pressed together was quiet, too: it must not go to sleep before it is apart.
        for i in range(len(bodies)):
            chipmunk.activate(bodies[i].address)
    hand.gripped, hand.raised = -1, True
    move_arm(state, 0.0, 0.0, 0.0)


@chipmunk.compiled
def lower(state: State, vx: float, vz: float, spin: float) -> None:
    """Put the disc on the table, where it bumps into bodies, moving as the hand does."""
    hand, space = state.hand, state.space
    chipmunk.set_position(space.disc, hand.x, hand.z)
    chipmunk.set_angle(space.disc, hand.angle)
    chipmunk.set_velocity(space.disc, vx, vz)
    chipmunk.set_spin(space.disc, spin)
    chipmunk.add_body(space.space, space.disc)
    chipmunk.add_shape(space.space, space.disc_shape)
    join(state, space.disc)


@chipmunk.compiled
def grip(state: State, bodies: Structs[Body], i: int, reach: float) -> bool:
    """Hold a body whose footprint is within reach. There is no disc then that could shove anything."""
    hand = state.hand
    if not hand.present or hand.gripped >= 0 or not bodies[i].movable:
        return False
    x, z, _ = hand_pose(state)
    if proximity.distance(bodies[i], x, z) > reach:
        return False
    lift(state, bodies)
    join(state, bodies[i].address)
    hand.gripped = i
    sleeping.wake(state)
    return True


@chipmunk.compiled
def in_reach(bodies: Structs[Body], eye: Eye, x: float, z: float) -> int:
    """The building that a hand at a place closes on, the nearest if that is in view; -1 for none."""
    found = proximity.nearest(bodies, x, z, REACH, False)
    if found >= 0 and sees(eye, bodies[found].x, bodies[found].elevation, bodies[found].z):
        return found
    return -1


@chipmunk.compiled
def raise_hand(state: State, bodies: Structs[Body]) -> None:
    """Let go, and stay above the bodies from now on."""
    lift(state, bodies)
    state.hand.goes_low = False


@chipmunk.compiled
def bring_hand(state: State, bodies: Structs[Body], x: float, z: float, raised: bool) -> None:
    """Put a hand in, in place of one that may be there."""
    lift(state, bodies)
    hand = state.hand
    hand.present, hand.raised, hand.gripped = True, True, -1
    hand.x = min(max(x, -HAND_ROOM), state.width + HAND_ROOM)
    hand.z = min(max(z, -HAND_ROOM), state.depth + HAND_ROOM)
    hand.angle = 0.0
    move_arm(state, 0.0, 0.0, 0.0)
    hand.goes_low = not raised


@chipmunk.compiled
def held_back(place: float, velocity: float, extent: float, seconds: float) -> float:
    """The velocity along one axis that takes a hand no farther than `HAND_ROOM` beyond the table."""
    lowest, highest = (-HAND_ROOM - place) / seconds, (extent + HAND_ROOM - place) / seconds
    return min(max(velocity, lowest), highest)
