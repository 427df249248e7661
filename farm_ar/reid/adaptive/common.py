"""Compiled search for a motion that all objects share: a school that swims on, a frame that has drifted."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled
from farm_ar.reid.adaptive.records import (
    Common,
    DetectionModel,
    Pairs,
    Profile,
    Profiles,
    Sparse,
)
from farm_ar.reid.adaptive.sparse import propagate

STEPS, ROUNDS = 2, 4
"""Steps of expectation and maximisation on each scale, and rounds of belief propagation in each."""

FAR_OFF, HOPELESS = 9.0, 6.0
"""In squares of a scale: as how much what is left of a pair counts at most; and the mean from which on
no step is spent on finer scales, since most objects do not fit even this one."""

TURN_SD, BEND_SD = 0.15, 0.2
"""SD of a shared turn, radians, and of how much all is stretched or sheared, as a share."""

USUAL_AHEAD = 2.0
"""How far objects usually go ahead besides a shared shift, in scales of what is left."""

_compile = compiled(error_model="numpy")


@_compile
def left_over(pairs: Pairs, p: int, common: Common) -> float:
    """Square of the distance from where the shared motion takes the label of pair p to its detection."""
    x, z = pairs.from_x[p] - common.x, pairs.from_z[p] - common.z
    east = pairs.shift_x[p] + x - (x * common.xx + z * common.xz + common.east)
    north = pairs.shift_z[p] + z - (x * common.zx + z * common.zz + common.north)
    east -= common.ahead * pairs.ahead_x[p]
    north -= common.ahead * pairs.ahead_z[p]
    return float(east * east + north * north)


@_compile
def best_motion(pairs: Pairs, belief: FloatArray, length: float, kind: int) -> Common:
    """The shared motion that explains pairs best, each counting by its belief.

    Args:
        pairs: the pairs.
        belief: (P,) of each.
        length: SD of what is left.
        kind: of the motion.
    """
    total, x, z, dx, dz, hx, hz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for p in range(len(belief)):
        b = belief[p]
        total += b
        x += b * pairs.from_x[p]
        z += b * pairs.from_z[p]
        dx += b * pairs.shift_x[p]
        dz += b * pairs.shift_z[p]
        hx += b * pairs.ahead_x[p]
        hz += b * pairs.ahead_z[p]
    total = max(total, 1e-9)
    x, z, dx, dz, hx, hz = x / total, z / total, dx / total, dz / total, hx / total, hz / total
    cross, dot, moment = 0.0, 0.0, 0.0
    if kind == Profile.STREAMING:
        for p in range(len(belief)):
            ax, az = pairs.ahead_x[p] - hx, pairs.ahead_z[p] - hz
            dot += belief[p] * (ax * (pairs.shift_x[p] - dx) + az * (pairs.shift_z[p] - dz))
            moment += belief[p] * (ax * ax + az * az)
        ahead = max(dot / max(moment, 1e-9), 0.0)
        sd = 1.0 / math.sqrt(max(moment, 1e-12))
        usual = 1.0 + (ahead / length / USUAL_AHEAD) ** 2
        freedom = min(math.log(math.sqrt(8.0 / math.pi) * sd / USUAL_AHEAD / usual), 0.0)
        return Common(x, z, dx - ahead * hx, dz - ahead * hz, 1.0, 0.0, 0.0, 1.0, ahead, total, freedom)
    if kind == Profile.TURNING:
        for p in range(len(belief)):
            ax, az = pairs.from_x[p] - x, pairs.from_z[p] - z
            bx, bz = ax + pairs.shift_x[p] - dx, az + pairs.shift_z[p] - dz
            cross += belief[p] * (az * bx - ax * bz)
            dot += belief[p] * (ax * bx + az * bz)
            moment += belief[p] * (ax * ax + az * az)
        # A prior of no turn, as strong as its SD says.
        turn = math.atan2(cross, dot + (length / TURN_SD) ** 2)
        sd = length / math.sqrt(max(moment, 1e-12))
        freedom = min(math.log(sd / TURN_SD), 0.0) - 0.5 * (turn / TURN_SD) ** 2
        sine, cosine = math.sin(turn), math.cos(turn)
        return Common(x, z, dx, dz, cosine, sine, -sine, cosine, 0.0, total, freedom)
    if kind == Profile.BENDING:
        return bent(pairs, belief, length, Common(x, z, dx, dz, 1.0, 0.0, 0.0, 1.0, 0.0, total, 0.0))
    return Common(x, z, dx, dz, 1.0, 0.0, 0.0, 1.0, 0.0, total, 0.0)


@_compile
def bent(pairs: Pairs, belief: FloatArray, length: float, common: Common) -> Common:
    """A shared shift with how all is stretched, sheared and turned about its centre: ridge regression."""
    weak = (length / BEND_SD) ** 2
    aa, ab, bb, ea, eb, na, nb = weak, 0.0, weak, 0.0, 0.0, 0.0, 0.0
    for p in range(len(belief)):
        x, z = pairs.from_x[p] - common.x, pairs.from_z[p] - common.z
        east, north = (
            belief[p] * (pairs.shift_x[p] - common.east),
            belief[p] * (pairs.shift_z[p] - common.north),
        )
        aa += belief[p] * x * x
        ab += belief[p] * x * z
        bb += belief[p] * z * z
        ea += east * x
        eb += east * z
        na += north * x
        nb += north * z
    volume = aa * bb - ab * ab
    xx, xz = (ea * bb - eb * ab) / volume, (eb * aa - ea * ab) / volume
    zx, zz = (na * bb - nb * ab) / volume, (nb * aa - na * ab) / volume
    square = xx * xx + xz * xz + zx * zx + zz * zz
    freedom = math.log(weak * weak / volume) - 0.5 * square / BEND_SD**2
    return Common(
        common.x, common.z, common.east, common.north, 1.0 + xx, xz, zx, 1.0 + zz, 0.0, common.total, freedom
    )


@_compile
def find_common(
    pairs: Pairs,
    profiles: Profiles,
    detecting: DetectionModel,
    like: FloatArray,
    some: Sparse,
    shift: FloatArray,
    penalty: FloatArray,
    swing: FloatArray,
) -> None:
    """Find a shared motion for each scale of what objects do besides, from the coarsest to the finest.

    Args:
        pairs: the pairs.
        profiles: of the shifts; those of shared motions stand together, the finest first.
        detecting: what is known of detecting.
        like: (P,) how likely each pair is otherwise.
        some: room for weights.
        shift: (R, P) filled, for the profiles of shared motions, with densities of what is left.
        penalty: (R,) filled with the log of how much of the prior of the motion the posterior takes up.
        swing: (R, 3) filled with the sine and cosine of how all turn, and how many headings that rests on.
    """
    labels = len(detecting.anywhere)
    weight, belief, to_row = np.empty(len(like)), np.empty(len(like)), np.empty(len(like))
    extent = profiles.length.max()
    before, left = -1, 0.0
    common = best_motion(pairs, like, extent, Profile.TOGETHER)
    for r in range(len(profiles.kind) - 1, -1, -1):
        penalty[r] = 0.0
        kind, length = profiles.kind[r], profiles.length[r]
        if kind < Profile.TOGETHER:
            continue
        if kind != before:
            for i in range(len(detecting.none)):
                for p in range(pairs.start[i], pairs.start[i + 1]):
                    belief[p] = like[p] / (pairs.start[i + 1] - pairs.start[i])
            common = best_motion(pairs, belief, length, Profile.TOGETHER)
            before, left = kind, 0.0
        if left < HOPELESS:
            for _ in range(STEPS):
                for p in range(len(like)):
                    weight[p] = like[p] * math.exp(-0.5 * left_over(pairs, p, common) / length**2)
                believe(pairs, weight, length**2, detecting, labels, some, to_row, belief)
                common = best_motion(pairs, belief, length, kind)
            left = 0.0
            for p in range(len(like)):
                left += belief[p] * min(left_over(pairs, p, common) / length**2, FAR_OFF)
            left /= common.total
        density_about(pairs, common, length, shift[r])
        penalty[r] = occam(length, common, extent)
        mean_turn(pairs, belief, swing[r])


@_compile
def mean_turn(pairs: Pairs, belief: FloatArray, swing: FloatArray) -> None:
    """Fill in the sine and cosine of the mean turn of pairs by their belief, and how many these are."""
    sine, cosine, count = 0.0, 0.0, 0.0
    for p in range(len(belief)):
        if pairs.turned[p] and not pairs.stays[p]:
            sine += belief[p] * pairs.turn_sine[p]
            cosine += belief[p] * pairs.turn[p]
            count += belief[p]
    length = math.hypot(sine, cosine)
    swing[0], swing[1], swing[2] = 0.0, 1.0, count
    if length > 1e-9:
        swing[0], swing[1] = sine / length, cosine / length


@_compile
def density_about(pairs: Pairs, common: Common, length: float, density: FloatArray) -> None:
    """Fill (P,) densities of what a shared motion leaves."""
    peak = 1.0 / (2 * math.pi * length**2)
    for p in range(len(density)):
        density[p] = peak * math.exp(-0.5 * left_over(pairs, p, common) / length**2)


@_compile
def believe(
    pairs: Pairs,
    weight: FloatArray,
    none: float,
    detecting: DetectionModel,
    labels: int,
    some: Sparse,
    to_row: FloatArray,
    belief: FloatArray,
) -> None:
    """Fill (P,) beliefs of pairs by their weights, each detection's having a label taken as likely before.

    Args:
        pairs: the pairs.
        weight: (P,) of each; changed.
        none: weight of having no label, in units of its density.
        detecting: what is known of detecting.
        labels: how many there are.
        some: room for weights.
        to_row: (P,) room for messages.
        belief: filled.
    """
    n = len(detecting.none)
    for i in range(n):
        largest = 1e-300
        for p in range(pairs.start[i], pairs.start[i + 1]):
            largest = max(largest, weight[p])
        some.start[i] = pairs.start[i]
        some.none[i] = max(none * detecting.none[i], 1e-6)
        for p in range(pairs.start[i], pairs.start[i + 1]):
            some.label[p] = pairs.label[p]
            some.pair[p] = p
            some.weight[p] = max(weight[p] / largest, 1e-9)
    some.start[n] = pairs.start[n]
    to_row[:] = free_share(n, labels)
    propagate(some, labels, to_row, ROUNDS, 1e-3)
    for i in range(n):
        reach = some.none[i]
        for p in range(pairs.start[i], pairs.start[i + 1]):
            reach += some.weight[p] * to_row[p]
        for p in range(pairs.start[i], pairs.start[i + 1]):
            belief[p] = some.weight[p] * to_row[p] / reach


@_compile
def occam(length: float, common: Common, extent: float) -> float:
    """Log of the share of the prior of a shared motion that its posterior takes up.

    The prior of how far is half Gaussian, of twice the scale of what else objects do, and half even by ratio,
    from that scale up to the extent.
    """
    levels = 0.5 * math.log(1.0 + (extent / length) ** 2) + 0.5
    square = (common.east**2 + common.north**2) / length**2
    density = 0.5 * 0.25 * math.exp(-square / 8) + 0.5 / ((square + 1.0) * levels)
    return min(math.log(density / max(common.total, 1.0)), 0.0) + common.freedom


@_compile
def free_share(detections: int, labels: int) -> float:
    """The share of labels that is left when each detection has one: where messages start from."""
    return min(max((labels - detections + 1.0) / max(labels, 1), 0.03), 1.0)
