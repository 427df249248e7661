"""Which detections of several snapshots are of one object, in a world that does not change between them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry import wrap
from farm_ar.kernels import compiled

POSITION_SDS = (0.003, 0.01, 0.03, 0.1)
"""SDs of detected places that are tried, as shares of the typical distance to the nearest other detection."""

YAW_SDS = tuple(math.radians(sd) for sd in (1.0, 4.0, 15.0, 50.0))
"""SDs of detected headings that are tried, radians."""

FINER_STEPS = (1.8, 1.3)
"""Factors by which the likeliest SDs of those are then changed, one after the other."""

INDEPENDENT = 4
"""As how many independent detections those of an object count at the most, once many are joined."""

SIDE_SD = 0.1
"""SD of the logarithms of detected sides."""


class Seen(NamedTuple):
    """The D detections of several snapshots.

    Args:
        snapshot: (D,) which snapshot each is of.
        category: (D,) codes, negative where not known.
        position: (D, 2) metres.
        yaw: (D,) radians.
        sides: (D, 3) logarithms of the sides.
    """

    snapshot: IntArray
    category: IntArray
    position: FloatArray
    yaw: FloatArray
    sides: FloatArray


class Noise(NamedTuple):
    """How exactly detections are measured, and where objects may be.

    Args:
        position_sd: of each coordinate, metres.
        yaw_sd: radians.
        side_sd: of the logarithms of the sides.
        area: over which objects may be strewn, square metres.
    """

    position_sd: float
    yaw_sd: float
    side_sd: float
    area: float


class Association(NamedTuple):
    """Objects that were detected in several snapshots, and how exactly.

    Args:
        object_of: (D,) the object of each detection, numbered in the order of their first detections.
        position_sd: of each coordinate of a detection, metres.
        yaw_sd: of the heading of a detection, radians.
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

    Args:
        seen: the detections.
        area: over which objects may be strewn, square metres.
    """
    spacing = _spacing(seen.snapshot, seen.position, area)

    def at(position_sd: float, yaw_sd: float) -> Association:
        object_of = np.arange(len(seen.yaw))
        evidence = join(seen, Noise(position_sd, yaw_sd, SIDE_SD, area), object_of)
        return Association(object_of, position_sd, yaw_sd, float(evidence))

    best = at(POSITION_SDS[0] * spacing, YAW_SDS[0])
    for share in POSITION_SDS:
        for yaw_sd in YAW_SDS:
            best = _likelier(best, at(share * spacing, yaw_sd))
    # Between the steps of the grid: of many detections, a noise taken for half as large splits objects.
    for factor in FINER_STEPS:
        for places, turns in ((factor, 1.0), (1 / factor, 1.0), (1.0, factor), (1.0, 1 / factor)):
            best = _likelier(best, at(best.position_sd * places, best.yaw_sd * turns))
    joined = _joined_over_passes(seen, best, area)
    return best._replace(object_of=_renumbered(joined))


def _joined_over_passes(seen: Seen, found: Association, area: float) -> IntArray:
    """The object of each detection, after joining those that differ by an error shared by many snapshots.

    What a headset has wrong about its own pose lasts for many snapshots: a hundred detections of an object on
    one pass, and a hundred on the next, do not give its place ten times better. So they count as
    `INDEPENDENT` at the most here; objects with no more detections than that stay as they are.
    """
    object_of, noise = found.object_of.copy(), Noise(found.position_sd, found.yaw_sd, SIDE_SD, area)
    while True:
        names = np.unique(object_of)
        if len(names) < 2:
            return object_of
        groups = [np.flatnonzero(object_of == name) for name in names]
        number = np.array([min(len(group), INDEPENDENT) for group in groups])
        place = np.array([seen.position[group].mean(axis=0) for group in groups])
        turn = np.array([mean_yaw(seen.yaw[group]) for group in groups])
        side = np.array([_mean_known(seen.sides[group]) for group in groups])
        kind = np.array([seen.category[group].max() for group in groups])
        shown = [set(seen.snapshot[group].tolist()) for group in groups]
        best, pair = 0.0, None
        for a in range(len(groups)):
            for b in range(a):
                apart = (kind[a] >= 0 and kind[b] >= 0 and kind[a] != kind[b]) or shown[a] & shown[b]
                if not apart and max(len(groups[a]), len(groups[b])) > INDEPENDENT:
                    gained = gain(number, place, turn, side, a, b, noise)
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


def mean_yaw(yaw: FloatArray) -> float:
    """The mean of headings close together, radians, of those that are known; NaN where none is."""
    known = yaw[~np.isnan(yaw)]
    yaw = known if len(known) else yaw[:1]
    return float(wrap(yaw[0] + wrap(yaw - yaw[0]).mean()))


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


_compile = compiled(error_model="numpy")


@_compile
def gain(
    number: IntArray, place: FloatArray, turn: FloatArray, side: FloatArray, a: int, b: int, noise: Noise
) -> float:
    """How much likelier the detections of objects a and b are if these are one: a logarithm.

    Args:
        number: (D,) detections of each object.
        place: (D, 2) their mean place, metres.
        turn: (D,) their mean heading, radians.
        side: (D, 3) their mean logarithms of the sides.
        a: one object.
        b: the other.
        noise: how exactly they were measured.
    """
    weight = number[a] * number[b] / (number[a] + number[b])
    dx, dz = place[a, 0] - place[b, 0], place[a, 1] - place[b, 1]
    angle = turn[a] - turn[b]
    angle -= 2 * math.pi * np.round(angle / (2 * math.pi))
    squares = (dx * dx + dz * dz) / noise.position_sd**2
    volume = math.log(noise.area * weight / (2 * math.pi * noise.position_sd**2))
    if not math.isnan(angle):
        squares += angle * angle / noise.yaw_sd**2
        volume += 0.5 * math.log(2 * math.pi * weight / noise.yaw_sd**2)
    for k in range(3):
        gap = side[a, k] - side[b, k]
        if not math.isnan(gap):
            squares += gap * gap / noise.side_sd**2
    return float(volume - 0.5 * weight * squares)


@_compile
def ways(number: IntArray, a: int, b: int) -> float:
    """Logarithm of how many ways there are to tell the detections of one object apart as those of a and b."""
    together = number[a] + number[b]
    return math.lgamma(together + 1.0) - math.lgamma(number[a] + 1.0) - math.lgamma(number[b] + 1.0)


@_compile
def join(seen: Seen, noise: Noise, object_of: IntArray) -> float:
    """Join the two objects that gain most until none gain; returns the sum of the gains.

    To each gain come the `ways` in which two objects might have shared the detections of one: without them a
    long sequence would look likelier as several objects of less noise, each seen now and then.

    Args:
        seen: the detections.
        noise: how exactly they were measured.
        object_of: (D,) 0, 1, ..., filled with the object of each detection.
    """
    count = len(seen.yaw)
    number = np.ones(count, dtype=np.int64)
    place, turn, side, kind = seen.position.copy(), seen.yaw.copy(), seen.sides.copy(), seen.category.copy()
    gains = np.full((count, count), -np.inf)
    for a in range(count):
        for b in range(a):
            apart = kind[a] >= 0 and kind[b] >= 0 and kind[a] != kind[b]
            if seen.snapshot[a] != seen.snapshot[b] and not apart:
                gains[a, b] = gain(number, place, turn, side, a, b, noise) + ways(number, a, b)
    total = 0.0
    while True:
        best_a, best_b = -1, -1
        best = 0.0
        for a in range(count):
            for b in range(a):
                if gains[a, b] > best:
                    best, best_a, best_b = gains[a, b], a, b
        if best_a < 0:
            return total
        total += best
        a, b = best_a, best_b
        share = number[a] / (number[a] + number[b])
        place[b] += share * (place[a] - place[b])
        if math.isnan(side[b, 0]):
            side[b] = side[a]
        elif not math.isnan(side[a, 0]):
            side[b] += share * (side[a] - side[b])
        angle = turn[a] - turn[b]
        if math.isnan(turn[b]):
            turn[b] = turn[a]
        elif not math.isnan(angle):
            turn[b] += share * (angle - 2 * math.pi * np.round(angle / (2 * math.pi)))
        number[b] += number[a]
        kind[b] = max(kind[a], kind[b])
        object_of[object_of == a] = b
        for other in range(count):
            high, low = max(b, other), min(b, other)
            blocked = other == b or gains[high, low] == -np.inf
            blocked = blocked or gains[max(a, other), min(a, other)] == -np.inf
            if not blocked:
                gains[high, low] = gain(number, place, turn, side, high, low, noise) + ways(number, high, low)
            elif other != b:
                gains[high, low] = -np.inf
        gains[a, :] = -np.inf
        gains[:, a] = -np.inf
