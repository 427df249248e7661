"""Buildings in space: boxes with roofs, doors, windows and planks."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import BARN, SLATE, WOOD, Colour, darker, lighter, mixed
from farm_ar.drawing.game.solids import Face, Solid

_TRIM: Colour = (244, 236, 216)
_DOORWAY: Colour = (58, 40, 28)
_GLASS: Colour = (188, 214, 224)
_WIRE: Colour = (98, 108, 84)


@lru_cache(maxsize=256)
def solid(category: str, colour: Colour, width: float, height: float, depth: float) -> Solid:
    """A building or other thing in space, its front ahead.

    Args:
        category: coops, hutches and sheds have shapes of their own, other things are boxes.
        colour: of a plain box.
        width: metres.
        height: metres.
        depth: metres.
    """
    build = {"coop": _coop, "hutch": _hutch, "shed": _shed}.get(category)
    w, d = width / 2, depth / 2
    return Solid(build(w, height, d) if build else _plain(w, height, d, colour))


def _walls(w: float, h: float, d: float) -> dict[str, FloatArray]:
    """The four sides of a box, each from its lower left corner as seen from outside."""
    corner = {
        "front": (w, d, -w, d),
        "left": (-w, d, -w, -d),
        "back": (-w, -d, w, -d),
        "right": (w, -d, w, d),
    }
    return {
        name: np.array([(x0, 0, z0), (x1, 0, z1), (x1, h, z1), (x0, h, z0)])
        for name, (x0, z0, x1, z1) in corner.items()
    }


def _on(wall: FloatArray, corners: npt.ArrayLike) -> FloatArray:
    """(V, 3) points on a wall given by shares (V, 2) of its width and height."""
    share = np.asarray(corners, dtype=np.float64)
    points: FloatArray = wall[0] + share[:, :1] * (wall[1] - wall[0]) + share[:, 1:] * (wall[3] - wall[0])
    return points


def _pane(
    wall: FloatArray, left: float, low: float, right: float, high: float, colour: Colour
) -> tuple[FloatArray, Colour]:
    return _on(wall, [(left, low), (right, low), (right, high), (left, high)]), colour


def _planks(wall: FloatArray, colour: Colour, count: int) -> list[tuple[FloatArray, Colour]]:
    """Upright seams between planks."""
    tone = darker(colour, 0.22)
    return [_pane(wall, k / count - 0.008, 0.0, k / count + 0.008, 1.0, tone) for k in range(1, count)]


def _gable_roof(w: float, eave: float, top: float, d: float, over: float, colour: Colour) -> list[Face]:
    """Two slopes with a ridge from back to front that reach `over` times beyond the walls."""
    reach, ends = w * over, d * over
    low = eave - (over - 1) * (top - eave)
    roofs = []
    for side in (-1.0, 1.0):
        near, far = -side * ends, side * ends
        slope = np.array([(side * reach, low, near), (side * reach, low, far), (0, top, far), (0, top, near)])
        lines = [
            _pane(slope, 0.0, y - 0.015, 1.0, y + 0.015, darker(colour, 0.20)) for y in (0.25, 0.5, 0.75)
        ]
        roofs.append(Face(slope, colour, tuple(lines)))
    return roofs


def _coop(w: float, h: float, d: float) -> tuple[Face, ...]:
    """Wooden walls, a gable at front and back, a door with a ramp."""
    eave = 0.58 * h
    colour, roof = lighter(WOOD, 0.12), darker(WOOD, 0.34)
    faces = []
    for name, wall in _walls(w, eave, d).items():
        details = _planks(wall, colour, 5)
        points = wall
        if name in ("front", "back"):
            points = np.vstack([wall[:3], _on(wall, [(0.5, h / eave)]), wall[3:]])
            details.append(
                (_on(wall, [(0.02, 1.0), (0.98, 1.0), (0.5, h / eave - 0.05)]), darker(colour, 0.08))
            )
        if name == "front":
            details.append(_pane(wall, 0.34, 0.0, 0.66, 0.85, _DOORWAY))
        elif name == "back":
            details += [
                _pane(wall, 0.36, 0.42, 0.64, 0.86, _TRIM),
                _pane(wall, 0.40, 0.48, 0.60, 0.80, _DOORWAY),
            ]
            details.append(_pane(wall, 0.485, 0.48, 0.515, 0.80, _TRIM))
        else:
            details += [
                _pane(wall, 0.28, 0.40, 0.72, 0.80, _TRIM),
                _pane(wall, 0.32, 0.46, 0.68, 0.74, _DOORWAY),
            ]
        faces.append(Face(points, colour, tuple(details)))
    return (*faces, *_gable_roof(w, eave, h, d, 1.12, roof))


def _hutch(w: float, h: float, d: float) -> tuple[Face, ...]:
    """Light walls with wire at the front, a felt roof that falls to the back."""
    low, colour, felt = 0.72 * h, lighter(SLATE, 0.42), darker(SLATE, 0.28)
    faces = []
    for name, wall in _walls(w, low, d).items():
        points, details = wall, _planks(wall, colour, 4)
        if name == "front":
            points = _walls(w, h, d)["front"]
            details = [_pane(points, 0.08, 0.12, 0.92, 0.88, _WIRE)]
            details += [_pane(points, x, 0.12, x + 0.02, 0.88, _TRIM) for x in (0.24, 0.40, 0.56, 0.72)]
        elif name == "left":
            points = np.vstack([wall[:3], [wall[3] + np.array([0.0, h - low, 0.0])]])
        elif name == "right":
            points = np.vstack([wall[:2], [wall[2] + np.array([0.0, h - low, 0.0])], wall[3:]])
        if name == "back":
            details += [_pane(wall, 0.30, 0.0, 0.70, 0.72, mixed(colour, _DOORWAY, 0.35))]
            details += [_pane(wall, 0.34, 0.05, 0.66, 0.66, _WIRE)]
            details += [_pane(wall, x, 0.05, x + 0.02, 0.66, _TRIM) for x in (0.41, 0.49, 0.57)]
        faces.append(Face(points, colour, tuple(details)))
    a, b = 1.10 * w, 1.12 * d
    top = np.array([(-a, low, -b), (a, low, -b), (a, 1.03 * h, b), (-a, 1.03 * h, b)])
    lines = [_pane(top, 0.0, y - 0.015, 1.0, y + 0.015, darker(felt, 0.2)) for y in (0.25, 0.5, 0.75)]
    return (*faces, Face(top, felt, tuple(lines)))


def _shed(w: float, h: float, d: float) -> tuple[Face, ...]:
    """A barn: wide doors at the front, a ridge from side to side."""
    eave, colour = 0.56 * h, lighter(BARN, 0.10)
    faces = []
    for name, wall in _walls(w, eave, d).items():
        points, details = wall, _planks(wall, colour, 9)
        if name in ("left", "right"):
            points = np.vstack([wall[:3], _on(wall, [(0.5, h / eave)]), wall[3:]])
            details.append(_pane(wall, 0.38, 0.95, 0.62, 1.30, _TRIM))
            details.append(_pane(wall, 0.42, 1.00, 0.58, 1.25, _GLASS))
        elif name == "front":
            details += [
                _pane(wall, 0.32, 0.0, 0.68, 0.84, _TRIM),
                _pane(wall, 0.345, 0.0, 0.655, 0.80, _DOORWAY),
            ]
            for x in (0.08, 0.76):
                details += [
                    _pane(wall, x, 0.34, x + 0.16, 0.74, _TRIM),
                    _pane(wall, x + 0.02, 0.40, x + 0.14, 0.68, _GLASS),
                ]
        faces.append(Face(points, colour, tuple(details)))
    turned = _gable_roof(d, eave, h, w, 1.06, darker(BARN, 0.30))
    quarter = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    roofs = [
        Face(f.points @ quarter, f.colour, tuple((points @ quarter, tone) for points, tone in f.details))
        for f in turned
    ]
    return (*faces, *roofs)


def _plain(w: float, h: float, d: float, colour: Colour) -> tuple[Face, ...]:
    """A box; on its lid a triangle that points to its front."""
    sides = [Face(wall, colour) for wall in _walls(w, h, d).values()]
    lid = np.array([(-w, h, -d), (w, h, -d), (w, h, d), (-w, h, d)])
    size = 0.4 * min(w, d)
    mark = np.array([(-0.7 * size, h, 0.85 * d - size), (0.7 * size, h, 0.85 * d - size), (0.0, h, 0.85 * d)])
    return (*sides, Face(lid, lighter(colour, 0.1), ((mark, darker(colour, 0.5)),)))
