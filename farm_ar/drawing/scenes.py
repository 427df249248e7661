"""A scene seen from above."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from farm_ar.drawing.cameras import draw_path, draw_view, outline_of, pieces
from farm_ar.drawing.footprints import (
    areas,
    draw_filled,
    draw_headings,
    draw_legend,
    label_spots,
    shown,
    with_heading,
)
from farm_ar.drawing.palette import FAINT, INK, SITE, SMALLEST, WALK, category_fills
from farm_ar.drawing.pictures import Area, in_picture, widen
from farm_ar.drawing.tags import Obstacle, Tag, add_tags
from farm_ar.errors import SceneError, SnapshotError
from farm_ar.geometry import footprint_corners, voronoi_cells
from farm_ar.scenes import Camera, Layout, Scene

MOST_LABELS = 400
"""The largest number of labels in a picture."""

_ON_TOP = 1.0
"""Level of points: above all objects, whose levels are less than 0."""


def draw_scene(
    axes: Axes,
    scene: Scene,
    *,
    layout: Layout | None = None,
    camera: Camera | None = None,
    labels: bool = True,
    cells: bool = True,
    path: bool = True,
    legend: bool = True,
) -> None:
    """Draw what stands in a place and where it heads; sites, cells, camera path and field of view.

    Args:
        axes: as `new_picture` or `set_up_axes` makes them. Whatever lies outside the room widens them, but
            for what `in_picture` leaves out.
        scene: the room.
        layout: a single arrangement of its objects; the reference layout by default.
        camera: a single camera whose field of view is shown; none by default.
        labels: whether objects are named, where they are not more than `MOST_LABELS`.
        cells: whether sites are marked and their Voronoi cells drawn.
        path: whether the camera path is drawn, where there is one.
        legend: whether categories are explained beside the axes, where there is more than one.

    Raises:
        SceneError: the layout is a batch.
        SnapshotError: the camera is a batch.
    """
    layout, area = scene.layout if layout is None else layout, Area.of(scene)
    if layout.batch_shape:
        raise SceneError("layout", "must be a single arrangement", layout.batch_shape)
    if camera is not None and camera.batch_shape:
        raise SnapshotError("camera", "must be a single camera", camera.batch_shape)
    draw_room(axes, scene, cells)
    if camera is not None:
        widen(axes, camera.position[None], area.margin)
        draw_view(axes, camera, scene.bounds)
    outside = np.any((layout.position < area.low) | (layout.position > area.high), axis=1)
    outside &= in_picture(layout.position, area)
    yaw, size = shown(layout.yaw, layout.size, area.margin)
    corners = footprint_corners(layout.position[outside], yaw[outside], size[outside])
    widen(axes, corners.reshape(-1, 2), area.margin)
    fills = category_fills((*scene.layout.categories, *layout.categories))
    draw_filled(axes, layout.position, yaw, size, layout.category, fills)
    front = with_heading(layout.category, scene.symmetry, layout.yaw)
    draw_headings(axes, layout.position, yaw, size, front)
    tags = object_tags(layout, usual=area.margin) if labels else []
    obstacles = [] if labels else [Obstacle(tag.outline) for tag in object_tags(layout, usual=area.margin)]
    if cells:
        tags += _site_tags(scene)
    if path and scene.camera_path is not None:
        walk = scene.camera_path.polyline
        widen(axes, walk, area.margin)
        draw_path(axes, scene.camera_path)
        tags.append(Tag("start", walk[:1], color=WALK, size=SMALLEST, level=_ON_TOP))
        obstacles += pieces(walk)
    add_tags(axes, tags, obstacles)
    if legend:
        draw_legend(axes, fills, set(layout.categories))


def draw_room(axes: Axes, scene: Scene, cells: bool = True) -> None:
    """Draw the bounds and, on request, the sites and the edges of their Voronoi cells."""
    area = Area.of(scene)
    if scene.bounds is not None:
        axes.add_patch(outline_of(scene.bounds, fill=False, edgecolor=INK, linewidth=0.9, zorder=2.0))
    if not (cells and scene.sites):
        return
    widen(axes, scene.site_positions, area.margin)
    width, depth = area.size.tolist()
    for cell in voronoi_cells(scene.site_positions - area.low, (width, depth)):
        if len(cell):
            edge = Polygon(cell + area.low, fill=False, edgecolor=FAINT, linewidth=0.4, zorder=1.0)
            axes.add_patch(edge)
            if scene.bounds is not None and scene.room is None:
                walls = outline_of(scene.bounds)
                walls.set_transform(axes.transData)
                edge.set_clip_path(walls)
    axes.plot(*scene.site_positions.T, "D", color=SITE, markersize=3.0, markeredgewidth=0.0, zorder=4.4)


def object_tags(
    layout: Layout, color: str = INK, text_size: float = SMALLEST, ground: float = 0.0, usual: float = 1.0
) -> list[Tag]:
    """The labels of a single arrangement, on their objects where there is room, at levels below `ground`.

    Of more than `MOST_LABELS` none could be read: there are none then. Objects of unknown size are drawn with
    a usual side, metres.
    """
    if len(layout) > MOST_LABELS:
        return []
    yaw, size = shown(layout.yaw, layout.size, usual)
    outlines = footprint_corners(layout.position, yaw, size)
    spots = label_spots(layout.position, yaw, size)
    return [
        Tag(label, outline, color, text_size, level=ground - float(area), spot=spot)
        for label, outline, area, spot in zip(layout.labels, outlines, areas(size), spots, strict=True)
    ]


def _site_tags(scene: Scene) -> list[Tag]:
    """The names of the sites."""
    return [
        Tag(site.name, place[None], SITE, SMALLEST, bold=True, level=_ON_TOP)
        for site, place in zip(scene.sites, scene.site_positions, strict=True)
    ]
