"""Whether the check has nothing to say of a snapshot, which is so of most: one compiled call finds out.

It computes bounds of what `check` and `set_aside` compute, from the same densities, and stops where they are
not conclusive: then those two say what there is, if anything.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry.angles import FULL_TURN, wrap_angle
from farm_ar.kernels import compiled
from farm_ar.reid.plausibility.duplicates import NEAR
from farm_ar.reid.plausibility.frames import FEWEST, MOST_LABELS, RADIAN, TELLING
from farm_ar.reid.plausibility.kept import kept
from farm_ar.reid.plausibility.kernels import ANYWHERE, TURNS, best_motions, elsewhere_of, evidence_of_all
from farm_ar.reid.plausibility.look_alikes import check_names
from farm_ar.reid.plausibility.patterns import CLOSE, MOST_DETECTIONS, OUTSIDE, places_of
from farm_ar.reid.plausibility.sizes import COMMON, UNITS
from farm_ar.reid.plausibility.view import SLACK, bounds_slack, labels_outside, usual_reach
from farm_ar.scenes import UNKNOWN, Scene, Snapshot

_compile = compiled(error_model="numpy")

_EXACT = 1e-9
"""By what share a bound must be kept: more than sums in another order differ by."""

_FACTORS: FloatArray = np.array([factor for metres in UNITS.values() for factor in (metres, 1 / metres)])
_ENOUGH = TELLING - math.log(2) - 1e-6
"""How much better than as given a snapshot may fit in any other way, at the least, before it is told."""

_NO_CORNERS: FloatArray = np.zeros((0, 2))


class _Labels(NamedTuple):
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


class _Kept(NamedTuple):
    """What follows from a scene: its labels for the kernel, the codes of its categories, whether it is right.

    Args:
        labels: for the kernel.
        codes: of the categories; None for one that is not known.
        right: whether nothing is said of the scene itself.
    """

    labels: _Labels
    codes: dict[str | None, int]
    right: bool


@kept
def _known(scene: Scene) -> _Kept:
    layout, places = scene.layout, places_of(scene)
    bounds = scene.bounds
    labels = _Labels(
        np.array(layout.position),
        np.array(layout.yaw),
        np.array(places.period, dtype=np.float64),
        np.array(layout.category_code),
        np.log(layout.size).mean(axis=1),
        _NO_CORNERS if bounds is None else np.array(bounds.corners),
        np.array(places.widths),
        (
            places.spacing,
            places.extent,
            usual_reach(layout),
            0.0 if bounds is None else bounds_slack(scene),
        ),
    )
    right = not check_names(layout) and (bounds is None or not labels_outside(scene).any())
    return _Kept(labels, {name: i for i, name in enumerate(layout.categories)} | {None: UNKNOWN}, right)


def quiet(scene: Scene, snapshot: Snapshot, checks: bool = True) -> bool:
    """Whether `check` finds nothing, and `set_aside` sets nothing aside; False where that is not obvious.

    Args:
        scene: the reference layout and its place.
        snapshot: what was seen.
        checks: whether `check` is asked; without it only what is set aside counts.
    """
    seen, camera = snapshot.detections, snapshot.camera
    if not len(seen) or not len(scene.layout):
        return False
    labels, codes, right = _known(scene)
    if checks and not right:
        return False
    try:
        category = np.array([codes[name] for name in seen.category])
    except KeyError:
        return False
    fov = camera.fov
    eye = (float(camera.position[0]), float(camera.position[1]), float(camera.yaw))
    view = (fov.left, fov.right, fov.range_m)
    poses = np.column_stack([seen.position, seen.yaw, seen.elevation, seen.size])
    if not math.isfinite(poses[:, :2].sum()) or not apart(poses, category, eye[:2], labels.lengths[0]):
        return False
    if not checks:
        return True
    some = np.arange(len(seen))
    if len(seen) > MOST_DETECTIONS:
        some = np.linspace(0, len(seen) - 1, MOST_DETECTIONS).astype(np.int64)
    return bool(
        in_place(poses, category, eye, view, labels) and as_given(poses[some], category[some], labels)
    )


@_compile
def apart(poses: FloatArray, category: IntArray, eye: tuple[float, float], spacing: float) -> bool:
    """Whether no two detections may be one, none has another's pose, the camera's or the origin's.

    Args:
        poses: (N, 7) x, z, yaw, height, width, height and depth of each detection; NaN where not known.
        category: (N,) codes of the categories, `UNKNOWN` where not known.
        eye: where the camera is, metres.
        spacing: of the labels, metres.
    """
    for i in range(len(poses)):
        x, z, yaw = poses[i, 0], poses[i, 1], poses[i, 2]
        if x == 0 and z == 0 and (yaw == 0 or math.isnan(yaw)):
            return False
        if x == eye[0] and z == eye[1]:
            return False
        for j in range(i):
            if not (category[i] == category[j] or category[i] == UNKNOWN or category[j] == UNKNOWN):
                if x == poses[j, 0] and z == poses[j, 1]:
                    return False
                continue
            between = math.hypot(x - poses[j, 0], z - poses[j, 1])
            if between <= min(_reach(poses[i], spacing), _reach(poses[j], spacing)) * (1 + _EXACT):
                return False
    return True


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
    labels: _Labels,
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
        if nearest < np.inf and not nearest < math.log(COMMON) - _EXACT:
            return False
        if len(labels.corners) and not _within(poses[i, 0], poses[i, 1], labels.corners):
            off = _off_edges(poses[i, 0], poses[i, 1], labels.corners)
            if not off < (slack + reach) * (1 - _EXACT):
                return False
    return True


@_compile
def _viewed(
    x: float, z: float, reach: float, eye: tuple[float, float, float], view: tuple[float, float, float]
) -> bool:
    """Whether a footprint of some reach is in view, at least in part."""
    away = math.hypot(x - eye[0], z - eye[1])
    angle = wrap_angle(math.atan2(x - eye[0], z - eye[1]) - eye[2])  # `bearing`
    slack = (reach + SLACK * away) * (1 - _EXACT)
    beyond = max(angle - view[1], -angle - view[0])
    around = 2 * math.pi - angle - view[0] if angle > 0 else 2 * math.pi + angle - view[1]
    beyond = min(beyond, around)
    aside = away if not beyond < math.pi / 2 else away * math.sin(max(beyond, 0.0))
    return away - view[2] <= slack and aside <= slack


@_compile
def _within(x: float, z: float, corners: FloatArray) -> bool:
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
def _off_edges(x: float, z: float, corners: FloatArray) -> float:
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


@_compile
def as_given(poses: FloatArray, category: IntArray, labels: _Labels) -> bool:
    """Whether a snapshot fits in no other frame, unit or convention so much better that it would be told.

    Args:
        poses: (N, 7) as of `apart`, of those that are compared.
        category: (N,) codes.
        labels: the scene.
    """
    n, m = len(poses), len(labels.place)
    spacing, extent = labels.lengths[0], labels.lengths[1]
    share, allowed = np.empty((n, m)), np.empty((n, m), dtype=np.bool_)
    for i in range(n):
        count = 0
        for j in range(m):
            allowed[i, j] = category[i] == UNKNOWN or category[i] == labels.category[j]
            count += allowed[i, j]
        for j in range(m):
            share[i, j] = allowed[i, j] / count
    known = (labels.place, labels.heading, labels.period)
    position = np.ascontiguousarray(poses[:, :2])
    yaw = np.empty((5, n))
    yaw[0], yaw[1], yaw[2], yaw[3] = poses[:, 2], -poses[:, 2], np.pi - poses[:, 2], np.pi / 2 - poses[:, 2]
    yaw[4] = poses[:, 2] * RADIAN
    places = np.empty((6, n, 2))
    places[0] = position
    _mirror(position, labels, places)
    which = np.empty((20, 2), dtype=np.int64)
    close = np.ones(20, dtype=np.bool_)
    which[0], which[1], close[0], close[1] = (0, 0), (0, 4), False, False
    row = 2
    for p in range(6):  # other headings, mirrored four times, and with exchanged axes
        for y in (1, 2, 3) if p == 0 else (0, 1, 2) if p < 5 else (0, 1, 3):
            which[row] = (p, y)
            row += 1
    told, most = 0, 0.0
    for i in range(n):
        if not (math.isnan(poses[i, 2]) or poses[i, 2] == 0):
            told += 1
            most = max(most, abs(poses[i, 2]))
    radians = told >= 2 and most <= 2 * np.pi / RADIAN
    found = evidence_of_all((places, yaw, which, close), share, known, labels.widths, CLOSE * spacing, extent)
    for h in range(len(which)):
        found[h] += _outside(places[which[h, 0]], labels.corners, h > 0)
    least = found[0] + _ENOUGH
    if radians and found[1] + told * math.log(RADIAN) > least:
        return False
    if _log_mean(found[2:5]) > least or _log_mean(found[5:]) > least:
        return False
    if not _in_these_units(position, yaw[:1], share, labels, least):
        return False
    if n < FEWEST or m > MOST_LABELS:
        return True
    mirrored = position.copy()
    mirrored[:, 1] *= -1
    return _unmoved(position, yaw[:1], (share, allowed), labels, least) and _unmoved(
        mirrored, yaw[:3], (share, allowed), labels, least
    )


@_compile
def _mirror(position: FloatArray, labels: _Labels, places: FloatArray) -> None:
    """Fill places 1 to 5 with a snapshot mirrored on two axes about two points, and with axes exchanged."""
    around = labels.corners if len(labels.corners) else labels.place
    for k in range(4):
        for axis in range(2):
            pivot = (around[:, axis].min() + around[:, axis].max()) / 2 if k >= 2 else 0.0
            side = -1.0 if k % 2 == axis else 1.0
            places[1 + k, :, axis] = pivot + (position[:, axis] - pivot) * side
    places[5, :, 0], places[5, :, 1] = position[:, 1], position[:, 0]


@_compile
def _outside(position: FloatArray, corners: FloatArray, at_most: bool) -> float:
    """Logarithm of how much less likely places (N, 2) are for those of them outside the bounds.

    Args:
        position: metres.
        corners: of the bounds.
        at_most: whether those on the edge count as inside, so that it is not too little.
    """
    if not len(corners):
        return 0.0
    total, size = 0.0, 0.0
    for axis in range(2):
        size = max(size, corners[:, axis].max() - corners[:, axis].min())
    for i in range(len(position)):
        inside = _within(position[i, 0], position[i, 1], corners)
        if _off_edges(position[i, 0], position[i, 1], corners) <= _EXACT * size:
            inside = at_most
        if not inside:
            total += math.log(OUTSIDE)
    return total


@_compile
def _log_mean(values: FloatArray) -> float:
    top, total = values.max(), 0.0
    for value in values:
        total += math.exp(value - top)
    mean: float = top + math.log(total / len(values))
    return mean


@_compile
def _in_these_units(
    position: FloatArray, yaw: FloatArray, share: FloatArray, labels: _Labels, least: float
) -> bool:
    """Whether a snapshot fits in no other unit better than `least`, as the mean over all units.

    Each is bounded by what a heading and the nearest label could give; it is computed where that is too much.
    """
    coordinates = np.count_nonzero(position)
    count = len(_FACTORS)
    found = np.empty(count)
    for k in range(count):
        volume = coordinates * math.log(_FACTORS[k])
        found[k] = _most(position * _FACTORS[k], share, labels) + volume
    if _log_mean(found) <= least:
        return True
    which, close = np.zeros((1, 2), dtype=np.int64), np.zeros(1, dtype=np.bool_)
    places = np.empty((1, *position.shape))
    known = (labels.place, labels.heading, labels.period)
    for k in range(count):
        if found[k] > least - math.log(count) - 5:
            places[0] = position * _FACTORS[k]
            found[k] = evidence_of_all(
                (places, yaw, which, close), share, known, labels.widths, 0.0, labels.lengths[1]
            )[0] + coordinates * math.log(_FACTORS[k])
    return _log_mean(found) <= least


@_compile
def _most(position: FloatArray, share: FloatArray, labels: _Labels) -> float:
    """A bound of the evidence of places (N, 2), whatever the headings: all may be the nearest label's."""
    extent, widths = labels.lengths[1], labels.widths
    total = np.zeros(len(widths))
    x_middle, z_middle = labels.place[:, 0].mean(), labels.place[:, 1].mean()
    peak = 1 / FULL_TURN
    for j in range(len(labels.period)):
        for r in range(len(TURNS)):
            part = labels.period[j] / TURNS[r]
            peak = max(peak, (1 + 2 * math.exp(-part * part / 2)) * part * FULL_TURN**-1.5)
    for i in range(len(position)):
        nearest = np.inf
        for j in range(len(labels.place)):
            if share[i, j] > 0:
                x, z = position[i, 0] - labels.place[j, 0], position[i, 1] - labels.place[j, 1]
                nearest = min(nearest, x * x + z * z)
        x, z = position[i, 0] - x_middle, position[i, 1] - z_middle
        elsewhere = elsewhere_of(x * x + z * z, extent)
        for s in range(len(widths)):
            twice = 2 * widths[s] * widths[s]
            near = math.exp(-nearest / twice) / (math.pi * twice)
            total[s] += math.log(max((1 - ANYWHERE) * near * peak + elsewhere, 1e-300))
    most: float = total.max()
    return most


