"""Rigid motions of the plane, and the one that best takes some poses to others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray


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
        The motion about `pivot`. Where nothing tells its turn, that is 0.
    """
    pivot = np.asarray(pivot, dtype=np.float64)
    before, after = source - pivot[..., None, :], target - pivot[..., None, :]
    weight = precision[..., None]
    sum_before, sum_after = (weight * before).sum(axis=-2), (weight * after).sum(axis=-2)
    information = precision.sum(axis=-1) + shift_precision
    along = (weight * before * after).sum(axis=(-2, -1)) - (sum_before * sum_after).sum(axis=-1) / information
    across = (precision * _cross(before, after)).sum(axis=-1) - _cross(sum_before, sum_after) / information
    along = along + turn_concentration
    if turn is not None and concentration is not None:
        along = along + (concentration * np.cos(turn)).sum(axis=-1)
        across = across + (concentration * np.sin(turn)).sum(axis=-1)
    angle = np.arctan2(across, along)
    shift = (sum_after - turned(sum_before, angle)) / information[..., None]
    motion = RigidMotion(np.broadcast_to(pivot, shift.shape), shift, angle)
    return Registration(motion, information, np.hypot(along, across))


def _cross(before: FloatArray, after: FloatArray) -> FloatArray:
    """(...) how far vectors (..., 2) turn clockwise on to others: the product of lengths and sine."""
    return after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0]
