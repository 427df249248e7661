"""The native vector environment: one compiled call a step, over all environments and all cores."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from farm_ar.arrays import BoolArray
from farm_ar.envs.batched import construction
from farm_ar.envs.batched.advance import advance
from farm_ar.envs.batched.arguments import array_of, mode_of, processors, reset_mask, seeds_of, whole
from farm_ar.envs.batched.coverage import check_batched
from farm_ar.envs.batched.kinds import Stage
from farm_ar.envs.batched.numpy_functions import DATA, room_for_call
from farm_ar.envs.batched.state import Batch, Environments, Given, Report
from farm_ar.envs.batched.streams import as_generator, read_generator
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.controls import control_of
from farm_ar.envs.generator import (
    VisitCameras,
    checked_options,
    given_camera,
    given_layout,
    scene_of,
)
from farm_ar.envs.observations import OBSERVATIONS, FlatObservation, StateObservation
from farm_ar.envs.rewards import EFFORT, REWARDS
from farm_ar.errors import OptionError
from farm_ar.game_logic.headset import field_of_view
from farm_ar.game_logic.visibility import eyes_of
from farm_ar.structs import Structs, words_of

MOST_ENVS = 1_000_000
"""Environments in a batch at most."""

_SMALLEST_PART = 32
"""The fewest environments for which a thread of their own saves time."""


class BatchedVectorEnv(VectorEnv[Any, Any, Any]):
    """Many environments of one kind, played by one compiled call a step on all cores.

    Each is what `FarmToTableEnv` with the same arguments and seed is: observations, rewards, ends and numbers
    in infos have the same bits, whatever the number of threads. `coverage` says what can be batched.

    Args:
        num_envs: how many.
        autoreset_mode: when an episode that is over is followed by another, an `AutoresetMode` or its value.
        threads: how many at most; as many as there are processors by default.
        arguments: of the environment, the fields of `EnvConfig`.

    Raises:
        OptionError: an argument is wrong, or cannot be batched.
    """

    def __init__(
        self,
        num_envs: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        **arguments: Any,
    ) -> None:
        self.num_envs = whole("num_envs", num_envs, MOST_ENVS)
        self._threads = whole("threads", processors() if threads is None else threads)
        self._mode = mode_of(autoreset_mode)
        self.config = config = EnvConfig(**arguments)
        self.scene = scene = scene_of(config.scene, config.game)
        check_batched(config, scene)
        control = control_of(config, scene)
        observation = OBSERVATIONS[config.observation](scene, config)
        assert isinstance(observation, StateObservation | FlatObservation)
        self._parts, self._flat = observation.places, isinstance(observation, FlatObservation)
        self.single_observation_space, self.single_action_space = observation.space, control.space
        self.observation_space = batch_space(observation.space, self.num_envs)
        self.action_space = batch_space(control.space, self.num_envs)
        self.metadata = {"render_modes": [], "autoreset_mode": self._mode}
        self._most, choices = None, 0
        if isinstance(control.space, spaces.MultiDiscrete):
            self._most, choices = control.space.nvec, int(control.space.nvec.sum())
        elif isinstance(control.space, spaces.Discrete):
            self._most, choices = control.space.n, int(control.space.n)
        self._discrete = self._most is not None
        self._choices = construction.choices_of(config, scene, self._mode is AutoresetMode.SAME_STEP)
        self._scenery = construction.scenery_of(config, scene)
        self._batch = construction.new_batch(self.num_envs, scene)
        self._herds = construction.new_herds(self.num_envs, scene, config.game)
        self._output = construction.new_output(self.num_envs, scene, choices)
        self._given = self._nothing = construction.nothing_given(scene)
        self._terms = [f"reward/{name}" for name in REWARDS[config.reward]]
        self._seeds: list[int | None] = [None] * self.num_envs
        self._begun, self._over = np.zeros(self.num_envs, dtype=bool), np.zeros(self.num_envs, dtype=bool)
        self._set: dict[str, tuple[Any, ...]] = {}
        self._pool: ThreadPoolExecutor | None = None
        self._busy = threading.Lock()

    def __getstate__(self) -> dict[str, Any]:
        """All but the threads and what is another view of the bodies' memory."""
        return vars(self) | {"_pool": None, "_busy": None, "_batch": self._batch._replace(places=np.empty(0))}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        bodies: Any = self._batch.bodies
        self._batch = self._batch._replace(places=words_of(bodies))
        self._busy = threading.Lock()

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begin episodes.

        Args:
            seed: one for each environment; of one number the k-th has that and k. None: they go on as they
                are.
            options: as of one environment, for all; and "reset_mask", (B,) which of them begin, by default
                all.

        Raises:
            OptionError: an option or a seed cannot be used.
            gymnasium.error.ClosedEnvironmentError: they are closed.
        """
        self._check_open()
        if not isinstance(options, Mapping | None):
            expected = "must be a mapping with layout, camera and reset_mask, all optional"
            raise OptionError("options", expected, options)
        asked = dict(options or {})
        mask = reset_mask(asked.pop("reset_mask", None), self.num_envs)
        seeds = seeds_of(seed, self.num_envs)
        self._given = self._given_by(checked_options(asked))
        for b in np.flatnonzero(mask).tolist():
            if seeds[b] is not None or self._seeds[b] is None:
                generator, self._seeds[b] = seeding.np_random(seeds[b])
                read_generator(generator, self._batch.tables[b].stream)
        try:
            self._advance(np.where(mask, Stage.BEGIN, Stage.DONE))
        finally:
            self._given = self._nothing
        self._begun |= mask
        self._over &= ~mask
        return self._observed(self._output.numbers), self._infos(
            self._output.reports, self._output.masks, mask
        )

    def step(self, actions: Any) -> tuple[Any, Any, BoolArray, BoolArray, dict[str, Any]]:
        """One action of each.

        Raises:
            gymnasium.error.ResetNeeded: one has not begun, or is over and the mode does not begin another.
            gymnasium.error.InvalidAction: they have the wrong shape, or one is no choice that there is.
            gymnasium.error.ClosedEnvironmentError: they are closed.
        """
        self._check_open()
        if not self._begun.all():
            raise gym.error.ResetNeeded("step() needs reset() of all environments first")
        if self._mode is AutoresetMode.DISABLED and self._over.any():
            which = np.flatnonzero(self._over).tolist()
            raise gym.error.ResetNeeded(f"environments {which} are over and need reset() with a reset_mask")
        output, everyone = self._output, np.ones(self.num_envs, dtype=bool)
        output.reward[:], output.over[:] = 0.0, False
        self._advance(np.where(self._over, Stage.BEGIN, Stage.ACT), self._checked(actions))
        over, infos = output.over.copy(), {}
        if self._mode is AutoresetMode.SAME_STEP:
            if over.any():
                infos = self._final(over)
        else:
            self._over = over
        infos |= self._infos(output.reports, output.masks, everyone)
        truncated = np.zeros(self.num_envs, dtype=bool)
        return self._observed(output.numbers), output.reward.copy(), over, truncated, infos

    def action_masks(self) -> BoolArray:
        """(B, A) the choices that make sense, flat over an action's dimensions; for discrete actions only.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
            OptionError: the action is not discrete.
        """
        if not self._discrete:
            raise OptionError(
                "action", "must be discrete, displacement or slot for masks", self.config.action
            )
        if not self._begun.all():
            raise gym.error.ResetNeeded("there is nothing to look at before reset()")
        return self._output.masks.copy()

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """Generators that go on where each environment's stream stands; they are copies."""
        return tuple(as_generator(self._batch.tables[b].stream) for b in range(self.num_envs))

    @property
    def state(self) -> Batch:
        """The arrays that kernels play on, of all environments, as they stand; not to be written to."""
        return self._batch

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # type: ignore[override]
        """The seed of each environment, None before the first reset."""
        return tuple(self._seeds)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Of each environment what a method or an attribute of this name gives.

        Raises:
            AttributeError: there is none; single environments have more.
        """
        if name in self._set:
            return self._set[name]
        if name == "action_masks":
            return tuple(self.action_masks())
        if name in ("np_random", "np_random_seed"):
            return tuple(getattr(self, name))
        shared: dict[str, Any] = {
            "config": self.config,
            "render_mode": None,
            "spec": self.spec,
            "metadata": self.metadata,
        }
        shared |= {
            "action_space": self.single_action_space,
            "observation_space": self.single_observation_space,
        }
        if name not in shared:
            raise AttributeError(f"environments in a batch have no {name}")
        return (shared[name],) * self.num_envs

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of each environment."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Give each environment an attribute, which `get_attr` gives from then on and nothing else looks at.

        Args:
            name: of the attribute.
            values: one for all, or a list or tuple of one for each.
        """
        one_for_each = isinstance(values, list | tuple)
        if one_for_each and len(values) != self.num_envs:
            raise OptionError("values", f"must be one for each of {self.num_envs} environments", len(values))
        self._set[name] = tuple(values) if one_for_each else (values,) * self.num_envs

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def _advance(self, stages: npt.NDArray[np.int64], actions: Any = None) -> None:
        """Have all go through their stages.

        Raises:
            RuntimeError: another thread has them do so.
        """
        if not self._busy.acquire(blocking=False):
            raise RuntimeError("a batch must be played by one thread at a time")
        try:
            self._batch.tables["stage"] = stages
            if actions is None:
                actions = np.zeros((self.num_envs, 1))
            while self._play(actions):
                self._herds = construction.with_more_room(self._herds)
        finally:
            self._busy.release()

    def _check_open(self) -> None:
        if self.closed:
            raise gym.error.ClosedEnvironmentError("the environments are closed; make them anew")

    def _play(self, actions: Any) -> int:
        """The compiled call, in parts on several threads; how many environments lack room."""
        environments = Environments(self._batch, self._scenery, self._herds, self._given, self._output)

        def part(first: int, end: int) -> int:
            return advance(first, end, actions, self._choices, environments, (*room_for_call(), DATA))

        parts = min(4 * self._threads, self.num_envs // _SMALLEST_PART)
        if parts < 2 or self._threads == 1:
            return part(0, self.num_envs)
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self._threads)
        ends = np.linspace(0, self.num_envs, parts + 1).astype(int).tolist()
        return sum(self._pool.map(lambda pair: part(*pair), pairwise(ends)))

    def _checked(self, actions: Any) -> Any:
        """(B, D) the actions as numbers, if they are valid, except where an episode begins instead.

        Raises:
            gymnasium.error.InvalidAction: they are not.
        """
        space = self.single_action_space
        given, shape = array_of(actions), (self.num_envs, *(space.shape or ()))
        if given.shape != shape or given.dtype.kind not in ("iu" if self._discrete else "biuf"):
            expected = f"must be numbers of shape {shape}" + (" and of an integer type" * self._discrete)
            raise gym.error.InvalidAction(f"actions: {expected}, got {given.dtype} of {given.shape}")
        with np.errstate(over="ignore"):  # what is too large is refused below
            values = given.astype(np.float64)
        right = np.isfinite(values)
        if self._most is not None:
            right = (values >= 0) & (values < self._most)
        right = right.reshape(self.num_envs, -1).all(axis=1) | self._over  # of these only a reset comes
        if not right.all():
            b = int(np.flatnonzero(~right)[0])
            raise gym.error.InvalidAction(f"actions[{b}]: must be in {space}, got {given[b].tolist()}")
        return values.reshape(self.num_envs, -1)

    def _observed(self, numbers: npt.NDArray[np.float32]) -> Any:
        """Observations, of copies: their parts by name, or joined in the order of names."""
        if self._flat:
            return np.concatenate([numbers[:, self._parts[name]] for name in sorted(self._parts)], axis=1)
        copied = numbers.copy()
        return {name: copied[:, place] for name, place in self._parts.items()}

    def _infos(self, reports: Structs[Report], masks: BoolArray, who: BoolArray) -> dict[str, Any]:
        """Numbers of `info` with masks of who has them, as `VectorEnv` has infos."""
        values: dict[str, npt.NDArray[Any]] = {
            name: reports[name].copy()
            for name in ("accuracy", "wrong_labels", "paper_margin", "effort", "miscounts", "phase")
        }
        values |= {name: reports["terms"][:, k].copy() for k, name in enumerate(self._terms)}
        values[EFFORT] = reports["effort_cost"].copy()
        if self._discrete:
            values["action_mask"] = masks.copy()
        infos: dict[str, Any] = {}
        for name, value in values.items():
            if not who.all():
                value[~who] = 0
            infos[name], infos[f"_{name}"] = value, who.copy()
        return infos

    def _final(self, over: BoolArray) -> dict[str, Any]:
        """What episodes ended with that have been followed by others in this step."""
        output, rows = self._output, np.flatnonzero(over).tolist()
        seen, final = self._observed(output.last_numbers), np.full(self.num_envs, None, dtype=object)
        if self._flat:
            each: list[Any] = list(seen[over])
        else:
            each = [
                dict(zip(seen, parts, strict=True))
                for parts in zip(*(list(v[over]) for v in seen.values()), strict=True)
            ]
        for b, one in zip(rows, each, strict=True):
            final[b] = one
        told = self._infos(output.last_reports, output.last_masks, over)
        return {"final_obs": final, "_final_obs": over.copy(), "final_info": told, "_final_info": over.copy()}

    def _given_by(self, asked: Mapping[str, Any]) -> Given:
        """What `reset` was given, for kernels."""
        given, scene, config = construction.nothing_given(self.scene), self.scene, self.config
        if asked.get("layout") is not None:
            layout = given_layout(scene, asked["layout"])
            given.position[:], given.yaw[:], given.has[0] = layout.position, layout.yaw, True
        if asked.get("camera") is not None:
            fov = VisitCameras(scene, field_of_view(config.fov), config.game).fov
            given.eyes[0] = eyes_of(given_camera(asked["camera"], fov))[0]
            given.has[1] = True
        return given
