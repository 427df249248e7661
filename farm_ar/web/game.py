"""One game that a pointer plays: an endless episode of the environment, and what a page receives of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.agents.certificates import NO_BOUND, lower_bound
from farm_ar.agents.distance import distances
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.worlds import World
from farm_ar.errors import OptionError, known_name
from farm_ar.game_logic.belief import SAME
from farm_ar.game_logic.farm_game import HAND_WAITS_AT_Z, FarmGame
from farm_ar.game_logic.headset import field_of_view, look_at
from farm_ar.game_logic.physics.gripper import MAX_HAND_SPEED, MAX_TWIST
from farm_ar.geometry import wrap
from farm_ar.reid import REIDENTIFIERS, reid_factory
from farm_ar.scenes import Layout
from farm_ar.web.telling import Json, told_answers, told_moment, told_scene

STEPS_PER_SECOND = 30
"""Of a game's clock."""

CM = 100.0

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
        beside: a second method that is asked too, "" for none.

    Attributes:
        effort_cm: what the visits before this one moved: the straight ways of all buildings, and for a turn
            of angle a the scene's diagonal x sin(a / 2), the price that the paper's method gives it.
        par_cm: what no one can fool the method with less than in one visit; None where that is not known.

    Raises:
        OptionError: a name is not known.
    """

    def __init__(
        self, seed: int = 0, reid: str = "spatial", jitter: str = "easy", gaze: str = "all", beside: str = ""
    ) -> None:
        known_name("reid", reid, METHODS)
        self.beside = known_name("beside", beside, METHODS) if beside else None
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
        self._stood = self.world.truth
        self._news: Json | None = None
        self.steps, self.effort_cm, self._visit_cm = 0, 0.0, 0.0
        self.par_cm = self._least_cm()

    @property
    def world(self) -> FarmGame:
        """The game that is played."""
        world: World = self._env.world
        assert isinstance(world, FarmGame)
        return world

    def _way_cm(self) -> float:
        """What this visit has moved so far."""
        position, yaw = self.world.tabletop.poses()
        diagonal = self.world.scene.diagonal
        return float(distances(self._stood, diagonal, position, yaw).sum() * diagonal * CM)

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
        looked, knew = len(world.sightings), world.believed
        self._env.step(action)
        self.steps += 1
        self._visit_cm = self._way_cm()
        if len(world.sightings) > looked:
            self._looked(knew)

    def hello(self) -> Json:
        """What does not change in a game, as JSON values."""
        return {
            "kind": "hello",
            "seed": self.seed,
            "reid": self.reid,
            "beside": self.beside,
            "jitter": self.jitter,
            "gaze": self.gaze,
            "gazes": list(GAZES),
            "methods": list(METHODS),
            **told_scene(self.world.scene),
        }

    def state(self) -> Json:
        """What may have changed, as JSON values: metres and radians, rounded to what can be seen."""
        return {
            "kind": "state",
            "step": self.steps,
            **told_moment(self.world.render_state()),
            "effort_cm": round(self.effort_cm + self._visit_cm, 2),
            "visit_cm": round(self._visit_cm, 2),
            "par_cm": self.par_cm,
            "snapshots": len(self.world.sightings),
            "over": self.over,
        }

    def news(self) -> Json | None:
        """The last snapshot's answers, as JSON values, once each; None where there is no new one.

        With them goes what a second method would have said, and how far the visit has moved things.
        """
        news, self._news = self._news, None
        return news

    def _looked(self, knew: Layout) -> None:
        """The headset has looked, when it believed everything to be as in a layout."""
        world, names = self.world, self.world.truth.labels
        sighting, number = world.sightings[-1], len(world.sightings)
        self._news = told_answers(sighting, names, number)
        self._news["wrong_labels"] = world.tracker.belief.wrong_labels
        self._news["visit_cm"] = round(self._visit_cm, 2)
        if self.beside is not None:
            reid = reid_factory(self.beside)(world.scene.knowing(knew))
            other = replace(sighting, identification=reid.identify(sighting.snapshot))
            detections = told_answers(other, names, number)["detections"]
            self._news["beside"] = {"reid": self.beside, "detections": detections}
        self.effort_cm += self._visit_cm
        self._stood, self._visit_cm = world.truth, 0.0
        self.par_cm = self._least_cm()

    def trace(self) -> Json:
        """The game so far as JSON values, for `farm-ar replay`."""
        return self.trace_so_far()()

    def trace_so_far(self) -> Callable[[], Json]:
        """What makes that trace, also later and in another thread, while the game goes on."""
        return self._env.trace_so_far()

    def _least_cm(self) -> float | None:
        """What no one can fool the headset with less than in this visit; None where nothing is proven."""
        scene, camera, world = self.world.scene, self.world.camera, self.world
        if distances(world.believed, scene.diagonal, *world.tabletop.poses()).max() > SAME:
            return None  # what it believes is not what is so: it may be fooled already
        case = Case(scene.knowing(self.world.truth), camera)
        bound = lower_bound(case, reid_factory(self.reid)(case.scene))
        least = bound.total * scene.diagonal * CM
        return round(float(least), 1) if bound.theorem != NO_BOUND and np.isfinite(least) else None
