"""Cameras from above: the field of view, and the path."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle

from farm_ar.arrays import FloatArray
from farm_ar.drawing.palette import VIEW, WALK
from farm_ar.drawing.tags import Obstacle
from farm_ar.geometry import direction, distance, equally_spaced, view_polygon
from farm_ar.scenes import Bounds, Camera, CameraPath

_HEADING = 0.25
"""Length of the heading line as a part of the range drawn."""

_ARROWS = 8


def draw_view(axes: Axes, camera: Camera, bounds: Bounds | None) -> Polygon:
    """The field of view as a translucent wedge, the camera as a dot, its heading as a line; the wedge.

    A range that reaches beyond the axes is drawn to their farthest corner. What a camera within the bounds
    sees ends there.
    """
    corners = np.array([(x, z) for x in axes.get_xlim() for z in axes.get_ylim()])
    reach = min(camera.fov.range_m, float(distance(camera.position, corners).max()))
    yaw = float(camera.yaw)
    outline = view_polygon(camera.position, yaw, camera.fov.left, camera.fov.right, reach, arc_points=64)
    wedge = Polygon(outline, facecolor=to_rgba(VIEW, 0.10), edgecolor=VIEW, linewidth=0.7, zorder=1.5)
    axes.add_patch(wedge)
    ahead = np.stack([camera.position, camera.position + _HEADING * reach * direction(yaw)])
    (line,) = axes.plot(*ahead.T, color=VIEW, linewidth=1.1, zorder=4.6)
    if bounds is not None and bounds.contains(camera.position):
        walls = outline_of(bounds)
        walls.set_transform(axes.transData)
        wedge.set_clip_path(walls)
        line.set_clip_path(walls)
    axes.plot(*camera.position, "o", color=VIEW, markersize=4.5, markeredgewidth=0.0, zorder=4.7)
    return wedge


def outline_of(bounds: Bounds, **style: Any) -> Rectangle | Polygon:
    """The bounds as a shape to draw or to clip by."""
    if bounds.room is not None:
        return Rectangle((0.0, 0.0), *bounds.room, **style)
    return Polygon(bounds.corners, **style)


def draw_path(axes: Axes, path: CameraPath) -> Line2D:
    """The path as a dashed curve with arrows along it and a ring where it starts; the curve."""
    (curve,) = axes.plot(*path.polyline.T, color=WALK, linewidth=0.8, dashes=(4, 2.5), zorder=2.5)
    places, yaw = equally_spaced(path.polyline, _ARROWS + 1, closed=path.closed)
    for place, turn in zip(places[1:], np.rad2deg(yaw[1:]), strict=True):
        axes.plot(*place, marker=(3, 0, -turn), color=WALK, markersize=5.0, markeredgewidth=0.0, zorder=2.6)
    axes.plot(
        *places[0], "o", color=WALK, markerfacecolor="white", markersize=5.0, markeredgewidth=1.0, zorder=2.7
    )
    return curve


def pieces(line: FloatArray, step: int = 8, level: float = -np.inf) -> list[Obstacle]:
    """A polyline (P, 2), metres, cut into short pieces for tags to keep clear of."""
    return [Obstacle(line[i : i + step + 1], level) for i in range(0, len(line) - 1, step)]
