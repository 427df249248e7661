"""The actions, by name: from what an agent says to what the hand does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from gymnasium.error import InvalidAction

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.envs.table import TableView
from farm_ar.errors import LONGEST_VALUE
from farm_ar.geometry import wrap


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


_SINGLE = np.dtype(np.float32)

REACH_M = 0.06
"""A pick farther than this from any building takes nothing."""


class MoveAction(Protocol):
    """An action that says what to pick and where to place it, or to leave."""

    space: spaces.Space[Any]

    def moves(self, action: Any, view: TableView) -> list[Move] | None:
        """The moves that the action asks for, before the budget; None for leaving the view."""
        ...

    def mask(self, view: TableView) -> BoolArray | None:
        """Which choices are allowed, flat over the dimensions; None where nothing can be masked."""
        ...


class DisplacementAction:
    """Which building, or leave; then seven levels each of x, z (+- 0.3 m) and yaw (+- 90 degrees)."""

    LEVELS = np.linspace(-1.0, 1.0, 7)

    def __init__(self, movable: int, kinds: int, unit_m: float) -> None:
        self.space: spaces.Space[Any] = spaces.MultiDiscrete([movable + 1, 7, 7, 7])
        self._reach = 0.3 * unit_m

    def moves(self, action: Any, view: TableView) -> list[Move] | None:
        """The moves that the action asks for, before the budget."""
        which, x, z, yaw = (int(v) for v in action)
        if which == len(view.movable):
            return None
        shift = self._reach * self.LEVELS[[x, z]]
        return [Move(int(view.movable[which]), shift, float(np.pi / 2 * self.LEVELS[yaw]))]

    def mask(self, view: TableView) -> BoolArray:
        """Buildings in view, leaving, and all of the levels."""
        return _mask(view, 21)


class SlotAction:
    """Building i towards the believed place of the j-th label of its kind, by .55, .8 or all of the way."""

    SHARES = (0.55, 0.8, 1.0)

    def __init__(self, movable: int, kinds: int, unit_m: float) -> None:
        self._slots = kinds
        self.space: spaces.Space[Any] = spaces.MultiDiscrete([movable + 1, kinds, len(self.SHARES)])

    def moves(self, action: Any, view: TableView) -> list[Move] | None:
        """The moves that the action asks for, before the budget."""
        which, slot, share = (int(v) for v in action)
        if which == len(view.movable):
            return None
        index = int(view.movable[which])
        same = view.movable[view.truth.category_code[view.movable] == view.truth.category_code[index]]
        home = int(same[slot % len(same)])
        shift = view.believed.position[home] - view.truth.position[index]
        turn = float(wrap(view.believed.yaw[home] - view.truth.yaw[index]))
        return [Move(index, self.SHARES[share] * shift, self.SHARES[share] * turn)]

    def mask(self, view: TableView) -> BoolArray:
        """Buildings in view, leaving, and all of the levels."""
        return _mask(view, self._slots + len(self.SHARES))


class ContinuousAction:
    """Where to pick (x, z over the table), how far to carry (+- 0.3 m), how far to twist (+- 90 degrees)."""

    def __init__(self, movable: int, kinds: int, unit_m: float) -> None:
        self.space: spaces.Space[Any] = spaces.Box(-1.0, 1.0, (5,), np.float32)
        self._unit = unit_m

    def moves(self, action: Any, view: TableView) -> list[Move] | None:
        """The moves that the action asks for, before the budget."""
        values = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        point = (values[:2] + 1) / 2 * np.asarray(view.size)
        index = view.nearest_movable(point, REACH_M * self._unit)
        if index is None:
            return None
        return [Move(index, 0.3 * self._unit * values[2:4], float(np.pi / 2 * values[4]))]

    def mask(self, view: TableView) -> None:
        """Nothing can be masked."""


class OffsetsAction:
    """A whole visit: for each object x, z (+- 0.15 m) and yaw (+- 45 degrees)."""

    def __init__(self, movable: int, kinds: int, unit_m: float) -> None:
        self.space: spaces.Space[Any] = spaces.Box(-1.0, 1.0, (3 * movable,), np.float32)
        self._unit = unit_m

    def moves(self, action: Any, view: TableView) -> list[Move]:
        """The moves that the action asks for, before the budget."""
        values = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0).reshape(-1, 3)
        return [
            Move(int(index), 0.15 * self._unit * row[:2], float(np.pi / 4 * row[2]))
            for index, row in zip(view.movable, values, strict=True)
            if view.in_view[index] and np.any(row != 0)
        ]

    def mask(self, view: TableView) -> None:
        """Nothing can be masked."""


ACTIONS: dict[str, Callable[[int, int, float], MoveAction]] = {
    "displacement": DisplacementAction,
    "slot": SlotAction,
    "continuous": ContinuousAction,
    "offsets": OffsetsAction,
}
"""The actions by name; made from the number of objects, the most of one kind, and the scene's unit."""


def checked_action(action: Any, space: spaces.Space[Any]) -> list[Any]:
    """The action as a list of numbers, if it can be carried out; those beyond a `Box` can, they are clipped.

    Raises:
        gymnasium.error.InvalidAction: it has the wrong shape, is not finite, or is no choice that there is.
    """
    # What agents send most, checked without the detours: no finite numbers have a sum that is not.
    plain = type(action) is np.ndarray and action.dtype is _SINGLE and type(space) is spaces.Box
    if plain and action.ndim == 1 and action.shape == space.shape:
        numbers: list[Any] = action.tolist()
        if isfinite(sum(numbers)):
            return numbers
    whole = isinstance(space, spaces.MultiDiscrete)
    try:
        given = np.asarray(action)
        right = given.shape == space.shape and given.dtype.kind in ("iu" if whole else "biuf")
        with np.errstate(over="ignore"):  # of a longer float
            values = given.astype(np.int64 if whole else np.float64) if right else given
        right = right and bool(np.isfinite(values).all())
    except (TypeError, ValueError, OverflowError):
        right = False
    if right and isinstance(space, spaces.MultiDiscrete):
        right = bool(((given >= 0) & (given < space.nvec)).all())
    if not right:
        raise InvalidAction(f"action: must be in {space}, got {_shown(action)}")
    listed: list[Any] = values.tolist()
    return listed


def _shown(action: Any) -> str:
    """The beginning of what was given, on one line."""
    shown = " ".join(repr(action).split())
    return shown if len(shown) <= LONGEST_VALUE else f"{shown[:LONGEST_VALUE]} ..."


def _mask(view: TableView, others: int) -> BoolArray:
    pick = view.in_view[view.movable]
    return np.concatenate([pick, np.ones(1 + others, dtype=np.bool_)])
