"""Goats, cattle and a dog, from above and from the side."""

from __future__ import annotations

from farm_ar.drawing.game.colours import INK, Colour, darker, lighter
from farm_ar.drawing.game.shapes import Thing, disc, ellipse, polygon, stroke, thing

_HAIR: Colour = (236, 228, 212)
_HORN: Colour = (112, 94, 70)
_SADDLE: Colour = (176, 128, 90)
_TAN: Colour = (186, 128, 72)


def goat(head_down: bool) -> Thing:
    """A goat; with its head down it grazes."""
    reach, low = (0.031, 0.011) if head_down else (0.027, 0.038)
    above = (
        ellipse(0.0, -0.004, 0.0115, 0.0210, _HAIR),
        ellipse(0.0, -0.013, 0.0112, 0.0095, _SADDLE),
        *(ellipse(x, reach - 0.0085, 0.0048, 0.0024, darker(_HAIR, 0.35)) for x in (-0.0085, 0.0085)),
        ellipse(0.0, reach - 0.006, 0.0060, 0.0095, _HAIR),
        stroke([(-0.003, reach - 0.008), (-0.008, reach - 0.018)], _HORN, 0.0032),
        stroke([(0.003, reach - 0.008), (0.008, reach - 0.018)], _HORN, 0.0032),
        disc(0.0, reach + 0.002, 0.0022, (120, 90, 84)),
    )
    side = (
        *(
            stroke([(x, 0.018), (x, 0.0)], darker(_HAIR, 0.35), 0.0042)
            for x in (-0.015, -0.009, 0.010, 0.015)
        ),
        ellipse(0.0, 0.024, 0.0215, 0.0115, _HAIR),
        ellipse(-0.009, 0.026, 0.0115, 0.0090, _SADDLE),
        polygon([(-0.020, 0.026), (-0.026, 0.034), (-0.017, 0.032)], _HAIR),
        stroke([(0.014, 0.027), (reach - 0.002, low)], _HAIR, 0.0095),
        ellipse(reach, low, 0.0090, 0.0058, _HAIR, 0.35),
        stroke([(reach - 0.004, low + 0.005), (reach - 0.012, low + 0.013)], _HORN, 0.0028),
        stroke([(reach + 0.002, low - 0.004), (reach, low - 0.010)], darker(_HAIR, 0.2), 0.0026),
        disc(reach + 0.002, low + 0.0015, 0.0015, INK),
    )
    return thing(above, side, 0.036)


def cow(head_down: bool) -> Thing:
    """A cow; with its head down it drinks."""
    white, patch, nose = (246, 242, 234), (62, 50, 44), (232, 176, 168)
    reach, low = (0.050, 0.016) if head_down else (0.044, 0.056)
    above = (
        ellipse(0.0, -0.006, 0.0185, 0.0340, white),
        ellipse(-0.008, -0.016, 0.0075, 0.0115, patch, 0.4),
        ellipse(0.009, 0.004, 0.0070, 0.0100, patch, -0.3),
        stroke([(-0.012, reach - 0.012), (0.012, reach - 0.012)], patch, 0.0055),
        ellipse(0.0, reach - 0.008, 0.0085, 0.0135, white),
        ellipse(0.0, reach + 0.004, 0.0065, 0.0042, nose),
    )
    side = (
        *(
            stroke([(x, 0.030), (x, 0.0)], darker(white, 0.25), 0.0066)
            for x in (-0.024, -0.015, 0.016, 0.024)
        ),
        stroke([(-0.032, 0.046), (-0.038, 0.022)], white, 0.0028),
        ellipse(0.0, 0.040, 0.0345, 0.0185, white),
        ellipse(-0.014, 0.045, 0.0110, 0.0095, patch, 0.3),
        ellipse(0.010, 0.036, 0.0085, 0.0090, patch, -0.2),
        stroke([(0.024, 0.046), (reach - 0.004, low + 0.004)], white, 0.0170),
        ellipse(reach, low, 0.0135, 0.0095, white, 0.4),
        ellipse(reach + 0.010, low - 0.004, 0.0058, 0.0066, nose),
        stroke([(reach - 0.006, low + 0.008), (reach - 0.010, low + 0.016)], _HORN, 0.0032),
        disc(reach + 0.002, low + 0.003, 0.0018, INK),
    )
    return thing(above, side, 0.052)


def dog(stride: int) -> Thing:
    """A dog in one of four phases of its stride."""
    wag, kick = (0.004, 0.0, -0.004, 0.0)[stride], (0.005, 0.0, -0.005, 0.0)[stride]
    above = (
        stroke([(0.0, -0.014), (wag, -0.026)], _TAN, 0.0036),
        ellipse(0.0, -0.002, 0.0082, 0.0165, _TAN),
        ellipse(0.0, 0.0165, 0.0066, 0.0078, _TAN),
        ellipse(-0.0064, 0.0135, 0.0026, 0.0052, darker(_TAN, 0.4), 0.5),
        ellipse(0.0064, 0.0135, 0.0026, 0.0052, darker(_TAN, 0.4), -0.5),
        disc(0.0, 0.0245, 0.0022, INK),
    )
    legs = ((-0.011, kick), (-0.009, -kick), (0.009, kick), (0.011, -kick))
    side = (
        *(stroke([(x, 0.012), (x + move, 0.0)], darker(_TAN, 0.2), 0.0038) for x, move in legs),
        stroke([(-0.014, 0.018), (-0.022, 0.027 + wag)], _TAN, 0.0036),
        ellipse(0.0, 0.016, 0.0160, 0.0078, _TAN),
        disc(0.0150, 0.0255, 0.0076, _TAN),
        ellipse(0.0220, 0.0235, 0.0055, 0.0040, lighter(_TAN, 0.3)),
        ellipse(0.0110, 0.0250, 0.0030, 0.0066, darker(_TAN, 0.4), 0.3),
        disc(0.0270, 0.0245, 0.0018, INK),
        disc(0.0170, 0.0275, 0.0014, INK),
    )
    return thing(above, side, 0.030)
