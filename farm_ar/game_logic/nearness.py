"""Compiled: which boxes of a plane are near."""

from __future__ import annotations

from math import cos, fabs, sin

from farm_ar.arrays import FloatArray
from farm_ar.game_logic import chipmunk, plane, resting


@chipmunk.compiled
def distance(box: FloatArray, i: int, x: float, z: float) -> float:
    """From a point to a box's footprint, metres; 0 inside."""
    sine, cosine = sin(box[i, plane.BOX_ANGLE]), cos(box[i, plane.BOX_ANGLE])
    dx, dz = x - box[i, plane.BOX_X], z - box[i, plane.BOX_Z]
    across = max(fabs(cosine * dx + sine * dz) - box[i, plane.HALF_WIDTH], 0.0)
    ahead = max(fabs(cosine * dz - sine * dx) - box[i, plane.HALF_DEPTH], 0.0)
    return resting.length(across, ahead)


@chipmunk.compiled
def nearest(box: FloatArray, x: float, z: float, reach: float, fixed: bool) -> int:
    """The movable box, or with `fixed` the box, nearest to a point and nearer than `reach`; -1 for none."""
    found, least = -1, reach
    for i in range(len(box)):
        if fixed or box[i, plane.MOVABLE] > 0:
            # Cheap: farther away than its corners reach, it cannot be the nearest.
            far = least + box[i, plane.HALF_WIDTH] + box[i, plane.HALF_DEPTH]
            if fabs(x - box[i, plane.BOX_X]) < far and fabs(z - box[i, plane.BOX_Z]) < far:
                away = distance(box, i, x, z)
                if away < least:
                    found, least = i, away
    return found


@chipmunk.compiled
def apart(box: FloatArray, i: int, k: int, room: float) -> bool:
    """Whether two footprints are farther apart than `room` metres along a side of one of them."""
    dx, dz = box[k, plane.BOX_X] - box[i, plane.BOX_X], box[k, plane.BOX_Z] - box[i, plane.BOX_Z]
    turn = box[k, plane.BOX_ANGLE] - box[i, plane.BOX_ANGLE]
    shared_sine, shared_cosine = fabs(sin(turn)), fabs(cos(turn))
    for one, other in ((i, k), (k, i)):
        sine, cosine = sin(box[one, plane.BOX_ANGLE]), cos(box[one, plane.BOX_ANGLE])
        width, depth = box[other, plane.HALF_WIDTH], box[other, plane.HALF_DEPTH]
        across = box[one, plane.HALF_WIDTH] + shared_cosine * width + shared_sine * depth
        ahead = box[one, plane.HALF_DEPTH] + shared_sine * width + shared_cosine * depth
        if fabs(cosine * dx + sine * dz) > across + room or fabs(cosine * dz - sine * dx) > ahead + room:
            return True
    return False
