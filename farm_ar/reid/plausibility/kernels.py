"""Compiled pieces of the check before identifying: evidence of variants, and the motion that fits best."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry.angles import FULL_TURN
from farm_ar.kernels import compiled

_compile = compiled(error_model="numpy")

ANYWHERE = 0.3
"""Share of the detections that may be anywhere."""

LEAST_SHIFT = 0.03
"""The least scale of shift, by the spacing."""

TURNS = (0.03, 0.1, 0.35, 1.0)
"""Scales of turn, radians, beside headings that tell nothing."""

MOST_CANDIDATES, BEST, ROUNDS = 2000, 3, 3
"""Motions that each of the longest pairs proposes; of all, those refined, and how often."""

TOLERANCE = 0.3
"""By how much two distances may differ, by the labels' spacing, and be of one pair."""

EQUAL = 1e-9
"""Scores that differ by less are equal, of which the first counts: where places are symmetric, many are."""

_NOTHING = 100.0
"""Negative exponent of a Gaussian from which on it is nothing beside what is added to it."""

_DIGITS = 40.0
"""The same, where it is as large as what is added when the exponent is 0."""

_LEAST = 1e-300

_TURN_DENSITY = FULL_TURN**-1.5

_ROOM = 8
"""Places for scales of shift in an array, some more than there are: a number that processors like."""


@_compile
def heading_densities(turn: float, period: float, result: FloatArray) -> None:
    """Fill (R + 1,) with densities of a turn for each scale, and for headings that tell nothing.

    Args:
        turn: radians; NaN where it is not known.
        period: of the headings, radians; 0 where there is none.
        result: what is filled.
    """
    if math.isnan(turn) or not period > 0:
        result[:] = 1 / FULL_TURN
        return
    off = turn - period * np.rint(turn / period)
    for r in range(len(TURNS)):
        width = TURNS[r]
        each, around = 1 / width, 0.0
        for k in range(-1, 2):
            part = (off + k * period) * each
            if part * part < 2 * _NOTHING:
                around += math.exp(-0.5 * part * part)
        result[r] = around * each * period * _TURN_DENSITY
    result[len(TURNS)] = 1 / FULL_TURN


@_compile
def evidence_of_all(
    variants: tuple[FloatArray, FloatArray, IntArray, BoolArray],
    share: FloatArray,
    labels: tuple[FloatArray, FloatArray, FloatArray],
    widths: FloatArray,
    most_if_close: float,
    extent: float,
) -> FloatArray:
    """(H,) logarithms of the marginal likelihood of a snapshot under each of H variants.

    Args:
        variants: (P, N, 2) places and (Y, N) headings; (H, 2) which of either each variant has; and (H,)
            whether it counts only as far as things are then close to where they were.
        share: (N, M) how likely each detection is each label's object, before it is seen where.
        labels: (M, 2) places, (M,) headings and (M,) their periods.
        widths: (S,) scales of shift, metres, rising; at most 8.
        most_if_close: the largest of them that counts for what is to be close.
        extent: of the labels, metres.
    """
    position, yaw, which, close = variants
    place, heading, period = labels
    (p_count, n_count, _), y_count, h_count = position.shape, len(yaw), len(which)
    s_count, r_count = len(widths), len(TURNS) + 1
    middle = np.array([place[:, 0].mean(), place[:, 1].mean()])
    shift = np.zeros((p_count, len(place), _ROOM))
    turn = np.empty((y_count, len(place), r_count))
    anywhere = np.empty(p_count)
    product = np.ones((h_count, s_count, r_count))
    total = np.zeros((h_count, s_count, r_count))
    of = np.empty(len(place), dtype=np.int64)
    needed = np.zeros(p_count, dtype=np.int64)  # of the scales of shift: those that a variant counts
    for h in range(h_count):
        most = _counting(widths, close[h], most_if_close)
        needed[which[h, 0]] = max(needed[which[h, 0]], most)
    twice, enough = np.empty(s_count), np.empty(s_count)
    for n in range(n_count):
        count = 0
        for m in range(len(place)):
            if share[n, m] > 0:
                of[count] = m
                count += 1
        for p in range(p_count):
            x, z = position[p, n, 0], position[p, n, 1]
            away = (x - middle[0]) ** 2 + (z - middle[1]) ** 2
            anywhere[p] = _anywhere(away, extent)
            for s in range(needed[p]):
                twice[s] = 2 * widths[s] * widths[s]
                enough[s] = twice[s] * _reach(1 / (math.pi * twice[s]), ANYWHERE * anywhere[p] / FULL_TURN)
            for c in range(count):
                square = (x - place[of[c], 0]) ** 2 + (z - place[of[c], 1]) ** 2
                shift[p, c] = 0.0
                for s in range(needed[p] - 1, -1, -1):
                    if square < enough[s]:
                        density = math.exp(-square / twice[s]) / (math.pi * twice[s])
                        shift[p, c, s] = share[n, of[c]] * density
        for y in range(y_count):
            for c in range(count):
                heading_densities(yaw[y, n] - heading[of[c]], period[of[c]], turn[y, c])
        for h in range(h_count):
            p, y = which[h, 0], which[h, 1]
            _add(shift[p, :count], turn[y, :count], anywhere[p], product[h], total[h])
    result = np.empty(h_count)
    for h in range(h_count):
        result[h] = _log_mean(product[h], total[h], _counting(widths, close[h], most_if_close))
    return result


