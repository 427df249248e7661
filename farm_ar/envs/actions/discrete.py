"""Moves as the choices of one number, for learners that know no other actions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.actions.base import Move
from farm_ar.envs.actions.moves import SlotAction
from farm_ar.envs.table import TableView


class DiscreteAction(SlotAction):
    """The choices of `slot`, numbered: (object x K + label) x 3 + share; the last one ends the turn."""

    def __init__(self, movable: int, kinds: int, unit_m: float) -> None:
        super().__init__(movable, kinds, unit_m)
        self._shape = movable, kinds, len(self.SHARES)
        self._last = int(np.prod(self._shape))
        self.space = spaces.Discrete(self._last + 1)

    def decode(self, action: Any, view: TableView) -> list[Move] | None:
        """The move that the action asks for, before the budget; None to end the turn."""
        number = int(action)
        return None if number == self._last else super().decode(np.unravel_index(number, self._shape), view)

    def encode(self, moves: Sequence[Move], view: TableView) -> npt.NDArray[np.int64]:
        """() the label and share that come nearest to the first move; without any the end of the turn."""
        if not moves:
            return np.array(self._last)
        return np.array(np.ravel_multi_index(tuple(super().encode(moves, view)), self._shape))

    def mask(self, view: TableView) -> BoolArray:
        """What is in view, towards a label's place where it does not stand; the end of the turn."""
        number, known = self._labels_of_all(view)
        truth, believed, mover, label = view.truth, view.believed, view.movable[:, None], view.movable[number]
        there = (believed.position[label] == truth.position[mover]).all(axis=-1)
        there &= believed.yaw[label] == truth.yaw[mover]
        return self._flat(known & view.in_view[mover] & ~there)

    def _labels_of_all(self, view: TableView) -> tuple[IntArray, BoolArray]:
        """(N, K) how actions number the labels of each object's kind, and whether there are so many."""
        code = view.truth.category_code[view.movable]  # sorted, as objects are met kind by kind
        slot = np.searchsorted(code, code)[:, None] + np.arange(self._shape[1])
        known = slot < np.searchsorted(code, code, side="right")[:, None]
        return np.where(known, slot, 0), known

    def _flat(self, useful: BoolArray) -> BoolArray:
        """The mask of an (N, K) choice of object and label."""
        return np.append(np.repeat(useful, self._shape[2]), True)


class ExchangeAction(DiscreteAction):
    """A visit in which two objects of a kind change places: the object of `discrete`, and the label's own.

    Each goes the same share of its way, the object first; of one out of view only the other moves. The last
    choice moves nothing.
    """

    def decode(self, action: Any, view: TableView) -> list[Move]:
        """The moves that the action asks for, before the budget."""
        number = int(action)
        if number == self._last:
            return []
        which, slot, share = (int(v) for v in np.unravel_index(number, self._shape))
        index = int(view.movable[which])
        labels = self._labels(index, view)
        other = int(labels[slot % len(labels)])
        back = int(np.flatnonzero(labels == index)[0])
        there = self._move(index, slot % len(labels), share, view)
        return [there] if other == index else [there, self._move(other, back, share, view)]

    def encode(self, moves: Sequence[Move], view: TableView) -> npt.NDArray[np.int64]:
        """() the exchange that comes nearest to what all of the moves together do; nothing without any."""
        asked = np.zeros((len(view.truth), 3))
        for move in moves:
            asked[move.index] = self._scaled(move, view)
        best, least = self._last, 0.0
        for choice in np.flatnonzero(self.mask(view)[:-1]) if moves else ():
            done = {move.index: self._scaled(move, view) for move in self.decode(choice, view)}
            off = sum(
                float(np.abs(way - asked[index]).sum() - np.abs(asked[index]).sum())
                for index, way in done.items()
                if view.in_view[index]
            )
            if off < least:
                best, least = int(choice), off
        return np.array(best)

    def mask(self, view: TableView) -> BoolArray:
        """Objects in view and labels of others of their kind, each pair in view once; and nothing at all."""
        label, known = self._labels_of_all(view)
        seen, number = view.in_view[view.movable], np.arange(len(view.movable))[:, None]
        return self._flat(known & seen[:, None] & (number != label) & ((number < label) | ~seen[label]))

    @staticmethod
    def _scaled(move: Move, view: TableView) -> FloatArray:
        """(3,) a move's share of the diagonal along x and z, and of half a turn."""
        return np.array([*(move.displacement / view.scene.diagonal), move.turn / np.pi])
