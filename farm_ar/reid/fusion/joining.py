"""Joining detections into objects, each pair by how much likelier it is one than two; compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.kernels import compiled


class Seen(NamedTuple):
    """The D detections of several snapshots.

    Args:
        snapshot: (D,) which snapshot each is of.
        category: (D,) codes, negative where not known.
        position: (D, 2) metres.
        yaw: (D,) radians.
        sides: (D, 3) logarithms of the sides.
        covariance: (D, 3, 3) of what each says of its errors of x, z and yaw, metres and radians; zeros where
            none says anything, and all errors are what is common to them.
    """

    snapshot: IntArray
    category: IntArray
    position: FloatArray
    yaw: FloatArray
    sides: FloatArray
    covariance: FloatArray


class Noise(NamedTuple):
    """How exactly detections are measured, beyond their covariances, and where objects may be.

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


class Precision(NamedTuple):
    """Inverse covariances of D detections or objects, as multiples of what the common noise alone would give.

    Args:
        place: (D, 3) entries xx, xz and zz of those of places, 1, 0 and 1 for a detection that says nothing.
        turn: (D,) of headings; 1 likewise.
    """

    place: FloatArray
    turn: FloatArray


class Objects(NamedTuple):
    """What is known of each of D objects from its detections.

    Args:
        number: (D,) as how many detections each counts.
        precision: sums over their detections.
        place: (D, 2) their mean places, metres.
        turn: (D,) their mean headings, radians.
        side: (D, 3) their mean logarithms of the sides.
    """

    number: FloatArray
    precision: Precision
    place: FloatArray
    turn: FloatArray
    side: FloatArray


_compile = compiled(error_model="numpy")


@_compile
def precision_of(covariance: FloatArray, position_sd: float, yaw_sd: float) -> Precision:
    """What each of D detections counts, beside one whose only error is the common noise.

    Args:
        covariance: (D, 3, 3) of what each says of its own errors, metres and radians.
        position_sd: of the common noise, metres.
        yaw_sd: of it, radians.
    """
    xx = 1 + covariance[:, 0, 0] / position_sd**2
    zz = 1 + covariance[:, 1, 1] / position_sd**2
    xz = covariance[:, 0, 1] / position_sd**2
    determinant = xx * zz - xz * xz
    place = np.empty((len(covariance), 3))
    place[:, 0], place[:, 1], place[:, 2] = zz / determinant, -xz / determinant, xx / determinant
    return Precision(place, 1 / (1 + covariance[:, 2, 2] / yaw_sd**2))


@_compile
def gain(objects: Objects, a: int, b: int, noise: Noise) -> float:
    """How much likelier the detections of objects a and b are if these are one: a logarithm.

    The difference of their places has the sum of their covariances for its own, likewise that of their
    headings and of their sides.

    Args:
        objects: all of them.
        a: one object.
        b: the other.
        noise: how exactly they were measured.
    """
    number, place, turn, side = objects.number, objects.place, objects.turn, objects.side
    one, other, turning = objects.precision.place[a], objects.precision.place[b], objects.precision.turn
    # The inverse of the sum of two covariances, from their inverses.
    det_one = one[0] * one[2] - one[1] * one[1]
    det_other = other[0] * other[2] - other[1] * other[1]
    both_xx, both_xz, both_zz = one[0] + other[0], one[1] + other[1], one[2] + other[2]
    det_both = both_xx * both_zz - both_xz * both_xz
    weight = (det_other * one[0] + det_one * other[0]) / det_both
    across = (det_other * one[1] + det_one * other[1]) / det_both
    along = (det_other * one[2] + det_one * other[2]) / det_both
    turn_weight = turning[a] * turning[b] / (turning[a] + turning[b])
    dx, dz = place[a, 0] - place[b, 0], place[a, 1] - place[b, 1]
    angle = turn[a] - turn[b]
    angle -= 2 * math.pi * np.round(angle / (2 * math.pi))
    # In units of the first weight: of equally exact detections all weights are one, to the last bit.
    squares = (dx * dx + 2 * dx * dz * (across / weight) + dz * dz * (along / weight)) / noise.position_sd**2
    spread = math.sqrt(weight * along - across * across)
    volume = math.log(noise.area * spread / (2 * math.pi * noise.position_sd**2))
    if not math.isnan(angle):
        squares += angle * angle / noise.yaw_sd**2 * (turn_weight / weight)
        volume += 0.5 * math.log(2 * math.pi * turn_weight / noise.yaw_sd**2)
    side_weight = number[a] * number[b] / (number[a] + number[b]) / weight
    for k in range(3):
        gap = side[a, k] - side[b, k]
        if not math.isnan(gap):
            squares += gap * gap / noise.side_sd**2 * side_weight
    return float(volume - 0.5 * weight * squares)


