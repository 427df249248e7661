"""The figures of a stress test's report, as SVG to stand in the page: charts, failures, cameras."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Polygon, Rectangle
from matplotlib.ticker import MaxNLocator

from farm_ar.agents.cases import Case
from farm_ar.arrays import FloatArray
from farm_ar.drawing.cameras import draw_view
from farm_ar.drawing.palette import CATEGORY_COLORS, FAINT, FAINTEST, INK, SMALL, WRONG
from farm_ar.geometry import direction, footprint_corners
from farm_ar.scenes import Scene, visible

COLORS = ("#2563eb", "#d97706", "#059669", "#db2777", "#7c3aed", "#0891b2", "#65a30d", "#475569", "#111827")
"""Of the lines, in turn; the last for the best of all attacks."""

CERTIFIED = "#dc2626"

SETTINGS: dict[Any, Any] = {
    "svg.hashsalt": "farm-ar",
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 8.0,
}
"""Ids that do not change, and letters that the page's reader can select."""

SEEN, MOVED_UNSEEN, UNSEEN = 1.0, 0.6, 0.35
"""Opacities of objects that are in view, that are not but were moved, and of the others."""

PICTURE_IN, CHART_IN = 3.4, (4.9, 3.0)
"""Inches: the width of a picture; the size of a chart."""


class Line(NamedTuple):
    """A line of a chart: its name, points, and colour; a bound is dashed."""

    name: str
    x: Sequence[float]
    y: Sequence[float]
    color: str
    bound: bool = False


def line_chart(lines: Sequence[Line], x_label: str, y_label: str, x_limit: float) -> str:
    """Lines from 0, with a legend below; y from 0 to 1."""
    figure, axes = _chart(CHART_IN, x_label, y_label)
    for line in lines:
        style = "--" if line.bound else "-"
        axes.plot(line.x, line.y, style, color=line.color, linewidth=1.5, label=line.name)
    axes.set_xlim(0.0, x_limit or 1.0)  # a method may fail with no distance at all
    axes.set_ylim(0.0, 1.02)
    if lines:
        columns = min(len(lines), 4)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=columns, frameon=False)
    return svg_of(figure)


def bar_chart(values: Sequence[float], counts: Sequence[float], x_label: str, y_label: str) -> str:
    """Bars of equal width from 0 to 1 with the diagonal; NaN leaves a gap. Their opacity is their count."""
    figure, axes = _chart((2.9, 2.4), x_label, y_label)
    most, width = max([*counts, 1.0]), 1 / max(len(values), 1)
    for k, (value, count) in enumerate(zip(values, counts, strict=True)):
        if np.isfinite(value):
            opacity = 0.25 + 0.75 * (count / most) ** 0.5
            axes.bar((k + 0.5) * width, max(value, 0.004), 0.9 * width, color=COLORS[0], alpha=opacity)
    axes.plot([0, 1], [0, 1], "--", color=FAINT, linewidth=0.8)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    return svg_of(figure)


def cell_chart(cells: Sequence[Sequence[float]], x_label: str, y_label: str, x_limit: float) -> str:
    """Cells coloured by the logarithm of their numbers; a row per value of y from 1, the last "and more"."""
    whole = np.asarray(cells, dtype=np.float64)
    used = max(int(np.flatnonzero(whole.any(axis=1)).max(initial=0)) + 1, 4)
    table = np.log1p(whole[:used])
    figure, axes = _chart((5.6, 2.8), x_label, y_label)
    axes.grid(visible=False)
    table[table == 0] = np.nan
    edges = np.linspace(0.0, x_limit, whole.shape[1] + 1)
    axes.pcolormesh(edges, np.arange(len(table) + 1) + 0.5, table, cmap="Reds", vmin=0.0, edgecolors="white")
    rows = np.arange(1, len(table) + 1)
    axes.set_yticks(rows, [f"{r}+" if r == len(whole) else str(r) for r in rows])
    return svg_of(figure)


