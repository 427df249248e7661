"""Hyperparameters: one YAML file per learner, keyed by environment id."""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_origin

import gymnasium as gym
import numpy as np
import yaml
from gymnasium import spaces
from sb3_contrib import MaskablePPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm

from farm_ar.agents.training.object_policy import ObjectPolicy
from farm_ar.arrays import number_in
from farm_ar.errors import InputError, OptionError, known_name
from farm_ar.scenes.files import read_text

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {"ppo": PPO, "maskable-ppo": MaskablePPO, "sac": SAC}
"""The learners by name."""

POLICY_CLASSES = {
    "MultiInputPolicy": "MultiInputPolicy",
    "MlpPolicy": "MlpPolicy",
    "CnnPolicy": "CnnPolicy",
    "ObjectPolicy": ObjectPolicy,
}
"""The policies by name."""


def policy_class(name: str, observations: spaces.Space[Any]) -> Any:
    """The policy of a name; the one for several inputs is `MlpPolicy` where there is one."""
    plain = isinstance(observations, spaces.Box) and len(observations.shape) == 1
    return POLICY_CLASSES["MlpPolicy" if plain and name == "MultiInputPolicy" else name]


OURS = frozenset(
    {"policy", "env", "seed", "verbose", "device", "tensorboard_log", "self", "_init_setup_model"}
)
"""Arguments of the learners that no file of hyperparameters sets."""


def settings_of(algorithm: str) -> dict[str, frozenset[type]]:
    """What a file of hyperparameters may set of a learner, and of which plain types each may be."""
    known = inspect.signature(ALGORITHMS[known_name("algo", algorithm, ALGORITHMS)].__init__).parameters
    return {name: _plain_types(one.annotation) for name, one in known.items() if name not in OURS}


def _plain_types(annotation: Any) -> frozenset[type]:
    parts = {get_origin(part) or part for part in (annotation, *get_args(annotation))}
    found = {part for part in (bool, int, float, str, dict, list, NoneType) if part in parts}
    return frozenset(found | ({int} if float in found else set()) | ({list} if tuple in parts else set()))


def check_fit(algorithm: str, policy: str, env: gym.Env[Any, Any]) -> None:
    """See that a learner and its policy can play an environment.

    Raises:
        OptionError: they cannot.
    """
    space = env.action_space
    if algorithm == "sac" and not isinstance(space, spaces.Box):
        raise OptionError("algo", "must be ppo or maskable-ppo for discrete actions", algorithm)
    if algorithm == "maskable-ppo" and isinstance(space, spaces.Box):
        raise OptionError("algo", "must be ppo or sac for continuous actions", algorithm)
    state = isinstance(env.observation_space, spaces.Dict)
    several = isinstance(space, spaces.MultiDiscrete)
    if policy == "ObjectPolicy" and (algorithm != "maskable-ppo" or not state or not several):
        expected = (
            "must be another one, but for maskable-ppo on state observations with action slot or displacement"
        )
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


OTHERS = "default"
"""The key that stands for every environment which has none of its own."""

OWN_KEYS = (
    "n_timesteps",
    "n_envs",
    "policy",
    "policy_kwargs",
    "env_kwargs",
    "normalize",
    "checkpoint_every",
    "imitate",
    "lift",
)
FORMER_KEYS = {"rehearse": "lift"}
"""What older files call a key."""

IMITATE = {"steps": 40960, "beam": 8, "batches": 500, "learning_rate": 0.02}
"""What may be set of the imitation of a planner, and what is taken where it is not."""

MOST = 10**12
"""No number of a recipe need be larger."""

LEAST = {"n_steps": 1, "batch_size": 1, "n_epochs": 1, "buffer_size": 1, "learning_starts": 0}
"""Settings of learners that are whole numbers, and the least of each."""

RATES = {
    "learning_rate": 1e3, "gamma": 1.0, "gae_lambda": 1.0, "tau": 1.0, "clip_range": 1e3, "vf_coef": 1e3,
    "max_grad_norm": 1e9,
}  # fmt: skip
"""Settings of learners that are numbers from 0 on, and the largest that makes sense of each."""

NORMALIZE_KEYS = ("norm_obs", "norm_reward", "clip_obs", "clip_reward", "gamma")

LEFT_OUT = ("play_seconds", "animals_a_second")
"""What recipes set to 0 where the reward does not look at animals."""


class RecipeError(InputError):
    """Hyperparameters that cannot be used."""


