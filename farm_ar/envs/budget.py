"""What a visit may cost: exceeding it scales a move down, it is not rejected."""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from operator import add
from typing import Protocol

from farm_ar.envs.actions import Move
from farm_ar.envs.config import EnvConfig
from farm_ar.game_logic.physics.limits import Motion
from farm_ar.game_logic.physics.tabletop import MotionLimit
from farm_ar.geometry.rectangles import length


class Budget(Protocol):
    """What is left for a visit."""

    @property
    def left(self) -> tuple[float, float]:
        """Shares left, of metres and of radians."""
        ...

    @property
    def most(self) -> MotionLimit:
        """What the buildings may still be moved by."""
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

    Attributes:
        left: shares left, of metres and of radians.
    """

    def __init__(self, metres: float, radians: float) -> None:
        self._metres = self._all_metres = metres
        self._radians = self._all_radians = radians
        self.left = 1.0, 1.0

    @property
    def most(self) -> MotionLimit:
        """What the buildings may still be moved by."""
        return MotionLimit(self._metres, self._radians)

    def fitted(self, moves: list[Move]) -> list[Move]:
        """The moves with ways and turns each scaled down together as far as needed."""
        by_way, by_turn = _share(self._metres, _metres(moves)), _share(self._radians, _radians(moves))
        return [Move(move.index, by_way * move.displacement, by_turn * move.turn) for move in moves]

    def spend(self, motion: Motion) -> None:
        """Take off what was executed."""
        self._metres = max(self._metres - motion.metres, 0.0)
        self._radians = max(self._radians - motion.radians, 0.0)
        self.left = self._metres / self._all_metres, self._radians / self._all_radians


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
    def left(self) -> tuple[float, float]:
        """The share left, twice."""
        return self._left / self._whole, self._left / self._whole

    @property
    def most(self) -> MotionLimit:
        """What the buildings may still be moved by."""
        return MotionLimit(effort=self._left, diagonal=self._diagonal)

    def fitted(self, moves: list[Move]) -> list[Move]:
        """The moves, ways and turns scaled down together as far as needed."""
        by = _share(self._left, Motion(_metres(moves), _radians(moves)).effort(self._diagonal))
        return [Move(move.index, by * move.displacement, by * move.turn) for move in moves]

    def spend(self, motion: Motion) -> None:
        """Take off what was executed."""
        self._left = max(self._left - motion.effort(self._diagonal), 0.0)


def budget_of(config: EnvConfig, diagonal: float) -> Budget:
    """A visit's whole budget."""
    if config.budget is None:
        return MotionBudget(config.budget_m, config.budget_rad)
    return EffortBudget(config.budget, diagonal)


def _share(left: float, asked: float) -> float:
    return left / asked if asked > left else 1.0


def _metres(moves: list[Move]) -> float:
    return in_turn(length(*move.displacement.tolist()) for move in moves)


def _radians(moves: list[Move]) -> float:
    return in_turn(abs(move.turn) for move in moves)


def in_turn(values: Iterable[float]) -> float:
    """The sum, added up one after the other; `sum` does not from Python 3.12 on."""
    return reduce(add, values, 0.0)
