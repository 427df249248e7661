# ruff: noqa: E501  # a row of a table in its docstring is a line
"""The environment of the delivery robot."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from farm_ar.arrays import FloatArray
from farm_ar.envs.actions import checked_action
from farm_ar.envs.delivery.config import DeliveryConfig
from farm_ar.envs.delivery.delivery import RAYS, Delivery, start_of
from farm_ar.envs.delivery.robot import MOST_M_S, MOST_RAD_S, Pose, Twist
from farm_ar.envs.delivery.room import Room
from farm_ar.envs.generator import given_layout
from farm_ar.errors import OptionError
from farm_ar.geometry import direction

TOUCH_COST = 0.1
SECOND_COST = 0.01
"""What touching something, and a second, cost, a delivery being 1."""


class DeliverToChairEnv(gym.Env[Any, Any]):
    """A robot delivers to one of several chairs that look exactly alike and were moved.

    ## Description

    A robot with differential drive of the size of a LoCoBot (a round base of 35 cm) is in a room in which the chairs were
    moved and turned since they were last known. It is sent to one of them, by default to chair 4 of chairs 4 to 7 of the
    scene `lab` (section 4.3.3 of Yu et al., doi:10.1007/s10055-025-01305-y). Its RGB-D camera, with the field of view and
    range of Intel's RealSense D435, detects chairs; once a second a re-identifier gives them labels, from all snapshots
    so far together. The agent drives, and decides when to hand over.

    ## Action Space

    `Box(-1, 1, (3,))`, held for 0.2 s: speed ahead (0.4 m/s), rate of turn to the left (1.5 rad/s), and whether to hand over
    (above 0). Of the chairs whose centre is within 0.75 m of the robot's, the one nearest to a point 0.55 m ahead of the robot's
    centre gets the delivery; if there is none, nothing happens.

    ## Observation Space

    A `Dict` of `Box`es of float32, finite and flat. N is the number of chairs, K = 2 N. It holds only what the robot has
    measured, no true poses. Places are x, z, the room from -1 to 1, clipped at ±1.5; headings are clockwise from above, 0 along +z,
    as sin and cos.

    | key | shape | meaning |
    |---|---|---|
    | `pose` | (4,) | the robot's estimate of its own pose: x, z, sin and cos of its heading |
    | `speed` | (2,) | ahead / 0.4 m/s, rate of turn to the left / 1.5 rad/s |
    | `scan` | (45,) | depth along 45 rays / 3 m, from left to right over the field of view; 1 where nothing is in range, or something is too near |
    | `target` | (N,) | one-hot |
    | `known_place`, `known_heading` | (2 N,) | each chair's last known pose |
    | `place`, `direction` | (2 K,) | poses of the K objects that were seen, the most probable target first; 0 where there are fewer |
    | `seen` | (K,) | 1 for each object that exists, else 0 |
    | `probability` | (K,) | probability that it is the target; 0 or 1 if the re-identifier has no probabilities |
    | `time` | (1,) | share of the time that is left |

    ## Rewards

    1 for the right chair, -1 for another one; less 0.1 for each touch and 0.01 for each second.

    ## Starting State

    Each chair moves by a normal shift along x and z and turns by a normal angle, and is drawn again if it overlaps
    another chair, a table (0.6 m, at every site: our choice) or a wall. The robot starts at a random position with 0.45 m of free space
    around it and faces the middle of the room, up to 30° to either side. `reset(options=...)` sets either:

    | option | form |
    |---|---|
    | `layout` | a `Layout` of the scene's chairs, or `{"position": (N, 2), "yaw": (N,)}` |
    | `robot` | x, z and heading, in metres and radians |

    ## Episode End

    The episode terminates with the delivery, and is truncated after `seconds`.

    ## Physics

    pymunk, at 60 Hz; chairs, tables and walls do not move. Acceleration is 0.8 m/s² and 6 rad/s². The wheels' odometry has an error
    of 2% (SD). Once a second the robot localises itself on its map to 2 cm and 0.5° (SD). A depth z has an SD of
    z² x 0.08 px / (focal length x 50 mm), 1.4 cm at 2 m; the SD of a chair's centre is 8 pixels of 848, that of its heading 4°, that of its
    sides 5%. Chairs that are hidden, nearer than 0.3 m or farther than 3 m are not detected.

    ## Arguments

    They are the fields of `DeliveryConfig`: keywords and, but for objects in place of names, JSON values.

    | argument | default | meaning |
    |---|---|---|
    | `scene` | `"lab"` | a built-in scene's name, a `.json` file, or a `Scene`, with a width and a depth |
    | `chairs` | `["4", "5", "6", "7"]` | the labels that stand in the room; `None` for all |
    | `target` | `"4"` | the label that is to get the delivery |
    | `reid` | `"spatial"` | any re-identifier's name, or a function from a `Scene` to a `Reidentifier` |
    | `shift_sd` | 0.6 | SD of the chairs' shifts along x and z, metres |
    | `turn_sd_deg` | 120 | SD of their turns, degrees |
    | `fov_deg` | (87, 58) | the camera's field of view, across and vertically; of its colour camera alone 69 by 42 |
    | `seconds` | 120 | time after which an episode is truncated |
    | `render_mode` | `None` | or `"rgb_array"`: the room from above |

    ## Info

    | key | type | meaning |
    |---|---|---|
    | `right`, `wrong` | int | 1 if the right, or a wrong, chair got the delivery |
    | `touches` | int | collisions so far |
    | `path_m` | float | path length so far, metres |
    | `looks` | int | snapshots so far |
    | `reward/delivery`, `reward/touch`, `reward/time` | float | the terms of the reward |

    ## Version History

    * v0: first version.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 5}  # noqa: RUF012  # Gymnasium's own form

    def __init__(self, **arguments: Any) -> None:
        self._config = config = DeliveryConfig(**arguments)
        self.render_mode = config.render_mode
        self._scene = config.known()
        self._room = Room(self._scene)
        n = len(self._scene.layout)
        self._objects = 2 * n
        self.action_space = spaces.Box(-1.0, 1.0, (3,), np.float32)
        far = {"pose": 4, "known_place": 2 * n, "place": 2 * self._objects}
        unit = {"speed": 2, "known_heading": 2 * n, "direction": 2 * self._objects}
        share = {"scan": RAYS, "target": n, "seen": self._objects, "probability": self._objects, "time": 1}
        self._boxes = {
            name: spaces.Box(low, high, (size,), np.float32)
            for low, high, sizes in ((-1.5, 1.5, far), (-1.0, 1.0, unit), (0.0, 1.0, share))
            for name, size in sizes.items()
        }
        self.observation_space = spaces.Dict({**self._boxes})
        self._began: tuple[Mapping[str, Any], dict[str, Any]] | None = None
        self._actions: list[list[float]] = []
        self._over = True

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: of `np_random`, from which all randomness comes.
            options: "layout" and "robot", used exactly as they are.

        Raises:
            OptionError: an option is not known or cannot be used.
        """
        super().reset(seed=seed)
        self._began, self._over = None, True
        self._begin(_checked(options))
        return self._observed(), self._info((0.0, 0.0, 0.0))

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Drive for .2 s, and hand over if the action says so.

        Raises:
            gymnasium.error.ResetNeeded: there is no episode under way.
            gymnasium.error.InvalidAction: the action has the wrong shape.
        """
        if self._over:
            raise gym.error.ResetNeeded("step() needs reset() first")
        ahead, left, hand_over = (
            min(max(float(v), -1.0), 1.0) for v in checked_action(action, self.action_space)
        )
        self._actions.append([ahead, left, hand_over])
        touches, seconds = self._delivery.robot.touches, self._delivery.seconds
        self._delivery.step(Twist(ahead * MOST_M_S, left * MOST_RAD_S), hand_over > 0)
        now = self._delivery
        terminated = now.delivered is not None
        truncated = not terminated and now.seconds >= self._config.seconds - 1e-9
        self._over = terminated or truncated
        terms = (
            0.0 if now.delivered is None else 1.0 if now.delivered == now.target else -1.0,
            -TOUCH_COST * (now.robot.touches - touches),
            -SECOND_COST * (now.seconds - seconds),
        )
        return self._observed(), float(sum(terms)), terminated, truncated, self._info(terms)

    @property
    def delivery(self) -> Delivery:
        """The episode, the truth included.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
        """
        if self._began is None:
            raise gym.error.ResetNeeded("there is nothing to look at before reset()")
        return self._delivery

    def render(self) -> Any:
        """The room from above, (H, W, 3) bytes, under `render_mode="rgb_array"`."""
        if self.render_mode is None:
            return None
        from farm_ar.envs.delivery.picture import picture

        return picture(self.delivery)

    def __getstate__(self) -> dict[str, Any]:
        return {
            "arguments": self._config.arguments(),
            "spec": self.spec,
            "generator": (self._np_random, self._np_random_seed),
            "episode": (self._began, self._actions, self._over),
            "spaces": (self.action_space, self.observation_space),
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        # Physics cannot be copied bit for bit; it is played again.
        self.__init__(**state["arguments"])  # type: ignore[misc]
        self.spec = state["spec"]
        self.action_space, self.observation_space = state["spaces"]
        began, actions, over = state["episode"]
        if began is not None:
            self._np_random = np.random.default_rng()
            self._np_random.bit_generator.state = deepcopy(began[0])
            self._begin(began[1])
            for ahead, left, hand_over in actions:
                self._delivery.step(Twist(ahead * MOST_M_S, left * MOST_RAD_S), hand_over > 0)
            self._actions, self._over = list(actions), over
            generator = self._np_random
        self._np_random, self._np_random_seed = state["generator"]
        if began is not None:
            assert self._np_random is not None
            generator.bit_generator.state = self._np_random.bit_generator.state
            self._np_random = generator  # the episode draws from it too

    def _begin(self, options: dict[str, Any]) -> None:
        began = (deepcopy(self.np_random.bit_generator.state), options)
        layout = options.get("layout")
        if layout is None:
            layout = self._room.rearranged(self._config.noise(), self.np_random)
        else:
            layout = given_layout(self._scene, layout)
        robot = options.get("robot")
        start = (
            start_of(self._room, layout, self.np_random) if robot is None else _start(robot, self._scene.size)
        )
        self._delivery = Delivery(self._config, self._scene, layout, start, self.np_random)
        self._began, self._actions, self._over = began, [], False

    def _observed(self) -> dict[str, Any]:
        known, n = self._delivery.knowledge(), self._objects
        layout = self._scene.layout
        probability = known.probability
        order = np.argsort(-probability, kind="stable")[:n]
        place, front = np.zeros((n, 2)), np.zeros((n, 2))
        seen, chance = np.zeros(n), np.zeros(n)
        if known.tracking is not None:
            objects, count = known.tracking.objects, len(order)
            place[:count], front[:count] = (
                self._scaled(objects.position[order]),
                direction(objects.yaw[order]),
            )
            seen[:count], chance[:count] = 1.0, probability[order]
        speed = [known.speed.ahead / MOST_M_S, known.speed.left / MOST_RAD_S]
        values = {
            "pose": np.concatenate([self._scaled(known.pose.place), direction(known.pose.yaw)]),
            "speed": np.array(speed),
            "scan": np.minimum(known.distance / 3.0, 1.0),
            "target": np.eye(len(layout))[layout.index(self._config.target)],
            "known_place": self._scaled(layout.position),
            "known_heading": direction(layout.yaw),
            "place": place,
            "direction": front,
            "seen": seen,
            "probability": chance,
            "time": np.array([1 - known.seconds / self._config.seconds]),
        }
        return {
            name: np.clip(values[name].reshape(-1), box.low, box.high).astype(np.float32)
            for name, box in self._boxes.items()
        }

    def _scaled(self, place: FloatArray) -> FloatArray:
        scaled: FloatArray = 2 * place / np.asarray(self._scene.size) - 1
        return scaled

    def _info(self, terms: tuple[float, float, float]) -> dict[str, Any]:
        now = self._delivery
        handed = now.delivered is not None
        return {
            "right": int(handed and now.delivered == now.target),
            "wrong": int(handed and now.delivered != now.target),
            "touches": now.robot.touches,
            "path_m": float(now.robot.driven),
            "looks": now.looks,
            **dict(zip(("reward/delivery", "reward/touch", "reward/time"), map(float, terms), strict=True)),
        }


def _checked(options: Any) -> dict[str, Any]:
    if not isinstance(options, Mapping | None):
        raise OptionError("options", "must be a mapping with layout and robot, both optional", options)
    for name in options or {}:
        if name not in ("layout", "robot"):
            raise OptionError("options", "must hold layout and robot only", name)
    return dict(options or {})


def _start(given: Any, size: tuple[float, float]) -> Pose:
    expected = "must be x and z within the room and a heading: metres, metres, radians"
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise OptionError("options.robot", expected, given) from None
    right = values.shape == (3,) and np.isfinite(values).all()
    if not (right and np.all((values[:2] > 0) & (values[:2] < size))):
        raise OptionError("options.robot", expected, given)
    return Pose.of(values[:2], float(values[2]))
