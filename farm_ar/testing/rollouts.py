"""Roll-outs of environments: everything that one gave, to be compared with what another gave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from farm_ar.testing.comparison import attempt, difference, require

Env = gym.Env[Any, Any]

GIVEN = ("observation", "reward", "terminated", "truncated", "info")


@dataclass
class Rollout:
    """What was done with an environment, and what it gave.

    Attributes:
        actions: the actions; None for a reset.
        given: observation, reward, terminated, truncated and info of each; after a reset the middle three are
            0.0, False and False.
    """

    actions: list[Any] = field(default_factory=list)
    given: list[tuple[Any, ...]] = field(default_factory=list)

    @property
    def over(self) -> bool:
        """Whether the last episode is over."""
        return bool(self.given[-1][2] or self.given[-1][3])


def roll(env: Env, seed: int, steps: int, *, one_episode: bool = False) -> Rollout:
    """Reset an environment with a seed, and take random steps; a finished episode is followed by another.

    Args:
        env: the environment.
        seed: of the environment and of the actions.
        steps: how many.
        one_episode: whether to stop when the episode is over.
    """
    result = Rollout()
    env.action_space.seed(seed)
    _reset(env, result, seed)
    _roll_on(env, result, steps, one_episode)
    return result


def go_on(env: Env, steps: int, *, over: bool) -> Rollout:
    """Random steps from where an environment stands; `over` says whether an episode must begin first."""
    result = Rollout()
    if over:
        _reset(env, result)
    _roll_on(env, result, steps, False)
    return result


def follow(env: Env, actions: Sequence[Any], seed: int | None = None) -> Rollout:
    """Do with an environment what was done with another.

    Args:
        env: the environment, reset already where the actions do not begin with a reset.
        actions: as a `Rollout` holds them.
        seed: of the reset with which the actions begin.
    """
    result = Rollout()
    for i, action in enumerate(actions):
        if action is None:
            _reset(env, result, seed if i == 0 else None)
        else:
            _step(env, result, action)
    return result


def random_action(env: Env) -> Any:
    """A random action of those that make sense now."""
    mask = action_mask(env)
    if mask is None:
        return env.action_space.sample()
    space = env.action_space
    if isinstance(space, spaces.Discrete):
        return space.sample(mask=mask.astype(np.int8))
    assert isinstance(space, spaces.MultiDiscrete)
    parts = np.split(mask.astype(np.int8), np.cumsum(space.nvec)[:-1])
    return space.sample(mask=tuple(parts))


def action_mask(env: Env) -> Any:
    """The mask of an environment with discrete choices and `action_masks()`; None of another."""
    inner = env.unwrapped
    if isinstance(env.action_space, spaces.Discrete | spaces.MultiDiscrete) and hasattr(
        inner, "action_masks"
    ):
        return inner.action_masks()
    return None


def require_equal(first: Rollout, second: Rollout, what: str) -> None:
    """Insist that two roll-outs gave the same, bit by bit."""
    require(len(first.given) == len(second.given), f"{what}: the episodes have other lengths")
    for i, (a, b) in enumerate(zip(first.given, second.given, strict=True)):
        for name, left, right in zip(GIVEN, a, b, strict=True):
            where = difference(left, right, name)
            call = "reset" if first.actions[i] is None else "step"
            require(where is None, f"{what}: {where} differs after call {i} (a {call})")


def _reset(env: Env, result: Rollout, seed: int | None = None) -> None:
    with attempt("reset"):
        observation, info = env.reset(seed=seed)
    result.actions.append(None)
    result.given.append((observation, 0.0, False, False, info))


def _step(env: Env, result: Rollout, action: Any) -> None:
    with attempt(f"step {len(result.actions)}"):
        given = env.step(action)
    result.actions.append(action)
    result.given.append(given)


def _roll_on(env: Env, result: Rollout, steps: int, one_episode: bool) -> None:
    for _ in range(steps):
        if result.given and result.over:
            if one_episode:
                return
            _reset(env, result)
        _step(env, result, random_action(env))
