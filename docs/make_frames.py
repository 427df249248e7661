"""Draws images/frames.svg: the axes, and the sense of yaw, of each frame that a file may be in.

python docs/make_frames.py
"""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from farm_ar.arrays import FloatArray
from farm_ar.drawing import save_picture
from farm_ar.geometry import FRAMES

IMAGE = Path(__file__).parent / "images" / "frames.svg"

COLORS = {"x": "#c0392b", "y": "#1e8449", "z": "#2455a4"}
INK, FAINT, THING = "#1f2933", "#c3cad1", "#e0912f"
PAPER = np.array([(1.0, -0.14), (0.0, 0.86), (0.52, 0.44)])
"""Where our axes (right, up, forward) point on the page."""

PLACE, HEADING_DEG = np.array([1.0, 0.0, 2.0]), 30.0
TITLES = {
    "unity": "unity\nUnity; farm-ar's own",
    "openxr": "openxr\nWebXR, ARKit, ARCore, OpenXR",
    "ros": "ros\nROS (REP 103)",
}


def on_page(points: FloatArray) -> FloatArray:
    """(..., 2) where points (..., 3) in our axes are drawn."""
    return np.asarray(points) @ PAPER


def arrow(axes: Axes, start: FloatArray, end: FloatArray, color: str, width: float = 1.6) -> None:
    """An arrow from one point to another, in our axes."""
    style = {"arrowstyle": "-|>", "color": color, "lw": width, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tuple(on_page(end)), tuple(on_page(start)), arrowprops=style)


def ahead(yaw_deg: float, length: float = 1.0) -> FloatArray:
    """A vector on the floor by its heading, clockwise from above."""
    yaw = np.deg2rad(yaw_deg)
    return length * np.array([np.sin(yaw), 0.0, np.cos(yaw)])


def draw(axes: Axes, frame: str) -> None:
    """The floor, the axes, a thing on the floor, and how its yaw is counted."""
    for k in np.arange(-1.0, 3.1):
        for ends in ([(-1.0, 0, k), (2.0, 0, k)], [(k - (k > 2), 0, -1.0), (k - (k > 2), 0, 3.0)]):
            axes.plot(*on_page(np.array(ends)).T, color=FAINT, linewidth=0.6, zorder=0)
    basis = FRAMES[frame]
    for name, axis in zip("xyz", basis, strict=True):
        arrow(axes, np.zeros(3), 1.25 * axis, COLORS[name], 2.2)
        axes.text(*on_page(1.5 * axis), name, color=COLORS[name], fontsize=13, ha="center", va="center")
    half_width, half_depth, height = 0.28, 0.2, 0.3
    forward, right = ahead(HEADING_DEG), ahead(HEADING_DEG + 90)
    around = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    foot = np.array([PLACE + a * half_width * right + b * half_depth * forward for a, b in around])
    up = np.array([0.0, height, 0.0])
    top = foot + up
    for face in (foot, *(np.vstack([foot[[i, i - 1]], top[[i - 1, i]]]) for i in (1, 2, 3, 0)), top):
        axes.fill(*on_page(face).T, facecolor=THING, edgecolor=INK, linewidth=0.7, alpha=0.9, zorder=3)
    level = PLACE + up
    arrow(axes, level, level + 1.1 * forward, INK, 1.8)
    axes.plot(*on_page(np.array([level, level + ahead(0.0)])).T, color=INK, linestyle=":", linewidth=1.0)
    arc = np.array([level + ahead(angle, 0.75) for angle in np.linspace(0, HEADING_DEG, 20)])
    axes.plot(*on_page(arc).T, color=INK, linewidth=1.0)
    sign = 1 if frame == "unity" else -1
    axes.text(
        *on_page(level + ahead(HEADING_DEG / 2, 1.25)),
        f"yaw {sign * HEADING_DEG:+.0f}°",
        fontsize=10,
        color=INK,
    )
    point = basis @ PLACE
    said = ", ".join(f"{value:g}" for value in point + 0.0)
    axes.text(*on_page(PLACE + np.array([0.5, 0.0, -0.6])), f"({said})", fontsize=10, color=INK, zorder=4)
    axes.set_title(TITLES[frame], fontsize=11, color=INK)
    axes.set_aspect("equal")
    axes.axis("off")


def main() -> None:
    """Write the picture."""
    figure = Figure(figsize=(11.0, 4.2), facecolor="white")
    for axes, frame in zip(figure.subplots(1, 3), TITLES, strict=True):
        draw(axes, frame)
        axes.set_xlim(-1.9, 4.2)
        axes.set_ylim(-1.3, 2.3)
    figure.subplots_adjust(0.0, 0.0, 1.0, 0.88, 0.02)
    save_picture(figure, IMAGE)
    print(f"Wrote {IMAGE}")


if __name__ == "__main__":
    main()
