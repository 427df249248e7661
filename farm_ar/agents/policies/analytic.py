"""A policy that plans a whole turn from the paper's cost: whole cycles change places."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from farm_ar.agents.policies.base import Policy, action_of, moves_left
from farm_ar.agents.policies.beam_search import search
from farm_ar.agents.policies.plan_steps import SHARES, Allowance, Table, Terms
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import LAYOUT_ACTIONS, MOVE_ACTIONS, Move
from farm_ar.envs.generator import unit_of
from farm_ar.envs.table import TableView
from farm_ar.errors import OptionError
from farm_ar.game_logic.visibility import eyes_of
from farm_ar.geometry import wrap
from farm_ar.scenes import Scene


class Step(NamedTuple):
    """Object `mover` goes `share` of its way to the place of `label`."""

    mover: int
    label: int
    share: float


def best_plan(env: FarmToTableEnv, beam: int) -> list[Step]:
    """The plan after which the paper's method would give most wrong labels, less the price of the effort.

    Every object is moved once at most, over half of the way to the place of a label of its kind or farther
    (T3, T5), on a way that is clear, and within the budget.

    Args:
        env: an environment in an episode.
        beam: how many unfinished plans are kept.

    Raises:
        OptionError: the hand is steered.
    """
    moves = moves_left(env)
    terms = terms_of(env.view.scene, str(env.config.action), env.config.effort_weight)
    return plan_of(env, moves, terms, beam)


def plan_of(env: FarmToTableEnv, moves: int, terms: Terms, beam: int) -> list[Step]:
    """The same with so many moves at most, whatever the control.

    Args:
        env: an environment in an episode.
        moves: how many objects are moved at most.
        terms: what objects cost, and how far an object can be moved.
        beam: how many unfinished plans are kept.
    """
    most, scene, m = env.budget.most, env.view.scene, len(env.view.truth)
    allowed = Allowance(most.metres, most.radians, most.effort, scene.diagonal, moves)
    steps, worth = np.zeros((moves, 3), dtype=np.int64), np.empty((m, m, len(SHARES)))
    count = search(_table(env), eyes_of(env.view.camera), terms, allowed, beam, steps, worth)
    return [Step(int(i), int(j), float(SHARES[share])) for i, j, share in steps[:count]]


def move_of(view: TableView, step: Step) -> Move:
    """The move that a step means, from where its object stands now."""
    shift = view.believed.position[step.label] - view.truth.position[step.mover]
    turn = float(wrap(view.believed.yaw[step.label] - view.truth.yaw[step.mover]))
    return Move(step.mover, step.share * shift, step.share * turn)


def terms_of(scene: Scene, action: str, effort_weight: float) -> Terms:
    """What objects cost on a scene, and what an action of that name can do.

    Args:
        scene: the room.
        action: by name.
        effort_weight: price of a unit of effort beside a wrong label.
    """
    weights, can = scene.cost_weights, {**LAYOUT_ACTIONS, **MOVE_ACTIONS}[action]
    return Terms(
        weights.translation / scene.diagonal,
        weights.rotation,
        effort_weight / scene.diagonal,
        effort_weight / np.pi,
        *scene.size,
        can.reach_m * unit_of(scene),
        can.reach_rad,
        can.levels,
    )


def _table(env: FarmToTableEnv) -> Table:
    truth, believed = env.view.truth, env.view.believed
    arrays: Any = (truth.position, truth.yaw, believed.position, believed.yaw, env.world.tracker.belief.wrong)
    arrays += (truth.category_code, truth.movable, truth.size, truth.elevation)
    return Table(*(array.copy() for array in arrays))  # kernels are compiled for what can be written to


class AnalyticPolicy(Policy):
    """Plans which objects are to be taken for which others, and plans again after every move.

    An object moved over half of the way to the place of another label of its kind is cheaper as that label
    (T3, T5), and whole cycles of them change places. A plan is made as if nothing were pushed; what was
    pushed is seen when the next one is made.

    Args:
        rng: not needed; every policy is made with one.
        beam: how many unfinished plans are kept.
    """

    def __init__(self, rng: np.random.Generator | None = None, beam: int = 32) -> None:
        self._beam = beam

    def act(self, env: FarmToTableEnv) -> Any:
        """The first step of the best plan from here; ending the turn, or doing nothing, where there is none.

        Raises:
            OptionError: the hand is steered, or the policy is a helper.
        """
        if env.config.sign != 1:
            raise OptionError("sign", "must be 1 for an analytic policy", env.config.sign)
        return action_of(env, [move_of(env.view, step) for step in best_plan(env, self._beam)])
