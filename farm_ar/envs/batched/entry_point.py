"""What `gymnasium.make_vec` makes: environments in a batch, or single ones where these cannot be batched."""

from __future__ import annotations

import os
import warnings
from functools import partial
from typing import Any

from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv

from farm_ar.envs.batched.coverage import obstacle
from farm_ar.envs.batched.vector_env import BatchedVectorEnv, mode_of
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.env import FarmToTableEnv
from farm_ar.envs.generator import scene_of

MOST_PROCESSES = 64
"""More single environments than this are played in one process."""


class NotBatchedWarning(UserWarning):
    """Environments were asked for that cannot be batched."""


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
    config = EnvConfig(**arguments)
    found = obstacle(config, scene_of(config.scene, config.game))
    if found is None:
        return BatchedVectorEnv(num_envs, autoreset_mode, threads, **arguments)
    name, expected, value = found
    apart = 1 < num_envs <= MOST_PROCESSES and len(os.sched_getaffinity(0)) > 1
    chosen = AsyncVectorEnv if apart else SyncVectorEnv
    warnings.warn(
        f"{name} {expected}, got {value!r}: single environments are played in place of a batch "
        f"({chosen.__name__}), many times slower",
        NotBatchedWarning,
        stacklevel=3,
    )
    make = partial(FarmToTableEnv, **arguments)
    return chosen([make] * num_envs, autoreset_mode=mode_of(autoreset_mode))
