"""The viewport of a picture from above: which part of the plane it shows, and at which scale."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import FloatArray

_RIM_PX = 9
"""Room left around the table, pixels of a picture 480 high."""


@dataclass(frozen=True)
class Viewport:
    """A picture's place on the plane, x to the right and z up the page.

    Args:
        width: of the picture, pixels.
        height: likewise.
        scale: pixels a metre.
        left: column of x = 0.
        base: row of z = 0.
    """

    width: int
    height: int
    scale: float
    left: float
    base: float

    def pixels(self, points: FloatArray) -> FloatArray:
        """Places in the picture, (..., 2) as column and row, of points (..., 2), metres."""
        place: FloatArray = points * np.array([self.scale, -self.scale]) + np.array([self.left, self.base])
        return place

    def metres(self, pixels: FloatArray) -> FloatArray:
        """The reverse of `pixels`."""
        point: FloatArray = (pixels - np.array([self.left, self.base])) / np.array([self.scale, -self.scale])
        return point


def viewport_on(
    table: tuple[float, float], width: int, height: int, top: int = 0, near: float = 0.0, rim: bool = True
) -> Viewport:
    """The viewport that shows a table as large as fits.

    Args:
        table: its width and depth, metres.
        width: of the picture, pixels.
        height: likewise.
        top: rows at the top that are kept free.
        near: how much of the floor before the near edge is shown too, metres.
        rim: whether room is left around the table.
    """
    room = max(2, round(_RIM_PX * height / 480)) if rim else 0
    free_width, free_height = width - 2 * room, height - top - room - (0 if near else room)
    scale = min(free_width / table[0], free_height / (table[1] + near))
    left = (width - scale * table[0]) / 2
    slack = free_height - scale * (table[1] + near)
    base = top + room + slack / 2 + scale * table[1]
    if near:
        base -= slack / 2
    return Viewport(width, height, float(scale), float(left), float(base))
