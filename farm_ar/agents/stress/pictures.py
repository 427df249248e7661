"""Pictures of failures from above, as SVG text: what was moved, from where, and what it was taken for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.arrays import FloatArray
from farm_ar.geometry import direction, footprint_corners, view_polygon
from farm_ar.scenes import Camera, Scene, visible

FILLS = ("#fde68a", "#bfdbfe", "#bbf7d0", "#fbcfe8", "#ddd6fe", "#fed7aa", "#cbd5e1", "#a5f3fc")
"""Of the categories, in turn."""

RED, INK, FAINT, PALE = "#dc2626", "#374151", "#9ca3af", "#f3f4f6"
WIDTH, TAG_HEIGHT = 340.0, 12.0


class _Sheet:
    """Turns metres into the units of a picture, z up the page.

    Args:
        low: (2,) corner of what is shown, metres.
        high: (2,) the opposite corner, metres.
    """

    def __init__(self, low: FloatArray, high: FloatArray) -> None:
        self._low, self._high = low, high
        self.scale = WIDTH / float(high[0] - low[0])
        self.height = self.scale * float(high[1] - low[1])

    def point(self, place: FloatArray) -> tuple[float, float]:
        x, z = (place - self._low) * self.scale
        return float(x), float(self.height - z)

    def path(self, corners: FloatArray) -> str:
        return " ".join("{:.1f},{:.1f}".format(*self.point(corner)) for corner in corners)

    def svg(self, content: str) -> str:
        return (
            f'<svg class="picture" viewBox="0 0 {WIDTH:g} {self.height:.1f}" '
            f'xmlns="http://www.w3.org/2000/svg">{content}</svg>'
        )


def failure_picture(case: Case, failure: Mapping[str, Any]) -> str:
    """What an attack did: moved objects with an arrow from their dashed places, misread ones in red.

    Args:
        case: whose camera looks.
        failure: with position, yaw and misread, as `attack_case` describes it.
    """
    layout = case.layout
    position, yaw = np.array(failure["position"]), np.array(failure["yaw"])
    misread = dict(failure["misread"])
    seen = visible(layout.with_poses(position, yaw), case.camera)
    moved = np.any(position != layout.position, axis=1) | (yaw != layout.yaw)
    sheet = _sheet(case.scene, case.camera, position)
    parts = [_ground(sheet, case.scene), _view(sheet, case.camera)]
    before = footprint_corners(layout.position, layout.yaw, layout.size)
    after = footprint_corners(position, yaw, layout.size)
    for k in np.flatnonzero(moved):
        parts.append(
            f'<polygon points="{sheet.path(before[k])}" fill="none" stroke="{FAINT}" stroke-dasharray="3 2"/>'
        )
    for i, label in enumerate(layout.labels):
        wrong = label in misread
        fill = FILLS[int(layout.category_code[i]) % len(FILLS)]
        stroke, weight = (RED, 2.2) if wrong else (INK, 0.8)
        if not (seen[i] or moved[i]):
            parts.append(f'<polygon points="{sheet.path(after[i])}" fill="{fill}" class="away"/>')
            continue
        opacity = 1.0 if seen[i] else 0.6
        front = position[i] + direction(yaw[i]) * layout.size[i, 2] / 2
        parts.append(
            f'<g opacity="{opacity}"><polygon points="{sheet.path(after[i])}" fill="{fill}" '
            f'stroke="{stroke}" stroke-width="{weight}"/>{_stroke(sheet, position[i], front, stroke, 1.0)}'
            f"<title>{escape(label)}</title></g>"
        )
    parts += [_arrow(sheet, layout.position[k], position[k]) for k in np.flatnonzero(moved)]
    places = {label: sheet.point(position[i]) for i, label in enumerate(layout.labels) if label in misread}
    return sheet.svg("".join(parts) + _tags(places, misread))


def _tags(places: Mapping[str, tuple[float, float]], misread: Mapping[str, str | None]) -> str:
    """What each misread object was taken for, one tag below the other where they would meet."""
    parts, lowest = [], -np.inf
    for label, (x, y) in sorted(places.items(), key=lambda item: item[1][1]):
        top = max(y - 10, lowest + TAG_HEIGHT)
        lowest = top
        given = "nothing" if misread[label] is None else misread[label]
        anchor = "start" if x < WIDTH / 3 else "end" if x > 2 * WIDTH / 3 else "middle"
        parts.append(
            f'<text class="tag" x="{x:.1f}" y="{top:.1f}" text-anchor="{anchor}">'
            f"{escape(label)} → {escape(str(given))}</text>"
        )
    return "".join(parts)


def cameras_picture(scene: Scene, cameras: Sequence[Sequence[float]], strength: Sequence[float]) -> str:
    """Where cameras stand and look, the redder the weaker (strength 0 to 1), over the scene's own layout."""
    places = np.array([camera[:2] for camera in cameras]).reshape(-1, 2)
    low = np.minimum(np.zeros(2), places.min(axis=0, initial=0.0)) - 0.04 * scene.diagonal
    high = np.maximum(np.array(scene.size), places.max(axis=0, initial=0.0)) + 0.04 * scene.diagonal
    sheet = _Sheet(low, high)
    parts = [_ground(sheet, scene)]
    layout = scene.layout
    for corners in footprint_corners(layout.position, layout.yaw, layout.size):
        parts.append(f'<polygon points="{sheet.path(corners)}" fill="white" stroke="{FAINT}"/>')
    for (x, z, yaw), share in zip(cameras, strength, strict=True):
        colour = f"hsl({150 * share:.0f} 75% 40%)"
        place = np.array([x, z])
        tip = place + 0.06 * scene.diagonal * direction(yaw)
        left, top = sheet.point(place)
        parts.append(_stroke(sheet, place, tip, colour, 1.6))
        parts.append(f'<circle cx="{left:.1f}" cy="{top:.1f}" r="3.5" fill="{colour}"/>')
    return sheet.svg("".join(parts))


