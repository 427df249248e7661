"""Whether each detection is where it may be, compiled: bounds of what `check_view` and others compute."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry.angles import wrap_angle
from farm_ar.kernels import compiled
from farm_ar.reid.plausibility.duplicates import GRID, IN_DOUBT, LESS_SURE, NEAR
from farm_ar.reid.plausibility.sizes import COMMON
from farm_ar.reid.plausibility.view import SLACK
from farm_ar.scenes import UNKNOWN

_compile = compiled(error_model="numpy")

EXACT = 1e-9
"""By what share a bound must be kept: more than sums in another order differ by."""


class Labels(NamedTuple):
    """A scene for the kernel.

    Args:
        place: (M, 2) metres.
        heading: (M,) radians.
        period: (M,) of the headings, radians.
        category: (M,) codes.
        size: (M,) means of the logarithms of the sides; NaN where not known.
        corners: (C, 2) of the bounds, metres; none without bounds.
        widths: (S,) scales of shift, metres.
        lengths: spacing and extent of the labels, the reach of one of unknown size, and how far outside the
            bounds a thing may stand, metres.
    """

    place: FloatArray
    heading: FloatArray
    period: FloatArray
    category: IntArray
    size: FloatArray
    corners: FloatArray
    widths: FloatArray
    lengths: tuple[float, float, float, float]


@_compile
def apart(
    poses: FloatArray, category: IntArray, eye: tuple[float, float], labels: Labels
) -> tuple[bool, bool]:
    """Whether no detection has the pose of another, the camera or the origin; and no two may be one thing.

    Args:
        poses: (N, 7) x, z, yaw, height, width, height and depth of each detection; NaN where not known.
        category: (N,) codes of the categories, `UNKNOWN` where not known.
        eye: where the camera is, metres.
        labels: the scene.
    """
    single = True
    for i in range(len(poses)):
        x, z, yaw = poses[i, 0], poses[i, 1], poses[i, 2]
        if x == 0 and z == 0 and (yaw == 0 or math.isnan(yaw)):
            return False, False
        if x == eye[0] and z == eye[1]:
            return False, False
        for j in range(i):
            if x == poses[j, 0] and z == poses[j, 1]:
                return False, False
            alike = category[i] == category[j] or category[i] == UNKNOWN or category[j] == UNKNOWN
            if alike and single:
                code = category[j] if category[i] == UNKNOWN else category[i]
                least = IN_DOUBT if _surplus(category, labels.category, code) else LESS_SURE
                single = not _may_be_one(poses[i], poses[j], labels.lengths[0], least)
    return True, single


@_compile
def _surplus(category: IntArray, offered: IntArray, code: int) -> bool:
    """Whether there are more detections that may be of a category than labels of it, which are `offered`."""
    number = 0
    for one in category:
        number += code == UNKNOWN or one in (UNKNOWN, code)
    for one in offered:
        number -= code == UNKNOWN or one == code
    return number > 0


@_compile
def _may_be_one(one: FloatArray, other: FloatArray, spacing: float, least: float) -> bool:
    """Whether footprints may coincide so far that `duplicates` takes two detections for one thing.

    Args:
        one: (7,) pose.
        other: (7,) likewise.
        spacing: of the labels, metres.
        least: share of either that the other covers then.
    """
    x, z = one[0] - other[0], one[1] - other[1]
    between, above = math.hypot(x, z), abs(one[3] - other[3])
    if between > min(_reach(one, spacing), _reach(other, spacing)) * (1 + EXACT):
        return False
    for k in (2, 4, 5, 6):
        if math.isnan(one[k]) or math.isnan(other[k]):
            return math.hypot(between, above) <= NEAR * spacing * (1 + EXACT)
    if above > min(one[5], other[5]) / 2 * (1 + EXACT):
        return False
    points = least * GRID * GRID
    return _points_in(one, other) >= points and _points_in(other, one) >= points


@_compile
def _points_in(one: FloatArray, other: FloatArray) -> int:
    """How many points of a grid over a footprint are in another, or on its edge but for rounding."""
    turn = one[2] - other[2]
    sine, cosine = math.sin(turn), math.cos(turn)
    x, z = one[0] - other[0], one[1] - other[1]
    right = x * math.cos(other[2]) - z * math.sin(other[2])
    ahead = x * math.sin(other[2]) + z * math.cos(other[2])
    wide, deep = other[4] / 2, other[6] / 2
    slack = EXACT * (one[4] + one[6] + other[4] + other[6]) + 1e-14 * (abs(one[0]) + abs(one[1]))
    count = 0
    for i in range(GRID):
        a = ((i + 0.5) / GRID - 0.5) * one[4]
        for j in range(GRID):
            b = ((j + 0.5) / GRID - 0.5) * one[6]
            in_width = abs(right + a * cosine + b * sine) <= wide + slack
            count += in_width and abs(ahead - a * sine + b * cosine) <= deep + slack
    return count


@_compile
def _reach(pose: FloatArray, spacing: float) -> float:
    """How near another must be to cover half of a thing, metres."""
    half = max(pose[4], pose[6]) / 2
    least = NEAR * spacing
    return half if half > least else least


@_compile
def in_place(
    poses: FloatArray,
    category: IntArray,
    eye: tuple[float, float, float],
    view: tuple[float, float, float],
    labels: Labels,
) -> bool:
    """Whether all detections are in the view and the bounds, and as large as a label that they may be.

    Args:
        poses: as of `apart`.
        category: likewise.
        eye: x, z and yaw of the camera.
        view: its left and right, radians, and its range, metres.
        labels: the scene.
    """
    usual, slack = labels.lengths[2], labels.lengths[3]
    for i in range(len(poses)):
        own = math.hypot(poses[i, 4], poses[i, 6]) / 2
        reach = usual if math.isnan(own) else own
        if not _viewed(poses[i, 0], poses[i, 1], reach, eye, view):
            return False
        mine, nearest = 0.0, np.inf
        for side in range(4, 7):
            mine += math.log(poses[i, side]) / 3
        for j in range(len(labels.size)):
            gap = abs(mine - labels.size[j])  # NaN where one is not known, and then never less
            if (category[i] == UNKNOWN or category[i] == labels.category[j]) and gap < nearest:
                nearest = gap
        if nearest < np.inf and not nearest < math.log(COMMON) - EXACT:
            return False
        if len(labels.corners) and not within(poses[i, 0], poses[i, 1], labels.corners):
            off = off_edges(poses[i, 0], poses[i, 1], labels.corners)
            if not off < (slack + reach) * (1 - EXACT):
                return False
    return True


@_compile
def _viewed(
    x: float, z: float, reach: float, eye: tuple[float, float, float], view: tuple[float, float, float]
) -> bool:
    """Whether a footprint of some reach is in view, at least in part."""
    away = math.hypot(x - eye[0], z - eye[1])
    angle = wrap_angle(math.atan2(x - eye[0], z - eye[1]) - eye[2])  # `bearing`
    slack = (reach + SLACK * away) * (1 - EXACT)
    beyond = max(angle - view[1], -angle - view[0])
    around = 2 * math.pi - angle - view[0] if angle > 0 else 2 * math.pi + angle - view[1]
    beyond = min(beyond, around)
    aside = away if not beyond < math.pi / 2 else away * math.sin(max(beyond, 0.0))
    return away - view[2] <= slack and aside <= slack


@_compile
def within(x: float, z: float, corners: FloatArray) -> bool:
    """Whether a point is within a polygon; of those on its edge nothing is said."""
    inside, last = False, len(corners) - 1
    for k in range(len(corners)):
        below, above = corners[last, 1] > z, corners[k, 1] > z
        if below != above:
            across = (corners[k, 0] - corners[last, 0]) * (z - corners[last, 1])
            across -= (corners[k, 1] - corners[last, 1]) * (x - corners[last, 0])
            inside ^= (across > 0) == (corners[k, 1] > corners[last, 1])
        last = k
    return inside


@_compile
def off_edges(x: float, z: float, corners: FloatArray) -> float:
    """How far a point is from the nearest edge of a polygon, metres."""
    least, last = np.inf, len(corners) - 1
    for k in range(len(corners)):
        along_x, along_z = corners[k, 0] - corners[last, 0], corners[k, 1] - corners[last, 1]
        off_x, off_z = x - corners[last, 0], z - corners[last, 1]
        part = (off_x * along_x + off_z * along_z) / (along_x * along_x + along_z * along_z)
        part = min(max(part, 0.0), 1.0)
        least = min(least, math.hypot(off_x - part * along_x, off_z - part * along_z))
        last = k
    return least