def failure_picture(case: Case, failure: Mapping[str, Any]) -> str:
    """What an attack did, in the marks of `key_picture`.

    Args:
        case: whose camera looks.
        failure: with position, yaw and misread, as `attack_case` describes it.
    """
    layout, scene = case.layout, case.scene
    position, yaw = np.array(failure["position"]), np.array(failure["yaw"])
    misread = dict(failure["misread"])
    seen = visible(layout.with_poses(position, yaw), case.camera)
    moved = np.any(position != layout.position, axis=1) | (yaw != layout.yaw)
    eye = np.clip(case.camera.position, -0.4 * np.array(scene.size), 1.4 * np.array(scene.size))
    figure, axes = _sheet(np.vstack([np.zeros(2), scene.size, eye, position]), scene)
    draw_view(axes, case.camera, scene.bounds)
    before = footprint_corners(layout.position, layout.yaw, layout.size)
    after = footprint_corners(position, yaw, layout.size)
    for k in np.flatnonzero(moved):
        _draw_former(axes, before[k])
    for i, label in enumerate(layout.labels):
        color = CATEGORY_COLORS[int(layout.category_code[i]) % len(CATEGORY_COLORS)]
        alpha = SEEN if seen[i] else MOVED_UNSEEN if moved[i] else UNSEEN
        _draw_object(axes, after[i], color, alpha, label in misread)
    for k in np.flatnonzero(moved):
        if np.linalg.norm(position[k] - layout.position[k]) > 0.01 * scene.diagonal:
            _draw_way(axes, layout.position[k], position[k])
    _tag_misread(axes, layout.labels, position, misread)
    return svg_of(figure)


def cameras_picture(scene: Scene, cameras: Sequence[Sequence[float]], strength: Sequence[float]) -> str:
    """Where cameras stand and look, the redder the weaker (strength 0 to 1), over the scene's own layout."""
    places = np.array([camera[:2] for camera in cameras]).reshape(-1, 2)
    figure, axes = _sheet(np.vstack([np.zeros(2), scene.size, places]), scene)
    layout = scene.layout
    for corners in footprint_corners(layout.position, layout.yaw, layout.size):
        axes.add_patch(Polygon(corners, facecolor="white", edgecolor=FAINT, linewidth=0.6))
    colors = mpl.colormaps["RdYlGn"]
    for (x, z, yaw), share in zip(cameras, strength, strict=True):
        tip = np.array([x, z]) + 0.06 * scene.diagonal * direction(yaw)
        axes.plot([x, tip[0]], [z, tip[1]], color=colors(share), linewidth=1.4)
        axes.plot(x, z, "o", color=colors(share), markersize=4.5)
    return svg_of(figure)


def key_picture() -> str:
    """What the marks of a failure's picture mean."""
    with mpl.rc_context(SETTINGS):
        figure = Figure(figsize=(7.2, 0.95))
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, 7.2)
    axes.set_ylim(0.0, 0.95)
    axes.set_axis_off()
    box, yaw, color = np.array([0.3, 0.1, 0.2]), np.float64(0.5), CATEGORY_COLORS[0]
    marks = (
        "in view; the line goes to its front",
        "out of view",
        "moved, out of view",
        "where a moved object stood",
        "how it was moved",
        "label → what it was read as",
    )
    for k, text in enumerate(marks):
        x, z = 0.3 + 2.4 * (k % 3), 0.72 - 0.48 * (k // 3)
        place = np.array([x, z])
        corners = footprint_corners(place, yaw, box)
        if k == 3:
            _draw_former(axes, corners)
        elif k == 4:
            _draw_way(axes, np.array([x - 0.2, z]), np.array([x + 0.2, z]))
        else:
            _draw_object(axes, corners, color, (SEEN, UNSEEN, MOVED_UNSEEN)[k] if k < 3 else SEEN, k == 5)
        axes.text(x + 0.3, z, text, va="center", color=WRONG if k == 5 else INK, fontsize=SMALL)
    return svg_of(figure)


def _draw_object(axes: Axes, corners: FloatArray, color: str, alpha: float, wrong: bool = False) -> None:
    """A footprint (4, 2) with a line from its middle to its front; red where its label is wrong."""
    edge, weight = (WRONG, 1.6) if wrong else (INK if alpha > UNSEEN else FAINT, 0.6)
    axes.add_patch(Polygon(corners, facecolor=color, edgecolor=edge, linewidth=weight, alpha=alpha))
    _draw_heading(axes, corners, edge, alpha)


def _draw_former(axes: Axes, corners: FloatArray) -> None:
    """The footprint (4, 2) that a moved object had, with its heading."""
    axes.add_patch(Polygon(corners, fill=False, edgecolor=FAINT, linestyle=(0, (3, 2)), linewidth=0.8))
    _draw_heading(axes, corners, FAINT, 1.0)


def _draw_heading(axes: Axes, corners: FloatArray, color: str, alpha: float) -> None:
    """A line from the middle of a footprint to the middle of its front."""
    front = corners[:2].mean(axis=0)
    axes.plot(*np.stack([corners.mean(axis=0), front], axis=1), color=color, linewidth=0.8, alpha=alpha)


def _draw_way(axes: Axes, begin: FloatArray, end: FloatArray) -> None:
    """The way of a moved object."""
    arrow: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 7, "shrinkA": 0, "shrinkB": 0}
    axes.add_patch(FancyArrowPatch(tuple(begin), tuple(end), color=INK, lw=1.0, **arrow))


