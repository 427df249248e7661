"""Colours: one per category, and those of everything else on a page."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

INK = "#222222"
FAINT = "#9a9a9a"
FAINTEST = "#c8c8c8"
RIGHT = "#14713a"
WRONG = "#c4161c"
WALK = "#1f5f8b"
VIEW = "#c2347e"
SITE = "#6b1f7a"

SMALL = 7.0
"""Size of ordinary letters, points."""
SMALLEST = 6.5
"""Size of letters where there is little room, points."""

CATEGORY_COLORS = (
    "#7db8e8",
    "#f0a830",
    "#a5f0a5",
    "#f07878",
    "#a587f0",
    "#ffd269",
    "#00a5b4",
    "#b4c387",
    "#b46978",
    "#69872d",
    "#5a78d2",
    "#b49600",
)
"""Fills that black letters can be read on and that stay apart for every kind of colour vision.

Found by exchanging colours until the least difference of any two (in OKLab, as seen with normal vision,
protanopia, deuteranopia and tritanopia after Machado et al. 2009) grew no more.
"""


@dataclass(frozen=True)
class Fill:
    """How the footprints of a category are filled.

    Args:
        color: of the inside.
        hatch: Matplotlib's letters for the hatch; "" for none.
        edge: colour of the hatch and the edge.
    """

    color: str
    hatch: str = ""
    edge: str = INK


UNKNOWN_FILL = Fill("#f0f0f0", "/////", "#8c8c8c")
"""Of detections whose category is not known."""


def category_fills(categories: Iterable[str]) -> dict[str, Fill]:
    """A fill for each category, by its place in the sorted order; after the 12th colours return, hatched."""
    names, colors = sorted(set(categories)), len(CATEGORY_COLORS)
    hatches = ("", "....", "\\\\\\\\", "xxxx")
    return {
        name: Fill(CATEGORY_COLORS[i % colors], hatches[i // colors % len(hatches)])
        for i, name in enumerate(names)
    }
