"""Compiled pieces of registration: sums over pairs of poses, and the likeliest motion that they tell.

`register` does the same for arrays at once, and says how.
"""

from __future__ import annotations

import math

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled

_compile = compiled(error_model="numpy")


@_compile
def add_pair(
    before: FloatArray,
    after: FloatArray,
    pivot: FloatArray,
    turn: float,
    precision: float,
    concentration: float,
    sums: FloatArray,
) -> None:
    """Add one pair of poses to the sums that a motion follows from.

    Args:
        before: (2,) position before, metres.
        after: (2,) position after, metres.
        pivot: (2,) what the motion turns about, metres.
        turn: of the heading, radians.
        precision: of each coordinate, 1 / m^2.
        concentration: of the heading, 1 / rad^2.
        sums: (7,) of the precision; by it and from the pivot, of x and z before and after; of the inner and
            outer products of both, and of the cosines and sines of the turns.
    """
    x0, x1 = before[0] - pivot[0], before[1] - pivot[1]
    y0, y1 = after[0] - pivot[0], after[1] - pivot[1]
    sums[0] += precision
    sums[1] += precision * x0
    sums[2] += precision * x1
    sums[3] += precision * y0
    sums[4] += precision * y1
    sums[5] += precision * (x0 * y0 + x1 * y1) + concentration * math.cos(turn)
    sums[6] += precision * (y0 * x1 - y1 * x0) + concentration * math.sin(turn)


@_compile
def solve_motion(
    sums: FloatArray, shift_precision: float, turn_concentration: float, motion: FloatArray
) -> tuple[float, float]:
    """Fill in the likeliest motion: shift x and z, turn; returns the information of its shift and turn.

    Args:
        sums: (7,) of `add_pair`.
        shift_precision: of the prior, 1 / m^2.
        turn_concentration: of the prior, 1 / rad^2.
        motion: (3,) filled, metres and radians.
    """
    precision = sums[0] + shift_precision
    along = sums[5] + turn_concentration - (sums[1] * sums[3] + sums[2] * sums[4]) / precision
    across = sums[6] - (sums[2] * sums[3] - sums[1] * sums[4]) / precision
    motion[2] = math.atan2(across, along)
    sine, cosine = math.sin(motion[2]), math.cos(motion[2])
    motion[0] = (sums[3] - (cosine * sums[1] + sine * sums[2])) / precision
    motion[1] = (sums[4] - (cosine * sums[2] - sine * sums[1])) / precision
    return precision, math.hypot(along, across)


@_compile
def volume(sums: FloatArray, shift_precision: float, turn_concentration: float, motion: FloatArray) -> float:
    """Log share of the prior's motions that do as well as the likeliest, by Laplace's approximation.

    Args:
        sums: (7,) of `add_pair`.
        shift_precision: of the prior, 1 / m^2.
        turn_concentration: of the prior, 1 / rad^2.
        motion: (3,) the likeliest, metres and radians.
    """
    precision = sums[0] + shift_precision
    along = sums[5] + turn_concentration - (sums[1] * sums[3] + sums[2] * sums[4]) / precision
    across = sums[6] - (sums[2] * sums[3] - sums[1] * sums[4]) / precision
    turned = max(math.hypot(along, across), turn_concentration * 1e-3)
    log_prior = -0.5 * shift_precision * (motion[0] ** 2 + motion[1] ** 2)
    log_prior -= turn_concentration * (1 - math.cos(motion[2]))
    return float(
        log_prior + math.log(shift_precision / precision) + 0.5 * math.log(turn_concentration / turned)
    )


@_compile
def concentration_of(sd: float) -> float:
    """That of the von Mises distribution most like a wrapped Gaussian of a standard deviation, 1 / rad^2.

    Its mean vector is as long, by the approximation of Banerjee et al. (2005).
    """
    squared = math.exp(-sd * sd)
    return math.sqrt(squared) * (2.0 - squared) / (1.0 - squared)
