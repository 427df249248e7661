"""Actions that ask for moves of single objects, or of all at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.actions.base import Move, MoveAction
from farm_ar.envs.table import TableView
from farm_ar.geometry import wrap


class DisplacementAction(MoveAction):
    """Which building, or the turn's end; then seven levels each of x, z (+- 0.3 m), yaw (+- 90 degrees)."""

    reach_m, reach_rad, levels = 0.3, float(np.pi / 2), 7
    LEVELS = np.linspace(-1.0, 1.0, levels)

    def __init__(self, movable: int, kinds: int, unit_m: float) -> None:
        self.space = spaces.MultiDiscrete([movable + 1, 7, 7, 7])
        self._end, self._reach = movable, self.reach_m * unit_m

    def decode(self, action: Any, view: TableView) -> list[Move] | None:
        """The move that the action asks for, before the budget; None to end the turn."""
        which, x, z, yaw = (int(v) for v in action)
        if which == self._end:
            return None
        return [self._move(int(view.movable[which]), x, z, yaw)]

    def encode(self, moves: Sequence[Move], view: TableView) -> IntArray:
        """(4,) the levels that come nearest to the first move; the end of the turn without any."""
        if not moves:
            return np.array([self._end, 0, 0, 0])
        return np.array([view.number(moves[0].index), *self._nearest(moves[0])])

    def possible(self, move: Move, view: TableView) -> Move:
        """The move of the nearest levels."""
        return self._move(move.index, *self._nearest(move))

    def mask(self, view: TableView) -> BoolArray:
        """Buildings in view, the end of the turn, and all of the levels."""
        return _mask(view, 3 * self.levels)

    def mirror(self, action: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """(..., 4) the other way along x and round."""
        turned = action.copy()
        turned[..., [1, 3]] = self.levels - 1 - action[..., [1, 3]]
        return np.where(action[..., :1] == self._end, action, turned)

    def _move(self, index: int, x: int, z: int, yaw: int) -> Move:
        turn = float(self.reach_rad * self.LEVELS[yaw])
        return Move(index, self._reach * self.LEVELS[[x, z]], turn)

    def _nearest(self, move: Move) -> tuple[int, int, int]:
        x, z = (int(np.argmin(np.abs(self._reach * self.LEVELS - metres))) for metres in move.displacement)
        return x, z, int(np.argmin(np.abs(self.reach_rad * self.LEVELS - move.turn)))


class SlotAction(MoveAction):
    """Building i towards the believed place of the j-th label of its kind, by .55, .8 or all of the way."""

    SHARES = (0.55, 0.8, 1.0)

    def __init__(self, movable: int, kinds: int, unit_m: float) -> None:
        self._end, self._slots = movable, kinds
        self.space = spaces.MultiDiscrete([movable + 1, kinds, len(self.SHARES)])

    def decode(self, action: Any, view: TableView) -> list[Move] | None:
        """The move that the action asks for, before the budget; None to end the turn."""
        which, slot, share = (int(v) for v in action)
        if which == self._end:
            return None
        index = int(view.movable[which])
        return [self._move(index, slot % len(self._labels(index, view)), share, view)]

    def encode(self, moves: Sequence[Move], view: TableView) -> IntArray:
        """(3,) the label and share that come nearest to the first move; without any the end of the turn."""
        if not moves:
            return np.array([self._end, 0, 0])
        return np.array([view.number(moves[0].index), *self._nearest(moves[0], view)])

    def possible(self, move: Move, view: TableView) -> Move:
        """The move of the nearest label and share."""
        return self._move(move.index, *self._nearest(move, view), view)

    def mask(self, view: TableView) -> BoolArray:
        """Buildings in view, the end of the turn, and all labels and shares."""
        return _mask(view, self._slots + len(self.SHARES))

    def mirror(self, action: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """(..., 3) the same: labels keep their numbers."""
        return action

    def _labels(self, index: int, view: TableView) -> IntArray:
        """The labels of an object's kind that move."""
        code = view.truth.category_code
        labels: IntArray = view.movable[code[view.movable] == code[index]]
        return labels

    def _ways(self, index: int, view: TableView) -> tuple[FloatArray, FloatArray]:
        """(K, 2) shifts and (K,) turns that take an object to the places of the labels of its kind."""
        labels = self._labels(index, view)
        shift: FloatArray = view.believed.position[labels] - view.truth.position[index]
        return shift, wrap(view.believed.yaw[labels] - view.truth.yaw[index])

    def _move(self, index: int, slot: int, share: int, view: TableView) -> Move:
        shift, turn = self._ways(index, view)
        return Move(index, self.SHARES[share] * shift[slot], self.SHARES[share] * float(turn[slot]))

    def _nearest(self, move: Move, view: TableView) -> tuple[int, int]:
        shift, turn = self._ways(move.index, view)
        share = np.array(self.SHARES)
        away = np.linalg.norm(share[:, None] * shift[:, None] - move.displacement, axis=-1)
        turned = np.abs(np.sin((share * turn[:, None] - move.turn) / 2))
        slot, which = np.unravel_index(int(np.argmin(away / view.scene.diagonal + turned)), away.shape)
        return int(slot), int(which)


class ContinuousAction(MoveAction):
    """Where to pick (x, z over the table), how far to carry (+- 0.3 m), how far to twist (+- 90 degrees)."""

    reach_m, reach_rad = 0.3, float(np.pi / 2)
    PICK_M = 0.06
    """A pick farther than this from any building in view takes nothing, and ends the turn."""

    def __init__(self, movable: int, kinds: int, unit_m: float) -> None:
        self.space = spaces.Box(-1.0, 1.0, (5,), np.float32)
        self._reach, self._pick = self.reach_m * unit_m, self.PICK_M * unit_m

    def decode(self, action: Any, view: TableView) -> list[Move] | None:
        """The move that the action asks for, before the budget; None to end the turn."""
        values = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        index = view.nearest_movable((values[:2] + 1) / 2 * np.asarray(view.size), self._pick)
        if index is None:
            return None
        return [Move(index, self._reach * values[2:4], float(self.reach_rad * values[4]))]

    def encode(self, moves: Sequence[Move], view: TableView) -> npt.NDArray[np.float32]:
        """(5,) the first move as far as it reaches; without any a pick at the corner farthest from all."""
        if not moves:
            corners = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
            places = (corners + 1) / 2 * np.asarray(view.size)
            away = np.linalg.norm(places[:, None] - view.truth.position, axis=-1).min(axis=1)
            return np.array([*corners[int(np.argmax(away))], 0.0, 0.0, 0.0], dtype=np.float32)
        move = moves[0]
        pick = 2 * view.truth.position[move.index] / view.size - 1
        carry = move.displacement / self._reach
        values = np.array([*pick, *carry, move.turn / self.reach_rad], dtype=np.float32)
        return np.clip(values, -1.0, 1.0)

    def possible(self, move: Move, view: TableView) -> Move:
        """The move as far as it reaches."""
        return _clipped(move, self._reach, self.reach_rad)

    def mirror(self, action: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """(..., 5) x, the way along it and the turn have the other sign."""
        turned: npt.NDArray[Any] = action * np.array([-1, 1, -1, 1, -1], dtype=action.dtype)
        return turned


class OffsetsAction(MoveAction):
    """A whole visit: for each object x, z (+- 0.15 m) and yaw (+- 45 degrees)."""

    reach_m, reach_rad = 0.15, float(np.pi / 4)

    def __init__(self, movable: int, kinds: int, unit_m: float) -> None:
        self.space = spaces.Box(-1.0, 1.0, (3 * movable,), np.float32)
        self._reach = self.reach_m * unit_m

    def decode(self, action: Any, view: TableView) -> list[Move]:
        """The moves that the action asks for, before the budget."""
        values = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0).reshape(-1, 3)
        return [
            Move(int(index), self._reach * row[:2], float(self.reach_rad * row[2]))
            for index, row in zip(view.movable, values, strict=True)
            if view.in_view[index] and np.any(row != 0)
        ]

    def encode(self, moves: Sequence[Move], view: TableView) -> npt.NDArray[np.float32]:
        """(3 N,) all of the moves, each as far as it reaches."""
        values = np.zeros((len(view.movable), 3), dtype=np.float32)
        for move in moves:
            row = values[view.number(move.index)]
            row[:2], row[2] = move.displacement / self._reach, move.turn / self.reach_rad
        return np.clip(values, -1.0, 1.0).reshape(-1)

    def possible(self, move: Move, view: TableView) -> Move:
        """The move as far as it reaches."""
        return _clipped(move, self._reach, self.reach_rad)

    def mirror(self, action: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """(..., 3 N) ways along x and turns have the other sign."""
        signs = np.array([-1, 1, -1], dtype=action.dtype)
        turned: npt.NDArray[Any] = action.reshape(*action.shape[:-1], -1, 3) * signs
        return turned.reshape(action.shape)


def _clipped(move: Move, reach_m: float, reach_rad: float) -> Move:
    turn = float(np.clip(move.turn, -reach_rad, reach_rad))
    return Move(move.index, np.clip(move.displacement, -reach_m, reach_m), turn)


def _mask(view: TableView, others: int) -> BoolArray:
    pick = view.in_view[view.movable]
    return np.concatenate([pick, np.ones(1 + others, dtype=np.bool_)])
