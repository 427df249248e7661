"""The order in which an agent meets objects, compiled: kind by kind, each from left to right."""

from __future__ import annotations

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry.camera import Eye, bearing_to
from farm_ar.kernels import compiled

OBJECT, KIND, FIXED, RIVALS = range(4)
"""Columns of the objects as they are met: their number, their kind, whether they never move; from there on
those of their kind, -1 for none."""


@compiled
def line_up(
    eye: Eye, place: FloatArray, kind: IntArray, fixed: BoolArray, angle: FloatArray, order: IntArray
) -> None:
    """Sort objects: those that move first, then by kind, then from left to right as a camera sees them.

    Args:
        eye: the camera, as `visibility.eye_of` has it.
        place: (M, 2) metres.
        kind: (M,) their kinds.
        fixed: (M,) whether they never move.
        angle: (M,) filled with how far to the right of where it looks each is, radians.
        order: (M,) filled with their numbers.
    """
    for i in range(len(place)):
        angle[i] = bearing_to(eye, place[i, 0], place[i, 1])
        k = i
        while k > 0:
            j = order[k - 1]
            if fixed[j] != fixed[i]:
                before = bool(fixed[i] < fixed[j])
            elif kind[j] != kind[i]:
                before = bool(kind[i] < kind[j])
            else:
                before = bool(angle[i] < angle[j])
            if not before:
                break
            order[k] = j
            k -= 1
        order[k] = i


@compiled
def introduce(order: IntArray, kind: IntArray, fixed: BoolArray, met: IntArray) -> None:
    """Fill in the objects as they are met, (M, `RIVALS` + W), W the most of a kind.

    Args:
        order: (M,) their numbers in the order in which they are met.
        kind: (M,) by number.
        fixed: (M,) by number.
        met: filled.
    """
    met[:] = -1
    for k in range(len(order)):
        i = order[k]
        met[k, OBJECT], met[k, KIND], met[k, FIXED] = i, kind[i], fixed[i]
        column = RIVALS
        for j in order:
            if kind[j] == kind[i]:
                met[k, column] = j
                column += 1
