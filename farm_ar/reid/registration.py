"""Rigid motions of the plane, and the one that best takes some poses to others."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled


class RigidMotion(NamedTuple):
    """A turn about a pivot, then a shift; or a batch of them.

    Args:
        pivot: (..., 2) metres.
        shift: (..., 2) of the pivot, metres.
        turn: (...) radians, clockwise seen from above like yaw.
    """

    pivot: FloatArray
    shift: FloatArray
    turn: FloatArray

    def position(self, point: FloatArray) -> FloatArray:
        """(..., P, 2) where points (..., P, 2) end up, metres."""
        pivot = self.pivot[..., None, :]
        return pivot + turned(point - pivot, self.turn[..., None]) + self.shift[..., None, :]

    def yaw(self, yaw: FloatArray) -> FloatArray:
        """(..., P) headings of what had headings (..., P), radians, not wrapped."""
        return yaw + self.turn[..., None]

    def about(self, pivot: FloatArray) -> RigidMotion:
        """The same motion, written with another pivot (..., 2)."""
        shift = self.position(pivot[..., None, :])[..., 0, :] - pivot
        return RigidMotion(pivot, shift, self.turn)

    def inverse(self) -> RigidMotion:
        """The motion that undoes this one."""
        return RigidMotion(self.pivot, turned(-self.shift, -self.turn), -self.turn)


class Registration(NamedTuple):
    """A rigid motion and how well the poses pin it down.

    Args:
        motion: the likeliest.
        shift_information: (...) inverse of the variance of each coordinate of the shift, once the turn is
            known, 1 / m^2.
        turn_information: (...) inverse of the variance of the turn, 1 / rad^2.
    """

    motion: RigidMotion
    shift_information: FloatArray
    turn_information: FloatArray


def turned(vector: FloatArray, turn: FloatArray) -> FloatArray:
    """(..., 2) vectors (..., 2) of the plane after turns (...), radians, clockwise seen from above."""
    sine, cosine = np.sin(turn), np.cos(turn)
    x, z = vector[..., 0], vector[..., 1]
    return np.stack([cosine * x + sine * z, cosine * z - sine * x], axis=-1)


def register(
    source: FloatArray,
    target: FloatArray,
    precision: FloatArray,
    pivot: FloatArray,
    turn: FloatArray | None = None,
    concentration: FloatArray | None = None,
    shift_precision: float = 0.0,
    turn_concentration: float = 0.0,
) -> Registration:
    """The likeliest rigid motion from P poses to P others, in closed form.

    Positions are off by Gaussian noise and headings by von Mises noise. A prior may hold the motion near
    none: Gaussian for the shift of the pivot, von Mises for the turn. With the shift eliminated, what remains
    of the logarithm of the posterior is a sine and a cosine of the turn, whichever terms there are (Kabsch
    1976 for positions alone, which are then centred).

    Args:
        source: (..., P, 2) positions before, metres.
        target: (..., P, 2) positions after, metres.
        precision: (..., P) of each target's coordinates, 1 / m^2; 0 leaves a pair out. Not all may be 0
            without a prior of the shift.
        pivot: (..., 2) what the motion turns about, metres; where it lies matters to the prior only.
        turn: (..., P) how much each heading has turned, radians; headings do not count without.
        concentration: (..., P) of these turns, 1 / rad^2; 0 leaves one out.
        shift_precision: of the prior, 1 / m^2.
        turn_concentration: of the prior, 1 / rad^2.

    Returns:
        The motion about `pivot`. Where nothing determines its turn, that is 0.
    """
    pivot = np.asarray(pivot, dtype=np.float64)
    before, after = source - pivot[..., None, :], target - pivot[..., None, :]
    weight = precision[..., None]
    sum_before, sum_after = (weight * before).sum(axis=-2), (weight * after).sum(axis=-2)
    along, across = (
        (weight * before * after).sum(axis=(-2, -1)),
        (precision * _cross(before, after)).sum(axis=-1),
    )
    if turn is not None and concentration is not None:
        along = along + (concentration * np.cos(turn)).sum(axis=-1)
        across = across + (concentration * np.sin(turn)).sum(axis=-1)
    parts = (precision.sum(axis=-1)[..., None], sum_before, sum_after, along[..., None], across[..., None])
    motion, information, sharpness = solve_motion(
        np.concatenate(parts, axis=-1), shift_precision, turn_concentration
    )
    shift = motion[..., :2]
    about = RigidMotion(np.broadcast_to(pivot, shift.shape), shift, motion[..., 2])
    return Registration(about, information, sharpness)


def solve_motion(
    sums: FloatArray, shift_precision: float, turn_concentration: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The likeliest motion (..., 3): shift x and z, turn; the information of its shift and of its turn (...).

    Args:
        sums: (..., 7) of `add_pair`.
        shift_precision: of the prior, 1 / m^2.
        turn_concentration: of the prior, 1 / rad^2.
    """
    information, along, across = _fitted(sums, shift_precision, turn_concentration)
    angle = np.arctan2(across, along)
    shift = (sums[..., 3:5] - turned(sums[..., 1:3], angle)) / information[..., None]
    return np.concatenate([shift, angle[..., None]], axis=-1), information, np.hypot(along, across)


def volume(
    sums: FloatArray, shift_precision: float, turn_concentration: float, motion: FloatArray
) -> FloatArray:
    """(...) log share of the prior's motions that do as well as the likeliest, by Laplace's approximation.

    Args:
        sums: (..., 7) of `add_pair`.
        shift_precision: of the prior, 1 / m^2.
        turn_concentration: of the prior, 1 / rad^2.
        motion: (3,) the likeliest, metres and radians.
    """
    information, along, across = _fitted(sums, shift_precision, turn_concentration)
    held = np.maximum(np.hypot(along, across), turn_concentration * 1e-3)
    log_prior = -0.5 * shift_precision * (motion[0] ** 2 + motion[1] ** 2)
    log_prior -= turn_concentration * (1 - np.cos(motion[2]))
    log_prior = log_prior + np.log(shift_precision / information)
    result: FloatArray = log_prior + 0.5 * np.log(turn_concentration / held)
    return result


def _fitted(
    sums: FloatArray, shift_precision: float, turn_concentration: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Information of the shift; cosine and sine of the turn, the shift eliminated, by that of the turn."""
    information = sums[..., 0] + shift_precision
    before, after = sums[..., 1:3], sums[..., 3:5]
    along = sums[..., 5] + turn_concentration - (before * after).sum(axis=-1) / information
    across = sums[..., 6] - _cross(before, after) / information
    return information, along, across


def concentration_of(sd: FloatArray) -> FloatArray:
    """(...) that of the von Mises distribution most like a wrapped Gaussian of SDs (...), 1 / rad^2.

    Its mean vector is as long, by the approximation of Banerjee et al. (2005).
    """
    squared = np.exp(-sd * sd)
    result: FloatArray = np.sqrt(squared) * (2.0 - squared) / (1.0 - squared)
    return result


def _cross(before: FloatArray, after: FloatArray) -> FloatArray:
    """(...) how far vectors (..., 2) turn clockwise on to others: the product of lengths and sine."""
    return after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0]


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
