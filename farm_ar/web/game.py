"""One game that a pointer plays: an endless episode of the environment, and what a page is told of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.worlds import World
from farm_ar.errors import OptionError, known_name
from farm_ar.game_logic.belief import Sighting
from farm_ar.game_logic.farm_game import HAND_WAITS_AT_Z, FarmGame
from farm_ar.game_logic.headset import field_of_view, look_at
from farm_ar.game_logic.physics.gripper import MAX_HAND_SPEED, MAX_TWIST
from farm_ar.geometry import wrap
from farm_ar.reid import REIDENTIFIERS

STEPS_PER_SECOND = 30
"""Of a game's clock."""

METHODS = tuple(name for name in REIDENTIFIERS if name not in ("spatial-unity", "last-known"))
"""Re-identifiers that a player can choose."""

_UNLIMITED_M, _UNLIMITED_RAD, _LONGEST_VISIT_S = 1e9, 1e9, 3600.0

GAZES = {
    "all": ((0.6, -0.46), (0.6, 0.35), 0.6),
    "left": ((0.45, -0.4), (0.3, 0.4), 0.5),
    "right": ((0.75, -0.4), (0.9, 0.4), 0.5),
}
"""Where the headset is, where on the table it looks, and how high it is, metres on the farm."""

MOST_STEPS = 2 * 3600 * STEPS_PER_SECOND
"""Steps of a game whose hand did something; then a new one has to be begun."""


@dataclass
class Pointer:
    """What the player's pointer does.

    Args:
        x: over the table, metres; None while it is away.
        z: likewise.
        grip: whether it is pressed.
        turn: how far it has turned since the visit began, clockwise, radians.
    """

    x: float | None = None
    z: float | None = None
    grip: bool = False
    turn: float = 0.0

    @classmethod
    def told(cls, message: Mapping[str, Any]) -> Pointer:
        """The pointer that a page tells of.

        Raises:
            OptionError: a value is not what it should be.
        """
        values: dict[str, float | None] = {}
        for name in ("x", "z", "turn"):
            value = message.get(name)
            if value is None:
                values[name] = None
                continue
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not (number and abs(value) <= 1e6):  # neither NaN nor infinity is
                raise OptionError(name, "must be a number from -1e6 to 1e6", value)
            values[name] = float(value)
        grip = message.get("grip", False)
        if not isinstance(grip, bool):
            raise OptionError("grip", "must be true or false", grip)
        return cls(values["x"], values["z"], grip, values["turn"] or 0.0)


