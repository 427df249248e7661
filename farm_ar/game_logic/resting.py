"""Compiled: where the boxes of a plane are, and whether all has come to rest."""

from __future__ import annotations

from math import fabs, sqrt

from farm_ar.arrays import FloatArray
from farm_ar.game_logic import chipmunk, plane, wedges
from farm_ar.game_logic.plane import Addresses

# At rest: from the sixth tick after the last touch on, nothing gets on by more than 3 mm/s, or 30 mrad/s, in
# three ticks. Places are compared because what pushes overlapping boxes apart does not show in their
# velocities, over three ticks because a wedged box trembles.
_WINDOW = 3
_STILL_METRES, _STILL_RADIANS = 3e-3 * _WINDOW * plane.TICK, 3e-2 * _WINDOW * plane.TICK


@chipmunk.compiled
def length(x: float, z: float) -> float:
    """Of a vector; `hypot` is not the same to the last bit everywhere."""
    return sqrt(x * x + z * z)


@chipmunk.compiled
def read(handle: Addresses, state: FloatArray, box: FloatArray) -> None:
    """Bring the boxes' poses up to date, and add up how far they have been moved and turned."""
    changed = False
    for i in range(len(box)):
        if box[i, plane.MOVABLE] > 0:
            x, z = chipmunk.get_position(handle[plane.FIRST + i])
            angle = chipmunk.get_angle(handle[plane.FIRST + i])
            dx, dz, turn = x - box[i, plane.BOX_X], z - box[i, plane.BOX_Z], angle - box[i, plane.BOX_ANGLE]
            if dx != 0 or dz != 0 or turn != 0:
                changed = True
                state[plane.METRES] += length(dx, dz)
                state[plane.RADIANS] += fabs(turn)
                box[i, plane.BOX_X], box[i, plane.BOX_Z], box[i, plane.BOX_ANGLE] = x, z, angle
    if changed:
        state[plane.CHANGES] += 1


@chipmunk.compiled
def wake(state: FloatArray) -> None:
    """Something was touched."""
    state[plane.STILL] = 0.0
    state[plane.QUIET] = 0.0


@chipmunk.compiled
def come_to_rest(handle: Addresses, state: FloatArray, box: FloatArray) -> None:
    """After a tick in which nobody moved anything: see whether all is still by now."""
    state[plane.QUIET] += 1
    if state[plane.QUIET] % _WINDOW != 0:
        return
    still = True
    for i in range(len(box)):
        if box[i, plane.MOVABLE] > 0:
            if (
                fabs(box[i, plane.BOX_X] - box[i, plane.OLD_X]) > _STILL_METRES
                or fabs(box[i, plane.BOX_Z] - box[i, plane.OLD_Z]) > _STILL_METRES
                or fabs(box[i, plane.BOX_ANGLE] - box[i, plane.OLD_ANGLE]) > _STILL_RADIANS
            ):
                still = False
            box[i, plane.OLD_X], box[i, plane.OLD_Z], box[i, plane.OLD_ANGLE] = (
                box[i, plane.BOX_X],
                box[i, plane.BOX_Z],
                box[i, plane.BOX_ANGLE],
            )
    if still and state[plane.QUIET] > _WINDOW:
        state[plane.STILL] = 1.0
        wedges.free_wedged(handle, state, box)
        read(handle, state, box)
        for i in range(len(box)):
            if box[i, plane.MOVABLE] > 0:
                vx, vz = chipmunk.get_velocity(handle[plane.FIRST + i])
                if vx != 0 or vz != 0 or chipmunk.get_spin(handle[plane.FIRST + i]) != 0:
                    chipmunk.set_velocity(handle[plane.FIRST + i], 0.0, 0.0)
                    chipmunk.set_spin(handle[plane.FIRST + i], 0.0)
