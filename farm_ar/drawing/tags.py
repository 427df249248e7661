"""Tags: small texts that name what is drawn, placed when the figure is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from matplotlib.transforms import IdentityTransform

from farm_ar.arrays import FloatArray
from farm_ar.drawing.labels import place_labels
from farm_ar.drawing.palette import INK, SMALL

MOST_LETTERS = 80
"""Of a name in a picture."""

_CLEARANCE_PT = 1.0
_POINT_PT = 3.0
_LINE_PT = 0.5
_LEADER_PART = 0.45


@dataclass(frozen=True, eq=False)
class Tag:
    """A text that names something.

    Args:
        text: what it says.
        outline: (V, 2) corners of what it names, metres; one point for a point.
        color: of the letters.
        size: of the letters, points.
        boxed: whether it stands in a white box with an edge of its colour.
        level: how high what it names lies; see `place_labels`.
        spot: (2,) where on what it names it would stand first, metres; None if it must stay beside.
        bold: whether its letters are.
    """

    text: str
    outline: FloatArray
    color: str = INK
    size: float = SMALL
    boxed: bool = False
    level: float = 0.0
    spot: FloatArray | None = None
    bold: bool = False


@dataclass(frozen=True, eq=False)
class Obstacle:
    """Something that tags should not cover: its outline (V, 2), metres, and how high it lies."""

    outline: FloatArray
    level: float = -np.inf


class Tags(Artist):
    """The tags of one picture, placed when it is drawn, so that they stay apart at every size and zoom.

    A thin line leads from a tag to what it names where the two are apart. What is named by a point outside
    the axes has no tag.

    Args:
        tags: the more important ones first.
        obstacles: what else tags should not cover.
    """

    def __init__(self, tags: Sequence[Tag], obstacles: Sequence[Obstacle] = ()) -> None:
        super().__init__()
        self.tags = tuple(tags)
        self.obstacles = tuple(obstacles)
        self.texts = [_text(tag) for tag in self.tags]
        self.leaders = [
            Line2D([], [], color=tag.color, linewidth=0.4, transform=IdentityTransform()) for tag in self.tags
        ]
        self.set_zorder(10)
        self.set_in_layout(False)

    def set_figure(self, fig: Figure | SubFigure) -> None:
        """Give the parts, too, the figure that they are in."""
        super().set_figure(fig)
        for part in (*self.leaders, *self.texts):
            part.set_figure(fig)

    def get_children(self) -> list[Artist]:
        """The lines and the texts."""
        return [*self.leaders, *self.texts]

    def draw(self, renderer: RendererBase) -> None:
        """Place the tags and draw them."""
        if not self.get_visible():
            return
        self.place(renderer)
        for part in self.get_children():
            part.draw(renderer)
        self.stale = False

    def place(self, renderer: RendererBase) -> FloatArray:
        """Put every tag in its place; (N, 4) left, bottom, right, top of each in dots, NaN if hidden."""
        outlines = [tag.outline for tag in self.tags] + [obstacle.outline for obstacle in self.obstacles]
        levels = [tag.level for tag in self.tags] + [obstacle.level for obstacle in self.obstacles]
        objects = np.array([self._box(outline, renderer) for outline in outlines]).reshape(-1, 4)
        shown = [i for i in range(len(self.tags)) if self._inside_axes(_centre(objects[i]))]
        order = shown + [i for i in range(len(objects)) if i not in shown]
        size = np.array([self._size(i, renderer) for i in shown]).reshape(-1, 2)
        centre = place_labels(
            anchor=_centre(objects[shown]),
            size=size,
            half_object=(objects[shown, 2:] - objects[shown, :2]) / 2,
            spot=np.array([self._spot(i) for i in shown]).reshape(-1, 2),
            bounds=np.array(self._host().bbox.extents),
            obstacles=objects[order],
            level=np.array(levels)[order],
        )
        boxes = np.full((len(self.tags), 4), np.nan)
        boxes[shown] = np.concatenate([centre - size / 2, centre + size / 2], axis=1)
        for i, box in enumerate(boxes):
            self._show(i, box)
        return boxes

    def _show(self, i: int, box: FloatArray) -> None:
        """Move a text into its box and draw a line from there to what it names, if they are apart."""
        text, leader = self.texts[i], self.leaders[i]
        text.set_visible(not np.isnan(box).any())
        leader.set_visible(False)
        if not text.get_visible():
            return
        place = _centre(box)
        text.set_position((float(place[0]), float(place[1])))
        outline = self._in_dots(self.tags[i].outline)
        if Path(outline).contains_point(tuple(place)):
            return
        start, end = _nearest(box, outline)
        if np.hypot(*(end - start)) > _LEADER_PART * (box[3] - box[1]):
            leader.set_data([start[0], end[0]], [start[1], end[1]])
            leader.set_visible(True)

    def _size(self, i: int, renderer: RendererBase) -> FloatArray:
        """Width and height of a tag with its frame and the space around it, dots."""
        extent = self.texts[i].get_window_extent(renderer)
        tag = self.tags[i]
        around = 2 * _CLEARANCE_PT if tag.boxed else _CLEARANCE_PT
        return np.array([extent.width, extent.height]) + 2 * _dots(renderer, around)

    def _spot(self, i: int) -> FloatArray:
        """(2,) where a tag would stand on what it names, dots; NaN if it must stay beside."""
        spot = self.tags[i].spot
        return np.full(2, np.nan) if spot is None else self._in_dots(spot)

    def _in_dots(self, points: FloatArray) -> FloatArray:
        return np.asarray(self._host().transData.transform(points))

    def _box(self, outline: FloatArray, renderer: RendererBase) -> FloatArray:
        """(4,) left, bottom, right, top around an outline with its line, or around a point's mark, dots."""
        dots = self._in_dots(outline)
        around = _dots(renderer, _POINT_PT if len(dots) == 1 else _LINE_PT)
        return np.concatenate([dots.min(axis=0) - around, dots.max(axis=0) + around])

    def _inside_axes(self, point: FloatArray) -> bool:
        return bool(self._host().bbox.contains(float(point[0]), float(point[1])))

    def _host(self) -> Axes:
        assert isinstance(self.axes, Axes)
        return self.axes


