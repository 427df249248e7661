"""A trained policy as a player: it is shown an environment and says what to do."""

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

from farm_ar.agents.training.algorithms import ALGORITHMS
from farm_ar.agents.training.callbacks import MODEL, NORMALIZATION
from farm_ar.agents.training.object_policy import ObjectPolicy
from farm_ar.agents.training.run_folder import BEST, CHECKPOINTS, RunFolder, as_written
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.registration import check_arguments
from farm_ar.errors import OptionError, known_name

SHIPPED, SHIPPED_ENV = "models", "FarmToTable-v0"


class TrainedPlayer:
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


def player_and_env(
    run: str, which: str = "best", arguments: Mapping[str, Any] | None = None
) -> tuple[TrainedPlayer, FarmToTableEnv]:
    """A trained player, and an environment in which it can play.

    Args:
        run: a run's folder, or the name of a player that comes with farm-ar.
        which: "best" or "last", of a run.
        arguments: of the environment, in place of those of the training.

    Raises:
        RunError: it is no run's folder.
        OptionError: there is neither such a folder nor such a player, or the player does not fit the
            environment with these arguments.
    """
    if run not in shipped() and not RunFolder(Path(run)).exists:
        raise OptionError("run", f"must be the folder of a run, or one of {', '.join(shipped())}", run)
    if run in shipped():
        player, env_id = load_shipped(run), SHIPPED_ENV
    else:
        player, env_id = load_player(Path(run), which), RunFolder(Path(run)).read().env
    check_arguments(env_id, arguments or {})
    try:
        env: Any = gym.make(env_id, **{**player.env_kwargs, **(arguments or {})}).unwrapped
    except (gym.error.Error, TypeError) as problem:
        expected = f"must suit the environment ({problem})"
        raise OptionError("arguments", expected, dict(arguments or {})) from None
    player.check_fit(env)
    return player, env


def load_player(run: Path, which: str = "best") -> TrainedPlayer:
    """The player that a run made.

    Args:
        run: the run's folder.
        which: "best", by the evaluations, or "last".

    Raises:
        RunError: it is no run's folder, or has come to no such model, or the model's files are damaged.
        OptionError: `which` is neither, or "best" of a run that has not been evaluated.
    """
    folder = RunFolder(run)
    description = folder.read()
    kind = BEST if known_name("which", which, ("best", "last")) == "best" else CHECKPOINTS
    if kind == BEST and not folder.kept(BEST) and folder.kept(CHECKPOINTS):
        raise OptionError("which", "must be last for a run that has not been evaluated yet", which)
    saved = folder.newest(kind)
    normalization = None
    with as_written(saved):
        model = ALGORITHMS[description.algo].load(saved / MODEL, device="cpu")
        if description.recipe.normalize is not None:
            kwargs = description.recipe.env_kwargs
            envs = DummyVecEnv([lambda: gym.make(description.env, **kwargs)])
            normalization = VecNormalize.load(str(saved / NORMALIZATION), envs)
    return TrainedPlayer(model, normalization, description.recipe.env_kwargs)


def save_weights(player: TrainedPlayer, path: Path, about: dict[str, Any]) -> None:
    """Write an `ObjectPolicy` as an array file that holds numbers only, half as precise as they were learnt.

    Args:
        player: with the policy.
        path: the file, `.npz`.
        about: what is to be known of it, as JSON values; holds "env_kwargs" and "policy_kwargs".
    """
    policy = getattr(player.policy, "policy", player.policy)
    weights = {name: value.numpy().astype(np.float16) for name, value in policy.state_dict().items()}
    text = np.frombuffer(json.dumps(about).encode(), dtype=np.uint8)
    with path.open("wb") as file:
        np.savez_compressed(file, about=text, **weights)


def load_weights(path: Path) -> TrainedPlayer:
    """The player that `save_weights` wrote."""
    with np.load(path, allow_pickle=False) as file:
        about = json.loads(file["about"].tobytes())
        weights = {name: torch.from_numpy(file[name].astype(np.float32)) for name in file if name != "about"}
    env = FarmToTableEnv(**about["env_kwargs"])
    observations, actions = env.observation_space, env.action_space
    assert isinstance(observations, spaces.Dict)
    assert isinstance(actions, spaces.MultiDiscrete)
    policy = ObjectPolicy(observations, actions, lambda _: 0.0, **about["policy_kwargs"])
    policy.load_state_dict(weights)
    return TrainedPlayer(policy, env_kwargs=about["env_kwargs"])


def shipped() -> list[str]:
    """Names of the players that come with farm-ar."""
    home = files(__package__).joinpath(SHIPPED)
    return sorted(Path(file.name).stem for file in home.iterdir() if file.name.endswith(".npz"))


def load_shipped(name: str) -> TrainedPlayer:
    """A player that comes with farm-ar.

    Raises:
        OptionError: there is none of that name.
    """
    known_name("adversary", name, shipped())
    with as_file(files(__package__).joinpath(SHIPPED, f"{name}.npz")) as path:
        return load_weights(path)


def _discrete(env: FarmToTableEnv) -> bool:
    return isinstance(env.action_space, spaces.MultiDiscrete)
