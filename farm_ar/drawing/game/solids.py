"""Solids in space: faces with what is painted on them, and how light they are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import Colour

_SUN = np.array([-0.45, 0.80, -0.40])


@dataclass(frozen=True, eq=False)
class Face:
    """A flat side of something, with what is painted on it.

    Args:
        points: (V, 3) to the right, up and ahead of the middle of its foot, counter-clockwise from outside.
        colour: in full light.
        details: polygons (V, 3) in the same plane with their colours, the lowest first.
    """

    points: FloatArray
    colour: Colour
    details: tuple[tuple[FloatArray, Colour], ...] = ()

    @property
    def normal(self) -> FloatArray:
        """(3,) unit vector outwards."""
        # Right, up, ahead is a left-handed frame.
        across = np.cross(self.points[2] - self.points[1], self.points[1] - self.points[0])
        unit: FloatArray = across / np.linalg.norm(across)
        return unit


@dataclass(frozen=True, eq=False)
class Solid:
    """Something in space, its faces and what is painted on them as one list of polygons.

    Args:
        faces: in the order in which they cover each other.
    """

    faces: tuple[Face, ...]

    @cached_property
    def points(self) -> FloatArray:
        """(P, 3) the corners of all polygons, one polygon after the other."""
        return np.concatenate([points for points, _, _ in self._polygons])

    @cached_property
    def ends(self) -> list[tuple[int, int]]:
        """First corner of each polygon, and the one after its last."""
        ends = np.cumsum([len(points) for points, _, _ in self._polygons]).tolist()
        return list(zip([0, *ends[:-1]], ends, strict=True))

    @cached_property
    def colours(self) -> FloatArray:
        """(Q, 3) of the polygons, in full light."""
        return np.array([colour for _, colour, _ in self._polygons], dtype=np.float64)

    @cached_property
    def face(self) -> list[int]:
        """The face on which each polygon lies."""
        return [face for _, _, face in self._polygons]

    @cached_property
    def normals(self) -> FloatArray:
        """(F, 3) unit vectors outwards."""
        return np.array([face.normal for face in self.faces])

    @cached_property
    def starts(self) -> FloatArray:
        """(F, 3) a corner of each face."""
        return np.array([face.points[0] for face in self.faces])

    @property
    def _polygons(self) -> list[tuple[FloatArray, Colour, int]]:
        polygons = []
        for k, face in enumerate(self.faces):
            polygons += [(face.points, face.colour, k), *((points, tone, k) for points, tone in face.details)]
        return polygons


def light_on(normals: FloatArray) -> FloatArray:
    """(F,) how light sides are that face along unit vectors (F, 3) in the world: 1 is their own colour."""
    toward = normals @ _SUN
    light: FloatArray = np.where(toward > 0, 1 + 0.10 * toward, 1 + 0.42 * toward)
    return light
