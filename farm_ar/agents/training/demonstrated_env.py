"""A batch of environments with a planner at the learner's side, which shows what it would do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from stable_baselines3.common.vec_env import VecEnvWrapper

from farm_ar.agents.policies.analytic import terms_of
from farm_ar.agents.policies.beam_search import search
from farm_ar.agents.policies.plan_steps import SHARES, Allowance, Table
from farm_ar.agents.training.demonstrations import CANDIDATES, Demonstration, demonstration
from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.batched.coverage import obstacle
from farm_ar.envs.batched.entry_point import arguments_of
from farm_ar.envs.batched.sb3 import BatchedVecEnv
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.generator import scene_of
from farm_ar.errors import OptionError
from farm_ar.geometry import wrap

LIFTED = {"carry": "lift", "perception": "oracle", "oracle_noise": "none"}
"""What a batch takes in place of a run's own values: the rest of the game is the run's."""


def lifted(env_id: str, arguments: Mapping[str, Any], count: int, seed: int, threads: int) -> DemonstratedEnv:
    """A batch of a run's environments in which the hand lifts and poses are true, whatever they are there.

    Args:
        env_id: of the run's environments.
        arguments: of these.
        count: how many.
        seed: of the first.
        threads: how many at most.

    Raises:
        OptionError: the others of the arguments cannot be batched.
    """
    where = "(which --imitate 0 --lift 0 leave out)"
    found = arguments_of(env_id, {**arguments, **LIFTED})
    if found is None:
        raise OptionError("env", f"must be an id of farm-ar that has batches {where}", env_id)
    config = EnvConfig(**found)
    problem = obstacle(config, scene_of(config.scene, config.game))
    if problem is not None:
        name, expected, got = problem
        raise OptionError(name, f"{expected} {where}", got)
    envs = DemonstratedEnv(BatchedVecEnv(count, threads, monitor=True, **found))
    envs.seed(seed)
    return envs


class DemonstratedEnv(VecEnvWrapper):
    """Environments in a batch, and a planner that shows what it would do before every step.

    The planner is the search of the analytic policy, which knows the paper's costs.

    Args:
        envs: with the action `displacement` or `slot`.

    Attributes:
        beam: how many plans the planner keeps; 0 for no planner.
        led: share of the steps in which what the planner would do is done.
        shown: what it would have done.
    """

    def __init__(self, envs: BatchedVecEnv) -> None:
        super().__init__(envs)
        self._batch, config, scene = envs.batch, envs.batch.config, envs.batch.scene
        self._terms = terms_of(scene, str(config.action), config.effort_weight)
        self._rng = np.random.default_rng(0)
        self.beam, self.led, self.shown = 0, 0.0, list[Demonstration]()

    def reset(self) -> Any:
        """Begin an episode in each."""
        return self.venv.reset()

    def step_async(self, actions: npt.NDArray[Any]) -> None:
        """What to do in each."""
        if self.beam:
            self.shown.append(shown := self.demonstrate(self.beam))
            led = self._rng.random(self.num_envs) < self.led
            best = np.argmax(shown.worth, axis=1)
            actions = np.array(actions, dtype=np.int64)
            actions[led] = shown.actions[led, best[led]]
        self.venv.step_async(actions)

    def step_wait(self) -> Any:
        """Do it."""
        return self.venv.step_wait()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Begin random numbers anew: which steps the planner leads, and episodes from the next reset on."""
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        return self.venv.seed(seed)

    def demonstrate(self, beam: int) -> Demonstration:
        """What the planner would do in every environment as it stands.

        Args:
            beam: how many unfinished plans it keeps.
        """
        state, config, scene = self._batch.state, self._batch.config, self._batch.scene
        number, tables = state.number, state.tables
        bodies: Any = state.bodies
        position = _met(np.stack([bodies["x"], bodies["z"]], axis=-1), number)
        yaw = wrap(-_met(bodies["angle"], number))
        home, facing = _met(state.believed, number), _met(state.facing, number)
        wrong = _met(state.holder, number) != number
        size, elevation = scene.layout.size, scene.layout.elevation
        count, m = number.shape
        worth = np.empty((count, m, m, len(SHARES)))
        for b in range(count):
            table = Table(
                position[b],
                yaw[b],
                home[b],
                facing[b],
                wrong[b],
                state.kind[b].copy(),
                ~state.fixed[b],
                size[number[b]],
                elevation[number[b]],
            )
            left: Any = tables[b]
            metres, radians, effort = float(left.metres), float(left.radians), np.inf
            if config.budget is not None:
                metres, radians, effort = np.inf, np.inf, float(left.effort)
            allowed = Allowance(metres, radians, effort, scene.diagonal, int(left.moves_left))
            steps = np.zeros((allowed.moves, 3), dtype=np.int64)
            search(table, state.eyes[b : b + 1], self._terms, allowed, beam, steps, worth[b])
        flat = worth.reshape(count, -1)
        best = np.argsort(-flat, axis=1, kind="stable")[:, :CANDIDATES]
        steps = np.stack(np.unravel_index(best, worth.shape[1:]), axis=-1)
        movable = int((~state.fixed[0]).sum())
        meant = self._meant(steps, (position, yaw), (home, facing), state.kind[:, :movable])
        return demonstration(meant, np.take_along_axis(flat, best, axis=1), movable)

    def _meant(
        self,
        steps: IntArray,
        truth: tuple[FloatArray, FloatArray],
        believed: tuple[FloatArray, FloatArray],
        kind: IntArray,
    ) -> IntArray:
        """(B, K, D) the actions that steps of plans mean; to end the turn is not among them."""
        which, label, share = np.moveaxis(steps, -1, 0)
        b = np.arange(len(steps))[:, None]
        if self._batch.config.action == "slot":
            kinds = kind[0]  # in all environments the same, kind by kind
            first = np.searchsorted(kinds, kinds[np.minimum(label, len(kinds) - 1)])
            return np.stack([which, label - first, share], axis=-1)
        part = SHARES[share]
        shift = part[..., None] * (believed[0][b, label] - truth[0][b, which])
        turn = part * wrap(believed[1][b, label] - truth[1][b, which])
        wanted = np.dstack([shift / self._terms.reach_m, turn / self._terms.reach_rad])
        last = self._terms.levels - 1
        levels = np.ceil((np.clip(wanted, -1.0, 1.0) + 1.0) / 2 * last - 0.5).astype(np.int64)
        return np.concatenate([which[..., None], levels], axis=-1)


def _met(values: npt.NDArray[Any], number: IntArray) -> npt.NDArray[Any]:
    """(B, M, ...) values in the agent's order of objects, from those by number."""
    index = number.reshape(*number.shape, *[1] * (values.ndim - 2))
    found: npt.NDArray[Any] = np.take_along_axis(values, index, axis=1)
    return found