class Game:
    """One game: the farm, a headset that looks once after every visit, and the player's pointer.

    It is an episode of `FarmToTableEnv` without an end: the hand lifts, nothing limits it, and its trace
    plays again to the same bytes.

    Args:
        seed: of layout and cameras.
        reid: name of the re-identifier.
        jitter: how the starting layout is drawn.
        gaze: where the headset looks, one of `GAZES`.

    Raises:
        OptionError: a name is not known.
    """

    def __init__(self, seed: int = 0, reid: str = "spatial", jitter: str = "easy", gaze: str = "all") -> None:
        known_name("reid", reid, METHODS)
        eye, target, height = GAZES[known_name("gaze", gaze, GAZES)]
        self.seed, self.reid, self.jitter, self.gaze = seed, reid, jitter, gaze
        self._env = FarmToTableEnv(
            control="hand",
            carry="lift",
            visits=None,
            steps_per_second=STEPS_PER_SECOND,
            budget_m=_UNLIMITED_M,
            budget_rad=_UNLIMITED_RAD,
            hand_seconds=_LONGEST_VISIT_S,
            play_seconds=0.0,
            gaze="still",
            reid=reid,
            jitter=jitter,
        )
        camera = look_at(np.array(eye), np.array(target), field_of_view("photo"), height)
        self._env.reset(seed=seed, options={"camera": camera})
        self.pointer = Pointer()
        self._yaw_at_begin, self._effort_m, self._effort_rad = 0.0, 0.0, 0.0
        self._told = 0
        self.steps = 0

    @property
    def world(self) -> FarmGame:
        """The game that is played."""
        world: World = self._env.world
        assert isinstance(world, FarmGame)
        return world

    @property
    def over(self) -> bool:
        """Whether the game has gone on for as long as its trace is kept."""
        return self.steps >= MOST_STEPS

    def step(self) -> None:
        """Let a step pass; the hand goes to where the pointer is, or out of view."""
        if self.over:
            return
        world, pointer = self.world, self.pointer
        hand = world.tabletop.hand
        assert hand is not None
        width, _ = world.scene.size
        away = pointer.x is None or pointer.z is None
        goal = np.array([width / 2, HAND_WAITS_AT_Z] if away else [pointer.x, pointer.z], dtype=np.float64)
        velocity = (goal - hand.position) * STEPS_PER_SECOND
        fast = max(1.0, float(np.hypot(*velocity)) / MAX_HAND_SPEED)
        turn = 0.0 if away else float(wrap(np.array(pointer.turn - hand.yaw))) * STEPS_PER_SECOND
        action = np.array(
            [
                *(velocity / fast / MAX_HAND_SPEED),
                np.clip(turn / MAX_TWIST, -1.0, 1.0),
                1.0 if pointer.grip and not away else -1.0,
            ],
            dtype=np.float32,
        )
        before = world.tabletop.moved
        self._env.step(action)
        moved = world.tabletop.moved - before
        self._effort_m += moved.metres
        self._effort_rad += moved.radians
        self.steps += 1

    def hello(self) -> dict[str, Any]:
        """What does not change in a game, as JSON values."""
        scene = self.world.scene
        layout = scene.layout
        return {
            "kind": "hello",
            "seed": self.seed,
            "reid": self.reid,
            "jitter": self.jitter,
            "gaze": self.gaze,
            "gazes": list(GAZES),
            "methods": list(METHODS),
            "width": scene.size[0],
            "depth": scene.size[1],
            "objects": [
                {
                    "label": layout.labels[i],
                    "category": layout.category[i],
                    "size": layout.size[i].tolist(),
                    "fixed": bool(layout.fixed[i]),
                }
                for i in range(len(layout))
            ],
        }

    def state(self) -> dict[str, Any]:
        """What may have changed, as JSON values: metres and radians, rounded to what can be seen."""
        world = self.world
        position, yaw = world.tabletop.poses()
        believed, camera, hand = world.believed, world.camera, world.tabletop.hand
        flock = world.flock
        animals = (
            np.column_stack([flock.position, flock.heading, flock.goal]) if len(flock) else np.zeros((0, 4))
        )
        return {
            "kind": "state",
            "step": self.steps,
            "phase": world.phase.text,
            "objects": np.column_stack([position, yaw]).round(4).tolist(),
            "believed": np.column_stack([believed.position, believed.yaw]).round(4).tolist(),
            "wrong": np.flatnonzero(world.tracker.belief.wrong).tolist(),
            "counts": world.counters.counted.tolist(),
            "misplaced": world.counters.misplaced.tolist(),
            "hand": None
            if hand is None
            else [*hand.position.round(4).tolist(), round(hand.yaw, 4), hand.gripped],
            "animals": animals.round(3).tolist(),
            "camera": {
                "x": round(float(camera.position[0]), 4),
                "z": round(float(camera.position[1]), 4),
                "height": round(float(camera.height or 0.0), 4),
                "yaw": round(float(camera.yaw), 4),
                "pitch": round(float(camera.pitch), 4),
                "left": round(camera.fov.left, 4),
                "right": round(camera.fov.right, 4),
                "range": camera.fov.range_m,
            },
            "effort_m": round(self._effort_m, 4),
            "effort_rad": round(self._effort_rad, 4),
            "snapshots": len(world.sightings),
            "over": self.over,
        }

    def news(self) -> dict[str, Any] | None:
        """The last snapshot's answers, as JSON values, once each; None where there is no new one."""
        sightings = self.world.sightings
        if len(sightings) == self._told:
            return None
        self._told = len(sightings)
        return self.answers(sightings[-1])

    def answers(self, sighting: Sighting) -> dict[str, Any]:
        """What a snapshot said, as JSON values."""
        names, found = self.world.truth.labels, sighting.identification
        confidence = found.confidence
        detections = [
            {
                "object": int(source),
                "label": label,
                "confidence": None if not np.isfinite(sure) else round(float(sure), 3),
                "right": label == (None if source < 0 else names[source]),
            }
            for source, label, sure in zip(sighting.source, found.labels, confidence, strict=True)
        ]
        return {
            "kind": "snapshot",
            "number": len(self.world.sightings),
            "accuracy": sighting.accuracy,
            "detections": detections,
            "wrong_labels": self.world.tracker.belief.wrong_labels,
        }

    def trace(self) -> str:
        """The game so far as JSON, for `farm-ar replay`."""
        return json.dumps(self._env.trace())
