"""The distance D of poses with both weights 1: what stress tests measure perturbations by.

The environments' effort is another number: metres by the diagonal plus radians by half a turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.geometry import wrap
from farm_ar.scenes import Layout


@dataclass(frozen=True)
class Distance:
    """What a perturbation took.

    Args:
        total: D summed over the objects.
        largest: D of the object that moved most.
        metres: all ways together.
        degrees: all turns together.
        moved: how many objects.
    """

    total: float
    largest: float
    metres: float
    degrees: float
    moved: int


def distances(layout: Layout, diagonal: float, position: FloatArray, yaw: FloatArray) -> FloatArray:
    """D(q, p) = |q - p| / l + sin(|yaw difference| / 2) of every object.

    Args:
        layout: N objects where they were.
        diagonal: `l` of the room, metres.
        position: (..., N, 2) where they are, metres.
        yaw: (..., N) how they are turned, radians.

    Returns:
        (..., N) distances, at most 1 for the turn.
    """
    shift = position - layout.position
    away = np.sqrt(shift[..., 0] ** 2 + shift[..., 1] ** 2) / diagonal
    turned: FloatArray = away + np.abs(np.sin((yaw - layout.yaw) / 2))
    return turned


def distance_of(layout: Layout, diagonal: float, position: FloatArray, yaw: FloatArray) -> Distance:
    """The distance of one perturbation: position (N, 2), yaw (N,)."""
    each = distances(layout, diagonal, position, yaw)
    metres = np.linalg.norm(position - layout.position, axis=-1)
    turn = np.abs(wrap(yaw - layout.yaw))
    return Distance(
        total=float(each.sum()),
        largest=float(each.max(initial=0.0)),
        metres=float(metres.sum()),
        degrees=float(np.rad2deg(turn).sum()),
        moved=int(np.count_nonzero(each)),
    )
