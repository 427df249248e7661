"""Bounds of the evidence of a snapshot in other ways, hardly above it, in a fraction of its time; compiled.

They have the densities of `evidence` over that of being anywhere, which makes each sum begin with 1, and an
exponential of which processors do several at once.
"""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry.angles import FULL_TURN
from farm_ar.kernels import compiled
from farm_ar.reid.plausibility.evidence import ANYWHERE, TURNS, elsewhere_of
from farm_ar.reid.plausibility.patterns import CLOSE
from farm_ar.reid.plausibility.quiet_places import Labels

_compile = compiled(error_model="numpy")

_WIDE = 13.0
"""By how many scales of turn a heading must be off for its density to be nothing."""

_LANES = 8
"""How many numbers processors work on at once; what is left over would take as long as all others."""


@_compile
def evidence_at_most(
    places: FloatArray, yaw: FloatArray, which: IntArray, share: FloatArray, labels: Labels, close: bool
) -> FloatArray:
    """(H,) bounds of `evidence_of_all`.

    Args:
        places: (P, N, 2) metres.
        yaw: (Y, N) radians.
        which: (H, 2) place and heading of each variant.
        share: (N, M) of the labels.
        labels: the scene.
        close: whether all count only as far as things are then close to where they were.
    """
    widths, extent = labels.widths, labels.lengths[1]
    (p_count, n_count, _), y_count, h_count = places.shape, len(yaw), len(which)
    s_count, r_count, m_count = len(widths), len(TURNS), len(labels.heading)
    most = s_count
    while close and most > 0 and widths[most - 1] > CLOSE * labels.lengths[0]:
        most -= 1
    x_middle, z_middle = labels.place[:, 0].mean(), labels.place[:, 1].mean()
    base, product = np.zeros(p_count), np.ones((h_count, most, r_count + 1))
    room = m_count + _LANES
    shift, turn = np.empty((p_count, most, room)), np.empty((y_count, room, r_count))
    x, z, heading, period = np.zeros(room), np.zeros(room), np.zeros(room), np.ones(room)
    square, away = np.empty(room), np.empty(room)
    for n in range(n_count):
        count, each = 0, 0.0
        for m in range(m_count):
            if share[n, m] > 0:
                x[count], z[count] = labels.place[m, 0], labels.place[m, 1]
                heading[count], period[count], each = labels.heading[m], labels.period[m], share[n, m]
                count += 1
        many = (count + _LANES - 1) // _LANES * _LANES
        for p in range(p_count):
            here_x, here_z = places[p, n, 0], places[p, n, 1]
            elsewhere = elsewhere_of((here_x - x_middle) ** 2 + (here_z - z_middle) ** 2, extent)
            base[p] += math.log(elsewhere)
            for k in range(many):
                square[k] = (here_x - x[k]) * (here_x - x[k]) + (here_z - z[k]) * (here_z - z[k])
            for s in range(most):
                twice = 2 * widths[s] * widths[s]
                over = -1 / twice
                height = (1 - ANYWHERE) * each / (math.pi * twice) / elsewhere
                for k in range(many):
                    shift[p, s, k] = height * _exp(over * square[k])
        for y in range(y_count):
            _fill_turns(yaw[y, n], heading[:many], period[:many], (away[:many], square[:many]), turn[y])
        for h in range(h_count):
            p, y = which[h, 0], which[h, 1]
            for s in range(most):
                a = b = c = d = e = 0.0
                for k in range(count):
                    near = shift[p, s, k]
                    a += near * turn[y, k, 0]
                    b += near * turn[y, k, 1]
                    c += near * turn[y, k, 2]
                    d += near * turn[y, k, 3]
                    e += near
                product[h, s, 0] *= 1 + a
                product[h, s, 1] *= 1 + b
                product[h, s, 2] *= 1 + c
                product[h, s, 3] *= 1 + d
                product[h, s, 4] *= 1 + e / FULL_TURN
    found = np.empty(h_count)
    for h in range(h_count):
        mean = product[h].sum() / (s_count * (r_count + 1))
        found[h] = base[which[h, 0]] + math.log(mean)
    return found


