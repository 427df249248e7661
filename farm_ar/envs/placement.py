"""Placing objects one after the other, each where it keeps clear of those before it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry.angles import wrap_angle
from farm_ar.geometry.rectangles import length, separation
from farm_ar.kernels import compiled

_ROUNDED = 1 + 1e-9  # footprints farther apart than their corners reach do not overlap, whatever the rounding


class Placement(NamedTuple):
    """What has been placed of N objects.

    Args:
        position: (N, 2) their centres, metres.
        yaw: (N,) their headings, radians.
        placed: (N,) those that have their pose.
    """

    position: FloatArray
    yaw: FloatArray
    placed: BoolArray


class Clearance(NamedTuple):
    """How far objects have to be from one another.

    Args:
        size: (N, 3) width, height, depth, metres.
        keeps_clear: (N, N) pairs whose footprints must not overlap.
        gap: how far from one another the footprints of those must be, metres.
        apart: how far from one another all centres must be, metres.
    """

    size: FloatArray
    keeps_clear: BoolArray
    gap: float
    apart: float


@compiled
def place_in_turn(turns: IntArray, tries: FloatArray, so_far: Placement, room: Clearance) -> bool:
    """Give each object the first of its poses that keeps clear of all that have theirs.

    Args:
        turns: (K,) the objects to place, in this order.
        tries: (K, T, 3) x, z and yaw of the poses to try for each.
        so_far: what has been placed; changed in place.
        room: how far they have to be from one another.

    Returns:
        Whether each found one; the first that did not is left as it was, and so are those after it.
    """
    position, yaw, placed, size = so_far.position, so_far.yaw, so_far.placed, room.size
    for k in range(len(turns)):
        i = turns[k]
        found = False
        half_width, half_depth = size[i, 0] / 2 + room.gap, size[i, 2] / 2 + room.gap
        corner = length(half_width, half_depth)
        for t in range(tries.shape[1]):
            x, z, heading = tries[k, t]
            fits = True
            for j in range(len(placed)):
                if not placed[j]:
                    continue
                dx, dz = position[j, 0] - x, position[j, 1] - z
                away = dx * dx + dz * dz
                if away < room.apart**2:
                    fits = False
                    break
                other_width, other_depth = size[j, 0] / 2, size[j, 2] / 2
                far = _ROUNDED * (corner + length(other_width, other_depth))
                if room.keeps_clear[i, j] and away <= far * far:
                    half, other = (half_width, half_depth), (other_width, other_depth)
                    if separation(dx, dz, -heading, -yaw[j], *half, *other)[0] < 0:
                        fits = False
                        break
            if fits:
                position[i, 0], position[i, 1], yaw[i] = x, z, heading
                placed[i] = found = True
                break
        if not found:
            return False
    return True


@compiled
def within(value: float, low: float, high: float) -> float:
    """The value, or the limit that it is beyond."""
    return min(max(value, low), high)


@compiled
def poses_nearby(
    turns: IntArray,
    drawn: FloatArray,
    home: FloatArray,
    heading: FloatArray,
    edge: FloatArray,
    room: FloatArray,
    spread: tuple[float, float],
    limit: float,
) -> FloatArray:
    """Poses near objects' own.

    A heading near 0 stays near it: were any allowed, turning alone would fool the method.

    Args:
        turns: (K,) the objects.
        drawn: (K, T, 3) normal numbers.
        home: (N, 2) where each object's own place is, metres.
        heading: (N,) their own headings, radians.
        edge: (N, 2) how far from the edges of the room they keep, metres.
        room: (2,) its width and depth, metres.
        spread: SD of position, metres, and of heading, radians.
        limit: how near to 0 a heading stays that is so near, radians.

    Returns:
        (K, T, 3) x, z and yaw.
    """
    pose = np.empty(drawn.shape)
    for k in range(len(turns)):
        i = turns[k]
        near = abs(wrap_angle(heading[i])) <= limit
        for t in range(drawn.shape[1]):
            for axis in range(2):
                moved = drawn[k, t, axis] * spread[0] + home[i, axis]
                pose[k, t, axis] = within(moved, edge[i, axis], room[axis] - edge[i, axis])
            turned = wrap_angle(drawn[k, t, 2] * spread[1] + heading[i])
            pose[k, t, 2] = within(turned, -limit, limit) if near else turned
    return pose


@compiled
def poses_anywhere(
    turns: IntArray, drawn: FloatArray, edge: FloatArray, room: FloatArray, limit: float
) -> FloatArray:
    """Poses all over a room, with headings near 0; arguments as for `poses_nearby`, but numbers from 0 to 1.

    Returns:
        (K, T, 3) x, z and yaw.
    """
    pose = np.empty(drawn.shape)
    for k in range(len(turns)):
        i = turns[k]
        for t in range(drawn.shape[1]):
            for axis in range(2):
                place = room[axis] * drawn[k, t, axis]
                pose[k, t, axis] = within(place, edge[i, axis], room[axis] - edge[i, axis])
            pose[k, t, 2] = -limit + 2 * limit * drawn[k, t, 2]
    return pose
