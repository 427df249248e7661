"""How much was moved."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_HALF_TURN = float(np.pi)


class Motion(NamedTuple):
    """What happened to all objects together, those that were pushed included.

    Args:
        metres: how far they were moved, summed.
        radians: how far they were turned, summed.
    """

    metres: float = 0.0
    radians: float = 0.0

    def __add__(self, other: Motion) -> Motion:  # type: ignore[override]  # two motions are no longer tuple
        return Motion(self.metres + other.metres, self.radians + other.radians)

    def __sub__(self, other: Motion) -> Motion:
        return Motion(self.metres - other.metres, self.radians - other.radians)

    def effort(self, diagonal: float) -> float:
        """Metres as a share of a scene's diagonal, plus radians as a share of half a turn."""
        return self.metres / diagonal + self.radians / _HALF_TURN
