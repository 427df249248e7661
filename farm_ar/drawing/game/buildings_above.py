"""Roofs: coops, hutches, the shed and plain objects from above, each filling exactly its footprint."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from farm_ar.drawing.game.colours import BARN, INK, SLATE, WOOD, Colour, darker, lighter, luminance
from farm_ar.drawing.game.shapes import Art, Part, box, polygon, stroke

_TRIM: Colour = (244, 236, 216)
_DOORWAY: Colour = (58, 40, 28)


@lru_cache(maxsize=256)
def roof(category: str, colour: Colour, width: float, depth: float) -> Art:
    """A building or other thing from above, its front ahead.

    Args:
        category: coops, hutches and sheds have roofs of their own, other objects a plain lid.
        colour: of a plain lid.
        width: of the footprint, metres.
        depth: likewise.
    """
    draw = {"coop": _coop, "hutch": _hutch, "shed": _shed}.get(category)
    side = min(width, depth)
    parts = draw(width / 2, depth / 2) if draw else _plain(width / 2, depth / 2, colour)
    return Art(parts, 0.016 * side, INK, 0.09 * side)


def _gable(w: float, d: float, colour: Colour, courses: int) -> tuple[Part, ...]:
    """Two slopes with a ridge from back to front, the left one in the light."""
    light, shade = lighter(colour, 0.10), darker(colour, 0.17)
    steps = np.linspace(0.0, w, courses + 1)[1:-1]
    lines = [stroke([(x, -d), (x, d)], darker(shade, 0.18), 0.03 * w) for x in steps]
    lines += [stroke([(-x, -d), (-x, d)], darker(light, 0.16), 0.03 * w) for x in steps]
    return (
        box(-w, -d, 0.0, d, light),
        box(0.0, -d, w, d, shade),
        *lines,
        stroke([(0.0, -d), (0.0, d)], lighter(colour, 0.45), 0.09 * w),
    )


def _coop(w: float, d: float) -> tuple[Part, ...]:
    """A wooden gable, a ramp with rungs at the door, a little turret."""
    ramp = [(-0.24 * w, 0.92 * d), (0.24 * w, 0.92 * d), (0.20 * w, 1.28 * d), (-0.20 * w, 1.28 * d)]
    rungs = (
        stroke([(-0.19 * w, y * d), (0.19 * w, y * d)], darker(WOOD, 0.55), 0.05 * w) for y in (1.06, 1.17)
    )
    t = 0.17 * w
    return (
        polygon(ramp, lighter(WOOD, 0.25)),
        *rungs,
        *_gable(w, d, WOOD, 4),
        polygon([(-0.30 * w, d), (0.30 * w, d), (0.0, 0.60 * d)], _DOORWAY),
        box(-t, -0.52 * d - t, t, -0.52 * d + t, darker(WOOD, 0.42)),
        polygon([(-t, -0.52 * d - t), (t, -0.52 * d + t), (-t, -0.52 * d + t)], darker(WOOD, 0.22)),
    )


def _hutch(w: float, d: float) -> tuple[Part, ...]:
    """A felt roof over the nest, a wire run over the front half, a round door."""
    run = [stroke([(x * w, 0.0), (x * w, 0.86 * d)], _TRIM, 0.035 * w) for x in (-0.6, -0.3, 0.0, 0.3, 0.6)]
    run += [stroke([(-0.88 * w, y * d), (0.88 * w, y * d)], _TRIM, 0.035 * w) for y in (0.25, 0.5, 0.75)]
    return (
        box(-w, -d, w, d, darker(SLATE, 0.42)),
        box(-0.88 * w, 0.0, 0.88 * w, 0.86 * d, (116, 134, 92)),
        *run,
        box(-w, -d, w, 0.10 * d, SLATE),
        *(stroke([(-w, y * d), (w, y * d)], darker(SLATE, 0.16), 0.035 * w) for y in (-0.68, -0.36, -0.04)),
        polygon([(-0.28 * w, 0.82 * d), (0.28 * w, 0.82 * d), (0.0, 0.36 * d)], _DOORWAY),
        stroke([(-w, 0.10 * d), (w, 0.10 * d)], lighter(SLATE, 0.5), 0.05 * w),
    )


def _shed(w: float, d: float) -> tuple[Part, ...]:
    """A barn: ridge from side to side, skylights, wide doors in a light frame."""
    light, shade = lighter(BARN, 0.08), darker(BARN, 0.20)
    courses = [
        stroke([(-w, y * d), (w, y * d)], darker(BARN, 0.30), 0.025 * d)
        for y in (-0.75, -0.5, -0.25, 0.25, 0.5, 0.75)
    ]
    seams = [
        stroke([(x * w, -d), (x * w, d)], darker(BARN, 0.28), 0.012 * d) for x in np.linspace(-0.8, 0.8, 9)
    ]
    glass = [
        box(x * w - 0.1 * w, 0.30 * d, x * w + 0.1 * w, 0.62 * d, (188, 214, 224)) for x in (-0.55, 0.55)
    ]
    return (
        box(-w, -d, w, 0.0, light),
        box(-w, 0.0, w, d, shade),
        *courses,
        *seams,
        *glass,
        stroke([(-w, 0.0), (w, 0.0)], lighter(BARN, 0.42), 0.09 * d),
        box(-0.30 * w, 0.80 * d, 0.30 * w, d, _TRIM),
        box(-0.25 * w, 0.84 * d, 0.25 * w, d, _DOORWAY),
        stroke([(0.0, 0.84 * d), (0.0, d)], _TRIM, 0.035 * w),
    )


def _plain(w: float, d: float, colour: Colour) -> tuple[Part, ...]:
    """A lid with a bevel and a triangle that points to its front."""
    rim, size = 0.10 * min(w, d), 0.42 * min(w, d)
    mark = darker(colour, 0.55) if luminance(colour) > 0.35 else lighter(colour, 0.6)
    return (
        box(-w, -d, w, d, darker(colour, 0.22)),
        box(-w + rim, -d + rim, w - rim, d - rim, colour),
        polygon([(-0.7 * size, d - rim - size), (0.7 * size, d - rim - size), (0.0, d - 1.4 * rim)], mark),
    )
