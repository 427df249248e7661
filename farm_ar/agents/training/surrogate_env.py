"""The surrogate environment: many tables at a time, without physics, for what can be learnt without it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv

from farm_ar.agents.policies.analytic import terms_of
from farm_ar.agents.policies.beam_search import search
from farm_ar.agents.policies.plan_steps import SHARES, Allowance, Table
from farm_ar.agents.training.demonstrations import CANDIDATES, Demonstration, demonstration
from farm_ar.agents.training.surrogate_kernels import Bodies, assess_all, carry_all
from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import DisplacementAction, SlotAction
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.features import MARGIN_SCALE, NO_RIVAL
from farm_ar.envs.generator import StartingLayouts, VisitCameras, scene_of, unit_of
from farm_ar.envs.rewards import MARGIN_SHARE
from farm_ar.envs.table import meeting_order
from farm_ar.errors import OptionError
from farm_ar.game_logic.headset import field_of_view
from farm_ar.game_logic.visibility import eyes_of
from farm_ar.geometry import wrap
from farm_ar.reid.assignment import Rule
from farm_ar.scenes import Camera, Layout, visible

DISC = 1.0
"""Radius of an object's disc as a share of half its mean side."""

ONLY = {
    "control": "move",
    "observation": "state",
    "knowledge": "white-box",
    "reid": "spatial",
    "session": "off",
    "perception": "oracle",
    "budget": None,
    "visits": 1,
    "head_noise_deg": 0.0,
    "game": True,
}
"""What it can stand for."""

REWARDS = ("identity", "margin", "clutter")
"""The rewards that do not look at animals or endpoints."""


