"""What `gymnasium.make_vec` makes: environments in a batch, or single ones where these cannot be batched."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from gymnasium.envs.registration import registry
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv

from farm_ar.envs.batched.arguments import mode_of, processors, whole
from farm_ar.envs.batched.coverage import obstacle
from farm_ar.envs.batched.vector_env import MOST_ENVS, BatchedVectorEnv
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.env import FarmToTableEnv
from farm_ar.envs.generator import scene_of

MOST_PROCESSES = 64
"""More single environments than this are played in one process."""


class NotBatchedWarning(UserWarning):
    """Environments were asked for that cannot be batched."""


ENTRY_POINT = "farm_ar.envs.batched:make_vector_env"
"""How ids name what makes a batch of them."""


def arguments_of(env_id: str, arguments: Mapping[str, Any]) -> dict[str, Any] | None:
    """The arguments of a registered id, with some in place of its own; None where an id has no batches."""
    spec = registry.get(env_id.removeprefix("farm_ar:"))
    if spec is None or spec.vector_entry_point != ENTRY_POINT:
        return None
    return {**spec.kwargs, **arguments}


def can_be_batched(env_id: str, arguments: Mapping[str, Any]) -> bool:
    """Whether environments of an id, with these arguments, can be batched."""
    found = arguments_of(env_id, arguments)
    if found is None:
        return False
    config = EnvConfig(**found)
    return obstacle(config, scene_of(config.scene, config.game)) is None


def make_vector_env(
    num_envs: int = 1,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    threads: int | None = None,
    **arguments: Any,
) -> VectorEnv[Any, Any, Any]:
    """Environments of one kind; those that cannot be batched are Gymnasium's own, and a warning says why.

    Args:
        num_envs: how many.
        autoreset_mode: when an episode that is over is followed by another, an `AutoresetMode` or its value.
        threads: how many at most, of a batch.
        arguments: of the environment.

    Raises:
        OptionError: an argument is wrong.
    """
    num_envs = whole("num_envs", num_envs, MOST_ENVS)
    config = EnvConfig(**arguments)
    found = obstacle(config, scene_of(config.scene, config.game))
    if found is None:
        return BatchedVectorEnv(num_envs, autoreset_mode, threads, **arguments)
    name, expected, value = found
    apart = 1 < num_envs <= MOST_PROCESSES and processors() > 1
    chosen = AsyncVectorEnv if apart else SyncVectorEnv
    warnings.warn(
        f"{name} {expected}, got {value!r}: single environments are played in place of a batch "
        f"({chosen.__name__}), many times slower",
        NotBatchedWarning,
        stacklevel=3,
    )
    make = partial(FarmToTableEnv, **arguments)
    if apart:
        _compile_with(make)
    return chosen([make] * num_envs, autoreset_mode=mode_of(autoreset_mode))


def _compile_with(make: Callable[..., FarmToTableEnv]) -> None:
    """Have kernels compiled and kept, and announced, before processes would compile them, each for itself."""
    env = make(render_mode=None)
    env.reset(seed=0)
    env.action_space.seed(0)
    env.step(env.action_space.sample())
    env.close()