@_compile
def _unmoved(
    position: FloatArray,
    yaw: FloatArray,
    may_be: tuple[FloatArray, BoolArray],
    labels: _Labels,
    least: float,
) -> bool:
    """Whether no motion of the frame makes a snapshot fit better than `least`, as the mean over headings.

    Args:
        position: (N, 2) metres.
        yaw: (Y, N) radians.
        may_be: (N, M) shares of the labels, and which each detection may be.
        labels: the scene.
        least: logarithm of the evidence.
    """
    share, allowed = may_be
    spacing, extent = labels.lengths[0], labels.lengths[1]
    motions = best_motions(position, allowed, labels.place, spacing, extent)
    count, n = len(yaw), len(position)
    places, turned = np.empty((1, n, 2)), np.empty((count, n))
    which = np.empty((count, 2), dtype=np.int64)
    close = np.full(count, count > 1)
    known = (labels.place, labels.heading, labels.period)
    for k in range(len(motions)):
        sine, cosine = math.sin(motions[k, 4]), math.cos(motions[k, 4])
        for i in range(n):
            x, z = position[i, 0] - motions[k, 0], position[i, 1] - motions[k, 1]
            places[0, i, 0] = motions[k, 0] + (cosine * x + sine * z) + motions[k, 2]
            places[0, i, 1] = motions[k, 1] + (cosine * z - sine * x) + motions[k, 3]
        for y in range(count):
            turned[y] = yaw[y] + motions[k, 4]
            which[y] = (0, y)
        found = evidence_of_all(
            (places, turned, which, close), share, known, labels.widths, CLOSE * spacing, extent
        )
        if _log_mean(found) + motions[k, 5] + _outside(places[0], labels.corners, True) > least:
            return False
    return True
