"""Which detections of several snapshots are of one object, in a world that does not change between them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry import wrap
from farm_ar.reid.fusion.joining import Noise, Objects, Precision, Seen, gain, join, precision_of

POSITION_SDS = (0.003, 0.01, 0.03, 0.1)
"""SDs of detected places that are tried, as shares of the typical distance to the nearest other detection.

They come on top of what detections say of their own errors.
"""

YAW_SDS = tuple(math.radians(sd) for sd in (1.0, 4.0, 15.0, 50.0))
"""SDs of detected headings that are tried, radians."""

FINER_STEPS = (1.8, 1.3)
"""Factors by which the likeliest SDs of those are then changed, one after the other."""

INDEPENDENT = 4
"""As how many independent detections those of an object count at the most, once many are joined."""

SIDE_SD = 0.1
"""SD of the logarithms of detected sides."""


class Association(NamedTuple):
    """Objects that were detected in several snapshots, and how exactly.

    Args:
        object_of: (D,) the object of each detection, numbered in the order of their first detections.
        position_sd: of each coordinate of a detection beyond its covariance, metres.
        yaw_sd: of the heading of a detection beyond its covariance, radians.
        log_evidence: of all detections, the objects anywhere and turned anyhow.
    """

    object_of: IntArray
    position_sd: float
    yaw_sd: float
    log_evidence: float


def associate(seen: Seen, area: float) -> Association:
    """Group detections into objects, at the noise of detecting under which they are likeliest.

    From every detection as an object of its own, the two objects are joined that gain most, as long as one
    does. No object has two detections of one snapshot, or of different known categories. Joining trades the
    area and the turns over which two objects could be strewn for how well one place and heading explain both.
    The order of the snapshots does not matter.

    Where detections say how large their own errors are, those that many snapshots share are told from them:
    what was joined is joined once more, at the noise under which that is likeliest.

    Args:
        seen: the detections.
        area: over which objects may be strewn, square metres.
    """
    spacing = _spacing(seen.snapshot, seen.position, area)
    found = _likeliest(seen, _apart(seen, np.arange(len(seen.yaw))), spacing, area)
    if seen.covariance.any():
        joined = _joined_over_drift(seen, found, spacing, area)
    else:
        joined = found._replace(object_of=_joined_over_passes(seen, found, area))
    return joined._replace(object_of=_renumbered(joined.object_of))


def _likeliest(seen: Seen, apart: BoolArray, spacing: float, area: float) -> Association:
    """The grouping at the noise at which it is likeliest.

    Args:
        seen: the detections.
        apart: (D, D) which two cannot be of one object.
        spacing: typical distance to the nearest other detection, metres.
        area: over which objects may be strewn, square metres.
    """

    def at(position_sd: float, yaw_sd: float) -> Association:
        object_of = np.arange(len(seen.yaw))
        evidence = join(seen, apart, Noise(position_sd, yaw_sd, SIDE_SD, area), object_of)
        return Association(object_of, position_sd, yaw_sd, float(evidence))

    best = at(POSITION_SDS[0] * spacing, YAW_SDS[0])
    for share in POSITION_SDS:
        for yaw_sd in YAW_SDS:
            best = _likelier(best, at(share * spacing, yaw_sd))
    # Between the steps of the grid: of many detections, a noise taken for half as large splits objects.
    for factor in FINER_STEPS:
        for places, turns in ((factor, 1.0), (1 / factor, 1.0), (1.0, factor), (1.0, 1 / factor)):
            best = _likelier(best, at(best.position_sd * places, best.yaw_sd * turns))
    return best


def _apart(seen: Seen, object_of: IntArray) -> BoolArray:
    """(K, K) which two groups of detections cannot be of one object: different kinds, or in one snapshot."""
    count = int(object_of.max(initial=-1)) + 1
    shown = np.zeros((count, int(seen.snapshot.max(initial=-1)) + 1), dtype=np.int64)
    shown[object_of, seen.snapshot] = 1
    kind = np.full(count, -1)
    np.maximum.at(kind, object_of, seen.category)
    unlike = (kind[:, None] >= 0) & (kind >= 0) & (kind[:, None] != kind)
    return np.asarray(unlike | (shown @ shown.T > 0))


def _joined_over_drift(seen: Seen, found: Association, spacing: float, area: float) -> Association:
    """What was found, after joining groups that differ by an error shared by many snapshots.

    What a headset has wrong about its own pose lasts: the detections of one pass agree with one another as
    well as the detector is exact, and not with those of the next. So each group counts as one detection, as
    exact as its own allow, and the noise common to them is sought anew.
    """
    object_of = _renumbered(found.object_of)
    groups = [np.flatnonzero(object_of == k) for k in range(object_of.max() + 1)]
    precision = precision_of(seen.covariance, found.position_sd, found.yaw_sd)
    place = np.array([precision.place[group].sum(axis=0) for group in groups])
    covariance = np.zeros((len(groups), 3, 3))
    determinant = (place[:, 0] * place[:, 2] - place[:, 1] ** 2) / found.position_sd**2
    covariance[:, 0, 0], covariance[:, 1, 1] = place[:, 2] / determinant, place[:, 0] / determinant
    covariance[:, 0, 1] = covariance[:, 1, 0] = -place[:, 1] / determinant
    covariance[:, 2, 2] = found.yaw_sd**2 / np.array([precision.turn[group].sum() for group in groups])
    pieces = Seen(
        np.arange(len(groups)),
        np.array([seen.category[group].max() for group in groups]),
        np.array([mean_place(seen.position[group], precision.place[group]) for group in groups]),
        np.array([mean_yaw(seen.yaw[group], precision.turn[group]) for group in groups]),
        np.array([_mean_known(seen.sides[group]) for group in groups]),
        covariance,
    )
    over = _likeliest(pieces, _apart(seen, object_of), spacing, area)
    return Association(
        over.object_of[object_of],
        math.hypot(found.position_sd, over.position_sd),
        math.hypot(found.yaw_sd, over.yaw_sd),
        found.log_evidence + over.log_evidence,
    )


def _joined_over_passes(seen: Seen, found: Association, area: float) -> IntArray:
    """The object of each detection, likewise, where detections say nothing of their own errors.

    Then these cannot be told from those shared by many snapshots. But a hundred detections of an object on
    one pass, and a hundred on the next, do not give its place ten times better: they count as `INDEPENDENT`
    at the most. Objects with no more detections than that stay as they are.
    """
    object_of, noise = found.object_of.copy(), Noise(found.position_sd, found.yaw_sd, SIDE_SD, area)
    same = precision_of(seen.covariance, noise.position_sd, noise.yaw_sd)
    while True:
        names, object_at = np.unique(object_of, return_inverse=True)
        if len(names) < 2:
            return object_of
        groups = [np.flatnonzero(object_of == name) for name in names]
        number = np.array([min(len(group), INDEPENDENT) for group in groups], dtype=np.float64)
        objects = Objects(
            number,
            Precision(number[:, None] * [1.0, 0.0, 1.0], number),
            np.array([mean_place(seen.position[group], same.place[group]) for group in groups]),
            np.array([mean_yaw(seen.yaw[group], same.turn[group]) for group in groups]),
            np.array([_mean_known(seen.sides[group]) for group in groups]),
        )
        apart = _apart(seen, object_at)
        best, pair = 0.0, None
        for a in range(len(groups)):
            for b in range(a):
                if not apart[a, b] and max(len(groups[a]), len(groups[b])) > INDEPENDENT:
                    gained = gain(objects, a, b, noise)
                    if gained > best:
                        best, pair = gained, (a, b)
        if pair is None:
            return object_of
        object_of[groups[pair[0]]] = names[pair[1]]


def _mean_known(sides: FloatArray) -> FloatArray:
    known = sides[~np.isnan(sides).any(axis=1)]
    mean: FloatArray = (known if len(known) else sides[:1]).mean(axis=0)
    return mean


def _likelier(best: Association, other: Association) -> Association:
    return other if other.log_evidence > best.log_evidence + 1e-9 else best


def mean_yaw(yaw: FloatArray, precision: FloatArray) -> float:
    """The mean of headings close together, radians, of those that are known; NaN where none is.

    Args:
        yaw: (K,) radians; NaN where not known.
        precision: (K,) what each counts.
    """
    known = ~np.isnan(yaw)
    if not known.any():
        return float("nan")
    yaw, precision = yaw[known], precision[known]
    return float(wrap(yaw[0] + (precision * wrap(yaw - yaw[0])).sum() / precision.sum()))


def mean_place(position: FloatArray, precision: FloatArray) -> FloatArray:
    """(2,) mean of K places (K, 2), metres, each counting by its precision (K, 3), as in `Precision`."""
    xx, xz, zz = precision.T
    x, z = position.T
    sum_x, sum_z = (xx * x + xz * z).sum(), (xz * x + zz * z).sum()
    xx, xz, zz = precision.sum(axis=0)
    # By Schur complements: places that count alike give their plain mean to the last bit.
    return np.array(
        [(sum_x - xz / zz * sum_z) / (xx - xz * xz / zz), (sum_z - xz / xx * sum_x) / (zz - xz * xz / xx)]
    )


def _spacing(snapshot: IntArray, position: FloatArray, area: float) -> float:
    """Median distance of a detection to the nearest other one of its snapshot, metres."""
    apart = np.linalg.norm(position[:, None] - position, axis=-1)
    other = (snapshot[:, None] == snapshot) & ~np.eye(len(snapshot), dtype=bool)
    nearest = np.where(other, apart, np.inf).min(axis=1, initial=np.inf)
    known = nearest[np.isfinite(nearest) & (nearest > 0)]
    return float(np.median(known)) if len(known) else math.sqrt(area) / 10


def _renumbered(object_of: IntArray) -> IntArray:
    _, first, inverse = np.unique(object_of, return_index=True, return_inverse=True)
    rank: IntArray = np.argsort(np.argsort(first))[inverse.reshape(-1)]
    return rank
