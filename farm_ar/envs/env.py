# ruff: noqa: E501  # a row of a table in its docstring is a line
"""The environment: an agent moves what a headset has to recognise again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import gymnasium as gym
import numpy as np

from farm_ar.arrays import BoolArray
from farm_ar.envs.actions import ACTIONS, checked_action
from farm_ar.envs.budget import Budget, EffortBudget, MotionBudget
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.controls import STEPS_PER_SECOND, Control, HandControl, MoveControl
from farm_ar.envs.features import AMBIGUITY, LEAST, Reading
from farm_ar.envs.generator import (
    StartingLayouts,
    VisitCameras,
    given_camera,
    given_layout,
    new_world,
    scene_of,
    unit_of,
)
from farm_ar.envs.observations import Left, PixelObservation, StateObservation
from farm_ar.envs.rewards import Reward
from farm_ar.envs.table import TableView, meeting_order
from farm_ar.envs.trace import Trace, state_digest
from farm_ar.envs.worlds import World
from farm_ar.errors import OptionError
from farm_ar.game_logic.belief import Sighting
from farm_ar.game_logic.headset import field_of_view
from farm_ar.game_logic.perception import Perception
from farm_ar.reid import ReidFactory
from farm_ar.scenes import Camera, Layout, Scene


class FarmToTableEnv(gym.Env[Any, Any]):
    """An agent moves what a headset has to recognise again.

    ## Description

    A table of toy buildings, several of which look exactly alike, under the eyes of an AR headset. The agent is the
    player's hand: it moves buildings while the headset waits. When the hand has left, the headset takes one snapshot
    through its narrow view, decides which building is which (by default with the rule of Yu et al.,
    doi:10.1007/s10055-025-01305-y), and the Farm-to-Table game goes on with what it now believes: chickens and bunnies
    run to where they believe the coop or hutch of their colour to be. The agent is paid for wrong beliefs and pays for
    effort. With `sign=-1` it is a helper instead, paid for right ones.

    | id | one step is |
    |---|---|
    | `FarmToTable-v0` | one pick-and-place, or leaving (`control="move"`) |
    | `FarmToTableHand-v0` | a tenth of a second of steering the hand (`control="hand"`) |
    | `FarmToTableLayout-v0` | a whole visit: a displacement for every building (`control="layout"`) |
    | `SceneLayout-v0` | the same in any scene, without physics and game (`control="layout"`, `game=False`) |

    A *visit* is the time from the hand's entering the view to its leaving it. The camera of its snapshot is drawn when
    it begins and can be observed. Only what the camera sees can be gripped. Buildings are pushed by what is dragged
    into them; the way that each of them goes counts as effort, tick by tick.

    ## Action Space

    N is the number of movable objects (farm: 10), K the most of one kind (farm: 5). Objects are numbered kind by kind,
    each kind from left to right as the camera sees it at the reset. Lengths are for the farm's table; in other scenes
    they grow with the diagonal.

    | control | `action` | space | meaning |
    |---|---|---|---|
    | `move` | `displacement` | `MultiDiscrete([N + 1, 7, 7, 7])` | which object, N for leaving; x, z in seven levels of ±0.3 m; turn in seven levels of ±90° |
    | `move` | `slot` | `MultiDiscrete([N + 1, K, 3])` | which object, N for leaving; towards the believed place of the j-th label of its kind; by .55, .8 or all of the way and turn |
    | `move` | `continuous` | `Box(-1, 1, (5,))` | where to pick (x, z over the table), how far to carry (±0.3 m), turn (±90°); a pick farther than 6 cm from any object in view is leaving |
    | `hand` | `velocity` | `Box(-1, 1, (4,))` | velocity x, z (1.5 m/s), twist (pi rad/s), grip when positive |
    | `layout` | `offsets` | `Box(-1, 1, (3 N,))` | x, z (±0.15 m) and turn (±45°) of every object |

    What exceeds the budget is scaled down, and the hand stops when what it does, pushed objects included, would exceed
    it. It is no hard limit: what was bumped into may still slide and spin on. In random play 61% of 717 visits of `move`
    and 37% of 752 of `hand` end over the budget, in metres by 2 mm and 17 mm in the median (at most 46 and 60 mm), in
    radians by 0.28 and 0.27 in the median (at most 1.8 and 2.3).

    `action_masks()` gives the choices that make sense for the discrete actions.

    ## Observation Space

    `observation="state"` is a `Dict` of `Box`es of float32, finite, clipped and flat (Stable-Baselines3 asks for that):
    `observation["position"].reshape(M, 2)` has a row for each of the M objects, in the order of the actions, the fixed
    ones last.

    | key | shape | meaning |
    |---|---|---|
    | `position` | (2 M,) | x, z, the table from -1 to 1 |
    | `heading` | (2 M,) | sin and cos of the yaw |
    | `category` | (kinds M,) | one-hot |
    | `in_view`, `fixed` | (M,) | 0 or 1 |
    | `camera` | (4,) | x, z like `position`, sin and cos of its yaw |
    | `budget` | (4,) | what is left of metres, radians, moves (or time) and visits, 0 to 1 |
    | `believed_position`, `believed_heading` | (2 M,) | of each object's own label; white-box only |
    | `difference` | (3 M,) | true less believed: x, z on the scale of `position`, yaw / pi; white-box only |
    | `cost` | (K' M,) | the paper's cost (Eq. 7) to each object of the labels of its kind, in order, K' the most of a kind, 2 where it has fewer; white-box only |
    | `margin` | (M,) | the paper's margin / 0.3 of a snapshot as things stand, 1 out of view; white-box only |
    | `hand` | (8,) | x, z, sin and cos of its yaw, velocity / 1.5 m/s, grip, in view; 0 when it has been withdrawn; control `hand` only |

    Costs and margins, here, in `info` and in the rewards `margin` and `clutter`, are those of the paper's rule with
    categories kept apart, whatever `reid` is. The margin of a detection is the rise of the total cost if it had to have
    another label.

    `observation="pixels"` is the table from above, `Box(0, 255, (96, W, 3), uint8)`.

    ## Rewards

    `sign` x harm - `effort_weight` x effort, effort = metres / diagonal + radians / pi of all objects together.

    | `reward` | harm of a step |
    |---|---|
    | `identity` | the rise of the number of wrong labels: those last read from another object than their own |
    | `margin` | the same + .5 x the rise of sum(1 - clip(margin / .3, 0, 1)) / 2 over the objects in view, of a snapshot as things stand |
    | `clutter` | the same + .5 x the rise of that sum over all movable objects, were they all in view and known to stand as they do; what a helper (`sign=-1`) can lower |
    | `miscount` | animals that got into the wrong building or arrived where nothing stands |
    | `endpoint` | the rise of the distance from believed to true places, summed, as a share of the diagonal |

    ## Starting State

    The scene's layout, redrawn by `jitter`, known to the game as it is. `reset(options={"layout": ..., "camera": ...})`
    sets either exactly.

    ## Episode End

    The episode terminates `play_seconds` after the snapshot of its last visit, within the same step. A visit ends by
    leaving, after its last move, or in control `hand` when the hand has been out of view and empty for half a second or
    its time is up. It is never truncated.

    ## Arguments

    All are keywords and, but for objects in place of names, JSON values.

    | argument | default | meaning |
    |---|---|---|
    | `scene` | `"farm"` | a built-in scene's name, a `.json` file, or a `Scene` |
    | `control`, `action` | by id | see Action Space |
    | `observation` | `"state"` | or `"pixels"` |
    | `knowledge` | `"white-box"` | or `"black-box"`: the player sees the table, not the headset's mind |
    | `reward`, `sign`, `effort_weight` | `"identity"`, 1, .25 | see Rewards |
    | `reid` | `"spatial"` | `likelihood`, `relational`, `nearest`, `distance`, `last-known`, or a function from a `Scene` to a `Reidentifier` |
    | `perception` | `"oracle"` | or a `Perception` |
    | `budget_m`, `budget_rad` | .6, pi / 2 | what a visit may move and turn |
    | `budget` | `None` | one effort in place of both |
    | `visits`, `moves` | 1, 6 | visits in an episode, moves in a visit |
    | `hand_seconds` | 12 | time of a visit in control `hand` |
    | `animals_a_second` | 10 | animals that leave the shed; about four times as many are on the table at once |
    | `jitter` | `"default"` | `"none"`, `"easy"` (SD .02 m, 6°), `"default"` (.05 m, 15°), `"hard"` (anywhere, .13 m apart) |
    | `play_seconds` | 5 | play after a snapshot |
    | `head_noise_deg` | 0 | SD of the head's turn between the begin of a visit and its snapshot |
    | `fov` | `"photo"` | 64.7° across, or `"display"`, 43° by 29° (HoloLens 2) |
    | `game` | `True` | physics, animals and counters |
    | `render_mode` | `None` | or `"rgb_array"` |

    ## Info

    `reset` and `step` return the same keys; none is an observation's.

    | key | type | meaning |
    |---|---|---|
    | `accuracy` | float | correct labels of the last snapshot as a share of its detections (Eq. 10), 0 to 1; 1 before the first |
    | `wrong_labels` | int | labels that were last read from another object than their own |
    | `paper_margin` | float | the least margin of a movable object in view, of a snapshot as things stand; 1 where none has another choice |
    | `effort` | float | of the step: metres / diagonal + radians / pi |
    | `miscounts` | int | animals so far that got into the wrong building or arrived where nothing stands |
    | `phase` | int | `Phase`: 0 (`PLAY`, animals run) or 1 (`HAND`, a visit is under way and they stand still) |
    | `reward/identity`, ... | float | the terms of the step's reward, weighted and signed: the reward is their sum; 0 at the reset |
    | `reward/effort` | float | what its effort costs, 0 or less |
    | `action_mask` | (sum of the choices,) bool | `action_masks()`; discrete actions only |

    ## Version History

    * v0: first version.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}  # noqa: RUF012  # Gymnasium's own form

    def __init__(
        self,
        *,
        scene: str | Scene = "farm",
        control: str = "move",
        action: str | None = None,
        observation: str = "state",
        knowledge: str = "white-box",
        reward: str = "identity",
        sign: int = 1,
        effort_weight: float = 0.25,
        reid: str | ReidFactory = "spatial",
        perception: str | Perception = "oracle",
        budget_m: float = 0.6,
        budget_rad: float = float(np.pi / 2),
        budget: float | None = None,
        visits: int = 1,
        moves: int = 6,
        hand_seconds: float = 12.0,
        animals_a_second: float = 10.0,
        jitter: str = "default",
        play_seconds: float = 5.0,
        head_noise_deg: float = 0.0,
        fov: str = "photo",
        game: bool = True,
        render_mode: str | None = None,
    ) -> None:
        given, before = locals(), set(vars(self))
        self._config = EnvConfig(**{f.name: given[f.name] for f in fields(EnvConfig)})
        if render_mode not in (None, *self.metadata["render_modes"]):
            expected = "must be rgb_array, through gym.make also rgb_array_list, or None; there is no window"
            raise OptionError("render_mode", expected, render_mode)
        self.render_mode = render_mode
        self._scene = scene_of(scene, game)
        self._diagonal = self._scene.diagonal
        self._reward = Reward(reward, self._config.sign, self._config.effort_weight)
        self._layouts = StartingLayouts(self._scene, jitter)
        self._cameras = VisitCameras(self._scene, field_of_view(fov), game)
        self._control = self._new_control()
        if control == "hand":
            self.metadata = {**self.metadata, "render_fps": STEPS_PER_SECOND}
        self.action_space = self._control.space
        self._masked = isinstance(self.action_space, gym.spaces.MultiDiscrete)
        white_box = knowledge == "white-box"
        self._observation: StateObservation | PixelObservation
        if observation == "state":
            self._observation = StateObservation(self._scene.layout, white_box, control == "hand")
        else:
            self._observation = PixelObservation(self._scene, white_box)
        self.observation_space = self._observation.space
        self._reading = Reading(self._scene, white_box and observation == "state", self._observation.length)
        self._trace: Trace | None = None
        self._view: TableView | None = None
        self._over = True
        self._frames: Any = None
        self._mine = (vars(self).keys() | _SET_LATER) - before

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: of `np_random`, from which all randomness comes.
            options: "layout", a `Layout` of the scene's objects or {"position": (N, 2), "yaw": (N,)}, and
                "camera", a `Camera` or a mapping of its fields; both are used exactly as they are.

        Raises:
            OptionError: an option is not known or cannot be used.
        """
        super().reset(seed=seed)
        self._trace, self._over = None, True
        if not isinstance(options, Mapping | None):
            raise OptionError("options", "must be a mapping with layout and camera, both optional", options)
        asked = dict(options or {})
        for name in asked:
            if name not in ("layout", "camera"):
                raise OptionError("options", "must hold layout and camera only", name)
        trace = Trace.begin(self.np_random, asked)
        layout, camera = self._layout(asked.get("layout")), self._camera(asked.get("camera"))
        self._world: World = new_world(self._scene, layout, camera, self._config, self.np_random)
        self._order = meeting_order(layout, camera)
        self._movable = self._order[layout.movable[self._order]]
        self._reading.meet(layout, self._order)
        self._visits_left = self._config.visits
        self._accuracy = 1.0
        self._trace, self._over = trace, False
        self._begin_visit()
        return self.observe(), self._info(0.0, self._reward.nothing())

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """One action. The episode ends within the step that takes its last snapshot.

        Raises:
            gymnasium.error.ResetNeeded: there is no episode under way.
            gymnasium.error.InvalidAction: the action has the wrong shape, or is no choice that there is.
        """
        if self._trace is None or self._over:
            raise gym.error.ResetNeeded("step() needs reset() first")
        values = checked_action(action, self._control.space)
        self._trace.actions.append(values)
        self._reward.begin(self)
        outcome = self._control.act(values, self._look, self._world, self._budget)
        if outcome.sighting is None:
            self._reward.foresee(self)
        if outcome.over:
            self._finish_visit(outcome.sighting)
        effort = outcome.motion.effort(self._diagonal)
        paid = self._reward.paid(self, effort)
        seen = self._observed() if outcome.over else self._observed_on()
        return seen, float(sum(paid.values())), self._over, False, self._info(effort, paid)

    def action_masks(self) -> BoolArray:
        """The choices that make sense now, flat over the action's dimensions; only for the discrete actions.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
            OptionError: the action is not discrete.
        """
        mask = self._control.mask(self.view)
        if mask is None:
            raise OptionError("action", "must be displacement or slot for masks", self._config.action)
        return mask

    def observe(self) -> Any:
        """The observation of now, as `reset` and `step` give it.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
        """
        self._require_reset()
        return self._observed()

    @property
    def config(self) -> EnvConfig:
        """What was chosen when the environment was made."""
        return self._config

    @property
    def control(self) -> Control:
        """How a visit is played."""
        return self._control

    @property
    def budget(self) -> Budget:
        """What is left for the visit.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
        """
        self._require_reset()
        return self._budget

    @property
    def view(self) -> TableView:
        """The table as it stands, for players that look behind the observation.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
        """
        world, view = self.world, self._view
        truth, believed, camera = world.truth, world.tracker.belief.layout, world.camera
        if view is None or (view.truth, view.believed, view.camera) != (truth, believed, camera):
            view = TableView(self._scene, truth, believed, camera, self._order, self._movable)
            self._view = view
        return view

    @property
    def ambiguity(self) -> float:
        """Half the sum over movable objects in view of 1 - `paper_margin` / 0.3, each from 0 to 1.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
        """
        self._reading.read(self.world)
        return self._reading.summary.item(AMBIGUITY)

    @property
    def world(self) -> World:
        """The game, or the plain scene, on which the episode plays.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
        """
        self._require_reset()
        return self._world

    def render(self) -> Any:
        """A picture of now, (H, W, 3) bytes, under `render_mode="rgb_array"`."""
        if self.render_mode is None:
            return None
        if self._frames is None:
            from farm_ar.drawing.game.frames import GameFrames

            self._frames = GameFrames(self._scene)
        return self._frames.frame(self.world.render_state())

    def trace(self) -> dict[str, Any]:
        """The episode so far as JSON values: what `farm_ar.envs.replay` plays again to the same hash.

        Raises:
            gymnasium.error.ResetNeeded: there is no episode.
            OptionError: an argument of the environment is an object, which has no name to be found by.
        """
        digest = self.state_hash()
        assert self._trace is not None
        arguments, again = self._arguments(), type(self).__new__(type(self))
        FarmToTableEnv.__init__(again, **arguments)  # a subclass may have other arguments
        return self._trace.as_json(arguments, digest, again)

    def state_hash(self) -> str:
        """A digest of all that may change in an episode; two equal ones mean equal states.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
        """
        left = [*self.world.state(), np.array(self._left())]
        return state_digest(left, self.np_random)

    def __getstate__(self) -> dict[str, Any]:
        return {
            "arguments": self._arguments(),
            "spec": self.spec,
            "spaces": (self.action_space, self.observation_space),
            "generator": (self._np_random, self._np_random_seed),
            "trace": self._trace,
            "own": {name: value for name, value in vars(self).items() if name not in self._mine},
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        FarmToTableEnv.__init__(self, **state["arguments"])  # a subclass may have other arguments
        vars(self).update(state["own"])
        self.spec = state["spec"]
        self.action_space, self.observation_space = state["spaces"]
        self._np_random, self._np_random_seed = state["generator"]
        if state["trace"] is not None:
            state["trace"].play_in(self)

    def _require_reset(self) -> None:
        if self._trace is None:
            raise gym.error.ResetNeeded("there is nothing to look at before reset()")

    def _arguments(self) -> dict[str, Any]:
        names = (f.name for f in fields(EnvConfig))
        return {name: getattr(self._config, name) for name in names} | {"render_mode": self.render_mode}

    def _new_control(self) -> Control:
        config, layout = self._config, self._scene.layout
        if config.control == "hand":
            return HandControl(config.hand_seconds)
        kinds = np.bincount(layout.category_code[layout.movable])
        action = ACTIONS[str(config.action)](int(kinds.sum()), int(kinds.max()), unit_of(self._scene))
        return MoveControl(action, config.moves if config.control == "move" else 1)

    def _layout(self, given: Layout | Mapping[str, Any] | None) -> Layout:
        return self._layouts.draw(self.np_random) if given is None else given_layout(self._scene, given)

    def _camera(self, given: Camera | Mapping[str, Any] | None) -> Camera:
        if given is None:
            return self._cameras.draw(self.np_random)
        return given_camera(given, self._cameras.fov)

    def _begin_visit(self) -> None:
        config = self._config
        self._budget: Budget
        if config.budget is None:
            self._budget = MotionBudget(config.budget_m, config.budget_rad)
        else:
            self._budget = EffortBudget(config.budget, self._diagonal)
        self._control.begin(self._world, self._budget)
        self._view = None

    def _finish_visit(self, sighting: Sighting | None) -> None:
        """Take the snapshot if the game has not, play on, and begin the next visit if there is one."""
        if sighting is None and self._config.control != "hand":
            sighting = self._world.end_visit()
        if sighting is not None:
            self._accuracy = float(sighting.accuracy)
        self._world.play(self._config.play_seconds)
        self._visits_left -= 1
        self._over = self._visits_left == 0
        if not self._over:
            self._world.camera = self._cameras.draw(self.np_random)
            self._begin_visit()

    def _observed(self) -> Any:
        self._reading.read(self._world)
        return self._observation.observe(self._reading, self._left(), self._world)

    def _observed_on(self) -> Any:
        """The same, after a step that did not end the visit."""
        world, reading = self._world, self._reading
        reading.read(world)
        return self._observation.observe_on(reading, self._control.left, self._budget.left, world)

    def _look(self) -> TableView:
        return self.view

    def _left(self) -> Left:
        """What is left of metres, radians, moves (or time) and visits, as shares."""
        metres, radians = self._budget.left
        return metres, radians, self._control.left, self._visits_left / self._config.visits

    def _info(self, effort: float, paid: dict[str, float]) -> dict[str, Any]:
        world = self._world
        info: dict[str, Any] = {
            "accuracy": self._accuracy,
            "wrong_labels": world.tracker.belief.wrong_labels,
            "paper_margin": self._reading.summary.item(LEAST),
            "effort": effort,
            "miscounts": world.miscounts,
            "phase": int(world.phase),
            **paid,
        }
        if self._masked:
            info["action_mask"] = self.action_masks()
        return info


_SET_LATER = frozenset(
    {
        *("_world", "_order", "_movable", "_visits_left", "_accuracy", "_budget", "_mine"),
        *("spec", "_np_random", "_np_random_seed"),
    }
)
"""Attributes that an environment gets after it was made, beside those of a subclass."""