def add_tags(axes: Axes, tags: Sequence[Tag], obstacles: Sequence[Obstacle] = ()) -> Tags:
    """Add tags to axes; arguments as in `Tags`."""
    artist = Tags(tags, obstacles)
    axes.add_artist(artist)
    return artist


def shortened(text: str) -> str:
    """A text of at most `MOST_LETTERS`, with a replacement sign for what is no letter, as a line's end."""
    text = "".join(sign if sign.isprintable() else "\N{REPLACEMENT CHARACTER}" for sign in text)
    return text if len(text) <= MOST_LETTERS else f"{text[: MOST_LETTERS - 1]}\N{HORIZONTAL ELLIPSIS}"


def _text(tag: Tag) -> Text:
    frame = {"boxstyle": "square,pad=0.12", "facecolor": "white", "edgecolor": tag.color, "linewidth": 0.5}
    return Text(
        0,
        0,
        shortened(tag.text),
        color=tag.color,
        fontsize=tag.size,
        fontweight="bold" if tag.bold else "normal",
        horizontalalignment="center",
        verticalalignment="center",
        transform=IdentityTransform(),
        parse_math=False,
        bbox=frame if tag.boxed else None,
        path_effects=None if tag.boxed else [withStroke(linewidth=1.2, foreground="white", alpha=0.7)],
    )


def _centre(box: FloatArray) -> FloatArray:
    """(..., 2) centres of boxes (..., 4)."""
    return (box[..., :2] + box[..., 2:]) / 2


def _nearest(box: FloatArray, outline: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The points of a box (4,) and of the edges of an outline (V, 2) that are nearest each other."""
    along = np.linspace(0.0, 1.0, 9)[:, None, None]
    edges = (outline + along * (np.roll(outline, -1, axis=0) - outline)).reshape(-1, 2)
    on_box = np.clip(edges, box[:2], box[2:])
    k = int(np.argmin(np.hypot(*(edges - on_box).T)))
    return on_box[k], edges[k]


def _dots(renderer: RendererBase, points: float) -> float:
    """A length in points (1/72 inch) as dots of the page."""
    return float(np.asarray(renderer.points_to_pixels(points), dtype=np.float64))