def _sheet(scene: Scene, camera: Camera, position: FloatArray) -> _Sheet:
    """The room, and the camera if it is not far away."""
    eye = np.clip(camera.position, -0.4 * np.array(scene.size), 1.4 * np.array(scene.size))
    places = np.vstack([np.zeros(2), scene.size, eye, position])
    gap = 0.03 * scene.diagonal
    return _Sheet(places.min(axis=0) - gap, places.max(axis=0) + gap)


def _ground(sheet: _Sheet, scene: Scene) -> str:
    width, depth = scene.size
    corners = np.array([[0.0, 0.0], [width, 0.0], [width, depth], [0.0, depth]])
    return f'<polygon points="{sheet.path(corners)}" fill="{PALE}" stroke="{FAINT}"/>'


def _view(sheet: _Sheet, camera: Camera) -> str:
    fov = camera.fov
    outline = view_polygon(camera.position, float(camera.yaw), fov.left, fov.right, fov.range_m)
    x, y = sheet.point(camera.position)
    return (
        f'<polygon points="{sheet.path(outline)}" fill="#3b82f6" fill-opacity="0.08" stroke="#3b82f6" '
        f'stroke-opacity="0.5"/><circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="#2563eb"/>'
    )


def _stroke(sheet: _Sheet, start: FloatArray, end: FloatArray, colour: str, weight: float) -> str:
    (x, y), (u, v) = sheet.point(start), sheet.point(end)
    ends = f'x1="{x:.1f}" y1="{y:.1f}" x2="{u:.1f}" y2="{v:.1f}"'
    return f'<line {ends} stroke="{colour}" stroke-width="{weight}"/>'


def _arrow(sheet: _Sheet, start: FloatArray, end: FloatArray) -> str:
    way = end - start
    length = float(np.linalg.norm(way))
    if length * sheet.scale < 4:
        return ""
    along, across = way / length, np.array([way[1], -way[0]]) / length
    head = 5 / sheet.scale
    tip = np.stack([end, end - head * along + 0.5 * head * across, end - head * along - 0.5 * head * across])
    return _stroke(sheet, start, end, INK, 1.2) + f'<polygon points="{sheet.path(tip)}" fill="{INK}"/>'
