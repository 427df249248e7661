# ruff: noqa: E501  # a row of a table in its docstring is a line
"""The environment: an agent moves objects that a headset has to identify again."""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping
from typing import Any

import gymnasium as gym

from farm_ar.arrays import BoolArray
from farm_ar.envs.actions import checked_action
from farm_ar.envs.budget import Budget, budget_of, in_turn
from farm_ar.envs.config import EnvConfig, render_modes
from farm_ar.envs.controls import Control, control_of
from farm_ar.envs.features import Features
from farm_ar.envs.generator import Generator, checked_options, scene_of
from farm_ar.envs.observations import OBSERVATIONS, Left
from farm_ar.envs.recorded import RecordedEnv
from farm_ar.envs.rewards import Reward
from farm_ar.envs.table import TableView, meeting_order
from farm_ar.envs.trace import Trace
from farm_ar.envs.window import Window, open_window
from farm_ar.envs.worlds import World, new_world
from farm_ar.errors import OptionError
from farm_ar.game_logic.belief import Sighting


class FarmToTableEnv(RecordedEnv):
    """An agent moves identical objects that a headset has to identify again.

    ## Description

    A table of toy buildings, several of which look exactly alike, seen by an AR headset. The agent is the hand of the
    player: it moves buildings while the headset waits. When the hand has left, the headset takes one snapshot
    through its narrow view, decides which building is which (by default with the method of Yu et al.,
    doi:10.1007/s10055-025-01305-y), and the Farm-to-Table game goes on with what it now believes: chickens and bunnies
    run to where they believe the coop or hutch of their colour to be. The agent is rewarded for wrong labels and pays for
    effort. With `sign=-1` it is a helper instead, rewarded for right ones.

    | id | one step is |
    |---|---|
    | `FarmToTable-v0` | one pick-and-place, or the end of the turn (`control="move"`) |
    | `FarmToTableHand-v0` | velocity control of the hand for 0.1 s (`control="hand"`) |
    | `FarmToTableHandLift-v0` | the same with `carry="lift"`: an open or closed hand bumps into nothing |
    | `FarmToTableLayout-v0` | a whole visit: a displacement for every building (`control="layout"`); so an episode of one visit is one step |
    | `SceneLayout-v0` | the same in any scene, without physics and game (`control="layout"`, `game=False`); one step too |

    Each of these has three variants. `FarmToTableDiscrete-v0`, `SceneLayoutDiscrete-v0` and so on have `action="discrete"` and
    `observation="flat"`, for learners such as DQN and CleanRL's `ppo.py`. `FarmToTableBlackBox-v0` and so on have
    `knowledge="black-box"`. `FarmToTableShaped-v0` and so on have `reward="shaped"`, to train learners without a recipe that are
    then evaluated with the id itself.

    `farm_ar.envs.two_players.env()` is a table for two agents with PettingZoo's interface (extra `pettingzoo`): an adversary's visit,
    then a helper's, whose gain is the adversary's loss.

    A second environment, `DeliverToChair-v0`, has a page below: a robot that must find one of several identical chairs.

    Write `gym.make("farm_ar:FarmToTable-v0")`: the module before the colon registers the id, also in the worker processes of
    vectorized environments (`SubprocVecEnv`, RLlib, TorchRL), where nothing that was imported elsewhere is registered.

    `gym.make_vec("farm_ar:FarmToTable-v0", num_envs=1024, carry="lift")` steps many environments in one compiled call, bit for bit
    as one by one: [batched.md](batched.md).

    A *visit* is the time from the hand's entering the view to its leaving it. The camera of its snapshot is drawn when
    it begins and can be observed. Only what the camera sees can be gripped. Buildings are pushed by what is dragged
    into them; the path length of each of them counts as effort, tick by tick.

    **Frame and units.** Metres, seconds, radians. The origin is the table's near left corner, x points right, z away from the
    player, y up. A yaw is clockwise seen from above, 0 along +z. The farm's table is 1.2 m wide and 0.8 m deep; *diagonal* is the
    root of width² + depth², 1.442 m there. `farm-ar scenes show farm --json` prints poses, sizes (width, height, depth) and categories.

    **Snapshot and labels.** The snapshot has the objects whose pivots the camera sees, the shed among them, from left to right. The
    paper's method gives each a label of its category at the least total cost, one label to at most one detection, with all labels as
    candidates (threshold 1). The cost of label j for detection i is

        exp(sum over k of |ln a_ik - ln b_jk|) (w_t |p_i - q_j| / diagonal + w_r |sin((u_i - v_j) / 2)|)

    with p, u the detected position and yaw, q, v those where the label is believed to be, and a, b the three sides of each in order
    of length. On the farm w_t = w_r = 1; a scene without weights has w_t = 0.36 x the root of its area in m², w_r = 1. The believed
    pose of a label becomes that of its detection; labels that no detection has keep theirs, and fixed objects always do.

    ## Action Space

    N is the number of movable objects (farm: 10), K the most of one category (farm: 5). Objects are numbered category by category,
    each category from left to right as the camera sees it at the reset. Lengths are for the farm's table; in another scene they are
    multiplied by its diagonal / 1.442 m.

    | control | `action` | space | meaning |
    |---|---|---|---|
    | `move` | `displacement` | `MultiDiscrete([N + 1, 7, 7, 7])` | which object, N to end the turn; x and z in 7 equal steps from -0.3 to 0.3 m; turn in 7 equal steps from -90° to 90° |
    | `move` | `slot` | `MultiDiscrete([N + 1, K, 3])` | which object, N to end the turn; towards the believed pose of the j-th label of its category (j modulo their number); by 0.55, 0.8 or all of the shift and the turn |
    | `move` | `discrete` | `Discrete(3 N K + 1)` | the choices of `slot` as one number, (object K + label) 3 + share; 3 N K to end the turn |
    | `move` | `continuous` | `Box(-1, 1, (5,))` | where to pick (x, z, the table from -1 to 1), how far to carry (±0.3 m), turn (±90°); it takes the nearest object in view, and a pick farther than 6 cm from all of them ends the turn |
    | `hand` | `velocity` | `Box(-1, 1, (4,))` | velocity x, z (1.5 m/s), twist (pi rad/s), grip when positive |
    | `hand` | `discrete` | `Discrete(20)` | 0: still; 1 to 8: 0.75 m/s along (x, z) = (-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1), all with an open hand; 9 to 17 the same, closed; 18 and 19: twist by pi rad/s anticlockwise and clockwise, closed |
    | `layout` | `offsets` | `Box(-1, 1, (3 N,))` | x, z (±0.15 m) and turn (±45°) of every object |
    | `layout` | `discrete` | `Discrete(3 N K + 1)` | two of a category change places: the object first, then the label's own, numbered as in `move`; by 0.55, 0.8 or all of their shifts and turns; 3 N K moves nothing |

    The moves of a visit in `layout` are executed one after the other in the order of the objects; an object that is out of view
    when its turn comes stays, as does one that is picked out of view in `move`, where that uses up a move.

    What exceeds the budget is scaled down: all shifts of a step by one factor, all turns by another (under `budget`, both by one).
    The hand stops when what it does, pushed objects included, would exceed the budget by more than 1 mm or 0.01 rad, what still
    slides counted (0.072 s x velocity, for what is held 0.02 s²/m x velocity²). It is no hard limit: what was bumped into may still
    slide and spin on. In random play 75% of 2000 visits of `move` end over the budget (48% in metres, by 0.5 mm in the median and
    55 mm at most; 70% in radians, by 0.14 and 1.8), and 39% of 2000 of `hand` (6% in metres, by 15 and 83 mm; 35% in radians, by
    0.31 and 2.9): `python benchmarks/environment_numbers.py`.

    `action_masks()` gives the choices that make sense for the discrete actions: what is in view, and for `discrete` only
    what would move anything, each pair once, and twists only of what is held.

    ## Observation Space

    `observation="state"` is a `Dict` of `Box`es of float32, finite, clipped to the bounds listed below, and flat (as Stable-Baselines3
    requires): `observation["position"].reshape(M, 2)` has a row for each of the M objects, in the order of the actions, the fixed
    ones last.

    | key | shape | meaning |
    |---|---|---|
    | `position` | (2 M,) | x, z, the table from -1 to 1 |
    | `heading` | (2 M,) | sin and cos of the yaw |
    | `category` | (categories x M,) | one-hot |
    | `in_view`, `fixed` | (M,) | 0 or 1 |
    | `camera` | (4,) | x, z like `position`, sin and cos of its yaw |
    | `budget` | (4,) | what is left of metres, radians, moves (or time) and visits, 0 to 1 |
    | `believed_position`, `believed_heading` | (2 M,) | of each object's own label; white-box only |
    | `difference` | (3 M,) | true less believed: x, z on the scale of `position`, yaw / pi; white-box only |
    | `cost` | (K' M,) | the paper's cost (Eq. 7) to each object of the labels of its category, in order, K' the most of a category, 2 where it has fewer; white-box only |
    | `margin` | (M,) | the paper's margin / 0.3 of a snapshot taken now, 1 out of view; white-box only |
    | `hand` | (8,) | x, z like `position`, sin and cos of its yaw, velocity / 1.5 m/s, grip, and whether the visit has begun; 0 when it has been withdrawn; control `hand` only |

    Costs and margins, here, in `info` and in the rewards `margin` and `clutter`, are those of the paper's method with
    categories kept apart, whatever `reid` is. The margin of a detection is the rise of the total cost if it had to have
    another label.

    `observation="flat"` is the same in one `Box`, the parts joined in the order of their names. `"pixels"` is the table from
    above, `Box(0, 255, (96, W, 3), uint8)`; `"headset"` is what the headset's camera sees, `Box(0, 255, (84, 84, 3), uint8)`:
    buildings, shed, table and hand, without labels.

    ## Rewards

    `sign` x harm - `effort_weight` x effort, effort = metres / diagonal + radians / pi of all objects together.

    | `reward` | harm of a step |
    |---|---|
    | `identity` | the rise of the number of wrong labels: those last read from another object than their own |
    | `margin` | the same + 0.5 x the rise of sum(1 - clip(margin / 0.3, 0, 1)) / 2 over the movable objects in view, of a snapshot taken now |
    | `shaped` | the same as `identity` + the rise of sum((1 - clip(m / 0.3, -1, 1)) / 2) over the movable objects in view, of a snapshot taken now; m is the margin, negative where the label would be wrong |
    | `clutter` | the same as `identity` + 0.5 x the rise of that sum over all movable objects, were they all in view and known to stand as they do; what a helper (`sign=-1`) can lower |
    | `miscount` | animals that got into the wrong building or ended at an empty spot |
    | `endpoint` | the rise of the distance from believed to true positions, summed, as a share of the diagonal |

    `margin` and `shaped` speak of the snapshot to come: in the last step of a visit they are measured before it is taken, and in control
    `hand` the step in which the visit ends by itself does not change them.

    ## Starting State

    The scene's layout, redrawn by `jitter`, known to the game as it is: truth and belief alike. `easy` and `default` add
    normal noise to every movable object's x, z and yaw, then clip them: the pivot stays half the footprint's diagonal from the table's
    edges, and a yaw that was within 30° of 0 stays within 30°, so that the yaws of `default`, SD 15°, have an SD of 12.9°. `hard` draws
    x and z uniformly, centres 0.13 m apart (or 0.6 x the root of the room's area / number of objects, where that is less), clips them
    likewise, and draws yaws uniformly from -30° to 30°. Footprints that are apart in the scene's own layout (under `hard`, all) stay 5 mm
    apart. Objects are placed in random order, each at the first of up to 50 poses that keeps these distances; where there is none, all
    are placed anew; after every ten failed attempts `hard` asks for a tenth less of the 0.13 m, and after 100 the layout is the scene's
    own. Lengths grow with the diagonal.

    The camera of a visit is drawn on the farm's table as uniform x from 0.3 to 0.9 m and z from -0.40 to -0.25 m, 0.45 m above the
    table, looking at a uniform point of it, x from 0.1 to 1.1 m, z from 0.3 to 0.6 m, and in proportion to width and depth on another
    table. It sees an object whose pivot (the middle of its box's bottom face) is at most 3 m away and within the angles of `fov`; nothing hides
    anything. 6.3 to 6.5 of the 10 movable buildings are in view on average. A scene without the game that has a camera path has one of
    200 equally spaced poses on it, and its own field of view and range. The layout is drawn first, then the camera, then the animals'
    lanes.

    `reset(options=...)` sets either exactly:

    | option | form |
    |---|---|
    | `layout` | a `Layout` of the scene's objects, or `{"position": (N, 2), "yaw": (N,)}` for all objects in the scene's order: x and z in metres, the yaw in radians, clockwise from above, 0 along +z |
    | `camera` | a `Camera`, or `{"position": (x, z), "yaw": radians}`; optional `"height"` above the table in metres (None: no vertical limits), `"pitch"` in radians, positive upwards, and `"fov"`, a `FieldOfView` or a mapping of its `left`, `right`, `range_m`, `up` and `down` |

    The other visits' cameras are drawn.

    ## Episode End

    The episode terminates `play_seconds` after the snapshot of its last visit, within the same step. A visit ends when
    the turn is ended, after its last move, or in control `hand` when the hand has been out of view and empty for 0.5 s or
    its time is up; a hand that was never in view leaves without a snapshot. Each visit has the whole budget. It is never truncated.

    ## Physics

    With the game, objects are boxes on a plane (Chipmunk, through pymunk): 1 kg each, friction 0.3 between surfaces, footprints
    1 mm wider on every side than the object; a sliding object keeps 1e-6 of its velocity after a second, so one let go at 1 m/s
    slides 7 cm. A tick is 1/60 s, of one to three steps of 20 iterations; 30% of an overlap is undone in a tick. The table's edge and
    fixed objects do not move. When all is at rest, footprints that still overlap by more than 0.2 mm are moved apart, each by half.

    The hand is a disc of 3 cm radius that pulls what it holds with at most 30 N and 3 Nm, moves at 1.5 m/s and pi rad/s at most, and
    may go 0.5 m beyond the table. In `move` and `layout` it comes in above the buildings at z = -0.15 m and the object's x, takes the
    object at its pivot, drags it along a straight line, turning the shorter way, from rest to rest (smoothstep 3 t² - 2 t³) at 0.75 m/s
    and pi rad/s at most, is corrected every 3 ticks, presses on at its goal for up to 0.5 s where something holds it up, lets go and
    leaves; then all comes to rest. In `hand` it starts at (width / 2, -0.5 m), is steered for 6 ticks a step, bumps into what is in its
    way, and when it closes grips the nearest building if that is in view and its footprint within 6 cm. It is in view when the camera
    sees any of a strip 6 cm wide and 6 cm high from the hand's middle to z = -0.45 m. With `carry="lift"` nothing is pushed: what is held
    follows the hand over the others, and is set down at the first free pose on the straight way back to where it was taken from.

    Animals run at 0.12 m/s on cubic Bézier curves from the shed's door (the middle of its front, where its yaw points) to the centre of
    where their label is believed to be. The label in place k of n sends its j-th animal after (j + k / n) n / `animals_a_second`
    seconds, on lane j modulo 4; the lanes bow out by a normal random number of SD 3 cm, and further, as little as needed, past other
    buildings. Each inner control point lies 0.3 of the distance ahead of its end, the way that building's yaw points. An animal arrives when it first enters the
    footprint of the real building that covers the end of its curve; where none does, it ends there, at an empty spot. They have been
    leaving the shed for 8 s when an episode begins, and stand still during a visit. After a snapshot the rest of each curve is split
    off where the animal is, and its last two control points move with the label.

    Without the game a move sets a pose at once, pushes nothing, and keeps the pivot in the room.

    ## Arguments

    They are the fields of `EnvConfig`: keywords and, but for objects in place of names, JSON values.

    | argument | default | meaning |
    |---|---|---|
    | `scene` | `"farm"` | a built-in scene's name, a `.json` file, or a `Scene` |
    | `control`, `action` | by id | see Action Space |
    | `observation` | `"state"` | or `"flat"`, `"pixels"`, `"headset"` |
    | `knowledge` | `"white-box"` | or `"black-box"`: the policy sees the table, not the headset's belief state |
    | `reward`, `sign`, `effort_weight` | `"identity"`, 1, 0.25 | see Rewards |
    | `reid` | `"spatial"` | any re-identifier's name ([files.md](files.md#methods-and-options-of-farm-ar-identify)), or a function from a `Scene` to a `Reidentifier` |
    | `session` | `"off"` | or `"learn"`, with `reid="adaptive"`: it learns from the answers of an episode how far things are moved |
    | `perception` | `"oracle"` | true poses; `"pixels"`: poses estimated from a picture of 640 x 360 pixels, by the headset's camera; or a `Perception` |
    | `oracle_noise` | `"none"` | `"measured"`: true poses with the errors, misses and false detections that were measured on such pictures |
    | `budget_m`, `budget_rad` | 0.6, pi / 2 | what a visit may move and turn all objects together, metres and radians |
    | `budget` | `None` | one effort in place of both |
    | `visits`, `moves` | 1, 6 | visits in an episode, `None` for no end; moves in a visit |
    | `hand_seconds` | 12 | time of a visit in control `hand` |
    | `steps_per_second` | 10 | steps a second in control `hand`: 10, 20, 30 or 60 |
    | `carry` | `"drag"` | or `"lift"`: the hand lifts a building over the others, pushes nothing, and sets it down where there is room, else at the first free pose on the straight way back; no physics then |
    | `animals_a_second` | 10 | animals that leave the shed; 3.3 times as many are on the table at once |
    | `jitter` | `"default"` | `"none"`, `"easy"` (SD 0.02 m, 6°), `"default"` (0.05 m, 15°), `"hard"` (anywhere, 0.13 m apart), see Starting State |
    | `play_seconds` | 5 | play after a snapshot |
    | `head_noise_deg` | 0 | SD of the normal error of the camera's yaw at the snapshot, against the one observed, degrees |
    | `fov` | `"photo"` | HoloLens 2: 64.7° across without vertical limits, or `"display"`, 43° across and 29° vertically; both 3 m far. The built-in scenes' own fields of view are for other commands |
    | `gaze` | `"random"` | a camera drawn for each visit; or `"still"`, the first visit's for all |
    | `update` | `"pause"` | one snapshot after a visit, during which animals stand still; or `"live"`: five a second while the hand moves buildings; the animals run on |
    | `game` | `True` | physics, animals and counters |
    | `render_mode` | `None` | or `"rgb_array"`; or `"human"`: a page in a browser on this machine, with the extra `web` and a display |

    ## Info

    `reset` and `step` return the same keys; none is an observation's.

    | key | type | meaning |
    |---|---|---|
    | `accuracy` | float | correct labels of the last snapshot as a share of its detections (Eq. 10), 0 to 1; 1 before the first |
    | `wrong_labels` | int | labels that were last read from another object than their own |
    | `paper_margin` | float | the least margin of a movable object in view, of a snapshot taken now; 1 where none has another choice |
    | `effort` | float | of the step: metres / diagonal + radians / pi |
    | `miscounts` | int | animals so far that got into the wrong building or ended at an empty spot |
    | `phase` | int | `Phase`: 0 (`PLAY`, animals run) or 1 (`HAND`, a visit is under way and they stand still) |
    | `reward/identity`, ... | float | the terms of the step's reward, weighted and signed: the reward is their sum; 0 at the reset |
    | `reward/effort` | float | cost of its effort, 0 or less |
    | `action_mask` | (sum of the choices,) bool | `action_masks()`; discrete actions only |

    ## Version History

    * v0: first version.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}  # noqa: RUF012  # Gymnasium's own form

    def __init__(self, **arguments: Any) -> None:
        before = set(vars(self))
        self._config = config = EnvConfig(**arguments)
        self.render_mode = config.render_mode
        self._scene = scene_of(config.scene, config.game)
        self._diagonal = self._scene.diagonal
        self._generator = Generator(self._scene, config)
        self._control = control_of(config, self._scene)
        self._reward = Reward(config.reward, config.sign, config.effort_weight)
        self._observation = OBSERVATIONS[config.observation](self._scene, config)
        self._features = Features(self._scene)
        self.action_space, self.observation_space = self._control.space, self._observation.space
        self._masked = isinstance(self.action_space, gym.spaces.MultiDiscrete | gym.spaces.Discrete)
        if config.control == "hand":
            self.metadata = {**self.metadata, "render_fps": config.steps_per_second}
        self.metadata = {**self.metadata, "render_modes": list(render_modes())}
        self._trace: Trace | None = None
        self._view: TableView | None = None
        self._over = True
        self._frames: Any = None
        self._window: Window | None = None
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
        asked = checked_options(options)
        trace = Trace.begin(self.np_random, asked)
        layout, camera = self._generator.begin(self.np_random, asked)
        self._world: World = new_world(self._scene, layout, camera, self._config, self.np_random)
        self._order = meeting_order(layout, camera)
        self._movable = self._order[layout.movable[self._order]]
        self._features.meet(layout, self._order)
        self._visits_left, self._accuracy = self._config.visits or math.inf, 1.0
        self._trace, self._over = trace, False
        self._begin_visit()
        self._show()
        return self._observed(), self._info(0.0, self._reward.nothing())

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
            self._reward.look_ahead(self)
        if outcome.over:
            self._finish_visit(outcome.sighting)
        effort = outcome.motion.effort(self._diagonal)
        paid = self._reward.paid(self, effort)
        self._show()
        seen = self._observed()
        return seen, in_turn(paid.values()), self._over, False, self._info(effort, paid)

    def action_masks(self) -> BoolArray:
        """The choices that make sense now, flat over the action's dimensions; only for the discrete actions.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
            OptionError: the action is not discrete.
        """
        mask = self._control.mask(self.view)
        if mask is None:
            raise OptionError(
                "action", "must be discrete, displacement or slot for masks", self._config.action
            )
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
    def visits_left(self) -> float:
        """How many visits the episode has left, the one that is under way among them.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
        """
        self._require_reset()
        return self._visits_left

    @property
    def view(self) -> TableView:
        """The table as it stands, for policies that look behind the observation.

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
        self._features.read(self.world)
        return self._features.ambiguity

    @property
    def world(self) -> World:
        """The game, or the plain scene, on which the episode plays.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
        """
        if self._trace is None:
            self._require_reset()
        return self._world

    @property
    def expected_wrong(self) -> float:
        """About how many labels a snapshot taken now would get wrong, each counted from 0 to 1.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
        """
        self._features.read(self.world)
        return self._features.expected_wrong

    def render(self) -> Any:
        """A picture of now, (H, W, 3) bytes, under `render_mode="rgb_array"`; under "human" a page shows it."""
        if self.render_mode != "rgb_array":
            return None
        if self._frames is None:
            from farm_ar.drawing.game.frames import GameFrames

            self._frames = GameFrames(self._scene)
        return self._frames.frame(self.world.render_state())

    def close(self) -> None:
        """End the page that shows the environment, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def _make(self, arguments: dict[str, Any]) -> None:
        FarmToTableEnv.__init__(self, **arguments)

    def _show(self) -> None:
        """Show how things stand, if a person looks."""
        if self.render_mode == "human":
            if self._window is None:
                self._window = open_window(self._scene, self.metadata["render_fps"])
            self._window.show(self._world.render_state())

    def _begin_visit(self) -> None:
        self._budget = budget_of(self._config, self._diagonal)
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
            if self._config.gaze == "random":
                self._world.camera = self._generator.camera(self.np_random)
            self._begin_visit()

    def _observed(self) -> Any:
        self._features.read(self._world)
        return self._observation.observe(self._features, self._left(), self._world)

    def _look(self) -> TableView:
        return self.view

    def _left(self) -> Left:
        metres, radians = self._budget.left
        visits = 1.0 if self._config.visits is None else self._visits_left / self._config.visits
        return metres, radians, self._control.left, visits

    def _info(self, effort: float, paid: dict[str, float]) -> dict[str, Any]:
        world = self._world
        info: dict[str, Any] = {
            "accuracy": self._accuracy,
            "wrong_labels": world.tracker.belief.wrong_labels,
            "paper_margin": self._features.least_margin,
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


def _signature() -> inspect.Signature:
    """`FarmToTableEnv`'s arguments are the fields of `EnvConfig`."""
    this = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    return inspect.Signature([this, *inspect.signature(EnvConfig).parameters.values()])


FarmToTableEnv.__init__.__signature__ = _signature()  # type: ignore[attr-defined]  # what `inspect` looks for
