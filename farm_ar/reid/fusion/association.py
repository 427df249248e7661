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
    best: Association | None = None
    for share in POSITION_SDS:
        for yaw_sd in YAW_SDS:
            object_of = np.arange(len(seen.yaw))
            evidence = join(seen, Noise(share * spacing, yaw_sd, SIDE_SD, area), object_of)
            if best is None or evidence > best.log_evidence + 1e-9:
                best = Association(object_of, share * spacing, yaw_sd, float(evidence))
    assert best is not None
    return best._replace(object_of=_renumbered(best.object_of))


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
def join(seen: Seen, noise: Noise, object_of: IntArray) -> float:
    """Join the two objects that gain most until none gain; returns the sum of the gains.

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
                gains[a, b] = gain(number, place, turn, side, a, b, noise)
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
                gains[high, low] = gain(number, place, turn, side, high, low, noise)
            elif other != b:
                gains[high, low] = -np.inf
        gains[a, :] = -np.inf
        gains[:, a] = -np.inf
