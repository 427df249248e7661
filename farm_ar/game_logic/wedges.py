"""Compiled: boxes that came to rest wedged in, where less room was left than they take.

A hand is strong enough to press a box into a gap that is a little too narrow. Between the table's edge and
what never moves the physics then find no rest without an overlap, since all that they do is to push. Surfaces
stand out from footprints, so that there nearly always is room for the footprints alone: here they share it.
"""

from __future__ import annotations

from math import cos, fabs, inf, sin

from farm_ar.arrays import FloatArray
from farm_ar.game_logic import chipmunk, plane
from farm_ar.game_logic.plane import Addresses

# Deeper than this, metres, nothing may stand in another or over the edge when all is at rest; freed, nothing
# does by more than the second; so many times all is gone through at most.
_TOLERATED, _LEFT = 2e-4, 1e-5
_ROUNDS = 200


@chipmunk.compiled
def depth_between(box: FloatArray, i: int, k: int) -> tuple[float, float, float]:
    """How deep two footprints reach into each other, metres, below 0 where they do not; and along what.

    Returns:
        The depth, and the unit vector along which the second has to move to get out by the shortest way.
    """
    dx, dz = box[k, plane.BOX_X] - box[i, plane.BOX_X], box[k, plane.BOX_Z] - box[i, plane.BOX_Z]
    turn = box[k, plane.BOX_ANGLE] - box[i, plane.BOX_ANGLE]
    shared_sine, shared_cosine = fabs(sin(turn)), fabs(cos(turn))
    least, along_x, along_z = inf, 0.0, 0.0
    for one, other in ((i, k), (k, i)):
        sine, cosine = sin(box[one, plane.BOX_ANGLE]), cos(box[one, plane.BOX_ANGLE])
        width, depth = box[other, plane.HALF_WIDTH], box[other, plane.HALF_DEPTH]
        across, ahead = cosine * dx + sine * dz, cosine * dz - sine * dx
        overlap = box[one, plane.HALF_WIDTH] + shared_cosine * width + shared_sine * depth - fabs(across)
        if overlap < least:
            side = 1.0 if across >= 0 else -1.0
            least, along_x, along_z = overlap, side * cosine, side * sine
        overlap = box[one, plane.HALF_DEPTH] + shared_sine * width + shared_cosine * depth - fabs(ahead)
        if overlap < least:
            side = 1.0 if ahead >= 0 else -1.0
            least, along_x, along_z = overlap, -side * sine, side * cosine
    return least, along_x, along_z


@chipmunk.compiled
def beyond_edge(state: FloatArray, box: FloatArray, i: int) -> tuple[float, float]:
    """How far a footprint has to move along x and z to be on the table, metres; 0 where it is."""
    sine, cosine = fabs(sin(box[i, plane.BOX_ANGLE])), fabs(cos(box[i, plane.BOX_ANGLE]))
    wide = cosine * box[i, plane.HALF_WIDTH] + sine * box[i, plane.HALF_DEPTH]
    deep = sine * box[i, plane.HALF_WIDTH] + cosine * box[i, plane.HALF_DEPTH]
    x, z = box[i, plane.BOX_X], box[i, plane.BOX_Z]
    back_x, back_z = 0.0, 0.0
    if x < wide:
        back_x = wide - x
    elif x > state[plane.WIDTH] - wide:
        back_x = state[plane.WIDTH] - wide - x
    if z < deep:
        back_z = deep - z
    elif z > state[plane.DEPTH] - deep:
        back_z = state[plane.DEPTH] - deep - z
    return back_x, back_z


@chipmunk.compiled
def push_apart(state: FloatArray, box: FloatArray) -> float:
    """Move each box that overlaps another, or the edge, out of it once, each of two by half if both can.

    Returns:
        How deep the deepest overlap was, metres.
    """
    deepest = 0.0
    for i in range(len(box)):
        for k in range(i):
            if box[i, plane.MOVABLE] == 0 and box[k, plane.MOVABLE] == 0:
                continue
            far = box[i, plane.HALF_WIDTH] + box[i, plane.HALF_DEPTH]
            far += box[k, plane.HALF_WIDTH] + box[k, plane.HALF_DEPTH]
            if (
                fabs(box[i, plane.BOX_X] - box[k, plane.BOX_X]) > far
                or fabs(box[i, plane.BOX_Z] - box[k, plane.BOX_Z]) > far
            ):
                continue
            depth, x, z = depth_between(box, i, k)
            if depth <= 0:
                continue
            deepest = max(deepest, depth)
            share = box[i, plane.MOVABLE] / (box[i, plane.MOVABLE] + box[k, plane.MOVABLE])
            box[i, plane.BOX_X] -= share * depth * x
            box[i, plane.BOX_Z] -= share * depth * z
            box[k, plane.BOX_X] += (1 - share) * depth * x
            box[k, plane.BOX_Z] += (1 - share) * depth * z
        if box[i, plane.MOVABLE] > 0:
            x, z = beyond_edge(state, box, i)
            deepest = max(deepest, fabs(x), fabs(z))
            box[i, plane.BOX_X] += x
            box[i, plane.BOX_Z] += z
    return deepest


@chipmunk.compiled
def wedged(state: FloatArray, box: FloatArray) -> bool:
    """Whether a footprint stands too deep in another or over the edge."""
    for i in range(len(box)):
        if box[i, plane.MOVABLE] > 0:
            x, z = beyond_edge(state, box, i)
            if fabs(x) > _TOLERATED or fabs(z) > _TOLERATED:
                return True
        for k in range(i):
            far = box[i, plane.HALF_WIDTH] + box[i, plane.HALF_DEPTH]
            far += box[k, plane.HALF_WIDTH] + box[k, plane.HALF_DEPTH]
            if (
                fabs(box[i, plane.BOX_X] - box[k, plane.BOX_X]) <= far
                and fabs(box[i, plane.BOX_Z] - box[k, plane.BOX_Z]) <= far
                and (box[i, plane.MOVABLE] > 0 or box[k, plane.MOVABLE] > 0)
                and depth_between(box, i, k)[0] > _TOLERATED
            ):
                return True
    return False


@chipmunk.compiled
def free_wedged(handle: Addresses, state: FloatArray, box: FloatArray) -> None:
    """If all is at rest but something wedged in, have footprints share the room that there is.

    The bodies are moved; `box` is left for `resting.read` to bring up to date.
    """
    if not wedged(state, box):
        return
    moved = box.copy()
    for _ in range(_ROUNDS):
        if push_apart(state, moved) <= _LEFT:
            break
    for i in range(len(box)):
        x, z = moved[i, plane.BOX_X], moved[i, plane.BOX_Z]
        if x != box[i, plane.BOX_X] or z != box[i, plane.BOX_Z]:
            chipmunk.set_position(handle[plane.FIRST + i], x, z)
