"""Compiled: where a curve first enters a footprint.

It is solved for, not stepped up to: no corner is clipped so slightly that it is missed.
"""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.game_logic import arc_length
from farm_ar.game_logic.arc_length import Polynomial
from farm_ar.kernels import compiled

NOWHERE = -1
"""In place of a building: inside nothing."""

ROUNDING = 1e-12
"""Metres that do not count."""

_PIECES = 4  # of a curve, looked at one by one for whether they can meet a footprint


@compiled
def boxes(position: FloatArray, yaw: FloatArray, size: FloatArray, obstacles: BoolArray) -> FloatArray:
    """Footprints of N buildings as `footprint_entry` wants them.

    Returns:
        (N, 8) x and z of the centre, sine and cosine of the yaw, half the width and half the depth, how far
        the footprint reaches along x and along z; nowhere (NaN) for those that are no obstacles.
    """
    box = np.full((len(yaw), 8), np.nan)
    for i in range(len(yaw)):
        if obstacles[i]:
            sine, cosine = np.sin(yaw[i]), np.cos(yaw[i])
            width, depth = size[i, 0] / 2, size[i, 2] / 2
            box[i, 0], box[i, 1], box[i, 2], box[i, 3] = position[i, 0], position[i, 1], sine, cosine
            box[i, 4], box[i, 5] = width, depth
            box[i, 6] = abs(cosine) * width + abs(sine) * depth + ROUNDING
            box[i, 7] = abs(sine) * width + abs(cosine) * depth + ROUNDING
    return box


@compiled
def standing_at(x: float, z: float, box: FloatArray) -> int:
    """Which of the footprints (N, 8) a point is in, edges included; of several the least, NOWHERE if none."""
    for i in range(len(box)):
        dx, dz, sine, cosine = x - box[i, 0], z - box[i, 1], box[i, 2], box[i, 3]
        if abs(dx * cosine - dz * sine) <= box[i, 4] and abs(dx * sine + dz * cosine) <= box[i, 5]:
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
def footprint_entry(p: Polynomial, begin: float, end: float, box: FloatArray) -> float:
    """First parameter from `begin` to `end` at which a curve is in a footprint, edges included; 2 for never.

    In the footprint's own axes the curve is cut where either coordinate turns round. On each piece both are
    monotone: each enters its strip at most once, and the later of the two enters the footprint, if the other
    has not left by then.

    Args:
        p: the curve.
        begin: where to look from.
        end: where to look to.
        box: (8,) a row of `boxes`.
    """
    x, z, sine, cosine, half_width, half_depth = box[0], box[1], box[2], box[3], box[4], box[5]
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
