"""Kernels: which bodies are near."""

from __future__ import annotations

from math import fabs

from farm_ar.game_logic.physics import chipmunk
from farm_ar.game_logic.physics.overlap_resolution import are_near, separation
from farm_ar.game_logic.physics.state import Body, State
from farm_ar.geometry import rectangles
from farm_ar.geometry.rectangles import length
from farm_ar.structs import Structs

# Nothing is near what the hand moves while there are so many metres between them, and everything else is slow
# while nothing moves by more than so many metres a second.
_NEAR, _SLOW = 0.004, 0.05


@chipmunk.compiled
def distance(body: Body, x: float, z: float) -> float:
    """From a point to a body's footprint, metres; 0 inside."""
    return rectangles.point_distance(x - body.x, z - body.z, body.angle, body.half_width, body.half_depth)


@chipmunk.compiled
def nearest(bodies: Structs[Body], x: float, z: float, reach: float, fixed: bool) -> int:
    """The movable body, or with `fixed` the body, nearest to a point and nearer than `reach`; -1 for none."""
    found, least = -1, reach
    for i in range(len(bodies)):
        body = bodies[i]
        if fixed or body.movable:
            # Cheap: farther away than its corners reach, it cannot be the nearest.
            far = least + body.half_width + body.half_depth
            if fabs(x - body.x) < far and fabs(z - body.z) < far:
                away = distance(body, x, z)
                if away < least:
                    found, least = i, away
    return found


@chipmunk.compiled
def keeps_clear_of_edges(state: State, body: Body, room: float) -> bool:
    """Whether a footprint is farther than `room` metres from the table's edges."""
    corner = length(body.half_width, body.half_depth)
    if (
        corner + room < body.x < state.width - corner - room
        and corner + room < body.z < state.depth - corner - room
    ):
        return True
    wide, deep = rectangles.half_extent(body.angle, body.half_width, body.half_depth)
    wide, deep = wide + room, deep + room
    return wide < body.x < state.width - wide and deep < body.z < state.depth - deep


@chipmunk.compiled
def is_clear(
    state: State, bodies: Structs[Body], x: float, z: float, radius: float, metres: float, radians: float
) -> bool:
    """Whether what the hand moves meets nothing within so far a way and turn, and nothing else moves.

    Args:
        state: of the table.
        bodies: likewise.
        x: where the middle of the hand is, metres.
        z: likewise.
        radius: of the hand, metres.
        metres: the way.
        radians: the turn.
    """
    held = state.hand.gripped
    room = metres + _NEAR
    if held >= 0:
        room += radians * length(bodies[held].half_width, bodies[held].half_depth)
        if not keeps_clear_of_edges(state, bodies[held], room):
            return False
    for i in range(len(bodies)):
        if i == held:
            continue
        if held >= 0:
            if are_near(bodies[held], bodies[i], room) and separation(bodies, held, i)[0] <= room:
                return False
        elif distance(bodies[i], x, z) <= radius + room:
            return False
        if bodies[i].movable:
            vx, vz = chipmunk.get_velocity(bodies[i].address)
            if fabs(vx) > _SLOW or fabs(vz) > _SLOW:
                return False
    return True
