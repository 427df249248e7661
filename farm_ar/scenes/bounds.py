"""The bounds of a place: the polygon on the plane within which its objects stand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import ANGLE, POSITION, SIDE, BoolArray, FloatArray, Record, first_wrong, read_only
from farm_ar.errors import SceneError
from farm_ar.geometry import crossing_sides, diameter, direction, heading, in_polygon, polygon_area

MOST_CORNERS = 1000
"""Corners that bounds may have."""


_SQUARE = 1e-6


class Rectangle(NamedTuple):
    """A rectangle: its corner behind on the left (x, z), heading in radians, width and depth in metres."""

    corner: FloatArray
    yaw: float
    width: float
    depth: float


@dataclass(frozen=True, eq=False)
class Bounds(Record):
    """A simple polygon, convex or not, anywhere on the plane.

    Args:
        corners: (P, 2) as (x, z), metres, in order either way, 3 to `MOST_CORNERS`; the last is joined to the
            first.

    Raises:
        SceneError: a corner is out of its limits, there are too few or too many, or sides meet where they
            must not.
    """

    corners: FloatArray

    def __post_init__(self) -> None:
        corners = read_only(self.corners, np.float64, empty=(0, 2))
        if corners.ndim != 2 or corners.shape[1:] != (2,) or not 3 <= len(corners) <= MOST_CORNERS:
            expected = f"must be 3 to {MOST_CORNERS} corners (x, z), an array of shape (P, 2)"
            raise SceneError("bounds", expected, corners.shape)
        where = first_wrong(POSITION.allow(corners))
        if where is not None:
            raise SceneError(f"bounds[{where[0]}]", POSITION.expected, corners[where[0]].tolist())
        same = np.all(corners == np.roll(corners, -1, axis=0), axis=1)
        if same.any():
            i = int(same.argmax())
            raise SceneError(f"bounds[{i}]", "must not be the corner that follows it", corners[i].tolist())
        crossing = crossing_sides(corners)
        if crossing is not None or not abs(polygon_area(corners)) > 0:
            expected = "must be the corners of a polygon in order, whose sides do not meet"
            got = "an area of 0" if crossing is None else f"sides {crossing[0]} and {crossing[1]} that do"
            raise SceneError("bounds", expected, got)
        object.__setattr__(self, "corners", corners)

    @classmethod
    def rectangle(
        cls, width: float, depth: float, origin: npt.ArrayLike = (0.0, 0.0), yaw: float = 0.0
    ) -> Bounds:
        """A rectangle.

        Args:
            width: its side to the right of its heading, metres.
            depth: its side along its heading, metres.
            origin: (x, z) of the corner that is at the back on the left, metres.
            yaw: its heading, radians, clockwise from above, 0 along +z.

        Raises:
            SceneError: a value is out of its limits.
        """
        for name, side in (("width", width), ("depth", depth)):
            if not SIDE.allow(side):
                raise SceneError(f"bounds.{name}", SIDE.expected, side)
        if not ANGLE.allow(yaw):
            raise SceneError("bounds.yaw", ANGLE.expected, yaw)
        ahead = np.array([0.0, 1.0]) if yaw == 0 else direction(np.asarray(yaw))
        right = np.array([ahead[1], -ahead[0]])
        corner = np.reshape(np.asarray(origin, dtype=np.float64), 2)
        across, along = width * right, depth * ahead
        return cls(np.array([corner, corner + across, corner + across + along, corner + along]))

    def __repr__(self) -> str:
        if self.room is not None:
            return f"Bounds.rectangle({self.room[0]:g}, {self.room[1]:g})"
        return f"Bounds({len(self.corners)} corners, {self.area:.4g} m²)"

    @cached_property
    def area(self) -> float:
        """Area, square metres."""
        return abs(polygon_area(self.corners))

    @cached_property
    def extent(self) -> float:
        """The largest distance between two corners, metres: the diagonal of a rectangle."""
        return diameter(self.corners)

    @cached_property
    def room(self) -> tuple[float, float] | None:
        """Width and depth where the bounds are [0, width] x [0, depth]; None where they are not."""
        width, depth = self.corners.max(axis=0).tolist()
        place = {(0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)}
        right = len(self.corners) == 4 and set(map(tuple, self.corners.tolist())) == place
        return (width, depth) if right else None

    @cached_property
    def as_rectangle(self) -> Rectangle | None:
        """The rectangle that the bounds are; None where they are none.

        Its heading is along one of its sides, the first of those that go on from the first corner.
        """
        corners = self.corners if polygon_area(self.corners) > 0 else self.corners[::-1]
        if len(corners) != 4:
            return None
        across, along = corners[1] - corners[0], corners[3] - corners[0]
        width, depth = np.hypot(*across), np.hypot(*along)
        off = max(
            abs(across @ along) / (width * depth), np.abs(corners[2] - corners[1] - along).max() / depth
        )
        if off > _SQUARE:
            return None
        return Rectangle(corners[0], float(heading(along)), float(width), float(depth))

    def contains(self, points: npt.ArrayLike) -> BoolArray:
        """(...) whether points (..., 2), metres, lie within the bounds or on their edge."""
        return in_polygon(np.asarray(points, dtype=np.float64), self.corners)

    def moved(self, shift: npt.ArrayLike = (0.0, 0.0), turn: float = 0.0) -> Bounds:
        """The bounds turned clockwise about the origin by `turn` radians, then shifted by (x, z) metres."""
        corners = self.corners if turn == 0 else turned(self.corners, turn)
        return Bounds(corners + np.asarray(shift, dtype=np.float64))


def turned(points: FloatArray, turn: float) -> FloatArray:
    """(..., 2) points turned about the origin, clockwise seen from above, by `turn` radians."""
    sine, cosine = np.sin(turn), np.cos(turn)
    x, z = points[..., 0], points[..., 1]
    return np.stack([cosine * x + sine * z, cosine * z - sine * x], axis=-1)
