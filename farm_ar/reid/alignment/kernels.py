"""Compiled pieces of alignment: motions that pairs of objects propose, their scores, and their refinement.

Lengths are in units of the map's spacing. A motion is (turn, x, z): what stands at p ends at p, turned, plus
(x, z).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray, IntArray, read_only
from farm_ar.kernels import compiled

_compile = compiled(error_model="numpy")

REACH = 0.4
"""Farthest that a detection may be off in the comparison of motions."""

NEAR, FAR = 0.06, 0.16
"""SD of positions where motions are compared: least, and most where the turn is not well known."""

HEADING, TELLS = 0.07, 0.8
"""SD of a heading where motions are compared, radians; probability that headings are informative."""

STEPS, LOOSELY = read_only([0.2, 0.12, 0.08, 0.06, 0.05, 0.05], np.float64), read_only([0.45], np.float64)
"""SDs of positions in the steps of a refinement; the same to pair what has moved a little."""


class Things(NamedTuple):
    """Detections, or labels of the map.

    Args:
        position: (P, 2).
        yaw: (P,) radians; NaN where it is not known.
        period: (P,) of the headings, radians; 0 where there is none.
    """

    position: FloatArray
    yaw: FloatArray
    period: FloatArray


class Grid(NamedTuple):
    """The labels by cells of a grid.

    Args:
        corner: (2,) where it begins.
        cell: side of a cell.
        shape: (2,) cells along x and z.
        start: (cells + 1,) where each cell's labels begin in `label`.
        label: (M,) indices of the labels, cell by cell.
    """

    corner: FloatArray
    cell: float
    shape: IntArray
    start: IntArray
    label: IntArray


class Pairs(NamedTuple):
    """Pairs of detections, pairs of labels in order of their distance, and which of these may be which.

    Args:
        seen: (P, 2) detections of each pair.
        low: (P,) the first pair of labels about as far apart.
        high: (P,) the first that no longer is.
        known: (Q, 2) labels of each pair.
    """

    seen: IntArray
    low: IntArray
    high: IntArray
    known: IntArray


@_compile
def turn_between(before: float, after: float, period: float) -> float:
    """How far a heading must turn to become another, of objects that look alike after a period; radians."""
    turn = after - before
    return turn - period * math.floor(turn / period + 0.5)


@_compile
def count_pairs(pairs: Pairs, fit: FloatArray) -> IntArray:
    """(P,) in how many ways each pair of detections may be a pair of labels.

    Args:
        pairs: the pairs.
        fit: (N, M) minus infinity where a detection cannot be a label.
    """
    count = np.zeros(len(pairs.seen), dtype=np.int64)
    for p in range(len(pairs.seen)):
        a, b = pairs.seen[p]
        for q in range(pairs.low[p], pairs.high[p]):
            j, k = pairs.known[q]
            count[p] += (fit[a, j] > -np.inf) & (fit[b, k] > -np.inf)
            count[p] += (fit[a, k] > -np.inf) & (fit[b, j] > -np.inf)
    return count


@_compile
def propose(pairs: Pairs, fit: FloatArray, seen: Things, known: Things, motions: FloatArray) -> int:
    """Fill in the motions that take pairs of detections to pairs of labels; returns how many there are.

    Args:
        pairs: the pairs.
        fit: (N, M) as in `count_pairs`.
        seen: the N detections.
        known: the M labels.
        motions: (H, 6) filled: turn, x, z; the middle of the pair of detections; SD of the turn.
    """
    filled = 0
    for p in range(len(pairs.seen)):
        a, b = pairs.seen[p]
        x0, z0 = (seen.position[a] + seen.position[b]) / 2
        dx, dz = seen.position[b] - seen.position[a]
        before, lever = math.atan2(dx, dz), math.hypot(dx, dz)
        for q in range(pairs.low[p], pairs.high[p]):
            for order in range(2):
                j, k = pairs.known[q, order], pairs.known[q, 1 - order]
                if fit[a, j] == -np.inf or fit[b, k] == -np.inf or filled >= len(motions):
                    continue
                dx, dz = known.position[k] - known.position[j]
                turn = turn_between(before, math.atan2(dx, dz), 2 * math.pi)
                sine, cosine = math.sin(turn), math.cos(turn)
                x1, z1 = (known.position[j] + known.position[k]) / 2
                row = motions[filled]
                row[0] = turn
                row[1] = x1 - (cosine * x0 + sine * z0)
                row[2] = z1 - (cosine * z0 - sine * x0)
                row[3], row[4], row[5] = x0, z0, NEAR / lever
                filled += 1
    return filled


@_compile
def _heading_gain(before: float, after: float, period: float, sd: float) -> float:
    """Likelihood of a heading where an object stayed, by that of any heading; 1 where nothing is known."""
    if not (period > 0) or math.isnan(before) or math.isnan(after):
        return 1.0
    turn = turn_between(before, after, period)
    return 1 - TELLS + TELLS * period / (math.sqrt(2 * math.pi) * sd) * math.exp(-0.5 * (turn / sd) ** 2)


@_compile
def _gain(i: int, j: int, x: float, z: float, turn: float, sd: float, seen: Things, known: Things) -> float:
    """Likelihood of a detection, moved to (x, z), at a label's place, by that of a cell of unit area."""
    dx, dz = x - known.position[j, 0], z - known.position[j, 1]
    square = (dx * dx + dz * dz) / (sd * sd)
    if square > 9:
        return 0.0
    heading = _heading_gain(seen.yaw[i] + turn, known.yaw[j], known.period[j], math.hypot(HEADING, sd / 4))
    return math.exp(-0.5 * square) / (2 * math.pi * sd * sd) * heading


