"""One pick-and-place, as an agent asks for it."""

from __future__ import annotations

from dataclasses import dataclass

from farm_ar.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Move:
    """One pick-and-place.

    Args:
        index: the object, as the layout numbers them.
        displacement: (2,) metres in x and z.
        turn: radians, clockwise.
    """

    index: int
    displacement: FloatArray
    turn: float
