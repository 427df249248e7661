"""Goats, cattle and a dog: from above, and which models they are."""

from __future__ import annotations

from farm_ar.drawing.game.colours import INK, Colour, darker
from farm_ar.drawing.game.shapes import Thing, disc, ellipse, solid_thing, stroke

_HAIR: Colour = (236, 228, 212)
_HORN: Colour = (112, 94, 70)
_SADDLE: Colour = (176, 128, 90)
_TAN: Colour = (186, 128, 72)

HEADS = {True: ("head-up",), False: ("head-down",)}
"""The parts of a model that are left out, by whether the head is down."""


def goat(head_down: bool) -> Thing:
    """A goat; with its head down it grazes."""
    reach = 0.031 if head_down else 0.027
    above = (
        ellipse(0.0, -0.004, 0.0115, 0.0210, _HAIR),
        ellipse(0.0, -0.013, 0.0112, 0.0095, _SADDLE),
        *(ellipse(x, reach - 0.0085, 0.0048, 0.0024, darker(_HAIR, 0.35)) for x in (-0.0085, 0.0085)),
        ellipse(0.0, reach - 0.006, 0.0060, 0.0095, _HAIR),
        stroke([(-0.003, reach - 0.008), (-0.008, reach - 0.018)], _HORN, 0.0032),
        stroke([(0.003, reach - 0.008), (0.008, reach - 0.018)], _HORN, 0.0032),
        disc(0.0, reach + 0.002, 0.0022, (120, 90, 84)),
    )
    return solid_thing(above, 0.036, "goat", HEADS[head_down])


def cow(head_down: bool) -> Thing:
    """A cow; with its head down it drinks."""
    white, patch, nose = (246, 242, 234), (62, 50, 44), (232, 176, 168)
    reach = 0.050 if head_down else 0.044
    above = (
        ellipse(0.0, -0.006, 0.0185, 0.0340, white),
        ellipse(-0.008, -0.016, 0.0075, 0.0115, patch, 0.4),
        ellipse(0.009, 0.004, 0.0070, 0.0100, patch, -0.3),
        stroke([(-0.012, reach - 0.012), (0.012, reach - 0.012)], patch, 0.0055),
        ellipse(0.0, reach - 0.008, 0.0085, 0.0135, white),
        ellipse(0.0, reach + 0.004, 0.0065, 0.0042, nose),
    )
    return solid_thing(above, 0.052, "cow", HEADS[head_down])


def dog(stride: int) -> Thing:
    """A dog in one of four phases of its stride."""
    wag = (0.004, 0.0, -0.004, 0.0)[stride]
    above = (
        stroke([(0.0, -0.014), (wag, -0.026)], _TAN, 0.0036),
        ellipse(0.0, -0.002, 0.0082, 0.0165, _TAN),
        ellipse(0.0, 0.0165, 0.0066, 0.0078, _TAN),
        ellipse(-0.0064, 0.0135, 0.0026, 0.0052, darker(_TAN, 0.4), 0.5),
        ellipse(0.0064, 0.0135, 0.0026, 0.0052, darker(_TAN, 0.4), -0.5),
        disc(0.0, 0.0245, 0.0022, INK),
    )
    return solid_thing(above, 0.030, "dog")
