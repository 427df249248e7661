"""What an action is: from what an agent says to what the hand does."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.error import InvalidAction

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.envs.table import TableView
from farm_ar.errors import LONGEST_VALUE


@dataclass(frozen=True, eq=False)
class Move:
    """One pick-and-place.

    Args:
        index: the object, as the layout numbers them.
        displacement: (2,) metres in x and z.
        turn: radians, clockwise.
    """

    index: int
    displacement: FloatArray
    turn: float


class Action(ABC):
    """What an agent says: its space, what it means, and all else that depends on how it is encoded.

    Attributes:
        space: its Gymnasium space.
    """

    space: spaces.Space[Any]

    @abstractmethod
    def mirror(self, action: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """(..., D) what does to the table's mirror image, x turned round, what actions do to the table."""


class MoveAction(Action):
    """An action that says which objects to pick and where to place them, or to end the turn.

    Args:
        movable: N, how many objects can be moved.
        kinds: how many of these are of one kind at most.
        unit_m: how much larger the scene is than the farm's table, by diagonal.

    Attributes:
        reach_m: the farthest that it carries along x and along z, metres on the farm's table.
        reach_rad: the farthest that it turns, radians.
        levels: how many levels lie between the two ends of either reach; 0 where all values are possible.
    """

    reach_m: ClassVar[float] = np.inf
    reach_rad: ClassVar[float] = np.inf
    levels: ClassVar[int] = 0

    @abstractmethod
    def __init__(self, movable: int, kinds: int, unit_m: float) -> None: ...

    @abstractmethod
    def decode(self, action: Any, view: TableView) -> list[Move] | None:
        """The moves that the action asks for, before the budget; None to end the turn."""

    @abstractmethod
    def encode(self, moves: Sequence[Move], view: TableView) -> npt.NDArray[Any]:
        """(D,) makes the first of the moves, or all if it can; without any it ends the turn."""

    @abstractmethod
    def possible(self, move: Move, view: TableView) -> Move:
        """The move that an action can ask for in place of the one wanted, whatever is left of the budget."""

    def mask(self, view: TableView) -> BoolArray | None:
        """Which choices make sense, flat over the dimensions; None where nothing can be masked."""
        return None


class HandAction(Action):
    """An action that steers the hand, and closes or opens it."""

    @abstractmethod
    def decode(self, action: Any) -> tuple[float, float, float, bool]:
        """Velocity along x and z, metres a second; twist, radians a second; whether the hand is closed."""

    def mask(self, holds: bool) -> BoolArray | None:
        """Which choices make sense of a hand that holds something or nothing; None where all do."""
        return None


_SINGLE = np.dtype(np.float32)


def checked_action(action: Any, space: spaces.Space[Any]) -> Any:
    """The action as a list of numbers, if it is valid; numbers beyond a `Box` are valid, they are clipped.

    An action of a `Discrete` space is a number alone.

    Raises:
        gymnasium.error.InvalidAction: it has the wrong shape, is not finite, or is no choice that there is.
    """
    # What agents send most, checked without the detours: no finite numbers have a sum that is not.
    plain = type(action) is np.ndarray and action.dtype is _SINGLE and type(space) is spaces.Box
    if plain and action.ndim == 1 and action.shape == space.shape:
        numbers: list[Any] = action.tolist()
        if isfinite(sum(numbers)):
            return numbers
    whole = isinstance(space, spaces.MultiDiscrete | spaces.Discrete)
    try:
        given = np.asarray(action)
        right = given.shape == space.shape and given.dtype.kind in ("iu" if whole else "biuf")
        with np.errstate(over="ignore"):  # of a longer float
            values = given.astype(np.int64 if whole else np.float64) if right else given
        right = right and bool(np.isfinite(values).all())
    except (TypeError, ValueError, OverflowError):
        right = False
    if right and isinstance(space, spaces.MultiDiscrete | spaces.Discrete):
        choices = space.nvec if isinstance(space, spaces.MultiDiscrete) else space.n
        right = bool(((given >= 0) & (given < choices)).all())
    if not right:
        raise InvalidAction(f"action: must be in {space}, got {_shown(action)}")
    return values.tolist()


def _shown(action: Any) -> str:
    """The beginning of what was given, on one line."""
    shown = " ".join(repr(action).split())
    return shown if len(shown) <= LONGEST_VALUE else f"{shown[:LONGEST_VALUE]} ..."
