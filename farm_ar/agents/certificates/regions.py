"""Where a pivot may be: convex polygons that hold all places in view and in the room."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.arrays import FloatArray
from farm_ar.geometry import direction
from farm_ar.scenes import Camera

ARC_SIDES = 16
"""Tangents that stand for the far end of a field of view: the polygon reaches a little beyond it."""


def room_polygon(size: tuple[float, float], inset: float) -> FloatArray:
    """(4, 2) a room's corners, moved inwards, counter-clockwise with x right and z up."""
    (width, depth), d = size, inset
    return np.array([[d, d], [width - d, d], [width - d, depth - d], [d, depth - d]])


def clip(polygon: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
    """The part of a convex polygon, (V, 2), where normal . point <= offset; (0, 2) if there is none."""
    if not len(polygon):
        return polygon
    depth = polygon @ normal - offset
    following, next_depth = np.roll(polygon, -1, axis=0), np.roll(depth, -1)
    kept = []
    for point, d, other, e in zip(polygon, depth, following, next_depth, strict=True):
        if d <= 0:
            kept.append(point)
        if (d < 0 < e) or (e < 0 < d):
            kept.append(point + (other - point) * d / (d - e))
    return np.array(kept).reshape(-1, 2)


def view_planes(camera: Camera) -> list[tuple[FloatArray, float]]:
    """The half-planes, normal . point <= offset, that hold a field of view; its left and right side first.

    None where it is half a turn wide or more, and so no convex sector; vertical limits are left out.
    """
    fov, eye, yaw = camera.fov, camera.position, float(camera.yaw)
    if fov.left + fov.right >= np.pi:
        return []
    sides = [direction(yaw - fov.left - np.pi / 2), direction(yaw + fov.right + np.pi / 2)]
    planes = [(normal, float(normal @ eye)) for normal in sides]
    for bearing in np.linspace(-fov.left, fov.right, ARC_SIDES):
        outward = direction(yaw + bearing)
        planes.append((outward, float(outward @ eye) + fov.range_m))
    return planes


def seen_polygon(camera: Camera, size: tuple[float, float], inset: float) -> FloatArray:
    """(V, 2) a convex polygon that holds every place in view in the room, `inset` metres from its walls."""
    polygon = room_polygon(size, inset)
    for normal, offset in view_planes(camera):
        polygon = clip(polygon, normal, offset)
    return polygon


def seen_polygons(case: Case) -> list[FloatArray]:
    """Where each object's pivot can be when it is detected; a fixed one is where it is."""
    layout, polygons = case.layout, []
    for i in range(len(layout)):
        inset = float(case.inner_radius[i]) if case.stays_inside[i] else 0.0
        polygon = seen_polygon(case.camera, case.scene.size, inset)
        if layout.fixed[i]:
            polygon = np.empty((0, 2)) if not case.in_view[i] else np.tile(layout.position[i], (3, 1))
        polygons.append(np.ascontiguousarray(polygon))
    return polygons


def way_out(camera: Camera, place: FloatArray, size: tuple[float, float], inset: float) -> float:
    """How far a pivot in view is from the nearest place in the room out of view, at the least; metres.

    Zero where that is not known: for a view with vertical limits, or half a turn wide or more.
    """
    fov = camera.fov
    planes = view_planes(camera)
    if not planes or (fov.up is not None and camera.height is not None):
        return 0.0
    room = room_polygon(size, inset)
    ways = [fov.range_m - float(np.linalg.norm(place - camera.position))]
    for normal, offset in planes[:2]:
        outside = clip(room, -normal, -offset)
        ways.append(distance_to(outside, place))
    return max(0.0, min(ways))


def distance_to(polygon: FloatArray, place: FloatArray) -> float:
    """From a place to a convex polygon, counter-clockwise; 0 inside, infinite where it is empty."""
    if not len(polygon):
        return np.inf
    along = np.roll(polygon, -1, axis=0) - polygon
    offset = place - polygon
    if len(polygon) > 2 and np.all(along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0] >= 0):
        return 0.0
    length = np.maximum(np.sum(along**2, axis=1), 1e-300)
    share = np.clip(np.sum(along * offset, axis=1) / length, 0.0, 1.0)
    return float(np.linalg.norm(offset - share[:, None] * along, axis=1).min())
