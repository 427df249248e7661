"""A batch of environments as Stable-Baselines3 has them (extra `train`)."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode

from farm_ar.envs.batched.entry_point import arguments_of
from farm_ar.envs.batched.vector_env import BatchedVectorEnv
from farm_ar.errors import MissingPackageError, OptionError

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as problem:  # pragma: no cover - of a core without extras
    raise MissingPackageError("this needs stable-baselines3: pip install 'farm-ar[train]'") from problem


class BatchedVecEnv(VecEnv):
    """`BatchedVectorEnv` with the interface of Stable-Baselines3.

    Episodes that are over are followed by others within the step; what they ended with is in infos, under
    `terminal_observation`. No episode is cut short, so `TimeLimit.truncated` is always False.

    Args:
        num_envs: how many.
        threads: how many at most; as many as there are processors by default.
        monitor: whether infos report episodes that ended, under `episode`, as `Monitor` does.
        arguments: of the environment, the fields of `EnvConfig`.

    Raises:
        OptionError: an argument is wrong, or cannot be batched.
    """

    def __init__(
        self, num_envs: int, threads: int | None = None, monitor: bool = False, **arguments: Any
    ) -> None:
        self._monitor, self._begun = monitor, time.time()
        self.batch = BatchedVectorEnv(num_envs, AutoresetMode.SAME_STEP, threads, **arguments)
        self._total, self._length = np.zeros(num_envs), np.zeros(num_envs, dtype=np.int64)
        self._actions: npt.NDArray[Any] = np.zeros(0)
        super().__init__(num_envs, self.batch.single_observation_space, self.batch.single_action_space)

    @classmethod
    def of(cls, env_id: str, num_envs: int, threads: int | None = None, **arguments: Any) -> BatchedVecEnv:
        """The environments of a registered id, with other arguments in place of its own; `monitor` is one.

        Raises:
            OptionError: an argument is wrong, or cannot be batched, or there is no such id.
        """
        found = arguments_of(env_id, arguments)
        if found is None:
            raise OptionError("env_id", "must be one of farm-ar that can be batched", env_id)
        return cls(num_envs, threads, **found)

    def reset(self) -> Any:
        """Begin an episode in each."""
        options = self._options[0]
        if any(one != options for one in self._options):
            raise OptionError("options", "must be the same for all environments of a batch", self._options)
        observations, infos = self.batch.reset(seed=self._seeds, options=options)
        self._total[:], self._length[:] = 0.0, 0
        self.reset_infos = _each(infos, self.num_envs)
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: npt.NDArray[Any]) -> None:
        """What to do in each."""
        self._actions = actions

    def step_wait(self) -> Any:
        """Do it."""
        observations, reward, over, _, infos = self.batch.step(self._actions)
        seen, told = infos.pop("final_obs", None), infos.pop("final_info", {})
        now = _each(infos, self.num_envs)
        last = _each(told, self.num_envs) if over.any() else now
        self._total += reward
        self._length += 1
        for b in np.flatnonzero(over).tolist():
            self.reset_infos[b], now[b] = now[b], last[b]
            now[b]["terminal_observation"] = seen[b]
            if self._monitor:
                took = round(time.time() - self._begun, 6)
                now[b]["episode"] = {
                    "r": round(float(self._total[b]), 6),
                    "l": int(self._length[b]),
                    "t": took,
                }
        self._total[over], self._length[over] = 0.0, 0
        for info in now:
            info["TimeLimit.truncated"] = False
        return observations, reward.astype(np.float32), over, now

    def close(self) -> None:
        """End the threads."""
        self.batch.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of some environments, by default of all."""
        values = self.batch.get_attr(attr_name)
        return [values[b] for b in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of some environments, which `get_attr` gives from then on."""
        values: list[Any] = [None] * self.num_envs
        if self.has_attr(attr_name):
            values = list(self.batch.get_attr(attr_name))
        for b in self._get_indices(indices):
            values[b] = value
        self.batch.set_attr(attr_name, values)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """What a method of some environments gives, by default of all; `action_masks` is the one there is."""
        values = self.batch.call(method_name, *method_args, **method_kwargs)
        return [values[b] for b in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """False: environments of a batch are not wrapped one by one."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[None]:
        """Nothing: a batch draws no pictures."""
        return [None] * self.num_envs


def _each(infos: Mapping[str, Any], count: int) -> list[dict[str, Any]]:
    """The infos of each environment."""
    names = [name for name in infos if not name.startswith("_")]
    columns = [list(infos[name]) if infos[name].ndim > 1 else infos[name].tolist() for name in names]
    return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)] or [{}] * count
