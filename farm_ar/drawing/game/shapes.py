"""Drawings as lists of flat-coloured shapes, in metres: rectangles, ellipses, strokes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import INK, Colour
from farm_ar.rendering import Mesh, model

_LINE, _SHADOW = 0.0015, 0.005


@dataclass(frozen=True, eq=False)
class Part:
    """A filled polygon, or a stroke along points.

    Args:
        points: (V, 2) to the right and ahead of the middle of what is drawn; in a drawing from the side, up.
        colour: of the part.
        width: of the stroke; 0 for a filled polygon.
        alpha: how opaque the part is, 0 to 255.
    """

    points: FloatArray
    colour: Colour
    width: float = 0.0
    alpha: int = 255


@dataclass(frozen=True, eq=False)
class Art:
    """A drawing of something, from above facing up the page, or from the side standing on 0.

    Args:
        parts: from the lowest to the highest.
        outline: width of the dark line around it all; 0 for none.
        ink: colour of that line.
        shadow: how far its shadow falls to the right and towards the near edge; 0 for none.
    """

    parts: tuple[Part, ...]
    outline: float = 0.0
    ink: Colour = INK
    shadow: float = 0.0

    def mirrored(self) -> Art:
        """The drawing with left and right exchanged."""
        parts = tuple(replace(part, points=part.points * np.array([-1.0, 1.0])) for part in self.parts)
        return replace(self, parts=parts)

    def scaled(self, factor: float) -> Art:
        """The drawing larger or smaller."""
        parts = tuple(replace(p, points=p.points * factor, width=p.width * factor) for p in self.parts)
        return Art(parts, self.outline * factor, self.ink, self.shadow * factor)


@dataclass(frozen=True, eq=False)
class Thing:
    """Something that is drawn from above, and either has a model or is drawn from the side.

    Args:
        above: the drawing from above, facing up the page.
        radius: room that it takes up, metres.
        side: the drawing from the side, facing right; None where there is a model.
        solid: name of the model, "" for none.
        without: parts of the model that are left out.
    """

    above: Art
    radius: float
    side: Art | None = None
    solid: str = ""
    without: tuple[str, ...] = ()

    @cached_property
    def mesh(self) -> Mesh:
        """The model."""
        return model(self.solid).without(*self.without)


def polygon(points: npt.ArrayLike, colour: Colour, alpha: int = 255) -> Part:
    """A filled polygon."""
    return Part(np.asarray(points, dtype=np.float64), colour, 0.0, alpha)


def stroke(points: npt.ArrayLike, colour: Colour, width: float) -> Part:
    """A line along points."""
    return Part(np.asarray(points, dtype=np.float64), colour, width)


def box(left: float, near: float, right: float, far: float, colour: Colour) -> Part:
    """A rectangle along the axes."""
    return polygon([(left, near), (right, near), (right, far), (left, far)], colour)


def ellipse(
    x: float, ahead: float, half_width: float, half_length: float, colour: Colour, turn: float = 0.0
) -> Part:
    """An ellipse, turned clockwise by `turn` radians."""
    angle = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    across, along = half_width * np.cos(angle), half_length * np.sin(angle)
    cosine, sine = np.cos(turn), np.sin(turn)
    return polygon(
        np.stack([x + across * cosine + along * sine, ahead - across * sine + along * cosine], axis=1), colour
    )


def disc(x: float, ahead: float, radius: float, colour: Colour) -> Part:
    """A circle."""
    return ellipse(x, ahead, radius, radius, colour)


def solid_thing(above: tuple[Part, ...], radius: float, solid: str, without: tuple[str, ...] = ()) -> Thing:
    """Something with a model; from above with a dark line around it, throwing a shadow."""
    return Thing(Art(above, _LINE, INK, _SHADOW), radius, None, solid, without)
