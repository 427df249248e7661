"""The score board: animals that got in, by label, and what the referee knows of them."""

from __future__ import annotations

from dataclasses import dataclass

from farm_ar.arrays import IntArray
from farm_ar.game_logic.animals.arrival import Counts
from farm_ar.structs import Structs, new_structs


@dataclass
class Counters:
    """Counts for N labels, all starting at 0; `arrival.count` raises them.

    Args:
        counts: (N,) all of them; the attributes below are its fields.

    Attributes:
        counted: (N,) what the game shows: animals of the label's colour that got into a building.
        misplaced: (N,) those of them that got into another label's building.
        stranded: (N,) animals that arrived where nothing stands, and were not counted.
    """

    counts: Structs[Counts]

    def __post_init__(self) -> None:
        self.counted: IntArray = self.counts["counted"]
        self.misplaced: IntArray = self.counts["misplaced"]
        self.stranded: IntArray = self.counts["stranded"]

    @classmethod
    def zero(cls, n: int) -> Counters:
        """Counters of `n` labels before anything has happened."""
        return cls(new_structs(Counts, n))

    @property
    def miscounts(self) -> int:
        """Animals that did not get into the building of their colour."""
        return int(self.misplaced.sum() + self.stranded.sum())


ANIMALS = {"coop": "Chicken", "hutch": "Bunny"}
"""The animal that lives in each category of building."""


def label_text(label: str, category: str, count: int) -> str:
    """A label as the game shows it: "Yellow Chicken Coop (22)" for "yellow-coop"."""
    colour = label.removesuffix(f"-{category}")
    words = [colour, ANIMALS.get(category, ""), category if colour != label else ""]
    return f"{' '.join(word.capitalize() for word in words if word)} ({count})"
