"""An identification from above, and an explanation of one: its cost terms beside the runner-up's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch

from farm_ar.arrays import FloatArray
from farm_ar.drawing.cameras import draw_view, pieces
from farm_ar.drawing.footprints import (
    areas,
    draw_filled,
    draw_headings,
    draw_legend,
    draw_outlines,
    shown,
    with_heading,
)
from farm_ar.drawing.palette import FAINT, FAINTEST, INK, RIGHT, SMALL, WRONG, category_fills
from farm_ar.drawing.pictures import Area, in_picture, widen
from farm_ar.drawing.scenes import MOST_LABELS, draw_room, object_tags
from farm_ar.drawing.tags import Obstacle, Tag, add_tags
from farm_ar.errors import SnapshotError
from farm_ar.geometry import footprint_corners
from farm_ar.reid import Identification
from farm_ar.reid.explanations import Explanation
from farm_ar.scenes import Detections, Scene, Snapshot

_REFERENCE_SIZE = 5.5
_GROUND = -1e6
"""Level of the reference layout: below every detection."""


def draw_identification(
    axes: Axes,
    scene: Scene,
    snapshot: Snapshot,
    identification: Identification,
    truth: Sequence[str | None] | None = None,
    *,
    reference_labels: bool = True,
    legend: bool = True,
) -> None:
    """Draw what the camera sees in colour, with the labels given, over the reference layout in grey.

    A thin arrow runs from where a label was to the detection that it was given to. Tags are green when right,
    red with the true label in brackets when wrong, black where the truth is not known; "?" is no label.

    Args:
        axes: as `new_picture` or `set_up_axes` makes them. What lies outside the room widens them.
        scene: the reference layout and its room.
        snapshot: the camera and its N detections.
        identification: the answer for them.
        truth: N labels that the detections really are, None for false ones; by default it is not known.
        reference_labels: whether the reference layout is named. Of more than `MOST_LABELS` labels or
            detections none is.
        legend: whether categories are explained beside the axes, where there is more than one.

    Raises:
        SnapshotError: there is not one label, and if the truth is known one true label, per detection.
    """
    seen = snapshot.detections
    _check_count("identification", identification.labels, len(seen))
    if truth is not None:
        _check_count("truth", truth, len(seen))
    draw_room(axes, scene, cells=False)
    area = Area.of(scene)
    near = in_picture(seen.position, area)
    yaw, size = shown(seen.yaw, seen.size, area.margin)
    corners = footprint_corners(seen.position[near], yaw[near], size[near])
    widen(axes, np.vstack([snapshot.camera.position, *corners]), area.margin)
    draw_view(axes, snapshot.camera, scene.bounds)
    known = scene.layout
    draw_outlines(axes, known.position, *shown(known.yaw, known.size, area.margin), FAINTEST)
    fills = category_fills((*scene.layout.categories, *(name for name in seen.category if name is not None)))
    draw_filled(axes, seen.position, yaw, size, seen.category, fills)
    front = with_heading(seen.category, scene.symmetry, seen.yaw)
    draw_headings(axes, seen.position, yaw, size, front)
    tags = _verdict_tags(seen, (yaw, size), identification.labels, truth)
    obstacles = _draw_moves(axes, scene, seen, tags, identification.labels)
    if len(seen) > MOST_LABELS:
        tags, obstacles = [], []
    if reference_labels:
        tags += object_tags(scene.layout, FAINT, _REFERENCE_SIZE, _GROUND, area.margin)
    add_tags(axes, tags, obstacles)
    if legend:
        draw_legend(axes, fills, set(seen.category))


def _verdict_tags(
    seen: Detections,
    drawn: tuple[FloatArray, FloatArray],
    labels: Sequence[str | None],
    truth: Sequence[str | None] | None,
) -> list[Tag]:
    """A tag beside each detection that says what it was taken for."""
    tags = []
    corners = footprint_corners(seen.position, *drawn)
    for i, area in enumerate(areas(drawn[1])):
        text, color = _verdict(labels[i], truth, i)
        tags.append(Tag(text, corners[i], color, SMALL, boxed=True, level=-float(area)))
    return tags


def _verdict(label: str | None, truth: Sequence[str | None] | None, i: int) -> tuple[str, str]:
    """What the tag of a detection says, and its colour."""
    given = "?" if label is None else label
    if truth is None:
        return given, INK
    if label == truth[i]:
        return given, RIGHT
    return f"{given} ({'none' if truth[i] is None else truth[i]})", WRONG


def _draw_moves(
    axes: Axes, scene: Scene, seen: Detections, tags: Sequence[Tag], labels: Sequence[str | None]
) -> list[Obstacle]:
    """An arrow to each detection from where its label was, as coloured as its tag; what tags should avoid."""
    obstacles = []
    before = dict(zip(scene.layout.labels, scene.layout.position, strict=True))
    for label, after, tag in zip(labels, seen.position, tags, strict=True):
        if label is not None and label in before:
            obstacles += _draw_move(axes, before[label], after, tag.color)
    return obstacles


def _draw_move(axes: Axes, before: FloatArray, after: FloatArray, color: str) -> list[Obstacle]:
    """A ring at one place (2,), and an arrow from it to another (2,), metres."""
    arrow = FancyArrowPatch(
        (before[0], before[1]),
        (after[0], after[1]),
        arrowstyle="-|>",
        mutation_scale=5.0,
        shrinkA=0.0,
        shrinkB=0.0,
        color=color,
        linewidth=0.7,
        zorder=4.3,
    )
    axes.add_patch(arrow)
    axes.plot(
        *before, "o", color=color, markerfacecolor="white", markersize=2.6, markeredgewidth=0.6, zorder=4.4
    )
    line = before + np.linspace(0.0, 1.0, 7)[:, None] * (after - before)
    return [Obstacle(before[None], level=np.inf), *pieces(line, step=1, level=np.inf)]


def _check_count(field: str, values: Sequence[str | None], count: int) -> None:
    if len(values) != count:
        raise SnapshotError(field, f"must have {count} labels, one per detection", len(values))


_RUNNER_UP = "#b0b0b0"


def draw_explanation(axes: Axes, explanation: Explanation) -> None:
    """Draw a pair of bars for each term: the label given, and the runner-up. Less speaks for a label.

    Args:
        axes: plain Matplotlib axes.
        explanation: what to draw; a detection without label and runner-up gives empty axes with a title.
    """
    shown = [
        (one, colour)
        for one, colour in ((explanation.given, RIGHT), (explanation.runner_up, _RUNNER_UP))
        if one is not None
    ]
    height = 0.8 / max(len(shown), 1)
    names: list[str] = []
    for k, (one, colour) in enumerate(shown):
        names = list(one.terms)
        place = np.arange(len(names)) + (k - (len(shown) - 1) / 2) * height
        label = f"{one.label}: {one.total:.2f}"
        axes.barh(place, list(one.terms.values()), height, color=colour, label=label)
    axes.set_yticks(range(len(names)), names, fontsize=SMALL, color=INK)
    axes.invert_yaxis()
    axes.axvline(0.0, color=INK, linewidth=0.8)
    axes.tick_params(labelsize=SMALL)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(f"why {explanation.detection} is {_name(explanation)}", fontsize=SMALL)
    axes.set_xlabel("cost", fontsize=SMALL)
    if shown:
        axes.legend(frameon=False, fontsize=SMALL)


def _name(explanation: Explanation) -> str:
    return "none of the labels" if explanation.given is None else explanation.given.label