def svg_of(figure: Figure) -> str:
    """A figure as an SVG element, whose text depends on nothing but the figure."""
    text = io.StringIO()
    with mpl.rc_context(SETTINGS):
        figure.savefig(text, format="svg", bbox_inches="tight", pad_inches=0.03)
    element = text.getvalue()
    element = element[element.index("<svg") :]
    element = re.sub(r"\s*<metadata>.*?</metadata>", "", element, flags=re.DOTALL)
    element = re.sub(r"<!--.*?-->\s*", "", element, flags=re.DOTALL)
    # Several of them stand on a page: the ids that nothing refers to would meet.
    element = re.sub(r' id="[A-Za-z0-9]+_\d+"', "", element)
    return re.sub(r"^<svg ", '<svg role="img" ', element.strip())


def _chart(size: tuple[float, float], x_label: str, y_label: str) -> tuple[Figure, Axes]:
    with mpl.rc_context(SETTINGS):
        figure = Figure(figsize=size)
        axes = figure.add_axes((0.12, 0.16, 0.86, 0.8))
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.grid(color="#e5e7eb", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(length=2, color=FAINT, labelcolor=INK)
    return figure, axes


def _sheet(places: FloatArray, scene: Scene) -> tuple[Figure, Axes]:
    """Axes without ticks that show a room and what stands beside it."""
    gap = 0.04 * scene.diagonal
    low, high = places.min(axis=0) - gap, places.max(axis=0) + gap
    width, height = high - low
    with mpl.rc_context(SETTINGS):
        figure = Figure(figsize=(PICTURE_IN, PICTURE_IN * float(height / width)))
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_axis_off()
    axes.add_patch(Rectangle((0.0, 0.0), *scene.size, facecolor="#f3f4f6", edgecolor=FAINTEST, zorder=0.5))
    return figure, axes


def _tag_misread(
    axes: Axes, labels: Sequence[str], position: FloatArray, misread: Mapping[str, str | None]
) -> None:
    """What each misread object was taken for, one line below the other where they would meet."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    line, lowest = 10.0 / 72 / PICTURE_IN * (right - left), np.inf
    chosen = [i for i, label in enumerate(labels) if label in misread]
    for i in sorted(chosen, key=lambda i: -position[i, 1]):
        x, z = position[i]
        lowest = z = float(np.clip(min(z + line, lowest - line), bottom, top))
        side = (x - left) / (right - left)
        align = "left" if side < 1 / 3 else "right" if side > 2 / 3 else "center"
        given = "nothing" if misread[labels[i]] is None else misread[labels[i]]
        axes.text(
            x, z, f"{labels[i]} → {given}".replace("$", r"\$"), ha=align, va="center", color=WRONG,
            fontsize=SMALL, fontweight="bold", zorder=9,
            bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 0.6},
        )  # fmt: skip
