"""From moves that a policy means to make to the action that an environment understands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import DisplacementAction, Move, SlotAction
from farm_ar.envs.controls import MoveControl
from farm_ar.envs.generator import unit_of
from farm_ar.envs.table import TableView
from farm_ar.errors import OptionError
from farm_ar.geometry import wrap


def action_of(env: FarmToTableEnv, moves: Sequence[Move]) -> Any:
    """The action that makes the first of the moves, or all where a visit is one action; leaving without any.

    Args:
        env: an environment in an episode.
        moves: what is meant to be done, of movable objects.

    Raises:
        OptionError: the hand is steered.
    """
    _require_moves(env)
    return _ACTIONS[str(env.config.action)](env.view, moves)


def possible(env: FarmToTableEnv, move: Move) -> Move:
    """The move that an action can ask for in place of the one wanted, whatever is left of the budget.

    Raises:
        OptionError: the hand is steered.
    """
    _require_moves(env)
    return _POSSIBLE[str(env.config.action)](env.view, move)


def moves_left(env: FarmToTableEnv) -> int:
    """How many objects a policy can still move in the visit.

    Raises:
        OptionError: the hand is steered.
    """
    control = _require_moves(env)
    return control.moves_left if env.config.control == "move" else len(env.view.movable)


def _require_moves(env: FarmToTableEnv) -> MoveControl:
    if not isinstance(env.control, MoveControl):
        raise OptionError("control", "must be move or layout for a policy that plans", env.config.control)
    return env.control


def _slot(view: TableView, moves: Sequence[Move]) -> IntArray:
    if not moves:
        return np.array([len(view.movable), 0, 0])
    i = moves[0].index
    slot, share = _nearest_slot(view, moves[0])
    return np.array([_place(view, i), slot, share])


def _nearest_slot(view: TableView, move: Move) -> tuple[int, int]:
    """The label, among those of its kind, and the share of the way that come nearest to a move."""
    code = view.truth.category_code
    same = view.movable[code[view.movable] == code[move.index]]
    shift, turn = _ways(view, move.index, same)
    share = np.array(SlotAction.SHARES)
    away = np.linalg.norm(share[:, None] * shift[:, None] - move.displacement, axis=-1) / view.scene.diagonal
    turned = np.abs(np.sin((share * turn[:, None] - move.turn) / 2))
    slot, which = np.unravel_index(int(np.argmin(away + turned)), away.shape)
    return int(slot), int(which)


def _ways(view: TableView, i: int, labels: IntArray) -> tuple[FloatArray, FloatArray]:
    """(L, 2) shifts and (L,) turns that take object i to the places of labels."""
    shift: FloatArray = view.believed.position[labels] - view.truth.position[i]
    return shift, wrap(view.believed.yaw[labels] - view.truth.yaw[i])


def _on_slot(view: TableView, move: Move) -> Move:
    code = view.truth.category_code
    same = view.movable[code[view.movable] == code[move.index]]
    slot, which = _nearest_slot(view, move)
    shift, turn = _ways(view, move.index, same)
    share = SlotAction.SHARES[which]
    return Move(move.index, share * shift[slot], float(share * turn[slot]))


def _displacement(view: TableView, moves: Sequence[Move]) -> IntArray:
    if not moves:
        return np.array([len(view.movable), 0, 0, 0])
    return np.array([_place(view, moves[0].index), *_nearest_levels(view, moves[0])])


def _nearest_levels(view: TableView, move: Move) -> tuple[int, int, int]:
    """The three levels that come nearest to a move."""
    levels, reach = DisplacementAction.LEVELS, 0.3 * unit_of(view.scene)
    x, z = (int(np.argmin(np.abs(reach * levels - metres))) for metres in move.displacement)
    return x, z, int(np.argmin(np.abs(np.pi / 2 * levels - move.turn)))


def _on_levels(view: TableView, move: Move) -> Move:
    x, z, yaw = DisplacementAction.LEVELS[list(_nearest_levels(view, move))]
    return Move(move.index, 0.3 * unit_of(view.scene) * np.array([x, z]), float(np.pi / 2 * yaw))


def _continuous(view: TableView, moves: Sequence[Move]) -> npt.NDArray[np.float32]:
    if not moves:
        return _empty_pick(view)
    move = moves[0]
    pick = 2 * view.truth.position[move.index] / view.size - 1
    carry = move.displacement / (0.3 * unit_of(view.scene))
    values = np.array([*pick, *carry, move.turn / (np.pi / 2)], dtype=np.float32)
    return np.clip(values, -1.0, 1.0)


def _empty_pick(view: TableView) -> npt.NDArray[np.float32]:
    """The action that picks where nothing is: at the corner farthest from all objects."""
    corners = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
    places = (corners + 1) / 2 * np.asarray(view.size)
    away = np.linalg.norm(places[:, None] - view.truth.position, axis=-1).min(axis=1)
    return np.array([*corners[int(np.argmax(away))], 0.0, 0.0, 0.0], dtype=np.float32)


def _offsets(view: TableView, moves: Sequence[Move]) -> npt.NDArray[np.float32]:
    values = np.zeros((len(view.movable), 3), dtype=np.float32)
    for move in moves:
        values[_place(view, move.index), :2] = move.displacement / (0.15 * unit_of(view.scene))
        values[_place(view, move.index), 2] = move.turn / (np.pi / 4)
    return np.clip(values, -1.0, 1.0).reshape(-1)


def _within(metres: float, radians: float) -> Callable[[TableView, Move], Move]:
    """Clips what a farm's action reaches: so many metres in x and z, so many radians."""

    def clipped(view: TableView, move: Move) -> Move:
        reach = metres * unit_of(view.scene)
        turn = float(np.clip(move.turn, -radians, radians))
        return Move(move.index, np.clip(move.displacement, -reach, reach), turn)

    return clipped


def _place(view: TableView, i: int) -> int:
    """How actions number object i."""
    return int(np.flatnonzero(view.movable == i)[0])


_ACTIONS: dict[str, Callable[[TableView, Sequence[Move]], Any]] = {
    "slot": _slot,
    "displacement": _displacement,
    "continuous": _continuous,
    "offsets": _offsets,
}
_POSSIBLE: dict[str, Callable[[TableView, Move], Move]] = {
    "slot": _on_slot,
    "displacement": _on_levels,
    "continuous": _within(0.3, float(np.pi / 2)),
    "offsets": _within(0.15, float(np.pi / 4)),
}
