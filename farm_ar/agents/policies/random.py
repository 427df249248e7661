"""A policy without a plan."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from farm_ar.agents.policies.base import Policy
from farm_ar.envs import FarmToTableEnv


class RandomPolicy(Policy):
    """Any action, uniformly; of discrete ones any that makes sense.

    Args:
        rng: where the randomness comes from.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def act(self, env: FarmToTableEnv) -> Any:
        """One at random."""
        space = env.action_space
        if isinstance(space, spaces.Discrete):
            return self._rng.choice(np.flatnonzero(env.action_masks()))
        if isinstance(space, spaces.MultiDiscrete):
            ends = np.cumsum(space.nvec)[:-1]
            allowed = [np.flatnonzero(part) for part in np.split(env.action_masks(), ends)]
            return np.array([choices[self._rng.integers(len(choices))] for choices in allowed])
        assert isinstance(space, spaces.Box)
        return self._rng.uniform(space.low, space.high).astype(space.dtype)
