"""A player that plans a whole visit from the paper's cost: whole cycles change places."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from farm_ar.agents.players.planning import Step, best_plan, move_of
from farm_ar.arrays import IntArray
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import DisplacementAction, SlotAction
from farm_ar.envs.controls import MoveControl
from farm_ar.envs.jitter import unit_of
from farm_ar.envs.moves import Move
from farm_ar.envs.table import TableView
from farm_ar.errors import OptionError


class AnalyticPlayer:
    """Plans which objects are to be taken for which others, and plans again after every move.

    An object moved over half of the way to the place of another label of its kind is cheaper as that label
    (T3, T5), and whole cycles of them change places. A plan is made as if nothing were pushed; what was
    pushed is seen when the next one is made.

    Args:
        rng: not needed; every player is made with one.
        beam: how many unfinished plans are kept.
    """

    def __init__(self, rng: np.random.Generator | None = None, beam: int = 8) -> None:
        self._beam = beam

    def act(self, env: FarmToTableEnv) -> Any:
        """The first step of the best plan from here; leaving, or doing nothing, where there is none.

        Raises:
            OptionError: the hand is steered, or the player is a helper.
        """
        if not isinstance(env.control, MoveControl):
            raise OptionError("control", "must be move or layout for an analytic player", env.options.control)
        if env.options.sign != 1:
            raise OptionError("sign", "must be 1 for an analytic player", env.options.sign)
        kind = _KINDS[str(env.options.action)]
        plan = best_plan(env, self._beam, lambda move: kind.possible(env.view, move))
        return kind.action(env, plan)


def _slot(env: FarmToTableEnv, plan: list[Step]) -> IntArray:
    view, code = env.view, env.view.truth.category_code
    if not plan:
        return np.array([len(view.movable), 0, 0])
    step = plan[0]
    same = view.movable[code[view.movable] == code[step.mover]]
    slot = int(np.flatnonzero(same == step.label)[0])
    return np.array([_place(view, step.mover), slot, SlotAction.SHARES.index(step.share)])


def _displacement(env: FarmToTableEnv, plan: list[Step]) -> IntArray:
    view = env.view
    if not plan:
        return np.array([len(view.movable), 0, 0, 0])
    move = move_of(view, plan[0])
    return np.array([_place(view, move.index), *_nearest_levels(view, move)])


def _continuous(env: FarmToTableEnv, plan: list[Step]) -> npt.NDArray[np.float32]:
    if not plan:
        return _empty_pick(env)
    view, move = env.view, move_of(env.view, plan[0])
    pick = 2 * view.truth.position[move.index] / view.size - 1
    carry = move.displacement / (0.3 * unit_of(view.scene))
    values = np.array([*pick, *carry, move.turn / (np.pi / 2)], dtype=np.float32)
    return np.clip(values, -1.0, 1.0)


def _offsets(env: FarmToTableEnv, plan: list[Step]) -> npt.NDArray[np.float32]:
    """The whole plan at once."""
    view = env.view
    values = np.zeros((len(view.movable), 3), dtype=np.float32)
    for step in plan:
        move = move_of(view, step)
        values[_place(view, step.mover), :2] = move.displacement / (0.15 * unit_of(view.scene))
        values[_place(view, step.mover), 2] = move.turn / (np.pi / 4)
    return np.clip(values, -1.0, 1.0).reshape(-1)


def _empty_pick(env: FarmToTableEnv) -> npt.NDArray[np.float32]:
    """The continuous action that picks where nothing is: at the corner farthest from all objects."""
    corners = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
    places = (corners + 1) / 2 * np.asarray(env.view.size)
    away = np.linalg.norm(places[:, None] - env.view.truth.position, axis=-1).min(axis=1)
    return np.array([*corners[int(np.argmax(away))], 0.0, 0.0, 0.0], dtype=np.float32)


def _place(view: TableView, i: int) -> int:
    """How actions number object i."""
    return int(np.flatnonzero(view.movable == i)[0])


def _as_wanted(view: TableView, move: Move) -> Move:
    return move


def _nearest_levels(view: TableView, move: Move) -> tuple[int, int, int]:
    """The three levels that come nearest to a move."""
    levels, reach = DisplacementAction.LEVELS, 0.3 * unit_of(view.scene)
    x, z = (int(np.argmin(np.abs(reach * levels - metres))) for metres in move.displacement)
    return x, z, int(np.argmin(np.abs(np.pi / 2 * levels - move.turn)))


def _on_levels(view: TableView, move: Move) -> Move:
    x, z, yaw = DisplacementAction.LEVELS[list(_nearest_levels(view, move))]
    return Move(move.index, 0.3 * unit_of(view.scene) * np.array([x, z]), float(np.pi / 2 * yaw))


def _within_offsets(view: TableView, move: Move) -> Move:
    reach = 0.15 * unit_of(view.scene)
    turn = float(np.clip(move.turn, -np.pi / 4, np.pi / 4))
    return Move(move.index, np.clip(move.displacement, -reach, reach), turn)


class _Kind(NamedTuple):
    """How a kind of action carries out a plan, and which moves it can ask for."""

    action: Callable[[FarmToTableEnv, list[Step]], Any]
    possible: Callable[[TableView, Move], Move]


_KINDS = {
    "slot": _Kind(_slot, _as_wanted),
    "displacement": _Kind(_displacement, _on_levels),
    "continuous": _Kind(_continuous, _as_wanted),
    "offsets": _Kind(_offsets, _within_offsets),
}
