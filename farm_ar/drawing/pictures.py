"""The page: a figure with one place on it, seen from above, and writing it to a file."""

from __future__ import annotations

import io
import os
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.drawing.palette import FAINT, INK, SMALL
from farm_ar.errors import OptionError
from farm_ar.scenes import Scene
from farm_ar.scenes.files import whole_file

_METADATA: dict[str, dict[str, str | None]] = {
    ".svg": {"Date": None, "Creator": None},
    ".png": {"Software": None},
}
"""What is kept out of a file by its suffix, so that it depends on nothing but the picture."""

_SETTINGS: dict[Any, Any] = {"svg.hashsalt": "farm-ar", "svg.fonttype": "path"}
"""Ids that do not change, and letters as outlines, which look the same where the font is missing."""

_PNG_DOTS_PER_INCH = 200
MOST_PIXELS = 30_000_000
"""Of a PNG; what would have more is drawn with fewer dots an inch."""

FARTHEST = 3.0
"""How far from the room a stray may be and still be shown, as a multiple of its longer side."""

LONGEST_SIDES = 6.0
"""The longer side of what axes show, as a multiple of the shorter: an outlier does not stretch the page."""

_MARGIN = 0.035


class Area(NamedTuple):
    """The rectangle along the axes that a picture shows at least: its least and largest (x, z), metres."""

    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, place: Scene | tuple[float, float] | Area) -> Area:
        """That of a room [0, w] x [0, d], or of the bounds of a scene, or else of what stands in it."""
        if isinstance(place, Area):
            return place
        if not isinstance(place, Scene):
            return cls(np.zeros(2), np.array(place, dtype=np.float64))
        points = place.layout.position if place.bounds is None else place.bounds.corners
        if not len(points):
            return cls(np.zeros(2), np.full(2, place.diagonal))
        low, high = points.min(axis=0), points.max(axis=0)
        middle, half = (low + high) / 2, (high - low) / 2
        half = np.maximum(half, max(half.max(), place.diagonal / 2) / LONGEST_SIDES)
        return cls(low, high) if place.bounds is not None else cls(middle - half, middle + half)

    @property
    def size(self) -> FloatArray:
        """(2,) its width and depth, metres."""
        return self.high - self.low

    @property
    def margin(self) -> float:
        """Free space that is left around what a picture must show, metres."""
        return float(_MARGIN * self.size.max())


Place = Scene | tuple[float, float] | Area
"""A scene, the size of a room, or an area, where a picture is of."""


def new_picture(place: Place, width_in: float = 6.0) -> tuple[Figure, Axes]:
    """A figure whose axes hold one place, x to the right and z up the page.

    Args:
        place: a scene, or width and depth of a room, metres.
        width_in: width of the axes, inches; a legend and the axis labels come on top of it.
    """
    figure = Figure(figsize=(width_in, width_in), dpi=100, facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    set_up_axes(axes, place)
    return figure, axes


def set_up_axes(axes: Axes, place: Place) -> None:
    """Make axes those of a place: in metres, with equal scales and a margin around it."""
    area = Area.of(place)
    axes.set_aspect("equal")
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)
    axes.tick_params(length=2.5, width=0.5, color=FAINT, labelcolor=INK, labelsize=SMALL)
    for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "z")):
        axis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))
        axis.set_label_text(f"{name} (m)", fontsize=SMALL, color=INK)
    axes.set_xlim(area.low[0], area.high[0])
    axes.set_ylim(area.low[1], area.high[1])
    widen(axes, np.array(area), area.margin)


def widen(axes: Axes, points: FloatArray, margin_m: float) -> None:
    """Widen the limits of axes until points lie inside; never narrow them.

    Axes that fill their figure keep their width: the figure's height follows.

    Args:
        axes: with equal scales.
        points: (P, 2) points, metres; there may be none.
        margin_m: free space to leave around them, metres.
    """
    if len(points):
        low, high = points.min(axis=0) - margin_m, points.max(axis=0) + margin_m
        left, right = axes.get_xlim()
        bottom, top = axes.get_ylim()
        x, y = (min(left, low[0]), max(right, high[0])), (min(bottom, low[1]), max(top, high[1]))
        axes.set_xlim(_at_least(x, (y[1] - y[0]) / LONGEST_SIDES))
        axes.set_ylim(_at_least(y, (x[1] - x[0]) / LONGEST_SIDES))
    figure = axes.figure
    if isinstance(figure, Figure) and axes.get_position(original=True).bounds == (0, 0, 1, 1):
        width, height = np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())
        figure.set_figheight(float(figure.get_figwidth() * height / width))


def in_picture(position: FloatArray, place: Place) -> BoolArray:
    """Which of (N, 2) places a picture shows: a few objects far from the room would shrink it to a speck.

    Those left out are farther from the area than three of its longer sides; if most are, all are shown.
    """
    area = Area.of(place)
    reach = FARTHEST * area.size.max()
    away = np.maximum(area.low - position, position - area.high).max(axis=-1, initial=0.0)
    near: BoolArray = away <= reach
    return near if 2 * np.count_nonzero(near) >= len(near) else np.ones_like(near)


def _at_least(limits: tuple[float, float], length: float) -> tuple[float, float]:
    """Limits so far apart, about the same middle."""
    more = max(0.0, length - (limits[1] - limits[0])) / 2
    return limits[0] - more, limits[1] + more


def save_picture(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as SVG or PNG, by the suffix.

    The file is written whole or not at all, and its bytes depend on nothing but the figure.

    Args:
        figure: cropped to what is drawn, a legend beside the axes included.
        path: ends in .svg or .png. Folders that are missing are made.

    Raises:
        OptionError: the suffix is another.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in _METADATA:
        raise OptionError("path", f"must end in {' or '.join(_METADATA)}", str(path))
    contents = io.BytesIO()
    width, height = figure.get_size_inches()
    dots = min(_PNG_DOTS_PER_INCH, int(np.sqrt(MOST_PIXELS / (width * height))))
    with mpl.rc_context(_SETTINGS), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")  # it is drawn as an empty box
        figure.savefig(
            contents,
            format=suffix[1:],
            dpi=dots,
            bbox_inches="tight",
            pad_inches=0.06,
            metadata=_METADATA[suffix],
        )
    with whole_file(target) as temporary:
        temporary.write_bytes(contents.getvalue())
