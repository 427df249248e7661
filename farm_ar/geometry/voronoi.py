"""Voronoi cells of sites: which site is nearest, and the part of a room that is nearest to each."""

import numpy as np
from scipy.spatial import Voronoi

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry.polygons import polygon_area

# Four helper sites this many times farther out than room and sites bound every cell and own nothing inside.
_FAR = 10.0

# Corners closer than this part of the room are one corner, and a cell thinner than it is none.
_NEGLIGIBLE = 1e-12


def nearest_site(points: FloatArray, sites: FloatArray) -> IntArray:
    """Index of the site nearest to each point; of equally near ones the first.

    Args:
        points: (..., 2) points, metres.
        sites: (K, 2) sites, metres; K is at least 1.

    Returns:
        (...) indices into `sites`.
    """
    offset = np.asarray(points)[..., None, :] - sites
    nearest: IntArray = np.argmin(np.sum(offset**2, axis=-1), axis=-1)
    return nearest


def voronoi_cells(sites: FloatArray, room_size: tuple[float, float]) -> list[FloatArray]:
    """The part of a room that is nearest to each site.

    Together the cells fill the room. Sites may stand anywhere, also outside the room or on one line. Of sites
    that coincide the first has the cell.

    Args:
        sites: (K, 2) sites, metres; K is at least 1.
        room_size: width and depth of the room [0, width] x [0, depth], metres.

    Returns:
        K convex polygons (V, 2), counter-clockwise with x to the right and z up the page, metres; (0, 2)
        for a site without a part of the room.
    """
    sites = np.asarray(sites, dtype=np.float64)
    room = np.asarray(room_size, dtype=np.float64)
    middle = room / 2
    far = _FAR * max(np.abs(sites - middle).max(), room.max())
    helpers = middle + far * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    diagram = Voronoi(np.vstack([sites, helpers]))
    regions = diagram.point_region[: len(sites)]
    cells = [np.empty((0, 2)) for _ in sites]
    # Sites that coincide share a region.
    for region, owner in zip(*np.unique(regions, return_index=True), strict=True):
        corners = diagram.vertices[diagram.regions[region]]
        cells[owner] = _clip_to_room(_counter_clockwise(corners), room)
    return cells


def _counter_clockwise(corners: FloatArray) -> FloatArray:
    """The corners of a convex polygon in the order of their angle about its inside."""
    offset = corners - corners.mean(axis=0)
    return corners[np.argsort(np.arctan2(offset[:, 1], offset[:, 0]))]


def _clip_to_room(polygon: FloatArray, room: FloatArray) -> FloatArray:
    """The part of a convex polygon in [0, width] x [0, depth], (0, 2) where there is none."""
    for axis in (0, 1):
        polygon = _clip(polygon, polygon[:, axis])
        polygon = _clip(polygon, room[axis] - polygon[:, axis])
    polygon = np.clip(polygon, 0.0, room)
    step = np.abs(np.roll(polygon, -1, axis=0) - polygon)
    polygon = polygon[np.any(step > _NEGLIGIBLE * room, axis=1)]
    kept = len(polygon) > 0 and polygon_area(polygon) > _NEGLIGIBLE * room.prod()
    return polygon if kept else np.empty((0, 2))


def _clip(polygon: FloatArray, depth: FloatArray) -> FloatArray:
    """The part of a convex polygon where `depth` (V,), linear in the plane, is not negative.

    Sutherland and Hodgman, 1974.
    """
    next_corner, next_depth = np.roll(polygon, -1, axis=0), np.roll(depth, -1)
    inside = depth >= 0
    crosses = inside != (next_depth >= 0)
    part = depth / np.where(crosses, depth - next_depth, 1.0)
    crossing = polygon + part[:, None] * (next_corner - polygon)
    kept: FloatArray = np.stack([polygon, crossing], axis=1)[np.stack([inside, crosses], axis=1)]
    return kept
