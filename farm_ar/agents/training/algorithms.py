"""The learners by name, and what may be set of each."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
from gymnasium import spaces
from sb3_contrib import MaskablePPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm

from farm_ar.agents.training.object_policy import ObjectPolicy
from farm_ar.errors import OptionError, known_name

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {"ppo": PPO, "maskable-ppo": MaskablePPO, "sac": SAC}
"""The learners by name."""

POLICIES = {"MultiInputPolicy": "MultiInputPolicy", "CnnPolicy": "CnnPolicy", "ObjectPolicy": ObjectPolicy}
"""The policies by name."""

OURS = frozenset(
    {"policy", "env", "seed", "verbose", "device", "tensorboard_log", "self", "_init_setup_model"}
)
"""Arguments of the learners that no file of hyperparameters sets."""


def settings_of(algorithm: str) -> frozenset[str]:
    """What a file of hyperparameters may set of a learner."""
    known = inspect.signature(ALGORITHMS[known_name("algo", algorithm, ALGORITHMS)].__init__).parameters
    return frozenset(known) - OURS


def check_fit(algorithm: str, policy: str, env: gym.Env[Any, Any]) -> None:
    """See that a learner and its policy can play an environment.

    Raises:
        OptionError: they cannot.
    """
    space = env.action_space
    if algorithm == "sac" and not isinstance(space, spaces.Box):
        raise OptionError("algo", "must be ppo or maskable-ppo for discrete actions", algorithm)
    if algorithm == "maskable-ppo" and not isinstance(space, spaces.MultiDiscrete):
        raise OptionError("algo", "must be ppo or sac for continuous actions", algorithm)
    state = isinstance(env.observation_space, spaces.Dict)
    if policy == "ObjectPolicy" and (algorithm != "maskable-ppo" or not state):
        expected = "must be another one, but for maskable-ppo on state observations"
        raise OptionError("policy", expected, policy)


@dataclass(frozen=True)
class Falling:
    """A learning rate that falls on a straight line to a twentieth: `lin_START` in the files.

    Args:
        start: what it begins with.
    """

    start: float

    def __call__(self, left: float) -> float:
        """The rate when this share of the training is left."""
        return self.start * max(left, 0.05)
