"""Kernels: arc length along cubic Béziers, to rounding everywhere.

A curve is worked with as its polynomials: x(t) = p[0] + p[1] t + p[2] t² + p[3] t³, and z(t) alike with p[4]
to p[7]. Its arc length is tabulated at up to KNOTS parameters, closer together where it nearly stops (at a
cusp).
"""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled

KNOTS = 64
"""Entries of a table of arc length: room for some even steps and for many where a curve nearly stops."""

Polynomial = tuple[float, float, float, float, float, float, float, float]

_EVEN_STEPS = 8
_TOLERANCE = 1e-14  # error of a table's step, as a part of the length around the control points
_CONVERGED = 1e-8  # a step of Newton's method this small leaves an error of rounding

# Eight-point Gauss-Legendre quadrature on [0, 1].
_NODES, _WEIGHTS = (1 + np.polynomial.legendre.leggauss(8)[0]) / 2, np.polynomial.legendre.leggauss(8)[1] / 2


@compiled
def polynomial(curve: FloatArray) -> Polynomial:
    """Coefficients of a curve of control points (4, 2)."""
    x0, x1, x2, x3 = curve[0, 0], curve[1, 0], curve[2, 0], curve[3, 0]
    z0, z1, z2, z3 = curve[0, 1], curve[1, 1], curve[2, 1], curve[3, 1]
    xb, xc, xd = 3 * (x1 - x0), 3 * (x2 - 2 * x1 + x0), x3 - x0 - 3 * (x2 - x1)
    zb, zc, zd = 3 * (z1 - z0), 3 * (z2 - 2 * z1 + z0), z3 - z0 - 3 * (z2 - z1)
    return x0, xb, xc, xd, z0, zb, zc, zd


@compiled
def point_at(p: Polynomial, t: float) -> tuple[float, float]:
    """Where a curve is at a parameter, metres."""
    return p[0] + t * (p[1] + t * (p[2] + t * p[3])), p[4] + t * (p[5] + t * (p[6] + t * p[7]))


@compiled
def speed(p: Polynomial, t: float) -> float:
    """Length of a curve's derivative, metres per unit of the parameter."""
    x, z = p[1] + t * (2 * p[2] + 3 * p[3] * t), p[5] + t * (2 * p[6] + 3 * p[7] * t)
    length: float = np.sqrt(x * x + z * z)
    return length


@compiled
def stretch(p: Polynomial, begin: float, end: float, part: FloatArray) -> float:
    """Length of a curve between two parameters by one quadrature, metres.

    Args:
        p: the curve.
        begin: parameter.
        end: parameter.
        part: (8,) to work in: what is added up is computed first, so that a processor does several at once.
    """
    # As many times as there is room: of a loop whose end is known beforehand, Numba takes one at a time.
    for k in range(len(part)):
        part[k] = speed(p, begin + (end - begin) * _NODES[k])
    total = 0.0
    for k in range(len(_NODES)):
        total += _WEIGHTS[k] * part[k]
    return (end - begin) * total


@compiled
def turning_points(b: float, c: float, d: float) -> tuple[float, float]:
    """Where from -1 to 1 b + 2 c t + 3 d t² is zero; 2, beyond every curve, for a root that is not there."""
    inside = c * c - 3 * b * d
    if inside < 0:
        return 2.0, 2.0
    q = -(c + np.copysign(np.sqrt(inside), c))
    first = q / (3 * d) if d != 0 and abs(q) <= abs(3 * d) else 2.0
    return first, b / q if q != 0 and abs(b) <= abs(q) else 2.0


