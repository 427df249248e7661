"""How well a snapshot fits the map under each way of writing it down, compiled (see `patterns`)."""

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

NOTHING = 100.0
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
            if part * part < 2 * NOTHING:
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
                enough[s] = twice[s] * reach(1 / (math.pi * twice[s]), ANYWHERE * anywhere[p] / FULL_TURN)
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
def reach(highest: float, floor: float) -> float:
    """Negative exponent from which on a Gaussian of a height is nothing beside what is added to it."""
    return _DIGITS + max(math.log(highest / floor), 0.0)
