"""A player that plans a whole visit from the paper's cost: whole cycles change places."""

from __future__ import annotations

from typing import Any

import numpy as np

from farm_ar.agents.players.acting import action_of
from farm_ar.agents.players.planning import best_plan, move_of
from farm_ar.envs import FarmToTableEnv
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

    def __init__(self, rng: np.random.Generator | None = None, beam: int = 32) -> None:
        self._beam = beam

    def act(self, env: FarmToTableEnv) -> Any:
        """The first step of the best plan from here; leaving, or doing nothing, where there is none.

        Raises:
            OptionError: the hand is steered, or the player is a helper.
        """
        if env.config.sign != 1:
            raise OptionError("sign", "must be 1 for an analytic player", env.config.sign)
        return action_of(env, [move_of(env.view, step) for step in best_plan(env, self._beam)])
