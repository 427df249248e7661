"""A policy that does one and the same whatever it meets: what any learning has to beat."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from farm_ar.agents.policies.base import Policy, Visit, play_episodes
from farm_ar.agents.policies.random import RandomPolicy
from farm_ar.envs import FarmToTableEnv


class ConstantPolicy(Policy):
    """The same actions in every visit, whatever the table looks like.

    Args:
        actions: the visit's first, second, ... action; the last is repeated. At least one.
    """

    def __init__(self, actions: Sequence[npt.ArrayLike]) -> None:
        self._actions = [np.asarray(action) for action in actions]
        self._visit = Visit()
        self._done = 0

    def act(self, env: FarmToTableEnv) -> Any:
        """The next of them."""
        if self._visit.is_new(env):
            self._done = 0
        self._done += 1
        return self._actions[min(self._done, len(self._actions)) - 1]


def best_constant(
    env: Any, rng: np.random.Generator, tries: int, seeds: Sequence[int], moves: int = 6
) -> ConstantPolicy:
    """The best constant policy that a random search with local steps finds.

    The first half of the tries are drawn anew, the others change one action of the best so far.

    Args:
        env: the environment, wrapped or not.
        rng: where the randomness comes from.
        tries: how many constant policies are tried, at least 1.
        seeds: of the episodes that each of them plays.
        moves: how many actions each has.
    """
    anything = RandomPolicy(rng)
    best: list[Any] = []
    best_total = -np.inf
    for k in range(tries):
        env.reset(seed=int(seeds[k % len(seeds)]))
        drawn = [anything.act(env.unwrapped) for _ in range(moves)]
        if 2 * k >= tries:
            kept = rng.random(moves) > 1 / moves
            drawn = [old if keep else new for old, new, keep in zip(best, drawn, kept, strict=True)]
        total = sum(episode.total for episode in play_episodes(env, ConstantPolicy(drawn), seeds))
        if total > best_total:
            best, best_total = drawn, total
    return ConstantPolicy(best)
