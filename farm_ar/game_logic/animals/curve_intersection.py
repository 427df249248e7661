"""Kernels: where a curve first enters a footprint.

It is solved for, not stepped up to: no corner is clipped so slightly that it is missed.
"""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.geometry import arc_length, rectangles
from farm_ar.geometry.arc_length import Polynomial
from farm_ar.kernels import compiled
from farm_ar.structs import Struct, Structs, struct_dtype

NOWHERE = -1
"""In place of a building: inside nothing."""

ROUNDING = 1e-12
"""Metres that do not count."""

_PIECES = 4  # of a curve, looked at one by one for whether they can meet a footprint


class Footprint(Struct):
    """The footprint of a building as an obstacle; all NaN, and so nowhere, for one that is none."""

    x: float
    """Centre, metres."""
    z: float
    sine: float
    """Of the yaw."""
    cosine: float
    half_width: float
    half_depth: float
    reach_x: float
    """How far it reaches from its centre along x and along z, metres."""
    reach_z: float


_FOOTPRINT = struct_dtype(Footprint)


@compiled
def footprints(
    position: FloatArray, yaw: FloatArray, size: FloatArray, obstacles: BoolArray
) -> Structs[Footprint]:
    """(N,) footprints of N buildings.

    Args:
        position: (N, 2) centres, metres.
        yaw: (N,) headings, radians.
        size: (N, 3) width, height, depth, metres.
        obstacles: (N,) those that are one.
    """
    made: Structs[Footprint] = np.empty(len(yaw), _FOOTPRINT)  # type: ignore[assignment]
    for i in range(len(yaw)):
        own = made[i]
        own.x = own.z = own.sine = own.cosine = np.nan
        own.half_width = own.half_depth = own.reach_x = own.reach_z = np.nan
        if obstacles[i]:
            own.x, own.z, own.sine, own.cosine = (
                position[i, 0],
                position[i, 1],
                np.sin(yaw[i]),
                np.cos(yaw[i]),
            )
            own.half_width, own.half_depth = size[i, 0] / 2, size[i, 2] / 2
            wide, deep = rectangles.half_extent(-yaw[i], own.half_width, own.half_depth)
            own.reach_x, own.reach_z = wide + ROUNDING, deep + ROUNDING
    return made


@compiled
def inside(own: Footprint, x: float, z: float) -> bool:
    """Whether a point is in a footprint, edges included."""
    dx, dz = x - own.x, z - own.z
    return bool(
        abs(dx * own.cosine - dz * own.sine) <= own.half_width
        and abs(dx * own.sine + dz * own.cosine) <= own.half_depth
    )


@compiled
def standing_at(x: float, z: float, buildings: Structs[Footprint]) -> int:
    """Which of the footprints (N,) a point is in, edges included; of several the least, NOWHERE if none."""
    for i in range(len(buildings)):
        if inside(buildings[i], x, z):
            return i
    return NOWHERE


@compiled
def hull(a: float, b: float, c: float, d: float, begin: float, end: float) -> tuple[float, float]:
    """Least and greatest control point of a cubic's part from `begin` to `end`: it stays between the two."""
    third = (end - begin) / 3
    first, last = a + begin * (b + begin * (c + begin * d)), a + end * (b + end * (c + end * d))
    second = first + third * (b + begin * (2 * c + 3 * d * begin))
    before_last = last - third * (b + end * (2 * c + 3 * d * end))
    return min(first, second, before_last, last), max(first, second, before_last, last)


@compiled
def strip_entry(a: float, b: float, c: float, d: float, half: float, begin: float, end: float) -> float:
    """First parameter at which a cubic, monotone from `begin` to `end`, is within ±half; 2 for never."""
    first, last = a + begin * (b + begin * (c + begin * d)), a + end * (b + end * (c + end * d))
    if abs(first) <= half:
        return begin
    side = 1.0 if first > 0 else -1.0
    level = side * half
    if side * (last - level) > 0:
        return 2.0
    low, high = begin, end
    t = begin + (end - begin) * (level - first) / (last - first)
    for _ in range(100):
        outside = side * (a + t * (b + t * (c + t * d)) - level)
        if outside > 0:
            low = t
        else:
            high = t
        slope = side * (b + t * (2 * c + 3 * d * t))
        after = t - outside / slope if slope < 0 else 2.0
        if abs(after - t) <= 1e-16:
            break
        t = after if low < after < high else (low + high) / 2
        if not low < t < high:
            return high
    return t


@compiled
def footprint_entry(p: Polynomial, begin: float, end: float, own: Footprint) -> float:
    """First parameter from `begin` to `end` at which a curve is in a footprint, edges included; 2 for never.

    In the footprint's own axes the curve is cut where either coordinate turns round. On each piece both are
    monotone: each enters its strip at most once, and the later of the two enters the footprint, if the other
    has not left by then.

    Args:
        p: the curve.
        begin: where to look from.
        end: where to look to.
        own: the footprint.
    """
    x, z, sine, cosine = own.x, own.z, own.sine, own.cosine
    half_width, half_depth = own.half_width, own.half_depth
    xa, xb = cosine * (p[0] - x) - sine * (p[4] - z), cosine * p[1] - sine * p[5]
    xc, xd = cosine * p[2] - sine * p[6], cosine * p[3] - sine * p[7]
    za, zb = sine * (p[0] - x) + cosine * (p[4] - z), sine * p[1] + cosine * p[5]
    zc, zd = sine * p[2] + cosine * p[6], sine * p[3] + cosine * p[7]
    misses = True
    for k in range(_PIECES):
        # Cheap: most curves that miss do so by their control points, a piece of the curve at a time.
        first, last = begin + (end - begin) * (k / _PIECES), begin + (end - begin) * ((k + 1) / _PIECES)
        least, most = hull(xa, xb, xc, xd, first, last)
        if least > half_width + 2 * ROUNDING or most < -half_width - 2 * ROUNDING:
            continue
        least, most = hull(za, zb, zc, zd, first, last)
        if not (least > half_depth + 2 * ROUNDING or most < -half_depth - 2 * ROUNDING):
            misses = False
            break
    if misses:
        return 2.0
    x_turns, z_turns = arc_length.turning_points(xb, xc, xd), arc_length.turning_points(zb, zc, zd)
    while True:
        stop = end
        for turn in (x_turns[0], x_turns[1], z_turns[0], z_turns[1]):
            if begin < turn < stop:
                stop = turn
        t = strip_entry(xa, xb, xc, xd, half_width, begin, stop)
        if t <= stop:
            t = max(t, strip_entry(za, zb, zc, zd, half_depth, begin, stop))
        if t <= stop:
            across, ahead = xa + t * (xb + t * (xc + t * xd)), za + t * (zb + t * (zc + t * zd))
            if abs(across) <= half_width + ROUNDING and abs(ahead) <= half_depth + ROUNDING:
                return t
        if stop >= end:
            return 2.0
        begin = stop
