"""The rigid motions that best take detections to labels, compiled."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.kernels import compiled
from farm_ar.reid.plausibility.evidence import ANYWHERE, LEAST_SHIFT, NOTHING, reach

_compile = compiled(error_model="numpy")

MOST_CANDIDATES, BEST, ROUNDS = 2000, 3, 3
"""Motions that each of the longest pairs proposes; of all, those refined, and how often."""

TOLERANCE = 0.3
"""By how much two distances may differ, by the labels' spacing, and be of one pair."""

EQUAL = 1e-9
"""Scores that differ by less are equal, of which the first counts: where places are symmetric, many are."""


@_compile
def best_motions(
    position: FloatArray, allowed: BoolArray, place: FloatArray, spacing: float, extent: float
) -> FloatArray:
    """The rigid motions that best take detections to labels, of those that pairs of them propose.

    Args:
        position: (N, 2) detections, metres.
        allowed: (N, M) which label each may be.
        place: (M, 2) labels, metres.
        spacing: of the labels, metres.
        extent: of the labels, metres.

    Returns:
        (K, 6): pivot, shift, metres, turn, radians, and the logarithm of the prior probability of all
        motions that fit about as well (Laplace's approximation). There are several where places are
        symmetric, so that they fit equally well, and none if no pair proposes any.
    """
    width, floor = LEAST_SHIFT * spacing * 5, ANYWHERE / extent**2
    proposed = _proposed(position, allowed, place, TOLERANCE * spacing)
    count = min(BEST, len(proposed))
    if not count:
        return np.empty((0, 6))
    scores, fitted = np.empty(len(proposed)), np.full(count, -np.inf)
    motions, there, share = np.empty((count, 6)), np.empty((count, *position.shape)), np.empty(allowed.shape)
    third = np.full(BEST, -np.inf)
    rest = _most_of_rest(allowed, place, width, floor)
    for k in range(len(proposed)):
        move(proposed[k], position, there[0])
        scores[k] = _score(there[0], allowed, place, width, floor, third[0] - EQUAL, rest)
        if scores[k] > third[0]:
            third[0] = scores[k]
            third.sort()
    for i in range(count):
        k = int(np.argmax(scores > scores.max() - EQUAL))
        scores[k] = -np.inf
        motions[i, :5] = proposed[k]
        for _ in range(ROUNDS):
            move(motions[i], position, there[i])
            _shares(there[i], allowed, place, width, floor, share)
            _refine(position, share, place, width, motions[i])
        move(motions[i], position, there[i])
        same = False
        for other in range(i):
            same |= np.abs(there[i] - there[other]).max() < 1e-6 * spacing
        if not same:
            fitted[i] = _score(there[i], allowed, place, width, floor, -np.inf, rest)
    best = fitted > max(fitted.max() - EQUAL, -1e300)
    for i in range(count):
        if best[i]:
            _shares(there[i], allowed, place, width, floor, share)
            motions[i, 5] = _log_share(there[i], share, place, motions[i], spacing, extent)
    result: FloatArray = motions[best]
    return result