@_compile
def _counting(widths: FloatArray, close: bool, most_if_close: float) -> int:
    """How many scales of shift count, of those from the least."""
    most = len(widths)
    while close and most > 0 and widths[most - 1] > most_if_close:
        most -= 1
    return most


@_compile
def elsewhere_of(away: float, extent: float) -> float:
    """Density of the pose of a thing that may be anywhere, `away` (squared) from the middle of the labels."""
    density: float = ANYWHERE * _anywhere(away, extent) / FULL_TURN
    return density


@_compile
def _anywhere(away: float, extent: float) -> float:
    """Density of a thing that may be anywhere, `away` (squared) from the middle of the labels."""
    wide = extent * extent
    near = 0.5 * math.exp(-away / (2 * wide)) / (2 * math.pi * wide)
    density: float = near + 0.5 * extent / (2 * math.pi * (away + wide) ** 1.5)
    return density


@_compile
def _add(
    shift: FloatArray, turn: FloatArray, anywhere: float, product: FloatArray, total: FloatArray
) -> None:
    """Multiply the likelihoods of all scales by those of one detection; logarithms where they must be."""
    s_count, r_count = product.shape
    fits = np.empty((r_count, _ROOM))
    for r in range(r_count):
        a = b = c = d = e = f = g = h = 0.0  # in registers, which an array would not be
        for k in range(len(shift)):
            t = turn[k, r]
            a += shift[k, 0] * t
            b += shift[k, 1] * t
            c += shift[k, 2] * t
            d += shift[k, 3] * t
            e += shift[k, 4] * t
            f += shift[k, 5] * t
            g += shift[k, 6] * t
            h += shift[k, 7] * t
        fits[r] = (a, b, c, d, e, f, g, h)
    elsewhere = ANYWHERE * anywhere / FULL_TURN
    for s in range(s_count):
        for r in range(r_count):
            each = max((1 - ANYWHERE) * fits[r, s] + elsewhere, _LEAST)
            if 1e-150 < each < 1e150:
                product[s, r] *= each
            else:
                total[s, r] += math.log(each)
            if not 1e-150 < product[s, r] < 1e150:
                total[s, r] += math.log(product[s, r])
                product[s, r] = 1.0


