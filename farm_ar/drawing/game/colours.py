"""Colours of the game's pictures: labels, buildings, and everything that shows the game's state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from farm_ar.drawing.palette import CATEGORY_COLORS

Colour = tuple[int, int, int]
"""Red, green, blue, 0 to 255."""

Image = npt.NDArray[np.uint8]
"""(H, W, 3) red, green, blue."""

INK: Colour = (38, 34, 30)
PAPER: Colour = (252, 250, 244)
WRONG: Colour = (226, 24, 34)
ICE: Colour = (170, 216, 255)
DEEP_ICE: Colour = (24, 92, 168)
GO: Colour = (46, 140, 62)
VIEW: Colour = (255, 246, 170)
SKIN: Colour = (232, 184, 148)
SLEEVE: Colour = (72, 96, 150)

WOOD: Colour = (205, 165, 112)
SLATE: Colour = (150, 164, 168)
BARN: Colour = (142, 96, 70)

BUILDINGS: dict[str, Colour] = {"coop": WOOD, "hutch": SLATE, "shed": BARN}
"""What a category's buildings are painted in. All of one category look alike: only labels have colours."""

_NAMED: dict[str, Colour] = {
    "yellow": (250, 208, 28),
    "blue": (40, 96, 224),
    "red": (222, 48, 44),
    "orange": (246, 138, 24),
    "green": (34, 160, 62),
    "cyan": (30, 204, 222),
    "magenta": (228, 52, 176),
    "purple": (128, 66, 204),
    "white": (250, 250, 250),
    "brown": (140, 88, 46),
    "black": (40, 40, 44),
    "grey": (136, 138, 142),
    "gray": (136, 138, 142),
    "pink": (250, 150, 190),
    "teal": (0, 134, 134),
    "lime": (164, 222, 40),
    "navy": (30, 44, 120),
}

_GOLDEN_TURN = 0.618034


def label_colours(labels: Sequence[str]) -> tuple[Colour, ...]:
    """The colour of each label: the one that it is named after, or else one of its own.

    Args:
        labels: N names; "yellow-coop" is yellow.
    """
    return tuple(_NAMED.get(label.split("-")[0].lower()) or _numbered(i) for i, label in enumerate(labels))


def category_colour(category: str, categories: Sequence[str]) -> Colour:
    """What objects of a category are painted in.

    Args:
        category: the category.
        categories: all there are, sorted.
    """
    if category in BUILDINGS:
        return BUILDINGS[category]
    text = CATEGORY_COLORS[categories.index(category) % len(CATEGORY_COLORS)]
    red, green, blue = (int(text[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue


def mixed(colour: Colour, other: Colour, part: float) -> Colour:
    """A colour with a part, 0 to 1, of another in it."""
    red, green, blue = (round(a + part * (b - a)) for a, b in zip(colour, other, strict=True))
    return red, green, blue


def lighter(colour: Colour, part: float) -> Colour:
    """A colour with a part of white in it."""
    return mixed(colour, (255, 255, 255), part)


def darker(colour: Colour, part: float) -> Colour:
    """A colour with a part of black in it."""
    return mixed(colour, (0, 0, 0), part)


def luminance(colour: Colour) -> float:
    """How light a colour is, 0 to 1."""
    red, green, blue = colour
    return (0.299 * red + 0.587 * green + 0.114 * blue) / 255


def legible_on(colour: Colour) -> Colour:
    """Black or white, whichever is read better on a colour."""
    return INK if luminance(colour) > 0.52 else PAPER


def _numbered(index: int) -> Colour:
    """Colours that differ for neighbouring numbers: around the colour circle in golden sections."""
    hue = (index * _GOLDEN_TURN) % 1.0
    value = (0.92, 0.72, 0.84)[index % 3]
    channel = np.clip(np.abs((hue * 6 + np.array([0.0, 4.0, 2.0])) % 6 - 3) - 1, 0, 1)
    red, green, blue = (round(255 * value * (1 - 0.72 * (1 - float(c)))) for c in channel)
    return red, green, blue
