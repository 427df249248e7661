"""Footprints from above: what objects cover, filled or in outline, and where they head."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch, Polygon

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.drawing.palette import INK, SMALL, UNKNOWN_FILL, Fill
from farm_ar.drawing.tags import shortened
from farm_ar.geometry import direction, footprint_corners

MOST_NAMES = 40
"""Categories that a legend explains."""

_NOTCH = 0.27
"""Height of a heading mark as a part of the footprint's shorter side."""


def shown(yaw: FloatArray, size: FloatArray, usual: float) -> tuple[FloatArray, FloatArray]:
    """Headings (N,) and sizes (N, 3) to draw where they are not known: along z, and squares of a usual side.

    Where some sizes are known, their median is the usual one.
    """
    unknown: BoolArray = np.any(np.isnan(size), axis=-1)
    if unknown.any():
        side = np.full(3, usual) if unknown.all() else np.median(size[~unknown], axis=0)
        size = np.where(unknown[:, None], side, size)
    return np.where(np.isnan(yaw), 0.0, yaw), size


def draw_filled(
    axes: Axes,
    position: FloatArray,
    yaw: FloatArray,
    size: FloatArray,
    category: Sequence[str | None],
    fills: Mapping[str, Fill],
) -> list[Polygon]:
    """One filled rectangle per object, large ones below small ones.

    Args:
        axes: where to draw.
        position: (N, 2) centres, metres.
        yaw: (N,) headings, radians.
        size: (N, 3) width, height, depth, metres.
        category: N categories; None where it is not known.
        fills: of the categories.
    """
    patches = []
    level = _level(size)
    for i, corners in enumerate(footprint_corners(position, yaw, size)):
        name = category[i]
        fill = UNKNOWN_FILL if name is None else fills[name]
        patch = Polygon(
            corners,
            facecolor=fill.color,
            edgecolor=fill.edge,
            linewidth=0.5,
            hatch=fill.hatch or None,
            zorder=level[i],
        )
        axes.add_patch(patch)
        patches.append(patch)
    return patches


def draw_outlines(
    axes: Axes, position: FloatArray, yaw: FloatArray, size: FloatArray, color: str
) -> list[Polygon]:
    """One empty rectangle per object, of one colour; arrays as in `draw_filled`."""
    outlines = [
        Polygon(corners, fill=False, edgecolor=color, linewidth=0.5, zorder=2.0)
        for corners in footprint_corners(position, yaw, size)
    ]
    for outline in outlines:
        axes.add_patch(outline)
    return outlines


def draw_headings(
    axes: Axes, position: FloatArray, yaw: FloatArray, size: FloatArray, which: Sequence[int]
) -> list[Polygon]:
    """A sharp triangle in the footprints at the indices `which`: its tip is the middle of the front.

    Other arrays as in `draw_filled`, whose footprints they lie on.
    """
    ahead, aside = direction(yaw), direction(yaw + np.pi / 2)
    tip = position + ahead * size[:, 2, None] / 2
    height = _notch(size)[:, None]
    base = tip - height * ahead
    triangles = np.stack([tip, base + 0.3 * height * aside, base - 0.3 * height * aside], axis=1)
    level = _level(size)
    marks = [Polygon(triangles[i], facecolor=INK, linewidth=0.0, zorder=level[i]) for i in which]
    for mark in marks:
        axes.add_patch(mark)
    return marks


def label_spots(position: FloatArray, yaw: FloatArray, size: FloatArray) -> FloatArray:
    """(N, 2) where labels stand in footprints: behind their middle, clear of the heading's triangle."""
    return position - direction(yaw) * _notch(size)[:, None] / 2


def _notch(size: FloatArray) -> FloatArray:
    """(N,) heights of the heading triangles: a part of the shorter side, on large objects no more."""
    side = np.minimum(size[:, 0], size[:, 2])
    return _NOTCH * np.minimum(side, np.median(side)) if len(side) else side


def areas(size: FloatArray) -> FloatArray:
    """(N,) areas of footprints, square metres."""
    return size[:, 0] * size[:, 2]


def _level(size: FloatArray) -> FloatArray:
    """(N,) zorders from 3 to 4 that put large footprints below small ones."""
    below = -areas(size)
    return 3.0 + np.searchsorted(np.sort(below), below) / max(len(below), 1)


def with_heading(category: Sequence[str | None], symmetry: Mapping[str, float], yaw: FloatArray) -> list[int]:
    """Indices of the objects whose front is known; those that look the same however turned have none."""
    front = [name is None or symmetry.get(name) != 0 for name in category]
    return [i for i, has in enumerate(front) if has and not np.isnan(yaw[i])]


def draw_legend(axes: Axes, fills: Mapping[str, Fill], shown: Collection[str | None]) -> None:
    """A legend of the categories that are shown, beside the axes; none for a single known one."""
    names = sorted(name for name in shown if name is not None)
    if len(names) + 2 * (None in shown) < 2:
        return
    rows = [(name, fills[name]) for name in names[:MOST_NAMES]]
    if None in shown:
        rows.append(("not known", UNKNOWN_FILL))
    handles = [
        Patch(
            facecolor=fill.color,
            edgecolor=fill.edge,
            linewidth=0.5,
            hatch=fill.hatch or None,
            label=shortened(name),
        )
        for name, fill in rows
    ]
    if len(names) > MOST_NAMES:
        handles.append(Patch(alpha=0.0, label=f"and {len(names) - MOST_NAMES} more"))
    axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        borderaxespad=0.0,
        frameon=False,
        fontsize=SMALL,
        handlelength=1.2,
        handleheight=1.0,
    )