@_compile
def _log_mean(product: FloatArray, total: FloatArray, most: int) -> float:
    """Logarithm of the mean likelihood over all scales, of which the first `most` of shift count."""
    top = -np.inf
    for s in range(most):
        for r in range(product.shape[1]):
            total[s, r] += math.log(product[s, r])
            top = max(top, total[s, r])
    mean = 0.0
    for s in range(most):
        for r in range(product.shape[1]):
            mean += math.exp(total[s, r] - top)
    return top + math.log(mean / product.size)


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
        _move(proposed[k], position, there[0])
        scores[k] = _score(there[0], allowed, place, width, floor, third[0] - EQUAL, rest)
        if scores[k] > third[0]:
            third[0] = scores[k]
            third.sort()
    for i in range(count):
        k = int(np.argmax(scores > scores.max() - EQUAL))
        scores[k] = -np.inf
        motions[i, :5] = proposed[k]
        for _ in range(ROUNDS):
            _move(motions[i], position, there[i])
            _shares(there[i], allowed, place, width, floor, share)
            _refine(position, share, place, width, motions[i])
        _move(motions[i], position, there[i])
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
    found = np.empty((3 * MOST_CANDIDATES, 5))
    k = 0
    for a, b in _longest(position):
        x, z = position[b, 0] - position[a, 0], position[b, 1] - position[a, 1]
        length = math.sqrt(x * x + z * z)
        if not length > 0:
            continue
        step, passed = 1, 0
        for second_time in (False, True):
            step, passed = 1 + passed // MOST_CANDIDATES, 0
            for i in range(len(place)):
                if not allowed[a, i]:
                    continue
                for j in range(len(place)):
                    if not allowed[b, j]:
                        continue
                    x_there, z_there = place[j, 0] - place[i, 0], place[j, 1] - place[i, 1]
                    apart = math.sqrt(x_there * x_there + z_there * z_there)
                    if not (abs(apart - length) <= tolerance and apart > 0):
                        continue
                    if second_time and passed % step == 0:
                        found[k, :2] = (position[a] + position[b]) / 2
                        found[k, 2:4] = (place[i] + place[j]) / 2 - found[k, :2]
                        found[k, 4] = math.atan2(x_there, z_there) - math.atan2(x, z)
                        k += 1
                    passed += 1
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
def _move(motion: FloatArray, position: FloatArray, there: FloatArray) -> None:
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
            if square < 4 * _NOTHING * twice:
                near += math.exp(-square / (4 * twice))
            else:
                near += math.exp(-_NOTHING)
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
    enough = twice * _reach(highest, floor)
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
def _reach(highest: float, floor: float) -> float:
    """Negative exponent from which on a Gaussian of a height is nothing beside what is added to it."""
    return _DIGITS + max(math.log(highest / floor), 0.0)


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
    enough = twice * _reach((1 - ANYWHERE) / (math.pi * twice), floor)
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
    weight = np.array([row.sum() for row in share])
    if np.count_nonzero(weight > 1e-3) < 2:
        return
    pivot = np.zeros(2)
    for n in range(len(position)):
        pivot += weight[n] * position[n]
    pivot /= weight.sum()
    information, along, across = 0.0, 0.0, 0.0
    before, after = np.zeros(2), np.zeros(2)
    for n in range(len(position)):
        target = np.zeros(2)
        for m in range(len(place)):
            target += share[n, m] * place[m]
        precision = weight[n] / width**2
        mine, theirs = position[n] - pivot, target / max(weight[n], 1e-300) - pivot
        information += precision
        before += precision * mine
        after += precision * theirs
        along += precision * (mine[0] * theirs[0] + mine[1] * theirs[1])
        across += precision * (theirs[0] * mine[1] - theirs[1] * mine[0])
    along -= (before[0] * after[0] + before[1] * after[1]) / information
    across -= (after[0] * before[1] - after[1] * before[0]) / information
    turn = math.atan2(across, along)
    sine, cosine = math.sin(turn), math.cos(turn)
    motion[:2] = pivot
    motion[2] = (after[0] - (cosine * before[0] + sine * before[1])) / information
    motion[3] = (after[1] - (cosine * before[1] - sine * before[0])) / information
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
    _move(motion, centre, moved)
    shift = math.hypot(moved[0, 0] - centre[0, 0], moved[0, 1] - centre[0, 1])
    prior = math.log(extent / (2 * math.pi * (extent**2 + shift**2) ** 1.5)) - math.log(2 * math.pi)
    turns = min(2 * math.pi, math.sqrt(2 * math.pi / total) * spread / arm)
    return prior + math.log(2 * math.pi * spread**2 / total) + math.log(turns)
