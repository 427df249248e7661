"""Props of a farm, from above and from the side."""

from __future__ import annotations

import numpy as np

from farm_ar.drawing.game.colours import INK, Colour, darker, lighter
from farm_ar.drawing.game.shapes import Art, Part, Thing, box, disc, ellipse, polygon, stroke, thing

_STEEL: Colour = (186, 194, 200)
_WATER: Colour = (96, 176, 222)
_LOG: Colour = (170, 120, 74)
_HAY: Colour = (222, 188, 92)
_LEAF: Colour = (58, 128, 52)
_TRACTOR: Colour = (52, 124, 60)
_TYRE: Colour = (44, 44, 48)


def silo() -> Thing:
    """A tall tower of steel."""
    above = tuple(
        disc(-0.006 * k / 4, 0.006 * k / 4, 0.040 * (1 - k / 5), lighter(darker(_STEEL, 0.28), 0.16 * k))
        for k in range(5)
    )
    bands = tuple(
        stroke([(-0.037, y), (0.037, y)], darker(_STEEL, 0.22), 0.0018) for y in np.arange(0.02, 0.13, 0.02)
    )
    side = (
        box(-0.037, 0.0, 0.037, 0.132, _STEEL),
        box(-0.037, 0.0, -0.018, 0.132, darker(_STEEL, 0.10)),
        box(0.004, 0.0, 0.018, 0.132, lighter(_STEEL, 0.45)),
        *bands,
        polygon(
            [(-0.037, 0.132), (-0.024, 0.156), (0.0, 0.168), (0.024, 0.156), (0.037, 0.132)],
            darker(_STEEL, 0.14),
        ),
        box(-0.007, 0.0, 0.007, 0.022, darker(_STEEL, 0.45)),
    )
    return thing(above, side, 0.044)


def tractor() -> Thing:
    """A tractor, parked."""
    above = (
        box(-0.030, -0.034, -0.018, -0.004, _TYRE),
        box(0.018, -0.034, 0.030, -0.004, _TYRE),
        box(-0.024, 0.022, -0.015, 0.040, _TYRE),
        box(0.015, 0.022, 0.024, 0.040, _TYRE),
        box(-0.012, -0.030, 0.012, 0.048, _TRACTOR),
        box(-0.009, 0.012, 0.009, 0.046, lighter(_TRACTOR, 0.18)),
        box(-0.016, -0.028, 0.016, 0.004, (238, 214, 74)),
        box(-0.011, -0.022, 0.011, -0.002, (250, 236, 160)),
        disc(0.005, 0.030, 0.0036, INK),
    )
    side = (
        box(-0.036, 0.018, 0.046, 0.036, _TRACTOR),
        box(0.004, 0.032, 0.046, 0.046, lighter(_TRACTOR, 0.15)),
        box(-0.034, 0.036, 0.002, 0.072, (238, 214, 74)),
        box(-0.028, 0.046, -0.004, 0.066, (196, 228, 240)),
        stroke([(0.030, 0.046), (0.030, 0.064)], INK, 0.0044),
        *(disc(-0.020, 0.024, r, c) for r, c in ((0.024, _TYRE), (0.012, (238, 214, 74)))),
        *(disc(0.034, 0.015, r, c) for r, c in ((0.015, _TYRE), (0.0075, (238, 214, 74)))),
    )
    return thing(above, side, 0.052)


def water_trough() -> Thing:
    """A trough full of water."""
    above = (
        box(-0.040, -0.014, 0.040, 0.014, darker(_LOG, 0.2)),
        box(-0.035, -0.009, 0.035, 0.009, _WATER),
        stroke([(-0.022, 0.003), (-0.006, 0.003)], lighter(_WATER, 0.6), 0.0020),
        stroke([(0.008, -0.003), (0.020, -0.003)], lighter(_WATER, 0.6), 0.0020),
    )
    side = (
        polygon([(-0.036, 0.0), (0.036, 0.0), (0.042, 0.021), (-0.042, 0.021)], darker(_LOG, 0.1)),
        ellipse(0.0, 0.021, 0.041, 0.005, _WATER),
    )
    return thing(above, side, 0.042)


def hay_trough() -> Thing:
    """A trough with hay in it."""
    straws = tuple(
        stroke([(x, -0.006), (x + 0.006, 0.007)], lighter(_HAY, 0.35), 0.0018)
        for x in np.arange(-0.028, 0.026, 0.009)
    )
    above = (
        box(-0.036, -0.013, 0.036, 0.013, darker(_LOG, 0.2)),
        box(-0.031, -0.009, 0.031, 0.009, _HAY),
        *straws,
    )
    side = (
        ellipse(0.0, 0.019, 0.034, 0.011, _HAY),
        polygon([(-0.032, 0.0), (0.032, 0.0), (0.038, 0.019), (-0.038, 0.019)], _LOG),
    )
    return thing(above, side, 0.038)


def wood_stack() -> Thing:
    """Logs, piled up."""
    rows = range(5)
    above = tuple(
        box(-0.034, -0.022 + 0.009 * k, 0.034, -0.014 + 0.009 * k, darker(_LOG, 0.07 * (k % 3))) for k in rows
    )
    ends: list[Part] = []
    for row in range(3):
        for k in range(5 - row):
            x, y = -0.026 + 0.013 * k + 0.0065 * row, 0.0068 + 0.0112 * row
            ends += [disc(x, y, 0.0068, darker(_LOG, 0.25)), disc(x, y, 0.0050, lighter(_LOG, 0.35))]
            ends.append(disc(x, y, 0.0022, _LOG))
    return thing(above, tuple(ends), 0.036)


def tuft() -> Thing:
    """Long grass."""
    lean = np.linspace(-0.010, 0.010, 5)
    above = tuple(stroke([(0.3 * x, 0.0), (x, 0.009 - 40 * x * x)], _LEAF, 0.0024) for x in lean)
    side = tuple(stroke([(0.3 * x, 0.0), (x, 0.017 - 60 * x * x)], _LEAF, 0.0022) for x in lean)
    return Thing(Art(above), Art(side), 0.010)


def flower(petal: Colour) -> Thing:
    """A flower."""
    around = np.linspace(0.0, 2 * np.pi, 5, endpoint=False)

    def blossom(height: float) -> tuple[Part, ...]:
        petals = (disc(0.0042 * np.sin(a), height + 0.0042 * np.cos(a), 0.0032, petal) for a in around)
        return (*petals, disc(0.0, height, 0.0026, (250, 206, 60)))

    side = (stroke([(0.0, 0.0), (0.0, 0.014)], _LEAF, 0.0020), *blossom(0.016))
    return Thing(Art(blossom(0.0), 0.0006, darker(petal, 0.4)), Art(side, 0.0006, darker(petal, 0.4)), 0.009)