@_compile
def _proposed(position: FloatArray, allowed: BoolArray, place: FloatArray, tolerance: float) -> FloatArray:
    """(K, 5) motions that take the detections farthest apart to two labels as far apart."""
    longest, m = _longest(position), len(place)
    fitting, counts = np.empty((len(longest), m * m), dtype=np.int32), np.zeros(len(longest), dtype=np.int64)
    for p, (a, b) in enumerate(longest):
        x, z = position[b, 0] - position[a, 0], position[b, 1] - position[a, 1]
        length = math.sqrt(x * x + z * z)
        if not length > 0:
            continue
        for i in range(m):
            if not allowed[a, i]:
                continue
            for j in range(m):
                if not allowed[b, j]:
                    continue
                x_there, z_there = place[j, 0] - place[i, 0], place[j, 1] - place[i, 1]
                apart = math.sqrt(x_there * x_there + z_there * z_there)
                if abs(apart - length) <= tolerance and apart > 0:
                    fitting[p, counts[p]] = i * m + j
                    counts[p] += 1
    found, k = np.empty((np.minimum(counts, MOST_CANDIDATES).sum(), 5)), 0
    for p, (a, b) in enumerate(longest):
        x, z = position[b, 0] - position[a, 0], position[b, 1] - position[a, 1]
        turn = math.atan2(x, z)
        for q in range(0, counts[p], 1 + counts[p] // MOST_CANDIDATES):
            i, j = fitting[p, q] // m, fitting[p, q] % m
            for axis in range(2):
                found[k, axis] = (position[a, axis] + position[b, axis]) / 2
                found[k, 2 + axis] = (place[i, axis] + place[j, axis]) / 2 - found[k, axis]
            found[k, 4] = math.atan2(place[j, 0] - place[i, 0], place[j, 1] - place[i, 1]) - turn
            k += 1
    return found[:k]


@_compile
def _longest(position: FloatArray) -> list[tuple[int, int]]:
    """The three pairs of detections farthest apart, the first of equals first."""
    pairs = [(0, 0)]
    pairs.clear()
    for _ in range(3):
        most, best = -1.0, (0, 0)
        for a in range(len(position)):
            for b in range(a + 1, len(position)):
                x, z = position[b, 0] - position[a, 0], position[b, 1] - position[a, 1]
                if x * x + z * z > most and (a, b) not in pairs:
                    most, best = x * x + z * z, (a, b)
        if most >= 0:
            pairs.append(best)
    return pairs


@_compile
def move(motion: FloatArray, position: FloatArray, there: FloatArray) -> None:
    """Fill (N, 2) with where a motion (5,) takes places (N, 2)."""
    sine, cosine = math.sin(motion[4]), math.cos(motion[4])
    for n in range(len(position)):
        x, z = position[n, 0] - motion[0], position[n, 1] - motion[1]
        there[n, 0] = motion[0] + (cosine * x + sine * z) + motion[2]
        there[n, 1] = motion[1] + (cosine * z - sine * x) + motion[3]


@_compile
def _most_of_rest(allowed: BoolArray, place: FloatArray, width: float, floor: float) -> FloatArray:
    """(N + 1,) the most that the score of the detections from each one on can be, wherever they are.

    A place is no nearer to any label than half as far as the label that is nearest to it.
    """
    twice, crowd = 2 * width * width, 1.0
    for j in range(len(place)):
        near = 0.0
        for m in range(len(place)):
            square = (place[j, 0] - place[m, 0]) ** 2 + (place[j, 1] - place[m, 1]) ** 2
            if square < 4 * NOTHING * twice:
                near += math.exp(-square / (4 * twice))
            else:
                near += math.exp(-NOTHING)
        crowd = max(crowd, near)
    rest = np.zeros(len(allowed) + 1)
    for n in range(len(allowed) - 1, -1, -1):
        highest = (1 - ANYWHERE) / (math.pi * twice * allowed[n].sum())
        rest[n] = rest[n + 1] + math.log(highest * crowd * (1 + 1e-9) + floor)
    return rest


@_compile
def _score(
    there: FloatArray,
    allowed: BoolArray,
    place: FloatArray,
    width: float,
    floor: float,
    least: float,
    rest: FloatArray,
) -> float:
    """Logarithm of the likelihood of places (N, 2), each near a label or anywhere; -inf if below `least`."""
    total, twice = 0.0, 2 * width * width
    highest = (1 - ANYWHERE) / (math.pi * twice)
    enough = twice * reach(highest, floor)
    for n in range(len(there)):
        if total + rest[n] < least:
            return -np.inf
        near, count = 0.0, 0
        for m in range(len(place)):
            if allowed[n, m]:
                count += 1
                square = (there[n, 0] - place[m, 0]) ** 2 + (there[n, 1] - place[m, 1]) ** 2
                if square < enough:
                    near += math.exp(-square / twice)
        total += math.log(highest * near / count + floor)
    return total


@_compile
def _shares(
    there: FloatArray,
    allowed: BoolArray,
    place: FloatArray,
    width: float,
    floor: float,
    share: FloatArray,
) -> None:
    """Fill (N, M) with the probability that each detection is each label's object, stayed there."""
    twice = 2 * width * width
    enough = twice * reach((1 - ANYWHERE) / (math.pi * twice), floor)
    for n in range(len(there)):
        factor = (1 - ANYWHERE) / (math.pi * twice * allowed[n].sum())
        total = floor
        for m in range(len(place)):
            square = (there[n, 0] - place[m, 0]) ** 2 + (there[n, 1] - place[m, 1]) ** 2
            fits = allowed[n, m] and square < enough
            share[n, m] = factor * math.exp(-square / twice) if fits else 0.0
            total += share[n, m]
        share[n] /= total


@_compile
def _refine(
    position: FloatArray, share: FloatArray, place: FloatArray, width: float, motion: FloatArray
) -> None:
    """Replace a motion (5,) by the likeliest one from places (N, 2) to labels with shares (`register`)."""
    n_count, m_count = share.shape
    weight, some, total = np.empty(n_count), 0, 0.0
    pivot_x, pivot_z = 0.0, 0.0
    for n in range(n_count):
        weight[n] = 0.0
        for m in range(m_count):
            weight[n] += share[n, m]
        some += weight[n] > 1e-3
        total += weight[n]
        pivot_x += weight[n] * position[n, 0]
        pivot_z += weight[n] * position[n, 1]
    if some < 2:
        return
    pivot_x, pivot_z = pivot_x / total, pivot_z / total
    information, along, across = 0.0, 0.0, 0.0
    before_x, before_z, after_x, after_z = 0.0, 0.0, 0.0, 0.0
    for n in range(n_count):
        target_x, target_z = 0.0, 0.0
        for m in range(m_count):
            target_x += share[n, m] * place[m, 0]
            target_z += share[n, m] * place[m, 1]
        precision = weight[n] / width**2
        mine_x, mine_z = position[n, 0] - pivot_x, position[n, 1] - pivot_z
        theirs_x = target_x / max(weight[n], 1e-300) - pivot_x
        theirs_z = target_z / max(weight[n], 1e-300) - pivot_z
        information += precision
        before_x += precision * mine_x
        before_z += precision * mine_z
        after_x += precision * theirs_x
        after_z += precision * theirs_z
        along += precision * (mine_x * theirs_x + mine_z * theirs_z)
        across += precision * (theirs_x * mine_z - theirs_z * mine_x)
    along -= (before_x * after_x + before_z * after_z) / information
    across -= (after_x * before_z - after_z * before_x) / information
    turn = math.atan2(across, along)
    sine, cosine = math.sin(turn), math.cos(turn)
    motion[0], motion[1] = pivot_x, pivot_z
    motion[2] = (after_x - (cosine * before_x + sine * before_z)) / information
    motion[3] = (after_z - (cosine * before_z - sine * before_x)) / information
    motion[4] = turn


@_compile
def _log_share(
    there: FloatArray,
    share: FloatArray,
    place: FloatArray,
    motion: FloatArray,
    spacing: float,
    extent: float,
) -> float:
    total = share.sum()
    if not total > 0:
        return -np.inf
    error, middle = 0.0, np.zeros(2)
    for n in range(len(there)):
        middle += share[n].sum() * there[n]
        for m in range(len(place)):
            square = (there[n, 0] - place[m, 0]) ** 2 + (there[n, 1] - place[m, 1]) ** 2
            error += share[n, m] * square
    middle /= total
    spread = math.sqrt(error / (2 * total)) + LEAST_SHIFT * spacing
    square = 0.0
    for n in range(len(there)):
        square += share[n].sum() * ((there[n, 0] - middle[0]) ** 2 + (there[n, 1] - middle[1]) ** 2)
    arm = math.sqrt(square / total) + spacing * LEAST_SHIFT
    centre = np.array([[place[:, 0].mean(), place[:, 1].mean()]])
    moved = np.empty_like(centre)
    move(motion, centre, moved)
    shift = math.hypot(moved[0, 0] - centre[0, 0], moved[0, 1] - centre[0, 1])
    prior = math.log(extent / (2 * math.pi * (extent**2 + shift**2) ** 1.5)) - math.log(2 * math.pi)
    turns = min(2 * math.pi, math.sqrt(2 * math.pi / total) * spread / arm)
    return prior + math.log(2 * math.pi * spread**2 / total) + math.log(turns)
