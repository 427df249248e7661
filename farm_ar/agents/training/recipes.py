"""Hyperparameters: one YAML file per learner, keyed by environment id, as rl-baselines3-zoo has them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

from farm_ar.agents.training.algorithms import POLICIES, Falling, settings_of
from farm_ar.errors import InputError, known_name

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
    "rehearse",
)
IMITATE = {"steps": 40960, "beam": 8, "batches": 500, "learning_rate": 0.02}
"""What may be set of the imitation of a planner, and what is taken where it is not."""

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
        rehearse: how many of the steps after those are taken in a `Rehearsal`, before the environment itself.
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
    rehearse: int = 0
    settings: dict[str, Any] = field(default_factory=dict)

    @property
    def before(self) -> int:
        """How many steps come before those in the environment itself."""
        return (self.imitate["steps"] if self.imitate else 0) + self.rehearse

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
        rehearse: int | None = None,
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
        rehearsed = self.rehearse if rehearse is None else rehearse
        planned = both.get("sign") != -1 and both.get("reward") != "miscount"
        shown = self.imitate if planned else None
        if imitate is not None:
            shown = {**IMITATE, **(shown or {}), "steps": imitate} if imitate else None
        return replace(self, env_kwargs=both, n_timesteps=steps, imitate=shown, rehearse=rehearsed)


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
        text = files(__package__).joinpath("recipes", f"{algorithm}.yml").read_text(encoding="utf-8")
        source = f"{algorithm}.yml"
    else:
        source = Path(path).name
        try:
            text = Path(path).read_text(encoding="utf-8")
        except (OSError, UnicodeError) as problem:
            raise RecipeError("file", "must be a readable file", str(problem), os.fspath(path)) from None
    try:
        sections = yaml.safe_load(text)
    except yaml.YAMLError as problem:
        raise RecipeError("file", "must be YAML", str(problem).replace("\n", " "), source) from None
    if not isinstance(sections, dict) or (env_id not in sections and OTHERS not in sections):
        raise RecipeError("file", f"must have a section {env_id} or {OTHERS}", sections, source)
    name = env_id if env_id in sections else OTHERS
    return recipe_from(sections[name], allowed, f"{source}: {name}")


def recipe_from(section: Any, allowed: frozenset[str], source: str) -> Recipe:
    """The recipe that a section of a file describes.

    Args:
        section: the values by name.
        allowed: what may be set of the learner.
        source: where it stands, for errors.

    Raises:
        RecipeError: a key is not known, or a value is of the wrong kind.
    """
    if not isinstance(section, dict):
        raise RecipeError("section", "must hold values by name", section, source)
    for key in section:
        if key not in allowed and key not in OWN_KEYS:
            known = ", ".join(sorted([*allowed, *OWN_KEYS]))
            raise RecipeError(str(key), f"must be one of {known}", key, source)
    own = {key: section[key] for key in OWN_KEYS if key in section}
    for key, lowest in {"n_timesteps": 1, "n_envs": 1, "checkpoint_every": 0, "rehearse": 0}.items():
        value = own.get(key, lowest)
        if isinstance(value, bool) or not isinstance(value, int) or value < lowest:
            raise RecipeError(key, f"must be a whole number not below {lowest}", value, source)
    for key in ("policy_kwargs", "env_kwargs"):
        if not isinstance(own.get(key, {}), dict):
            raise RecipeError(key, "must hold values by name", own[key], source)
    if own.get("imitate") is not None:
        own["imitate"] = _imitation(own["imitate"], source)
    if own.get("normalize") is not None:
        _check_normalize(own["normalize"], source)
    if "policy" in own:
        known_name("policy", own["policy"], POLICIES)
    settings = {key: value for key, value in section.items() if key not in OWN_KEYS}
    for key, value in settings.items():
        if isinstance(value, str) and value.startswith("lin_"):
            _value(value, RecipeError(key, "must end in a number after lin_", value, source))
    return Recipe(**own, settings=settings)


def _imitation(value: Any, source: str) -> dict[str, Any]:
    """All that is to be set of an imitation."""
    if not isinstance(value, dict):
        raise RecipeError("imitate", f"must hold values for {', '.join(IMITATE)}", value, source)
    for key, given in value.items():
        if key not in IMITATE:
            raise RecipeError(f"imitate.{key}", f"must be one of {', '.join(IMITATE)}", key, source)
        whole = key != "learning_rate"
        right = isinstance(given, int if whole else (int, float)) and not isinstance(given, bool)
        if not right or given <= 0:
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


def _value(value: Any, problem: Exception | None = None) -> Any:
    if not isinstance(value, str) or not value.startswith("lin_"):
        return value
    try:
        return Falling(float(value.removeprefix("lin_")))
    except ValueError:
        raise problem or ValueError(value) from None
