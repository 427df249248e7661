"""What a visit may cost: exceeding it scales a move down, it is not rejected."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.envs.moves import Move
from farm_ar.game_logic.motion import Motion


class Budget(Protocol):
    """What is left for a visit."""

    @property
    def left(self) -> FloatArray:
        """(2,) shares left, of metres and of radians."""
        ...

    def fitted(self, moves: list[Move]) -> list[Move]:
        """The moves, scaled down together as far as needed."""
        ...

    def spend(self, motion: Motion) -> None:
        """Take off what was executed."""
        ...


class MotionBudget:
    """Metres and radians, each on its own.

    Args:
        metres: all objects' ways together, positive.
        radians: all objects' turns together, positive.
    """

    def __init__(self, metres: float, radians: float) -> None:
        self._whole = np.array([metres, radians])
        self._left = self._whole.copy()

    @property
    def left(self) -> FloatArray:
        """(2,) shares left, of metres and of radians."""
        left: FloatArray = self._left / self._whole
        return left

    def fitted(self, moves: list[Move]) -> list[Move]:
        """The moves with ways and turns each scaled down together as far as needed."""
        asked = np.array([_metres(moves), _radians(moves)])
        by_way, by_turn = np.minimum(1.0, self._left / np.maximum(asked, 1e-12))
        return [Move(move.index, by_way * move.displacement, float(by_turn * move.turn)) for move in moves]

    def spend(self, motion: Motion) -> None:
        """Take off what was executed."""
        self._left = np.maximum(self._left - [motion.metres, motion.radians], 0.0)


class EffortBudget:
    """One effort for both: metres as a share of the scene's diagonal, plus radians as a share of half a turn.

    Args:
        effort: all objects' efforts together, positive.
        diagonal: of the scene, metres.
    """

    def __init__(self, effort: float, diagonal: float) -> None:
        self._whole = self._left = effort
        self._diagonal = diagonal

    @property
    def left(self) -> FloatArray:
        """(2,) the share left, twice."""
        return np.full(2, self._left / self._whole)

    def fitted(self, moves: list[Move]) -> list[Move]:
        """The moves, ways and turns scaled down together as far as needed."""
        asked = Motion(_metres(moves), _radians(moves)).effort(self._diagonal)
        by = min(1.0, self._left / asked) if asked > 0 else 1.0
        return [Move(move.index, by * move.displacement, by * move.turn) for move in moves]

    def spend(self, motion: Motion) -> None:
        """Take off what was executed."""
        self._left = max(self._left - motion.effort(self._diagonal), 0.0)


def _metres(moves: list[Move]) -> float:
    return sum(float(np.linalg.norm(move.displacement)) for move in moves)


def _radians(moves: list[Move]) -> float:
    return sum(abs(move.turn) for move in moves)