@_compile
def ways(number: FloatArray, a: int, b: int) -> float:
    """Logarithm of how many ways there are to tell the detections of one object apart as those of a and b."""
    together = number[a] + number[b]
    return math.lgamma(together + 1.0) - math.lgamma(number[a] + 1.0) - math.lgamma(number[b] + 1.0)


@_compile
def _merge(objects: Objects, a: int, b: int) -> None:
    """Object b becomes both."""
    number, place, turn, side = objects.number, objects.place, objects.turn, objects.side
    precise, turning = objects.precision.place, objects.precision.turn
    one = precise[a].copy()
    precise[b] += one
    both = precise[b]
    determinant = both[0] * both[2] - both[1] * both[1]
    dx, dz = place[a, 0] - place[b, 0], place[a, 1] - place[b, 1]
    # The place of b moves by its share of the precision of both: (one) (both)^-1, transposed.
    xx = (one[0] * both[2] - one[1] * both[1]) / determinant
    xz = (one[1] * both[2] - one[2] * both[1]) / determinant
    zx = (one[1] * both[0] - one[0] * both[1]) / determinant
    zz = (one[2] * both[0] - one[1] * both[1]) / determinant
    place[b, 0] += xx * dx + xz * dz
    place[b, 1] += zx * dx + zz * dz
    share = number[a] / (number[a] + number[b])
    if math.isnan(side[b, 0]):
        side[b] = side[a]
    elif not math.isnan(side[a, 0]):
        side[b] += share * (side[a] - side[b])
    angle = turn[a] - turn[b]
    if math.isnan(turn[b]):
        turn[b] = turn[a]
    elif not math.isnan(angle):
        turned = turning[a] / (turning[a] + turning[b])
        turn[b] += turned * (angle - 2 * math.pi * np.round(angle / (2 * math.pi)))
    turning[b] += turning[a]
    number[b] += number[a]


@_compile
def _likeliest(gains: FloatArray, row: int) -> int:
    """With which earlier object one gains most by being joined; -1 where it gains with none."""
    found, most = -1, 0.0
    for other in range(row):
        if gains[row, other] > most:
            found, most = other, gains[row, other]
    return found


@_compile
def join(seen: Seen, apart: BoolArray, noise: Noise, object_of: IntArray) -> float:
    """Join the two objects that gain most until none gain; returns the sum of the gains.

    To each gain come the `ways` in which two objects might have shared the detections of one: without them a
    long sequence would look likelier as several objects of less noise, each seen now and then.

    Args:
        seen: the detections.
        apart: (D, D) which two cannot be of one object.
        noise: how exactly they were measured.
        object_of: (D,) 0, 1, ..., filled with the object of each detection.
    """
    count = len(seen.yaw)
    precision = precision_of(seen.covariance, noise.position_sd, noise.yaw_sd)
    objects = Objects(np.ones(count), precision, seen.position.copy(), seen.yaw.copy(), seen.sides.copy())
    gains = np.full((count, count), -np.inf)
    for a in range(count):
        for b in range(a):
            if not apart[a, b]:
                gains[a, b] = gain(objects, a, b, noise) + ways(objects.number, a, b)
    likeliest = np.empty(count, dtype=np.int64)  # of each row, so that a merger costs D steps and not D²
    for a in range(count):
        likeliest[a] = _likeliest(gains, a)
    total = 0.0
    while True:
        a, best = -1, 0.0
        for row in range(count):
            if likeliest[row] >= 0 and gains[row, likeliest[row]] > best:
                a, best = row, gains[row, likeliest[row]]
        if a < 0:
            return total
        b = likeliest[a]
        total += best
        _merge(objects, a, b)
        object_of[object_of == a] = b
        for other in range(count):
            high, low = max(b, other), min(b, other)
            blocked = other == b or gains[high, low] == -np.inf
            blocked = blocked or gains[max(a, other), min(a, other)] == -np.inf
            if not blocked:
                gains[high, low] = gain(objects, high, low, noise) + ways(objects.number, high, low)
            elif other != b:
                gains[high, low] = -np.inf
        gains[a, :] = -np.inf
        gains[:, a] = -np.inf
        likeliest[a] = -1
        for row in range(b, count):
            before = likeliest[row]
            if row == b or before in (a, b):
                likeliest[row] = _likeliest(gains, row)
            elif gains[row, b] > 0:
                most = gains[row, before] if before >= 0 else 0.0
                if gains[row, b] > most or (gains[row, b] == most and b < before):
                    likeliest[row] = b
