"""Kernels: overlaps that are left when everything has come to rest are resolved by sharing the room.

A hand is strong enough to press a body into a gap that is a little too narrow. Between the table's edge and
what never moves the physics then find no rest without an overlap, since all that they do is to push. Surfaces
stand out from footprints, so that there nearly always is room for the footprints alone: here they share it.
"""

from __future__ import annotations

from math import fabs

from farm_ar.game_logic.physics import chipmunk
from farm_ar.game_logic.physics.state import Body, State
from farm_ar.geometry import rectangles
from farm_ar.structs import Structs

# Deeper than this, metres, nothing may stand in another or over the edge when all is at rest; afterwards
# nothing does by more than the second; so many times all is gone through at most.
_TOLERATED, _LEFT = 2e-4, 1e-5
_ROUNDS = 200


@chipmunk.compiled
def separation(bodies: Structs[Body], i: int, k: int) -> tuple[float, float, float]:
    """How far apart two footprints are, metres, below 0 where they overlap; and along what.

    Returns:
        As `rectangles.separation`.
    """
    one, other = bodies[i], bodies[k]
    return rectangles.separation(
        other.x - one.x,
        other.z - one.z,
        one.angle,
        other.angle,
        one.half_width,
        one.half_depth,
        other.half_width,
        other.half_depth,
    )


@chipmunk.compiled
def are_near(one: Body, other: Body, room: float) -> bool:
    """Whether two footprints may be no farther apart than `room` metres; quick, and never wrongly no."""
    far = one.half_width + one.half_depth
    far += other.half_width + other.half_depth
    return bool(fabs(one.x - other.x) <= far + room and fabs(one.z - other.z) <= far + room)


@chipmunk.compiled
def may_overlap(one: Body, other: Body) -> bool:
    """Whether one of two bodies can be moved, and they are so near that they may overlap."""
    return (one.movable or other.movable) and are_near(one, other, 0.0)


@chipmunk.compiled
def way_to_table(state: State, body: Body) -> tuple[float, float]:
    """How far a footprint has to move along x and z to be on the table, metres; 0 where it is."""
    wide, deep = rectangles.half_extent(body.angle, body.half_width, body.half_depth)
    x, z = 0.0, 0.0
    if body.x < wide:
        x = wide - body.x
    elif body.x > state.width - wide:
        x = state.width - wide - body.x
    if body.z < deep:
        z = deep - body.z
    elif body.z > state.depth - deep:
        z = state.depth - deep - body.z
    return x, z


@chipmunk.compiled
def push_apart(state: State, bodies: Structs[Body]) -> float:
    """Move each body that overlaps another, or the edge, out of it once, each of two by half if both can.

    Returns:
        How deep the deepest overlap was, metres.
    """
    deepest = 0.0
    for i in range(len(bodies)):
        body = bodies[i]
        for k in range(i):
            other = bodies[k]
            if not may_overlap(body, other):
                continue
            gap, x, z = separation(bodies, i, k)
            if gap >= 0:
                continue
            depth = -gap
            deepest = max(deepest, depth)
            share = (0.5 if other.movable else 1.0) if body.movable else 0.0
            body.x -= share * depth * x
            body.z -= share * depth * z
            other.x += (1 - share) * depth * x
            other.z += (1 - share) * depth * z
        if body.movable:
            x, z = way_to_table(state, body)
            deepest = max(deepest, fabs(x), fabs(z))
            body.x += x
            body.z += z
    return deepest


@chipmunk.compiled
def has_overlap(state: State, bodies: Structs[Body]) -> bool:
    """Whether a footprint stands too deep in another or over the edge."""
    for i in range(len(bodies)):
        if bodies[i].movable:
            x, z = way_to_table(state, bodies[i])
            if fabs(x) > _TOLERATED or fabs(z) > _TOLERATED:
                return True
        for k in range(i):
            if may_overlap(bodies[i], bodies[k]) and -separation(bodies, i, k)[0] > _TOLERATED:
                return True
    return False


@chipmunk.compiled
def resolve_overlaps(state: State, bodies: Structs[Body]) -> None:
    """If all is at rest but footprints overlap, have them share the room that there is.

    Chipmunk's bodies are moved; the poses are left for `sleeping.read_poses` to bring up to date.
    """
    if not has_overlap(state, bodies):
        return
    moved = bodies.copy()
    for _ in range(_ROUNDS):
        if push_apart(state, moved) <= _LEFT:
            break
    for i in range(len(bodies)):
        x, z = moved[i].x, moved[i].z
        if x != bodies[i].x or z != bodies[i].z:
            chipmunk.set_position(bodies[i].address, x, z)
