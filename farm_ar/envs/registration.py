"""Where Gymnasium enters: what it makes when a registered id is asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import gymnasium as gym
from gymnasium.envs.registration import registry

from farm_ar.envs.config import EnvConfig
from farm_ar.envs.delivery import DeliverToChairEnv
from farm_ar.envs.env import FarmToTableEnv
from farm_ar.errors import OptionError, known_name


class EntryPoint:
    """Makes `FarmToTableEnv` for `gymnasium.make`.

    Left to itself Gymnasium would put a window of its own before an environment that is asked for
    `render_mode="human"`, which needs another package and a display, and complain in its own words where
    either is missing. The names below have it leave that mode to the environment, which says what there is.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array", "human"], "render_fps": 4}

    def __call__(self, **arguments: Any) -> FarmToTableEnv:
        """The environment, with the arguments of the id and those that `make` was given."""
        return FarmToTableEnv(**arguments)


class DeliveryEntryPoint:
    """Makes `DeliverToChairEnv` for `gymnasium.make`; of windows it says the same."""

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array", "human"], "render_fps": 5}

    def __call__(self, **arguments: Any) -> DeliverToChairEnv:
        """The environment, with the arguments that `make` was given."""
        return DeliverToChairEnv(**arguments)


make_farm_to_table = EntryPoint()
"""Makes an environment; the ids of the game and of plain scenes name it."""

make_deliver_to_chair = DeliveryEntryPoint()
"""Makes an environment; `DeliverToChair-v0` names it."""

NAMED = f"{__package__}:make_farm_to_table"
"""How ids name it."""


def check_arguments(env_id: str, arguments: Iterable[str]) -> None:
    """See that an environment of this package has arguments of these names.

    Raises:
        OptionError: it has none of one of them.
    """
    spec = registry.get(env_id.removeprefix("farm_ar:"))
    if spec is not None and spec.entry_point == NAMED:
        for name in arguments:
            known_name("argument", name, EnvConfig.__dataclass_fields__)


def make_env(env_id: str, arguments: Mapping[str, Any]) -> gym.Env[Any, Any]:
    """The environment of any id, with its arguments.

    Raises:
        OptionError: there is no such environment or module, or it does not take the arguments.
    """
    check_arguments(env_id, arguments)
    try:
        return gym.make(env_id, **arguments)
    except (gym.error.Error, TypeError, ModuleNotFoundError) as problem:
        raise OptionError("env", f"must be one that can be made ({problem})", env_id) from None
