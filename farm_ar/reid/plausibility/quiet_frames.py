"""Whether a snapshot fits the map in no other way much better than as given, compiled.

Each way is bounded from above by what `patterns` computes of it, so that whatever is reported is found.
"""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.plausibility.evidence import evidence_of_all
from farm_ar.reid.plausibility.evidence_bounds import evidence_at_most, evidence_of_nearest, highest_turn
from farm_ar.reid.plausibility.frames import FEWEST, MOST_LABELS, RADIAN, TELLING
from farm_ar.reid.plausibility.motions import best_motions, move
from farm_ar.reid.plausibility.patterns import OUTSIDE
from farm_ar.reid.plausibility.quiet_places import EXACT, Labels, off_edges, within
from farm_ar.reid.plausibility.sizes import UNITS
from farm_ar.scenes import UNKNOWN

_compile = compiled(error_model="numpy")

_FACTORS: FloatArray = np.array([factor for metres in UNITS.values() for factor in (metres, 1 / metres)])
_ENOUGH = TELLING - math.log(2) - 1e-6
"""How much better than as given a snapshot may fit in any other way, at the least, before it is reported."""

_OTHERS = (
    *[(0, y) for y in (1, 2, 3)],
    *[(p, y) for p in (1, 2, 3, 4) for y in (0, 1, 2)],
    *[(5, y) for y in (0, 1, 3)],
)
"""Place and heading of each other way: headings alone, mirrored on two axes about two points, exchanged."""

_WHICH: IntArray = np.array(_OTHERS)
_HEADINGS = 3
"""How many of them are of headings alone."""


@_compile
def as_given(poses: FloatArray, category: IntArray, labels: Labels) -> bool:
    """Whether a snapshot fits in no other frame, unit or convention so much better that it would be told.

    Args:
        poses: (N, 7) as of `apart`, of those that are compared.
        category: (N,) codes.
        labels: the scene.
    """
    n, m = len(poses), len(labels.place)
    share, allowed = np.empty((n, m)), np.empty((n, m), dtype=np.bool_)
    for i in range(n):
        count = 0
        for j in range(m):
            allowed[i, j] = category[i] == UNKNOWN or category[i] == labels.category[j]
            count += allowed[i, j]
        for j in range(m):
            share[i, j] = allowed[i, j] / count
    places, yaw = np.empty((6, n, 2)), np.empty((4, n))
    _fill_ways(poses, labels, places, yaw)
    least = _evidence_as_given(places[:1], yaw[:1], share, labels) + _ENOUGH
    which, outside = _WHICH.copy(), np.empty(len(places))
    for p in range(len(places)):
        outside[p] = _outside(places[p], labels.corners, True)
    found = evidence_at_most(places, yaw, which, share, labels, True) + outside[which[:, 0]]
    if not (_log_mean(found[:_HEADINGS]) <= least and _log_mean(found[_HEADINGS:]) <= least):
        return False
    if not _no_radians(places[:1], yaw[:1], share, labels, least):
        return False
    if not _in_these_units(places[0], yaw[:1], share, labels, least):
        return False
    if n < FEWEST or m > MOST_LABELS:
        return True
    if not _unmoved(places[0], yaw[:1], (share, allowed), labels, least):
        return False
    mirrored = places[0].copy()
    mirrored[:, 1] *= -1
    return _unmoved(mirrored, yaw[:3], (share, allowed), labels, least)


@_compile
def _fill_ways(poses: FloatArray, labels: Labels, places: FloatArray, yaw: FloatArray) -> None:
    """Fill places (6, N, 2) with those given, mirrored and exchanged ones, and headings (4, N) likewise."""
    around = labels.corners if len(labels.corners) else labels.place
    for axis in range(2):
        pivot = (around[:, axis].min() + around[:, axis].max()) / 2
        for i in range(len(poses)):
            x = poses[i, axis]
            places[0, i, axis], places[5, i, 1 - axis] = x, x
            places[1 + axis, i, axis], places[2 - axis, i, axis] = -x, x
            places[3 + axis, i, axis], places[4 - axis, i, axis] = pivot - (x - pivot), x
    for i in range(len(poses)):
        heading = poses[i, 2]
        yaw[0, i], yaw[1, i], yaw[2, i], yaw[3, i] = heading, -heading, np.pi - heading, np.pi / 2 - heading


@_compile
def _evidence_as_given(places: FloatArray, yaw: FloatArray, share: FloatArray, labels: Labels) -> float:
    """A bound from below of the evidence as given: places (1, N, 2), headings (1, N)."""
    which, close = np.zeros((1, 2), dtype=np.int64), np.zeros(1, dtype=np.bool_)
    known = (labels.place, labels.heading, labels.period)
    found = evidence_of_all((places, yaw, which, close), share, known, labels.widths, 0.0, labels.lengths[1])
    given: float = found[0] + _outside(places[0], labels.corners, False)
    return given


@_compile
def _no_radians(places: FloatArray, yaw: FloatArray, share: FloatArray, labels: Labels, least: float) -> bool:
    """Whether headings (1, N), taken for radians, explain a snapshot no better than `least`."""
    told, most = 0, 0.0
    for heading in yaw[0]:
        if not (math.isnan(heading) or heading == 0):
            told += 1
            most = max(most, abs(heading))
    if told < 2 or most > 2 * np.pi / RADIAN:
        return True
    found = evidence_at_most(places, yaw * RADIAN, np.zeros((1, 2), dtype=np.int64), share, labels, False)
    outside = _outside(places[0], labels.corners, True)
    return bool(found[0] + outside + told * math.log(RADIAN) <= least)


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
        inside = within(position[i, 0], position[i, 1], corners)
        if off_edges(position[i, 0], position[i, 1], corners) <= EXACT * size:
            inside = at_most
        if not inside:
            total += math.log(OUTSIDE)
    return total


@_compile
def _log_mean(values: FloatArray) -> float:
    """Logarithm of the mean of what values (H,) are the logarithms of; NaN where one is infinite."""
    top, total = values.max(), 0.0
    for value in values:
        total += math.exp(value - top)
    mean: float = top + math.log(total / len(values))
    return mean


@_compile
def _in_these_units(
    position: FloatArray, yaw: FloatArray, share: FloatArray, labels: Labels, least: float
) -> bool:
    """Whether a snapshot fits in no other unit better than `least`, as the mean over all units.

    Each is bounded by what a heading and the nearest label could give; it is computed where that is too much.
    """
    coordinates = np.count_nonzero(position)
    count, peak = len(_FACTORS), highest_turn(labels.period)
    found = np.empty(count)
    for k in range(count):
        found[k] = evidence_of_nearest(position, _FACTORS[k], share, labels, peak)
        found[k] += coordinates * math.log(_FACTORS[k])
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
def _unmoved(
    position: FloatArray,
    yaw: FloatArray,
    may_be: tuple[FloatArray, BoolArray],
    labels: Labels,
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
    which = np.zeros((count, 2), dtype=np.int64)
    which[:, 1] = np.arange(count)
    for k in range(len(motions)):
        move(motions[k], position, places[0])
        for y in range(count):
            for i in range(n):
                turned[y, i] = yaw[y, i] + motions[k, 4]
        found = evidence_at_most(places, turned, which, share, labels, count > 1)
        outside = _outside(places[0], labels.corners, True)
        if not _log_mean(found) + motions[k, 5] + outside <= least:
            return False
    return True