@dataclass(frozen=True)
class Recipe:
    """How a learner is trained on an environment.

    Args:
        n_timesteps: steps in all.
        n_envs: environments at a time.
        policy: by name.
        policy_kwargs: its arguments.
        env_kwargs: the environment's arguments.
        normalize: arguments of `VecNormalize`; None for no normalization.
        checkpoint_every: steps between checkpoints at the least; 0 for one after every update.
        imitate: arguments of `ImitatingPPO`, whom a planner shows what to do in the first of the steps; None
            for no planner.
        lift: how many of the steps after those are taken in a batch with `carry="lift"` first.
        settings: arguments of the learner.
    """

    n_timesteps: int = 200_000
    n_envs: int = 8
    policy: str = "MultiInputPolicy"
    policy_kwargs: dict[str, Any] = field(default_factory=dict)
    env_kwargs: dict[str, Any] = field(default_factory=dict)
    normalize: dict[str, Any] | None = None
    checkpoint_every: int = 0
    imitate: dict[str, Any] | None = None
    lift: int = 0
    settings: dict[str, Any] = field(default_factory=dict)

    @property
    def before(self) -> int:
        """How many steps come before those in the environment itself."""
        return (self.imitate["steps"] if self.imitate else 0) + self.lift

    def of_learner(self) -> dict[str, Any]:
        """The learner's arguments, `lin_` turned into a falling rate."""
        return {name: _value(value) for name, value in self.settings.items()}

    def as_dict(self) -> dict[str, Any]:
        """As a section of a file."""
        values = asdict(self)
        return {**{name: values[name] for name in OWN_KEYS}, **self.settings}

    def with_arguments(
        self,
        env_kwargs: Mapping[str, Any],
        n_timesteps: int | None = None,
        imitate: int | None = None,
        lift: int | None = None,
    ) -> Recipe:
        """The same with further arguments of the environment, and other numbers of steps.

        No planner can show what to do to a helper (`sign` -1) or for the reward `miscount`; a recipe's
        is left out there. That reward looks at the animals: a recipe that leaves them out is not taken at its
        word.
        """
        steps = self.n_timesteps if n_timesteps is None else n_timesteps
        both = {**self.env_kwargs, **env_kwargs}
        if both.get("reward") == "miscount":
            both = {name: value for name, value in both.items() if name not in LEFT_OUT or name in env_kwargs}
        lifted = self.lift if lift is None else lift
        planned = both.get("sign") != -1 and both.get("reward") != "miscount"
        shown = self.imitate if planned else None
        if imitate is not None:
            shown = {**IMITATE, **(shown or {}), "steps": imitate} if imitate else None
        return replace(self, env_kwargs=both, n_timesteps=steps, imitate=shown, lift=lifted)


def load_recipe(algorithm: str, env_id: str, path: str | os.PathLike[str] | None = None) -> Recipe:
    """The recipe of a learner for an environment.

    Args:
        algorithm: the learner, by name.
        env_id: the environment's.
        path: a YAML file in place of the one that comes with farm-ar.

    Raises:
        RecipeError: the file cannot be read, or holds what is not known; names it.
    """
    allowed = settings_of(algorithm)
    if path is None:
        text = (
            files("farm_ar.agents.training")
            .joinpath("recipes", f"{algorithm}.yml")
            .read_text(encoding="utf-8")
        )
        source = f"{algorithm}.yml"
    else:
        source = Path(path).name
        text = read_text(path, RecipeError, "YAML")
    sections = yaml_from(text, source, RecipeError)
    if not isinstance(sections, dict) or (env_id not in sections and OTHERS not in sections):
        raise RecipeError("file", f"must have a section {env_id} or {OTHERS}", sections, source)
    name = env_id if env_id in sections else OTHERS
    return recipe_from(sections[name], allowed, f"{source}: {name}")


def yaml_from(text: str, source: str, error: type[InputError]) -> Any:
    """What a YAML text holds: plain values only.

    Raises:
        InputError: of the given class; it is no YAML.
    """
    try:
        return yaml.safe_load(text)
    except (
        yaml.YAMLError,
        ValueError,
        RecursionError,
    ) as problem:  # dates have errors of their own
        raise error("file", "must be YAML", " ".join(str(problem).split()), source) from None


