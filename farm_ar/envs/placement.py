"""Placing objects one after the other, each where it keeps clear of those before it."""

from __future__ import annotations

from typing import NamedTuple

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry.angles import wrap_angle
from farm_ar.geometry.rectangles import separation
from farm_ar.kernels import compiled

_REACHES = (
    2.0 + 1e-9
)  # footprints farther apart than their corners reach do not overlap, whatever the rounding


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


class Strewing(NamedTuple):
    """How poses of N objects are made of numbers that were drawn.

    Args:
        anywhere: whether they are all over the room, or near objects' own.
        home: (N, 2) where each object's own place is, metres.
        heading: (N,) their own headings, radians.
        edge: (N, 2) how far from the edges of the room they keep, metres.
        room: (2,) its width and depth, metres.
        spread: SD of position, metres, and of heading, radians.
        limit: how near to 0 a heading stays that is so near, radians.
    """

    anywhere: bool
    home: FloatArray
    heading: FloatArray
    edge: FloatArray
    room: FloatArray
    spread: tuple[float, float]
    limit: float


@compiled
def within(value: float, low: float, high: float) -> float:
    """The value, or the limit that it is beyond."""
    return min(max(value, low), high)


@compiled(inline="always")
def pose_of(i: int, first: float, second: float, third: float, how: Strewing) -> tuple[float, float, float]:
    """x, z and yaw of an object, from three numbers: from 0 to 1 for a pose anywhere, normal ones otherwise.

    A heading near 0 stays near it: were any allowed, turning alone would fool the method.
    """
    width, depth = how.room[0], how.room[1]
    if how.anywhere:
        x, z, yaw = width * first, depth * second, -how.limit + 2 * how.limit * third
    else:
        x, z = first * how.spread[0] + how.home[i, 0], second * how.spread[0] + how.home[i, 1]
        yaw = wrap_angle(third * how.spread[1] + how.heading[i])
        if abs(wrap_angle(how.heading[i])) <= how.limit:
            yaw = within(yaw, -how.limit, how.limit)
    x = within(x, how.edge[i, 0], width - how.edge[i, 0])
    z = within(z, how.edge[i, 1], depth - how.edge[i, 1])
    return x, z, yaw


@compiled(inline="always")
def fits(i: int, x: float, z: float, heading: float, so_far: Placement, room: Clearance) -> bool:
    """Whether an object at a pose keeps clear of all that have theirs."""
    size, result = room.size, True
    half_width, half_depth = size[i, 0] / 2 + room.gap, size[i, 2] / 2 + room.gap
    for j in range(len(so_far.placed)):
        if not so_far.placed[j]:
            continue
        dx, dz = so_far.position[j, 0] - x, so_far.position[j, 1] - z
        away = dx * dx + dz * dz
        if away < room.apart**2:
            result = False
            break
        width, depth = size[j, 0] / 2, size[j, 2] / 2
        # Cheap: twice the sum of the squares of two half diagonals is no less than the square of their sum.
        reach = half_width * half_width + half_depth * half_depth + width * width + depth * depth
        if room.keeps_clear[i, j] and away <= _REACHES * reach:
            yaw, half, other = so_far.yaw[j], (half_width, half_depth), (width, depth)
            if separation(dx, dz, -heading, -yaw, *half, *other)[0] < 0:
                result = False
                break
    return result


@compiled
def strew(turns: IntArray, drawn: FloatArray, how: Strewing, so_far: Placement, room: Clearance) -> bool:
    """Give each object the first of its poses that keeps clear of all that have theirs.

    Args:
        turns: (K,) the objects to place, in this order.
        drawn: (K, T, 3) numbers of which the poses to try for each are made.
        how: how they are made.
        so_far: what has been placed; changed in place.
        room: how far objects have to be from one another.

    Returns:
        Whether each found one; the first that did not is left as it was, and so are those after it.
    """
    for k in range(len(turns)):
        i, found = turns[k], False
        for t in range(drawn.shape[1]):
            x, z, heading = pose_of(i, drawn[k, t, 0], drawn[k, t, 1], drawn[k, t, 2], how)
            if fits(i, x, z, heading, so_far, room):
                so_far.position[i, 0], so_far.position[i, 1], so_far.yaw[i] = x, z, heading
                so_far.placed[i] = found = True
                break
        if not found:
            return False
    return True
