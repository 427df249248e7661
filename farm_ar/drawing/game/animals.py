"""Chickens and bunnies from above, each in the colour of the label that it runs to."""

from __future__ import annotations

from functools import lru_cache

from farm_ar.drawing.game.colours import INK, Colour, darker, lighter, luminance, mixed
from farm_ar.drawing.game.shapes import Art, Part, disc, ellipse, polygon

LENGTH_M = 0.045
"""Their length as drawn: large enough to distinguish them."""

_LARGER = 1.15

_BEAK: Colour = (255, 190, 30)
_COMB: Colour = (214, 36, 40)
_PINK: Colour = (246, 176, 186)
_OUTLINE = 0.0017


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