class SurrogateEnv(VecEnv):
    """`FarmToTable-v0` on many tables at once, with discs that push one another in place of physics.

    Layouts, cameras, budget, observations and rewards are the environment's own; the method is the paper's,
    for objects of one size in each category. Only the ways that objects take when they are pushed differ.

    Args:
        count: how many tables.
        seed: of layouts and cameras.
        arguments: of the environment.

    Attributes:
        beam: how many plans a planner keeps that shows what it would do before every step; 0 for no planner.
        led: share of the steps in which what the planner would do is done.
        shown: what it would have done.

    Raises:
        OptionError: they ask for something that it cannot stand for.
    """

    def __init__(self, count: int, seed: int, **arguments: Any) -> None:
        self._chosen = option = EnvConfig(**arguments)
        where = "in the surrogate environment (which --imitate 0 --rehearse 0 leave out)"
        for name, value in ONLY.items():
            if getattr(option, name) != value:
                raise OptionError(name, f"must be {value} {where}", getattr(option, name))
        if option.reward not in REWARDS:
            raise OptionError("reward", f"must be {', '.join(REWARDS)} {where}", option.reward)
        if option.action not in ("displacement", "slot"):
            raise OptionError("action", f"must be displacement or slot {where}", option.action)
        self._scene = scene = scene_of(option.scene, True)
        for category in scene.layout.categories:
            sizes = scene.layout.size[np.array(scene.layout.category) == category]
            if np.any(sizes != sizes[0]):  # the method's costs would depend on them
                expected = f"must hold objects of one size in each category {where}"
                raise OptionError("scene", expected, f"{category} of several sizes")
        env = FarmToTableEnv(**arguments)
        super().__init__(count, env.observation_space, env.action_space)
        self._layouts = StartingLayouts(scene, option.jitter)
        self._cameras = VisitCameras(scene, field_of_view(option.fov), True)
        self._rng = np.random.default_rng(seed)
        self.beam, self.led, self.shown = 0, 0.0, list[Demonstration]()
        self._terms = terms_of(scene, str(option.action), option.effort_weight)
        self._learn_objects(scene.layout)
        weights, m = scene.cost_weights, len(scene.layout)
        self._rule = Rule(weights.translation / scene.diagonal, float(weights.rotation))
        self._position, self._home = np.empty((count, m, 2)), np.empty((count, m, 2))
        self._yaw, self._facing = np.empty((count, m)), np.empty((count, m))
        self._eye, self._gaze = np.empty((count, 2)), np.empty((3, count))
        self._left, self._moves = np.empty((count, 2)), np.empty(count, dtype=np.int64)
        self._cost = np.full((count, m, self._widest), NO_RIVAL)
        self._margin, self._wrong = np.empty((count, m)), np.empty(count, dtype=np.int64)
        self._seen: BoolArray = np.zeros((count, m), dtype=np.bool_)
        self._total, self._length = np.zeros(count), np.zeros(count, dtype=np.int64)
        self._actions: IntArray = np.zeros((count, 1), dtype=np.int64)

    def reset(self) -> Any:
        """Begin an episode on every table."""
        for b in range(self.num_envs):
            self._begin(b)
        self._look()
        return self._observation()

    def step_async(self, actions: npt.NDArray[Any]) -> None:
        """What to do on each table."""
        self._actions = np.array(actions, dtype=np.int64)
        if self.beam:
            self.shown.append(shown := self.demonstrate(self.beam))
            led = self._rng.random(self.num_envs) < self.led
            best = np.argmax(shown.worth, axis=1)
            self._actions[led] = shown.actions[led, best[led]]

    def step_wait(self) -> Any:
        """Do it. An episode that is over is followed by another."""
        option, b, before = self._chosen, np.arange(self.num_envs), self._closeness()
        which = self._actions[:, 0].copy()
        leaves = which == self._movable
        which[leaves] = 0
        shift, turn = self._asked(which)
        idle = leaves | ~self._seen[b, which]
        metres, radians = np.linalg.norm(shift, axis=1), np.abs(turn)
        shift *= _share(self._left[:, 0], metres)[:, None]
        turn *= _share(self._left[:, 1], radians)
        moved = np.empty((self.num_envs, 2))
        carried, poses = np.where(idle, -1, which), (self._position, self._yaw)
        carry_all(carried, shift, turn, *poses, self._bodies, moved)
        self._left = np.maximum(self._left - moved, 0.0)
        self._moves -= 1
        self._look()
        over = leaves | (self._moves == 0)
        effort = moved[:, 0] / self._scene.diagonal + moved[:, 1] / np.pi
        harm = np.where(over, self._wrong, 0.0) + MARGIN_SHARE * (self._closeness() - before)
        rewards = option.sign * harm - option.effort_weight * effort
        self._total += rewards
        self._length += 1
        infos: list[dict[str, Any]] = [{} for _ in b]
        if over.any():
            self._end(np.flatnonzero(over), infos)
        return self._observation(), rewards.astype(np.float32), over, infos

    def action_masks(self) -> BoolArray:
        """(B, choices) what makes sense now, as the environment says it."""
        rest = np.ones((self.num_envs, 1 + int(self._nvec[1:].sum())), dtype=np.bool_)
        return np.concatenate([self._seen[:, : self._movable], rest], axis=1)

    def demonstrate(self, beam: int) -> Demonstration:
        """What a planner would do on every table as it stands.

        Args:
            beam: how many unfinished plans it keeps.
        """
        count, layout = self.num_envs, self._template
        yaw, pitch, height = self._gaze
        cameras = Camera(self._eye, yaw, self._cameras.fov, height, pitch)
        worth = np.empty((count, len(layout), len(layout), len(SHARES)))
        nothing_wrong = np.zeros(len(layout), dtype=np.bool_)
        what: Any = [self._code.copy(), ~self._fixed, layout.size.copy(), layout.elevation.copy()]
        for b in range(count):
            table = Table(
                self._position[b],
                self._yaw[b],
                self._home[b],
                self._facing[b],
                nothing_wrong,
                *what,
            )
            metres, radians = self._left[b].tolist()
            allowed = Allowance(metres, radians, np.inf, self._scene.diagonal, int(self._moves[b]))
            steps = np.zeros((allowed.moves, 3), dtype=np.int64)
            search(table, eyes_of(cameras.at(b)), self._terms, allowed, beam, steps, worth[b])
        flat = worth.reshape(count, -1)
        best = np.argsort(-flat, axis=1, kind="stable")[:, :CANDIDATES]
        steps = np.stack(np.unravel_index(best, worth.shape[1:]), axis=-1)
        return demonstration(self._meant(steps), np.take_along_axis(flat, best, axis=1), self._movable)

    def _meant(self, steps: IntArray) -> IntArray:
        """(B, K, D) the actions that steps of plans mean; leaving is not among them."""
        which, label, share = np.moveaxis(steps, -1, 0)
        if self._chosen.action == "slot":
            kind = np.searchsorted(self._starts, which, side="right") - 1
            return np.stack([which, label - self._starts[kind], share], axis=-1)
        b, part = np.arange(self.num_envs)[:, None], SHARES[share]
        shift = part[..., None] * (self._home[b, label] - self._position[b, which])
        turn = part * wrap(self._facing[b, label] - self._yaw[b, which])
        wanted = np.dstack([shift / self._terms.reach_m, turn / self._terms.reach_rad])
        last = self._terms.levels - 1
        levels = np.ceil((np.clip(wanted, -1.0, 1.0) + 1.0) / 2 * last - 0.5).astype(np.int64)
        return np.concatenate([which[..., None], levels], axis=-1)

    def _end(self, over: IntArray, infos: list[dict[str, Any]]) -> None:
        last = self._observation()
        for b in over:
            infos[b]["terminal_observation"] = {name: values[b] for name, values in last.items()}
            infos[b]["episode"] = {"r": float(self._total[b]), "l": int(self._length[b]), "t": 0.0}
            self._begin(b)
        self._look()

    def _begin(self, b: int) -> None:
        layout, camera = self._layouts.draw(self._rng), self._cameras.draw(self._rng)
        order = meeting_order(layout, camera)
        self._position[b] = self._home[b] = layout.position[order]
        self._yaw[b] = self._facing[b] = layout.yaw[order]
        self._eye[b] = camera.position
        self._gaze[:, b] = camera.yaw, camera.pitch, camera.height
        self._left[b] = self._chosen.budget_m, self._chosen.budget_rad
        self._moves[b] = self._chosen.moves
        self._total[b], self._length[b] = 0.0, 0

    def _learn_objects(self, layout: Layout) -> None:
        """What does not change: objects stand kind by kind, the fixed ones last."""
        order = np.lexsort((layout.category_code, layout.fixed))
        code = layout.category_code[order]
        self._code, self._fixed, self._kinds = code, layout.fixed[order], len(layout.categories)
        self._movable = int((~self._fixed).sum())
        self._starts = np.flatnonzero(np.diff(code, prepend=-1, append=-1))
        self._widest = int(np.diff(self._starts).max())
        half = layout.size[order][:, [0, 2]] / 2
        size = np.array(self._scene.size, dtype=np.float64)
        self._bodies = Bodies(DISC * half.mean(axis=1), self._fixed, half, size)
        self._template = Layout(
            tuple(str(i) for i in order),
            tuple(layout.category[i] for i in order),
            layout.position[order],
            layout.yaw[order],
            layout.size[order],
            layout.elevation[order],
            self._fixed,
        )
        space = self.action_space
        assert isinstance(space, spaces.MultiDiscrete)
        self._nvec = space.nvec

    def _asked(self, which: IntArray) -> tuple[FloatArray, FloatArray]:
        """(B, 2) metres and (B,) radians that the actions ask for, before the budget."""
        b, levels = np.arange(self.num_envs), DisplacementAction.LEVELS
        if self._chosen.action == "displacement":
            shift = 0.3 * unit_of(self._scene) * levels[self._actions[:, 1:3]]
            return shift, np.pi / 2 * levels[self._actions[:, 3]]
        kind = np.searchsorted(self._starts, which, side="right") - 1
        first, count = self._starts[kind], np.diff(self._starts)[kind]
        label = first + self._actions[:, 1] % count
        share = np.asarray(SlotAction.SHARES)[self._actions[:, 2]]
        shift = share[:, None] * (self._home[b, label] - self._position[b, which])
        turn: FloatArray = share * wrap(self._facing[b, label] - self._yaw[b, which])
        return shift, turn

    def _look(self) -> None:
        """What the camera sees, and what the method would say."""
        yaw, pitch, height = self._gaze
        cameras = Camera(self._eye, yaw, self._cameras.fov, height, pitch)
        self._seen = visible(self._template.with_poses(self._position, self._yaw), cameras)
        poses = self._position, self._yaw, self._home, self._facing
        self._margin, self._wrong = assess_all(*poses, self._seen, self._starts, self._rule, self._cost)

    def _closeness(self) -> FloatArray:
        """(B,) what the reward looks at beside wrong labels: `TableView`'s ambiguity, its clutter, or 0."""
        n, margin = self._movable, self._margin
        if self._chosen.reward == "identity":
            return np.zeros(self.num_envs)
        if self._chosen.reward == "clutter":
            poses, everything = (self._position, self._yaw), np.ones_like(self._seen)
            margin, _ = assess_all(
                *poses, *poses, everything, self._starts, self._rule, np.empty_like(self._cost)
            )
        closeness: FloatArray = (1 - np.clip(margin[:, :n] / MARGIN_SCALE, 0.0, 1.0)).sum(axis=1) / 2
        return closeness

    def _observation(self) -> dict[str, npt.NDArray[np.float32]]:
        option, size = self._chosen, np.asarray(self._scene.size)
        turned = wrap(self._yaw - self._facing) / np.pi
        values = {
            "position": 2 * self._position / size - 1,
            "heading": _heading(self._yaw),
            "category": np.tile(np.eye(self._kinds)[self._code], (self.num_envs, 1, 1)),
            "in_view": self._seen,
            "fixed": np.broadcast_to(self._fixed, self._seen.shape),
            "camera": np.concatenate([2 * self._eye / size - 1, _heading(self._gaze[0])], axis=1),
            "budget": np.column_stack(
                [
                    self._left / [option.budget_m, option.budget_rad],
                    self._moves / option.moves,
                    np.ones(self.num_envs),
                ]
            ),
            "believed_position": 2 * self._home / size - 1,
            "believed_heading": _heading(self._facing),
            "difference": np.dstack([2 * (self._position - self._home) / size, turned]),
            "cost": self._cost,
            "margin": np.minimum(self._margin / MARGIN_SCALE, 1.0),
        }
        assert isinstance(self.observation_space, spaces.Dict)
        result = {}
        for name, space in self.observation_space.spaces.items():
            assert isinstance(space, spaces.Box)
            low, high = space.low.flat[0], space.high.flat[0]
            flat = values[name].reshape(self.num_envs, -1)
            result[name] = np.clip(flat, low, high).astype(np.float32)
        return result

    def close(self) -> None:
        """Nothing is open."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute, once for each table; the tables have none of their own."""
        value = self.action_masks if attr_name == "action_masks" else getattr(self, attr_name, None)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Nothing can be set."""
        raise AttributeError(attr_name)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call `action_masks`, which is all that learners ask for."""
        if method_name != "action_masks":
            raise AttributeError(method_name)
        masks = self.action_masks()
        return [masks[b] for b in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Whether wrapped; the returns of episodes are noted as if by a monitor."""
        return [False for _ in self._get_indices(indices)]

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Begin the random numbers anew."""
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        return [seed] * self.num_envs


def _share(left: FloatArray, asked: FloatArray) -> FloatArray:
    return np.where(asked > left, left / np.maximum(asked, 1e-12), 1.0)


def _heading(yaw: FloatArray) -> FloatArray:
    return np.stack([np.sin(yaw), np.cos(yaw)], axis=-1)
