"""Compiled search for a motion that all things share: a school that swims on, a frame that has drifted."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled
from farm_ar.reid.adaptive.records import TURNING, Pairs, Profiles, Seeing, Sparse
from farm_ar.reid.adaptive.sparse import propagate

STEPS, ROUNDS = 2, 4
"""Steps of expectation and maximisation on each scale, and rounds of belief propagation in each."""

TURN_SD = 0.35
"""SD of a shared turn, radians."""

SHARED_TURN_SD = 0.5
"""SD of the turns of single things, beside the shared one, while that is sought; radians."""

_compile = compiled(error_model="numpy")


@_compile
def residual(pairs: Pairs, p: int, turn: float, shift: FloatArray, middle: FloatArray) -> tuple[float, float]:
    """By how much the place of pair p differs from where the shared motion takes its label."""
    x, z = pairs.from_x[p] - middle[0], pairs.from_z[p] - middle[1]
    sine, cosine = math.sin(turn), math.cos(turn)
    east = pairs.shift_x[p] + pairs.from_x[p] - (middle[0] + x * cosine + z * sine + shift[0])
    north = pairs.shift_z[p] + pairs.from_z[p] - (middle[1] + z * cosine - x * sine + shift[1])
    return east, north


@_compile
def best_motion(
    pairs: Pairs, belief: FloatArray, length: float, turning: bool, middle: FloatArray, shift: FloatArray
) -> tuple[float, float, float]:
    """The rigid motion that explains pairs best, each counting by its belief; fills in the shift.

    Args:
        pairs: the pairs.
        belief: (P,) of each.
        length: SD of what is left.
        turning: whether it may turn.
        middle: (2,) filled with the place about which it turns.
        shift: (2,) filled.

    Returns:
        The turn, radians; the pairs' number and their moment about the middle.
    """
    total, x, z, dx, dz = 0.0, 0.0, 0.0, 0.0, 0.0
    for p in range(len(belief)):
        b = belief[p]
        total += b
        x += b * pairs.from_x[p]
        z += b * pairs.from_z[p]
        dx += b * pairs.shift_x[p]
        dz += b * pairs.shift_z[p]
    total = max(total, 1e-9)
    middle[0], middle[1] = x / total, z / total
    shift[0], shift[1] = dx / total, dz / total
    if not turning:
        return 0.0, total, 0.0
    cross, dot, moment = 0.0, 0.0, 0.0
    for p in range(len(belief)):
        b = belief[p]
        ax, az = pairs.from_x[p] - middle[0], pairs.from_z[p] - middle[1]
        bx, bz = ax + pairs.shift_x[p] - shift[0], az + pairs.shift_z[p] - shift[1]
        cross += b * (az * bx - ax * bz)
        dot += b * (ax * bx + az * bz)
        moment += b * (ax * ax + az * az)
    # A prior of no turn, as strong as its SD says.
    return math.atan2(cross, dot + (length / TURN_SD) ** 2), total, moment


@_compile
def find_common(
    pairs: Pairs,
    profiles: Profiles,
    seeing: Seeing,
    like: FloatArray,
    some: Sparse,
    shift: FloatArray,
    penalty: FloatArray,
) -> None:
    """Find a shared motion for each scale of what things do besides, from the coarsest to the finest.

    Args:
        pairs: the pairs.
        profiles: of the shifts; those of shared motions stand together, the finest first.
        seeing: what is known of detecting.
        like: (P,) how likely each pair is otherwise.
        some: room for weights.
        shift: (R, P) filled, for the profiles of shared motions, with densities of what is left.
        penalty: (R,) filled with the log of how much of the prior of the motion the posterior takes up.
    """
    count, n, labels = len(pairs.label), len(seeing.none), len(seeing.anywhere)
    weight, belief, to_row = np.empty(count), np.empty(count), np.empty(count)
    middle, way = np.zeros(2), np.zeros(2)
    before = -1
    for r in range(len(profiles.kind) - 1, -1, -1):
        penalty[r] = 0.0
        kind, length = profiles.kind[r], profiles.length[r]
        if kind < TURNING - 1:
            continue
        if kind != before:
            for i in range(n):
                for p in range(pairs.start[i], pairs.start[i + 1]):
                    belief[p] = like[p] / (pairs.start[i + 1] - pairs.start[i])
            turn, total, moment = best_motion(pairs, belief, length, False, middle, way)
            before = kind
        for _ in range(STEPS):
            for i in range(n):
                largest = 1e-300
                for p in range(pairs.start[i], pairs.start[i + 1]):
                    east, north = residual(pairs, p, turn, way, middle)
                    weight[p] = like[p] * math.exp(-0.5 * (east * east + north * north) / length**2)
                    largest = max(largest, weight[p])
                for p in range(pairs.start[i], pairs.start[i + 1]):
                    weight[p] = max(weight[p] / largest, 1e-9)
            fill(pairs, weight, length**2 * seeing.none, some)
            to_row[:] = free_share(n, labels)
            propagate(some, labels, to_row, ROUNDS, 1e-3)
            for i in range(n):
                reach = some.none[i]
                for p in range(pairs.start[i], pairs.start[i + 1]):
                    reach += weight[p] * to_row[p]
                for p in range(pairs.start[i], pairs.start[i + 1]):
                    belief[p] = weight[p] * to_row[p] / reach
            turn, total, moment = best_motion(pairs, belief, length, kind == TURNING, middle, way)
        for p in range(count):
            east, north = residual(pairs, p, turn, way, middle)
            rest = (east * east + north * north) / length**2
            shift[r, p] = math.exp(-0.5 * rest) / (2 * math.pi * length**2)
        penalty[r] = occam(length, total, way, profiles.length.max(), turn, moment, kind == TURNING)


@_compile
def occam(
    length: float,
    total: float,
    way: FloatArray,
    extent: float,
    turn: float,
    moment: float,
    turning: bool,
) -> float:
    """Log of the share of the prior of a shared motion that its posterior takes up.

    The prior of how far is half Gaussian, of twice the scale of what else things do, and half even by ratio,
    from that scale up to the extent.
    """
    levels = 0.5 * math.log(1.0 + (extent / length) ** 2) + 0.5
    square = (way[0] * way[0] + way[1] * way[1]) / length**2
    density = 0.5 * 0.25 * math.exp(-square / 8) + 0.5 / ((square + 1.0) * levels)
    result = min(math.log(density / max(total, 1.0)), 0.0)
    if turning:
        sd = length / math.sqrt(max(moment, 1e-12))
        result += min(math.log(sd / TURN_SD), 0.0) - 0.5 * (turn / TURN_SD) ** 2
    return result


@_compile
def free_share(detections: int, labels: int) -> float:
    """The share of labels that is left when each detection has one: where messages start from."""
    return min(max((labels - detections + 1.0) / max(labels, 1), 0.03), 1.0)


@_compile
def fill(pairs: Pairs, weight: FloatArray, none: FloatArray, some: Sparse) -> None:
    """All pairs as weights, none of them left out."""
    for i in range(len(none)):
        some.start[i] = pairs.start[i]
        some.none[i] = max(none[i], 1e-6)
        for p in range(pairs.start[i], pairs.start[i + 1]):
            some.label[p] = pairs.label[p]
            some.pair[p] = p
            some.weight[p] = weight[p]
    some.start[len(none)] = pairs.start[len(none)]
