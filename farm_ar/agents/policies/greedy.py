"""A policy that looks one action ahead."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from farm_ar.agents.policies.base import Policy
from farm_ar.agents.policies.lookahead import effort_of, look_ahead, placed
from farm_ar.agents.policies.random import RandomPolicy
from farm_ar.arrays import IntArray
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.controls import MoveControl
from farm_ar.errors import OptionError

AMBIGUITY_SHARE = 0.5
"""Weight of a unit of ambiguity, a wrong label being 1: the first moves of an attack gain nothing else."""


class GreedyPolicy(Policy):
    """The action whose outcome, if nothing is pushed, the paper's method handles worst (or best: sign -1).

    Args:
        rng: where the randomness comes from.
        samples: how many actions are looked at where they cannot all be.
    """

    def __init__(self, rng: np.random.Generator, samples: int = 512) -> None:
        self._rng, self._samples = rng, samples

    def act(self, env: FarmToTableEnv) -> Any:
        """The best action as far as one can see; a tie goes to the first.

        Raises:
            OptionError: the hand is steered: one action is too short a horizon for it.
        """
        control = env.control
        if not isinstance(control, MoveControl):
            raise OptionError("control", "must be move or layout for a greedy policy", env.config.control)
        actions = self._actions(env)
        asked = [control.asked(action, env.view, env.budget) or [] for action in actions]
        poses = [placed(env.view, moves) for moves in asked]
        seen = look_ahead(env, np.array([p for p, _ in poses]), np.array([y for _, y in poses]))
        effort = np.array([effort_of(env.view, moves) for moves in asked])
        harm = seen.wrong + AMBIGUITY_SHARE * seen.ambiguity
        score = env.config.sign * harm - env.config.effort_weight * effort
        return actions[int(np.argmax(score))]

    def _actions(self, env: FarmToTableEnv) -> list[Any]:
        space = env.action_space
        if isinstance(space, spaces.Discrete | spaces.MultiDiscrete):
            return list(allowed_actions(env))
        anything = RandomPolicy(self._rng)
        still = np.zeros(space.shape or (), dtype=np.float32)
        return [still, *(anything.act(env) for _ in range(self._samples - 1))]


def allowed_actions(env: FarmToTableEnv) -> IntArray:
    """(A, D), or (A,) of one number, all discrete actions that make sense now; ending the turn once."""
    space = env.action_space
    if isinstance(space, spaces.Discrete):
        return np.flatnonzero(env.action_masks())
    assert isinstance(space, spaces.MultiDiscrete)
    ends = np.cumsum(space.nvec)[:-1]
    which, *others = (np.flatnonzero(part) for part in np.split(env.action_masks(), ends))
    objects = which[which < space.nvec[0] - 1]
    grid = np.stack(np.meshgrid(objects, *others, indexing="ij"), axis=-1).reshape(-1, len(space.nvec))
    leave = np.zeros((1, len(space.nvec)), dtype=np.int64)
    leave[0, 0] = space.nvec[0] - 1
    return np.concatenate([grid, leave])
