"""Solid shapes from which models are built: boxes, prisms, tubes, ellipsoids and panes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray
from farm_ar.rendering.mesh import Mesh

Colour = tuple[int, int, int]
Point = Sequence[float] | FloatArray
Polygon = tuple[FloatArray, Colour]
"""(V, 3) corners, counter-clockwise from outside, to the right, up and ahead, metres; and a colour."""


def mesh_of(polygons: Iterable[Polygon]) -> Mesh:
    """The triangles of convex polygons."""
    corners, colours = [], []
    for points, colour in polygons:
        for k in range(1, len(points) - 1):
            corners.append(points[[0, k, k + 1]])
            colours.append(colour)
    return Mesh(np.array(corners), np.array(colours, dtype=np.float64), np.zeros(len(corners), np.int64))


def hull(faces: Iterable[npt.ArrayLike], colour: Colour) -> list[Polygon]:
    """The faces of a convex solid, each turned so that it is seen from outside."""
    polygons = [np.asarray(face, dtype=np.float64) for face in faces]
    middle = np.concatenate(polygons).mean(axis=0)
    return [(_outwards(points, points.mean(axis=0) - middle), colour) for points in polygons]


def box(low: Point, high: Point, colour: Colour) -> list[Polygon]:
    """A box along the axes between two corners."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return prism([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], z0, z1, colour)


def prism(profile: npt.ArrayLike, near: float, far: float, colour: Colour) -> list[Polygon]:
    """A convex profile (V, 2), right and up, from `near` to `far` ahead."""
    across = np.asarray(profile, dtype=np.float64)
    ends = [np.column_stack([across, np.full(len(across), z)]) for z in (near, far)]
    following = np.roll(np.arange(len(across)), -1)
    sides = [np.array([ends[0][k], ends[0][j], ends[1][j], ends[1][k]]) for k, j in enumerate(following)]
    return hull([*ends, *sides], colour)


def sideways(polygons: Iterable[Polygon]) -> list[Polygon]:
    """The same turned a quarter, so that what was ahead is to the right."""
    quarter = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    return [(points @ quarter, colour) for points, colour in polygons]


def moved(polygons: Iterable[Polygon], shift: Point) -> list[Polygon]:
    """The same elsewhere."""
    return [(points + np.asarray(shift, dtype=np.float64), colour) for points, colour in polygons]


def pane(corners: npt.ArrayLike, outwards: Point, colour: Colour) -> list[Polygon]:
    """A flat piece, seen from the side to which a direction points."""
    return [(_outwards(np.asarray(corners, dtype=np.float64), np.asarray(outwards, float)), colour)]


def tube(
    begin: Point, end: Point, wide: float, narrow: float, colour: Colour, sides: int = 10
) -> list[Polygon]:
    """A straight limb with flat ends, of two radii."""
    start, stop = np.asarray(begin, dtype=np.float64), np.asarray(end, dtype=np.float64)
    along = (stop - start) / np.linalg.norm(stop - start)
    first = np.cross(along, [0.0, 1.0, 0.0] if abs(along[1]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None]
    ring = np.cos(angle) * first + np.sin(angle) * np.cross(along, first)
    a, b = start + wide * ring, stop + narrow * ring
    following = np.roll(np.arange(sides), -1)
    walls = [np.array([a[k], a[j], b[j], b[k]]) for k, j in enumerate(following)]
    return hull([a, b, *walls], colour)


def ellipsoid(middle: Point, radii: Point, colour: Colour, around: int = 10, up: int = 6) -> list[Polygon]:
    """An ellipsoid along the axes, of flat faces."""
    longitude = np.linspace(0, 2 * np.pi, around + 1)
    latitude = np.linspace(-np.pi / 2, np.pi / 2, up + 1)
    level, turn = np.meshgrid(latitude, longitude, indexing="ij")
    unit = np.stack([np.cos(level) * np.sin(turn), np.sin(level), np.cos(level) * np.cos(turn)], axis=-1)
    grid = np.asarray(middle) + np.asarray(radii) * unit
    faces = []
    for i in range(up):
        for j in range(around):
            corners = [grid[i, j], grid[i, j + 1], grid[i + 1, j + 1], grid[i + 1, j]]
            faces.append(np.array(corners[1:] if i == 0 else (corners[:3] if i == up - 1 else corners)))
    return hull(faces, colour)


def _outwards(points: FloatArray, direction: FloatArray) -> FloatArray:
    """The same corners in the order in which they are seen from the side to which a direction points."""
    # Right, up, ahead is a left-handed frame.
    normal = np.cross(points[2] - points[1], points[1] - points[0])
    return points if normal @ direction > 0 else points[::-1]