@_compile
def _fill_turns(
    yaw: float, heading: FloatArray, period: FloatArray, room: tuple[FloatArray, FloatArray], turn: FloatArray
) -> None:
    """Fill (M, R) with bounds of `heading_densities`, but for headings that tell nothing.

    Args:
        yaw: radians.
        heading: (M,) radians.
        period: (M,) radians.
        room: twice (M,), to work in.
        turn: what is filled.
    """
    off, density = room
    for k in range(len(heading)):
        away = yaw - heading[k]
        off[k] = abs(away - period[k] * np.floor(away / period[k] + 0.5))
    least = period.min()
    for r in range(len(TURNS)):
        each = 1 / TURNS[r]
        for k in range(len(heading)):
            part = off[k] * each
            density[k] = _exp(-0.5 * part * part) + 1e-33
        if least * each < 2 * _WIDE:
            for k in range(len(heading)):
                other, third = (period[k] - off[k]) * each, (period[k] + off[k]) * each
                density[k] += _exp(-0.5 * other * other) + _exp(-0.5 * third * third)
        for k in range(len(heading)):
            right = off[k] >= 0 and period[k] > 0  # else it is not known
            turn[k, r] = density[k] * each * period[k] * FULL_TURN**-1.5 if right else 1 / FULL_TURN


@_compile
def _exp(x: float) -> float:
    """A bound of exp(x) from above, x not positive: (the fourth Taylor polynomial of x / 128) to the 128th.

    Above it by a share of 1e-7 at -5 and 1e-4 at -20; never below e^-80. Processors do several at once.
    """
    t = max(x, -80.0) * (1 / 128)
    one = 1 + t * (1 + t * (1 / 2 + t * (1 / 6 + t * (1 / 24))))
    two = one * one
    four = two * two
    eight = four * four
    sixteen = eight * eight
    many = sixteen * sixteen
    more = many * many
    return more * more


@_compile
def highest_turn(period: FloatArray) -> float:
    """A bound of the densities of turns, of headings with periods (M,)."""
    peak = 1 / FULL_TURN
    for j in range(len(period)):
        for r in range(len(TURNS)):
            part = period[j] / TURNS[r]
            peak = max(peak, (1 + 2 * _exp(-part * part / 2)) * part * FULL_TURN**-1.5)
    return peak


@_compile
def evidence_of_nearest(
    position: FloatArray, factor: float, share: FloatArray, labels: Labels, peak: float
) -> float:
    """A bound of the evidence of places in another unit: each is at the nearest label, and turned as that.

    Args:
        position: (N, 2) metres, before they are multiplied.
        factor: of the unit.
        share: (N, M) of the labels.
        labels: the scene.
        peak: the highest density of a turn.
    """
    extent, widths = labels.lengths[1], labels.widths
    base, product = 0.0, np.ones(len(widths))
    x_middle, z_middle = labels.place[:, 0].mean(), labels.place[:, 1].mean()
    for i in range(len(position)):
        x, z, nearest = position[i, 0] * factor, position[i, 1] * factor, np.inf
        for j in range(len(labels.place)):
            off_x, off_z = x - labels.place[j, 0], z - labels.place[j, 1]
            square = off_x * off_x + off_z * off_z
            if square < nearest and share[i, j] > 0:
                nearest = square
        elsewhere = elsewhere_of((x - x_middle) ** 2 + (z - z_middle) ** 2, extent)
        base += math.log(elsewhere)
        for s in range(len(widths)):
            twice = 2 * widths[s] * widths[s]
            near = _exp(-nearest / twice) / (math.pi * twice)
            product[s] *= 1 + (1 - ANYWHERE) * near * peak / elsewhere
    return base + math.log(product.max())