@_compile
def score(
    motions: FloatArray, seen: Things, known: Things, grid: Grid, fit: FloatArray, floor: FloatArray
) -> FloatArray:
    """(H,) roughly how much more probable the detections are after each motion than anywhere.

    Args:
        motions: (H, 6) of `propose`.
        seen: the N detections.
        known: the M labels.
        grid: of the labels.
        fit: (N, M) log likelihood of each detection's looks if it is each label.
        floor: (N,) how many objects like each detection there are a unit of area.
    """
    total = np.zeros(len(motions))
    for h in range(len(motions)):
        turn, sine, cosine = motions[h, 0], math.sin(motions[h, 0]), math.cos(motions[h, 0])
        for i in range(len(seen.yaw)):
            px, pz = seen.position[i]
            x, z = cosine * px + sine * pz + motions[h, 1], cosine * pz - sine * px + motions[h, 2]
            away = math.hypot(px - motions[h, 3], pz - motions[h, 4]) * motions[h, 5]
            sd = min(math.hypot(NEAR, away), FAR)
            best = 0.0
            left = max(math.floor((x - REACH - grid.corner[0]) / grid.cell), 0)
            right = min(math.floor((x + REACH - grid.corner[0]) / grid.cell), grid.shape[0] - 1)
            low = max(math.floor((z - REACH - grid.corner[1]) / grid.cell), 0)
            high = min(math.floor((z + REACH - grid.corner[1]) / grid.cell), grid.shape[1] - 1)
            for column in range(left, right + 1):
                for row in range(low, high + 1):
                    cell = column * grid.shape[1] + row
                    for k in range(grid.start[cell], grid.start[cell + 1]):
                        j = grid.label[k]
                        if fit[i, j] > -np.inf:
                            gain = _gain(i, j, x, z, turn, sd, seen, known) * math.exp(fit[i, j])
                            best = max(best, gain)
            total[h] += math.log1p(best / floor[i])
    return total


@_compile
def choose(motions: FloatArray, order: IntArray, most: int, apart: float, turned: float) -> IntArray:
    """The best motions that differ: their indices.

    Args:
        motions: (H, 6) of `propose`.
        order: (H,) the best first.
        most: of them at most.
        apart: by how much shifts differ at least.
        turned: or turns, radians.
    """
    chosen = np.empty(most, dtype=np.int64)
    count = 0
    for h in order:
        new = True
        for c in range(count):
            other = motions[chosen[c]]
            near = math.hypot(motions[h, 1] - other[1], motions[h, 2] - other[2]) < apart
            if near and abs(turn_between(motions[h, 0], other[0], 2 * math.pi)) < turned:
                new = False
                break
        if new:
            chosen[count] = h
            count += 1
            if count == most:
                break
    return chosen[:count]


