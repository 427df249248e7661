"""From moves that a policy means to make to the action that an environment understands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import Move
from farm_ar.envs.controls import MoveControl
from farm_ar.errors import OptionError


def action_of(env: FarmToTableEnv, moves: Sequence[Move]) -> Any:
    """The action that makes the first of the moves, or all where a visit is one action; leaving without any.

    Args:
        env: an environment in an episode.
        moves: what is meant to be done, of movable objects.

    Raises:
        OptionError: the hand is steered.
    """
    return _require_moves(env).action.encode(moves, env.view)


def possible(env: FarmToTableEnv, move: Move) -> Move:
    """The move that an action can ask for in place of the one wanted, whatever is left of the budget.

    Raises:
        OptionError: the hand is steered.
    """
    return _require_moves(env).action.possible(move, env.view)


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
