"""Trained policies: those of a run, and those that come with farm-ar."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from farm_ar.agents.policies.base import SHIPPED, SHIPPED_ENV, Policy, shipped
from farm_ar.agents.training.checkpoints import as_written, normalized, read_tensors
from farm_ar.agents.training.object_policy import ObjectPolicy
from farm_ar.agents.training.recipes import ALGORITHMS, policy_class
from farm_ar.agents.training.run_folder import BEST, CHECKPOINTS, RunFolder
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.registration import check_arguments, make_env
from farm_ar.errors import OptionError, known_name


class TrainedPolicy(Policy):
    """Does what a policy finds likeliest.

    Args:
        policy: of Stable-Baselines3, or a learner.
        normalization: what its observations were normalized with, if they were.
        env_kwargs: arguments of the environment in which it was trained.
    """

    def __init__(
        self, policy: Any, normalization: VecNormalize | None = None, env_kwargs: dict[str, Any] | None = None
    ) -> None:
        self.policy, self.env_kwargs = policy, dict(env_kwargs or {})
        self._normalization = normalization
        inner = getattr(policy, "policy", policy)
        self._space = inner.observation_space
        self._masks = "action_masks" in inner.predict.__code__.co_varnames
        self._actions = inner.action_space

    def check_fit(self, env: FarmToTableEnv) -> None:
        """See that it can play in an environment.

        Raises:
            OptionError: the environment's actions or observations are not those it was trained with.
        """
        if env.action_space != self._actions or env.observation_space != self._space:
            expected = f"must have the actions {self._actions} and the observations of the training"
            raise OptionError("env", expected, env.action_space)

    def act(self, env: FarmToTableEnv) -> Any:
        """The next action.

        Raises:
            OptionError: the environment's actions or observations are not those it was trained with.
        """
        self.check_fit(env)
        observation: Any = env.observe()
        if self._normalization is not None:
            observation = self._normalization.normalize_obs(observation)
        masks = {"action_masks": env.action_masks()} if self._masks and _discrete(env) else {}
        action, _ = self.policy.predict(observation, deterministic=True, **masks)
        return action


def policy_and_env(
    run: str, which: str = "best", arguments: Mapping[str, Any] | None = None, trust: bool = False
) -> tuple[TrainedPolicy, FarmToTableEnv]:
    """A trained policy, and an environment in which it can act.

    Args:
        run: a run's folder, or the name of a policy that comes with farm-ar.
        which: "best" or "last", of a run.
        arguments: of the environment, in place of those of the training.
        trust: whether a run may load code of whoever wrote it, as in `load_policy`.

    Raises:
        RunError: it is no run's folder, or needs to be trusted.
        OptionError: there is neither such a folder nor such a policy, or the policy does not fit the
            environment with these arguments.
    """
    if run not in shipped() and not RunFolder(Path(run)).exists:
        raise OptionError("run", f"must be the folder of a run, or one of {', '.join(shipped())}", run)
    if run in shipped():
        trained, env_id = load_shipped(run), SHIPPED_ENV
    else:
        trained, env_id = load_policy(Path(run), which, trust), RunFolder(Path(run)).read().env
    check_arguments(env_id, arguments or {})
    try:
        env: Any = gym.make(env_id, **{**trained.env_kwargs, **(arguments or {})}).unwrapped
    except (gym.error.Error, TypeError) as problem:
        expected = f"must suit the environment ({problem})"
        raise OptionError("arguments", expected, dict(arguments or {})) from None
    trained.check_fit(env)
    return trained, env


def load_policy(run: Path, which: str = "best", trust: bool = False) -> TrainedPolicy:
    """The policy that a run made.

    Args:
        run: the run's folder.
        which: "best", by the evaluations, or "last".
        trust: whether the folder may run code of whoever wrote it: the module of its environment, pickles of
            an older version.

    Raises:
        RunError: it is no run's folder, or has come to no such model, or the model's files are damaged or
            would run code that is not trusted.
        OptionError: `which` is neither, or "best" of a run that has not been evaluated; or its environment
            cannot be made.
    """
    folder = RunFolder(run)
    description = folder.read_to_make(trust)
    kind = BEST if known_name("which", which, ("best", "last")) == "best" else CHECKPOINTS
    if kind == BEST and not folder.kept(BEST) and folder.kept(CHECKPOINTS):
        raise OptionError("which", "must be last for a run that has not been evaluated yet", which)
    saved, recipe = folder.newest(kind), description.recipe
    learner: Any = ALGORITHMS[description.algo]
    envs = DummyVecEnv([lambda: make_env(description.env, recipe.env_kwargs)])
    spaces_of = learner._wrap_env(envs, monitor_wrapper=False)  # images are turned for the network
    make = policy_class(recipe.policy, spaces_of.observation_space)
    make = learner.policy_aliases.get(make, make)
    parameters, _ = read_tensors(saved)
    with as_written(saved):
        policy = make(
            spaces_of.observation_space, spaces_of.action_space, lambda _: 0.0, **recipe.policy_kwargs
        )
        policy.load_state_dict(parameters["policy"])
        policy.set_training_mode(False)
    normalization = None
    if recipe.normalize is not None:
        normalization = normalized(envs, recipe.normalize, saved, trust)
    return TrainedPolicy(policy, normalization, recipe.env_kwargs)


def save_weights(trained: TrainedPolicy, path: Path, about: dict[str, Any]) -> None:
    """Write an `ObjectPolicy` as an array file that holds numbers only, half as precise as they were learnt.

    Args:
        trained: holds the policy.
        path: the file, `.npz`.
        about: what is to be known of it, as JSON values; holds "env_kwargs" and "policy_kwargs".
    """
    policy = getattr(trained.policy, "policy", trained.policy)
    weights = {name: value.numpy().astype(np.float16) for name, value in policy.state_dict().items()}
    text = np.frombuffer(json.dumps(about).encode(), dtype=np.uint8)
    with path.open("wb") as file:
        np.savez_compressed(file, about=text, **weights)


def load_weights(path: Path) -> TrainedPolicy:
    """The policy that `save_weights` wrote."""
    with np.load(path, allow_pickle=False) as file:
        about = json.loads(file["about"].tobytes())
        weights = {name: torch.from_numpy(file[name].astype(np.float32)) for name in file if name != "about"}
    env = FarmToTableEnv(**about["env_kwargs"])
    observations, actions = env.observation_space, env.action_space
    assert isinstance(observations, spaces.Dict)
    assert isinstance(actions, spaces.MultiDiscrete)
    policy = ObjectPolicy(observations, actions, lambda _: 0.0, **about["policy_kwargs"])
    policy.load_state_dict(weights)
    return TrainedPolicy(policy, env_kwargs=about["env_kwargs"])


def load_shipped(name: str) -> TrainedPolicy:
    """A policy that comes with farm-ar.

    Raises:
        OptionError: there is none of that name.
    """
    known_name("adversary", name, shipped())
    with as_file(files("farm_ar.agents.policies").joinpath(SHIPPED, f"{name}.npz")) as path:
        return load_weights(path)


def _discrete(env: FarmToTableEnv) -> bool:
    return isinstance(env.action_space, spaces.Discrete | spaces.MultiDiscrete)