@_compile
def refine(
    motions: FloatArray, seen: Things, known: Things, fit: FloatArray, floor: FloatArray, steps: FloatArray
) -> IntArray:
    """Improve motions step by step; (H, N) which label each detection then stands at, -1 for none.

    Each step pairs detections with labels one to one, the likeliest first, and fits the motion to the pairs.

    Args:
        motions: (H, 3 or more) turn, x, z: changed.
        seen: the N detections.
        known: the M labels.
        fit: (N, M) as in `score`.
        floor: (N,) as in `score`.
        steps: SD of positions in each step.
    """
    n, m = fit.shape
    match = np.full((len(motions), n), -1)
    gain, which = np.empty(n * m), np.empty(n * m, dtype=np.int64)
    for h in range(len(motions)):
        row = match[h]
        for sd in steps:
            turn, sine, cosine = motions[h, 0], math.sin(motions[h, 0]), math.cos(motions[h, 0])
            found = 0
            for i in range(n):
                px, pz = seen.position[i]
                x, z = cosine * px + sine * pz + motions[h, 1], cosine * pz - sine * px + motions[h, 2]
                for j in range(m):
                    if fit[i, j] > -np.inf and abs(x - known.position[j, 0]) < 3 * sd:
                        value = _gain(i, j, x, z, turn, sd, seen, known) * math.exp(fit[i, j]) / floor[i]
                        if value > 0:
                            gain[found], which[found] = value, i * m + j
                            found += 1
            row[:] = -1
            taken = np.zeros(m, dtype=np.bool_)
            weight = np.zeros(n)
            for f in np.argsort(-gain[:found]):
                i, j = which[f] // m, which[f] % m
                if row[i] < 0 and not taken[j]:
                    row[i], taken[j] = j, True
                    weight[i] = gain[f] / (1 + gain[f])
            _fit_motion(motions[h], row, weight, sd, seen, known)
    return match


@_compile
def _fit_motion(
    motion: FloatArray, match: IntArray, weight: FloatArray, sd: float, seen: Things, known: Things
) -> None:
    """The motion that best takes detections to their labels; left as it is where there are none."""
    total, x0, z0, x1, z1 = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(match)):
        if match[i] >= 0:
            total += weight[i]
            x0 += weight[i] * seen.position[i, 0]
            z0 += weight[i] * seen.position[i, 1]
            x1 += weight[i] * known.position[match[i], 0]
            z1 += weight[i] * known.position[match[i], 1]
    if total <= 0:
        return
    x0, z0, x1, z1 = x0 / total, z0 / total, x1 / total, z1 / total
    along, across = 0.0, 0.0
    for i in range(len(match)):
        j = match[i]
        if j >= 0:
            px, pz = seen.position[i, 0] - x0, seen.position[i, 1] - z0
            qx, qz = known.position[j, 0] - x1, known.position[j, 1] - z1
            along += weight[i] * (px * qx + pz * qz)
            across += weight[i] * (qx * pz - qz * px)
            before, after, period = seen.yaw[i] + motion[0], known.yaw[j], known.period[j]
            if period > 0 and not (math.isnan(before) or math.isnan(after)):
                turn = turn_between(before, after, period)
                if abs(turn) < 3 * HEADING:
                    share = weight[i] * (sd / HEADING) ** 2
                    along += share * math.cos(turn + motion[0])
                    across += share * math.sin(turn + motion[0])
    motion[0] = math.atan2(across, along)
    sine, cosine = math.sin(motion[0]), math.cos(motion[0])
    motion[1] = x1 - (cosine * x0 + sine * z0)
    motion[2] = z1 - (cosine * z0 - sine * x0)