@compiled
def measure(curve: FloatArray, knot: FloatArray, travelled: FloatArray) -> None:
    """Tabulate the arc length of a curve: steps are halved until two quadratures agree with one.

    The first steps end where x or z turns round, too. An exact cusp is such a place, and a quadrature across
    it may be wrong without showing it.

    Args:
        curve: (4, 2) control points, metres.
        knot: (KNOTS,) filled with parameters rising from 0 to 1, then 1 to the end.
        travelled: (KNOTS,) filled with the length up to each, metres.
    """
    ends, part = np.empty(KNOTS), np.empty(len(_NODES))
    p = polynomial(curve)
    around = 0.0
    for i in range(3):
        around += np.hypot(curve[i + 1, 0] - curve[i, 0], curve[i + 1, 1] - curve[i, 1])
    for i in range(_EVEN_STEPS):
        ends[i] = 1 - i / _EVEN_STEPS
    waiting, used = _EVEN_STEPS, 1
    x_turns, z_turns = turning_points(p[1], p[2], p[3]), turning_points(p[5], p[6], p[7])
    for turn in (x_turns[0], x_turns[1], z_turns[0], z_turns[1]):
        if 0 < turn < 1:
            place = waiting
            while ends[place - 1] < turn:
                ends[place] = ends[place - 1]
                place -= 1
            ends[place] = turn
            waiting += 1
    begin = length = 0.0
    knot[0] = travelled[0] = 0.0
    while waiting > 0:
        end = ends[waiting - 1]
        middle = (begin + end) / 2
        step = stretch(p, begin, end, part)
        error = abs(step - stretch(p, begin, middle, part) - stretch(p, middle, end, part))
        if error > _TOLERANCE * around and used + waiting < KNOTS:
            ends[waiting] = middle
            waiting += 1
            continue
        length += step
        knot[used], travelled[used] = end, length
        begin = end
        used += 1
        waiting -= 1
    knot[used:], travelled[used:] = 1.0, length


@compiled
def locate(curve: FloatArray, along: FloatArray, parameter: FloatArray) -> None:
    """Fill in the parameters (A,) of curves (A, 4, 2) after (A,) metres."""
    knot, travelled = np.empty(KNOTS), np.empty(KNOTS)
    for a in range(len(curve)):
        parameter[a] = 0.0
        if along[a] > 0:
            measure(curve[a], knot, travelled)
            parameter[a] = parameter_at(polynomial(curve[a]), knot, travelled, along[a])


@compiled
def last_below(values: FloatArray, value: float) -> int:
    """Index of the last of rising values (K,) that is not above `value`, at most K - 2."""
    i = 0  # from the front: most tables have few steps
    while i < len(values) - 2 and values[i + 1] <= value:
        i += 1
    return i


@compiled
def length_at(p: Polynomial, knot: FloatArray, travelled: FloatArray, t: float) -> float:
    """Length of a curve up to a parameter, by its table (KNOTS,), metres."""
    i = last_below(knot, t)
    length: float = travelled[i] + stretch(p, knot[i], t, np.empty(len(_NODES)))
    return length


@compiled
def parameter_at(p: Polynomial, knot: FloatArray, travelled: FloatArray, length: float) -> float:
    """Parameter at which a curve is so many metres long, by its table (KNOTS,); 1 beyond its end.

    Between two entries of the table the first guess takes the speed to change evenly; then Newton's method,
    by bisection where that would leave the two.
    """
    if length >= travelled[-1]:
        return 1.0
    i = last_below(travelled, length)
    low: float = knot[i]
    high: float = knot[i + 1]
    wanted = length - travelled[i]
    if wanted <= 0:
        return low
    share = wanted / (travelled[i + 1] - travelled[i])
    slow, fast = speed(p, low), speed(p, high)
    lean = (fast - slow) / (fast + slow) if fast + slow > 0 else 0.0
    root: float = np.sqrt(max((1 - lean) ** 2 + 4 * lean * share, 0.0))
    t: float = low + (high - low) * 2 * share / (1 - lean + root)
    part = np.empty(len(_NODES))
    while True:
        excess = stretch(p, knot[i], t, part) - wanted
        if excess > 0:
            high = t
        else:
            low = t
        here = speed(p, t)
        step = -excess / here if here > 0 else 2.0
        if abs(step) <= _CONVERGED:
            return min(max(t + step, low), high)
        t = t + step if low < t + step < high else (low + high) / 2
        if not low < t < high:
            return t
