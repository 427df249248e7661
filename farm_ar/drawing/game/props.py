"""Props of a farm: from above, and which models they are; plants from the side."""

from __future__ import annotations

import numpy as np

from farm_ar.drawing.game.colours import INK, Colour, darker, lighter
from farm_ar.drawing.game.shapes import Art, Part, Thing, box, disc, solid_thing, stroke

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
    return solid_thing(above, 0.044, "silo")


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
    return solid_thing(above, 0.052, "tractor")


def water_trough() -> Thing:
    """A trough full of water."""
    above = (
        box(-0.040, -0.014, 0.040, 0.014, darker(_LOG, 0.2)),
        box(-0.035, -0.009, 0.035, 0.009, _WATER),
        stroke([(-0.022, 0.003), (-0.006, 0.003)], lighter(_WATER, 0.6), 0.0020),
        stroke([(0.008, -0.003), (0.020, -0.003)], lighter(_WATER, 0.6), 0.0020),
    )
    return solid_thing(above, 0.042, "water-trough")


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
    return solid_thing(above, 0.038, "hay-trough")


def wood_stack() -> Thing:
    """Logs, piled up."""
    rows = range(5)
    above = tuple(
        box(-0.034, -0.022 + 0.009 * k, 0.034, -0.014 + 0.009 * k, darker(_LOG, 0.07 * (k % 3))) for k in rows
    )
    return solid_thing(above, 0.036, "wood-stack")


def tuft() -> Thing:
    """Long grass."""
    lean = np.linspace(-0.010, 0.010, 5)
    above = tuple(stroke([(0.3 * x, 0.0), (x, 0.009 - 40 * x * x)], _LEAF, 0.0024) for x in lean)
    side = tuple(stroke([(0.3 * x, 0.0), (x, 0.017 - 60 * x * x)], _LEAF, 0.0022) for x in lean)
    return Thing(Art(above), 0.010, Art(side))


def flower(petal: Colour) -> Thing:
    """A flower."""
    around = np.linspace(0.0, 2 * np.pi, 5, endpoint=False)

    def blossom(height: float) -> tuple[Part, ...]:
        petals = (disc(0.0042 * np.sin(a), height + 0.0042 * np.cos(a), 0.0032, petal) for a in around)
        return (*petals, disc(0.0, height, 0.0026, (250, 206, 60)))

    side = (stroke([(0.0, 0.0), (0.0, 0.014)], _LEAF, 0.0020), *blossom(0.016))
    ink = darker(petal, 0.4)
    return Thing(Art(blossom(0.0), 0.0006, ink), 0.009, Art(side, 0.0006, ink))
