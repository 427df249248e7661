"""Kernels: a hand that lifts what it holds over everything else, and sets it down where there is room.

There is no physics in it: nothing is bumped into or pushed, and where a body comes to stand can be computed.
"""

from __future__ import annotations

from math import ceil, cos, fabs, pi, sin

from farm_ar.game_logic.physics import chipmunk, overlap_resolution, proximity
from farm_ar.game_logic.physics.gripper import MAX_HAND_SPEED, MAX_TWIST, REACH, held_back, in_reach
from farm_ar.game_logic.physics.state import TICK, Body, Limits, State
from farm_ar.geometry.angles import wrap_angle
from farm_ar.geometry.camera import Eye
from farm_ar.geometry.rectangles import length
from farm_ar.structs import Structs

# The way back is looked along in steps of at most so many metres and radians, and the first free pose on it
# then found by halving; footprints may touch.
_STEP_METRES, _STEP_RADIANS = 5e-3, pi / 90
_HALVINGS = 30
_TOUCHING = 1e-9
_REACHES = 2.0 + 1e-9


@chipmunk.compiled
def take(state: State, bodies: Structs[Body], i: int, reach: float) -> bool:
    """Take hold of a body from above, if its footprint is within reach and the hand is empty."""
    hand, body = state.hand, bodies[i]
    if not hand.present or hand.gripped >= 0 or not body.movable:
        return False
    if proximity.distance(body, hand.x, hand.z) > reach:
        return False
    x, z, c, s = hand.x - body.x, hand.z - body.z, cos(body.angle), sin(body.angle)
    hand.point_x, hand.point_z = c * x + s * z, c * z - s * x
    hand.turn = hand.angle - body.angle
    hand.from_x, hand.from_z, hand.from_angle = body.x, body.z, body.angle
    hand.gripped = i
    return True


@chipmunk.compiled
def follow(state: State, bodies: Structs[Body]) -> None:
    """Bring what the hand holds to where the hand is."""
    hand = state.hand
    body = bodies[hand.gripped]
    body.angle = hand.angle - hand.turn
    c, s = cos(body.angle), sin(body.angle)
    body.x = hand.x - (c * hand.point_x - s * hand.point_z)
    body.z = hand.z - (s * hand.point_x + c * hand.point_z)
    state.changes += 1


@chipmunk.compiled
def has_room(state: State, bodies: Structs[Body], i: int) -> bool:
    """Whether a body lies on the table, and no other reaches into its footprint."""
    x, z = overlap_resolution.way_to_table(state, bodies[i])
    if fabs(x) > _TOUCHING or fabs(z) > _TOUCHING:
        return False
    body = bodies[i]
    for k in range(len(bodies)):
        other = bodies[k]
        # Cheap: twice the sum of the squares of two half diagonals is no less than the square of their sum.
        x, z = body.x - other.x, body.z - other.z
        reach = body.half_width * body.half_width + body.half_depth * body.half_depth
        reach += other.half_width * other.half_width + other.half_depth * other.half_depth
        near = k != i and x * x + z * z <= _REACHES * reach
        if near and overlap_resolution.separation(bodies, i, k)[0] < -_TOUCHING:
            return False
    return True


@chipmunk.compiled
def place(
    body: Body, x: float, z: float, angle: float, way_x: float, way_z: float, turn: float, share: float
) -> None:
    """Put a body where it is after a share of its way and turn from a pose."""
    body.x, body.z, body.angle = x + share * way_x, z + share * way_z, angle + share * turn


@chipmunk.compiled
def set_down(
    state: State, bodies: Structs[Body], metres: float, radians: float, effort: float, diagonal: float
) -> None:
    """Put down what is held: where it is, or on the straight way back, as soon as there is room.

    Where it was taken from it may always be put.

    Args:
        state: of the table.
        bodies: likewise.
        metres: how far it may come at most.
        radians: how far it may be turned.
        effort: what both together may be, as a share of `diagonal` and of half a turn.
        diagonal: of the scene, metres.
    """
    hand = state.hand
    if hand.gripped < 0:
        return
    i, body = hand.gripped, bodies[hand.gripped]
    x, z, angle = hand.from_x, hand.from_z, hand.from_angle
    way_x, way_z, turn = body.x - x, body.z - z, wrap_angle(body.angle - angle)
    way, most = length(way_x, way_z), 1.0
    if way > metres:
        most = max(metres, 0.0) / way
    if fabs(turn) * most > radians:
        most = max(radians, 0.0) / fabs(turn)
    cost = way / diagonal + fabs(turn) / pi
    if cost * most > effort:
        most = max(effort, 0.0) / cost
    steps = ceil(most * max(way / _STEP_METRES, fabs(turn) / _STEP_RADIANS))
    share, taken = most, 0.0
    for k in range(steps, 0, -1):
        share = most * k / steps
        place(body, x, z, angle, way_x, way_z, turn, share)
        if has_room(state, bodies, i):
            taken = share
            if k < steps:
                low, high = share, most * (k + 1) / steps
                for _ in range(_HALVINGS):
                    middle = 0.5 * (low + high)
                    place(body, x, z, angle, way_x, way_z, turn, middle)
                    if has_room(state, bodies, i):
                        low = middle
                    else:
                        high = middle
                taken = low
            break
    place(body, x, z, angle, way_x, way_z, turn, taken)
    if body.address != 0:  # of a batch's tables there are none in Chipmunk
        chipmunk.set_position(body.address, body.x, body.z)
        chipmunk.set_angle(body.address, body.angle)
    hand.gripped = -1
    if taken > 0:
        state.metres += taken * way
        state.radians += taken * fabs(turn)
    state.changes += 1


@chipmunk.compiled
def set_down_within(state: State, bodies: Structs[Body], limits: Limits) -> None:
    """The same, so that the limits are kept."""
    metres, radians = state.metres - limits.began_metres, state.radians - limits.began_radians
    spent = metres / limits.scene_diagonal + radians / pi
    set_down(
        state,
        bodies,
        limits.metres - metres,
        limits.radians - radians,
        limits.effort - spent,
        limits.scene_diagonal,
    )


@chipmunk.compiled
def control_tick(
    state: State,
    bodies: Structs[Body],
    eye: Eye,
    limits: Limits,
    vx: float,
    vz: float,
    spin: float,
    closed: bool,
) -> None:
    """A tick under a steered hand, as that of `velocity_control`."""
    hand = state.hand
    state.ticks += 1
    if not hand.present:
        return
    if not closed:
        set_down_within(state, bodies, limits)
    elif hand.gripped < 0:
        found = in_reach(bodies, eye, hand.x, hand.z)
        if found >= 0:
            take(state, bodies, found, REACH)
    speed = length(vx, vz)
    if speed > MAX_HAND_SPEED:
        vx, vz = vx * MAX_HAND_SPEED / speed, vz * MAX_HAND_SPEED / speed
    vx, vz = held_back(hand.x, vx, state.width, TICK), held_back(hand.z, vz, state.depth, TICK)
    spin = min(max(spin, -MAX_TWIST), MAX_TWIST)
    hand.velocity_x, hand.velocity_z, hand.spin = vx, vz, spin
    hand.x += vx * TICK
    hand.z += vz * TICK
    hand.angle += spin * TICK
    if hand.gripped >= 0 and (vx != 0 or vz != 0 or spin != 0):
        follow(state, bodies)