def recipe_from(section: Any, allowed: Mapping[str, frozenset[type]], source: str) -> Recipe:
    """The recipe that a section of a file describes.

    Args:
        section: the values by name.
        allowed: what may be set of the learner, and the types of each.
        source: where it stands, for errors.

    Raises:
        RecipeError: a key is not known, or a value is of the wrong kind.
    """
    if not isinstance(section, dict):
        raise RecipeError("section", "must hold values by name", section, source)
    former = {key: today for key, today in FORMER_KEYS.items() if key in section and today not in section}
    section = {former.get(key, key): value for key, value in section.items()}
    for key in section:
        if not isinstance(key, str) or (key not in allowed and key not in OWN_KEYS):
            known = ", ".join(sorted([*allowed, *OWN_KEYS]))
            raise RecipeError(str(key), f"must be one of {known}", key, source)
    own = {key: section[key] for key in OWN_KEYS if key in section}
    for key, lowest in {"n_timesteps": 1, "n_envs": 1, "checkpoint_every": 0, "lift": 0}.items():
        _check_whole(key, own.get(key, lowest), lowest, source)
    for key in ("policy_kwargs", "env_kwargs"):
        value = own.get(key, {})
        if not isinstance(value, dict) or not all(isinstance(name, str) for name in value):
            raise RecipeError(key, "must hold values by name", own[key], source)
    if own.get("imitate") is not None:
        own["imitate"] = _imitation(own["imitate"], source)
    if own.get("normalize") is not None:
        _check_normalize(own["normalize"], source)
    if "policy" in own and own["policy"] not in list(POLICY_CLASSES):
        raise RecipeError(
            "policy", f"must be one of {', '.join(sorted(POLICY_CLASSES))}", own["policy"], source
        )
    settings = {key: value for key, value in section.items() if key not in OWN_KEYS}
    for key, value in settings.items():
        if isinstance(value, str) and value.startswith("lin_"):
            _value(value, RecipeError(key, "must end in a number after lin_", value, source))
        elif type(value) not in allowed[key]:
            types = ", ".join(sorted(one.__name__ for one in allowed[key]))
            raise RecipeError(key, f"must be of the type {types}", value, source)
        elif key in LEAST and value is not None:
            _check_whole(key, value, LEAST[key], source)
        elif key in RATES and value is not None and not _is_number(value, 0.0, RATES[key]):
            raise RecipeError(key, f"must be a number from 0 to {RATES[key]:g}", value, source)
    return Recipe(**own, settings=settings)


def _check_whole(key: str, value: Any, lowest: int, source: str) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not lowest <= value <= MOST:
        raise RecipeError(key, f"must be a whole number not below {lowest}", value, source)


def _is_number(value: Any, low: float, high: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high


def _imitation(value: Any, source: str) -> dict[str, Any]:
    """All that is to be set of an imitation."""
    if not isinstance(value, dict):
        raise RecipeError("imitate", f"must hold values for {', '.join(IMITATE)}", value, source)
    for key, given in value.items():
        if key not in IMITATE:
            raise RecipeError(f"imitate.{key}", f"must be one of {', '.join(IMITATE)}", key, source)
        whole = key != "learning_rate"
        right = _is_number(given, 1e-12, MOST) and (isinstance(given, int) or not whole)
        if not right:
            expected = f"must be a positive {'whole ' if whole else ''}number"
            raise RecipeError(f"imitate.{key}", expected, given, source)
    return {**IMITATE, **value}


def _check_normalize(value: Any, source: str) -> None:
    if not isinstance(value, dict):
        expected = f"must hold values for {', '.join(NORMALIZE_KEYS)}"
        raise RecipeError("normalize", expected, value, source)
    for key in value:
        if key not in NORMALIZE_KEYS:
            raise RecipeError(f"normalize.{key}", f"must be one of {', '.join(NORMALIZE_KEYS)}", key, source)
        flag = key.startswith("norm_")
        if not (isinstance(value[key], bool) if flag else _is_number(value[key], 0.0, MOST)):
            expected = "must be true or false" if flag else "must be a number not below 0"
            raise RecipeError(f"normalize.{key}", expected, value[key], source)


def _value(value: Any, problem: Exception | None = None) -> Any:
    if not isinstance(value, str) or not value.startswith("lin_"):
        return value
    try:
        start = number_in(value.removeprefix("lin_"))
        if start is None or not 0.0 < start < np.inf:
            raise ValueError(value)
        return Falling(start)
    except ValueError:
        raise problem or ValueError(value) from None
