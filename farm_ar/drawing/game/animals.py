"""Animals from above: chickens and bunnies in the colour of their label; goats, cattle and a dog."""

from __future__ import annotations

from functools import lru_cache

from farm_ar.drawing.game.colours import INK, Colour, darker, lighter, luminance, mixed
from farm_ar.drawing.game.shapes import Art, Part, Thing, disc, ellipse, polygon, solid_thing, stroke

LENGTH_M = 0.045
"""Their length as drawn: large enough to distinguish them."""

_LARGER = 1.15

_BEAK: Colour = (255, 190, 30)
_COMB: Colour = (214, 36, 40)
_PINK: Colour = (246, 176, 186)
_OUTLINE = 0.0017

_HAIR: Colour = (236, 228, 212)
_HORN: Colour = (112, 94, 70)
_SADDLE: Colour = (176, 128, 90)
_TAN: Colour = (186, 128, 72)

HEADS = {True: ("head-up",), False: ("head-down",)}
"""The parts of a model that are left out, by whether the head is down."""


@lru_cache(maxsize=64)
def chicken(colour: Colour) -> Art:
    """A chicken from above."""
    wing = _shade(colour)
    parts = (
        polygon([(-0.006, -0.010), (-0.008, -0.021), (0.0, -0.017), (0.008, -0.021), (0.006, -0.010)], wing),
        ellipse(0.0, -0.001, 0.0105, 0.0135, colour),
        ellipse(-0.008, -0.003, 0.0035, 0.0095, wing, -0.15),
        ellipse(0.008, -0.003, 0.0035, 0.0095, wing, 0.15),
        polygon([(-0.0055, 0.0150), (0.0, 0.0270), (0.0055, 0.0150)], _BEAK),
        disc(0.0, 0.0125, 0.0068, colour),
        ellipse(0.0, 0.0115, 0.0018, 0.0052, _COMB),
    )
    return _finished(parts, colour, 0.003)


@lru_cache(maxsize=64)
def bunny(colour: Colour) -> Art:
    """A bunny from above."""
    tail: Colour = (250, 250, 250) if luminance(colour) < 0.9 else (226, 222, 214)
    parts = (
        disc(0.0, -0.0155, 0.0052, tail),
        ellipse(0.0, -0.002, 0.0105, 0.0135, colour),
        disc(0.0, 0.0125, 0.0080, colour),
        ellipse(-0.0062, 0.0045, 0.0034, 0.0105, colour, 0.42),
        ellipse(0.0062, 0.0045, 0.0034, 0.0105, colour, -0.42),
        ellipse(-0.0064, 0.0040, 0.0016, 0.0075, mixed(_PINK, colour, 0.15), 0.42),
        ellipse(0.0064, 0.0040, 0.0016, 0.0075, mixed(_PINK, colour, 0.15), -0.42),
        disc(0.0, 0.0195, 0.0016, INK),
    )
    return _finished(parts, colour, 0.003)


def _finished(parts: tuple[Part, ...], colour: Colour, shadow: float) -> Art:
    return Art(parts, _OUTLINE, _ink(colour), shadow).scaled(_LARGER)


def _shade(colour: Colour) -> Colour:
    """The same colour on a wing or a hip."""
    return darker(colour, 0.16) if luminance(colour) > 0.3 else lighter(colour, 0.22)


def _ink(colour: Colour) -> Colour:
    """A line that is seen around the colour and on the grass."""
    return mixed(INK, darker(colour, 0.6), 0.4)


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
