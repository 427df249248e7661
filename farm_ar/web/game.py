"""One game that a pointer plays: an endless episode of the environment, and what a page receives of it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.agents.certificates import NO_BOUND, lower_bound
from farm_ar.agents.distance import distances
from farm_ar.arrays import FloatArray
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.generator import scene_of
from farm_ar.envs.worlds import World
from farm_ar.errors import known_name
from farm_ar.game_logic.belief import SAME
from farm_ar.game_logic.farm_game import HAND_WAITS_AT_Z, FarmGame
from farm_ar.game_logic.headset import RANGE_M, field_of_view, look_at
from farm_ar.game_logic.physics.gripper import MAX_HAND_SPEED, MAX_TWIST
from farm_ar.geometry import wrap
from farm_ar.reid import REIDENTIFIERS, reid_factory
from farm_ar.scenes import Camera, Layout, Scene
from farm_ar.scenes.builtin.farm import TABLE
from farm_ar.web.messages import Handles, Json, told_answers, told_moment, told_scene, true_labels
from farm_ar.web.pointer import STEPS_PER_SECOND, Pointer
from farm_ar.web.rounds import FREE, MODES, new_round

CM = 100.0

METHODS = tuple(name for name in REIDENTIFIERS if name not in ("spatial-unity", "last-known"))
"""Re-identifiers that a player can choose."""

_UNLIMITED_M, _UNLIMITED_RAD, _LONGEST_VISIT_S = 1e9, 1e9, 3600.0

GAZES = {
    "all": ((0.6, -0.46), (0.6, 0.35), 0.6),
    "left": ((0.45, -0.4), (0.3, 0.4), 0.5),
    "right": ((0.75, -0.4), (0.9, 0.4), 0.5),
}
"""Where the headset is, where on the table it looks, and how high it is: metres, on the farm."""

RESTS = 0.72
"""Where a hand rests in view: so much of the way from under the headset to where that looks."""

MOST_STEPS = 2 * 3600 * STEPS_PER_SECOND
"""Steps of a game whose hand did something; then a new one has to be begun."""


def camera_of(scene: Scene, gaze: str) -> tuple[Camera, FloatArray]:
    """The headset's camera, and (2,) where a hand rests in its view, metres.

    Args:
        scene: on whose table all is in proportion to the sides, as on the farm; but the headset is no farther
            from the near edge than there, for farther away a hand out of view waits.
        gaze: one of `GAZES`.
    """
    sides = np.array(scene.size) / TABLE
    at, looked_at, height = GAZES[gaze]
    eye, target = np.array(at) * np.minimum(sides, [np.inf, 1.0]), np.array(looked_at) * sides
    fov = replace(field_of_view("photo"), range_m=RANGE_M * max(1.0, *sides.tolist()))
    camera = look_at(eye, target, fov, height * float(sides[1]))
    return camera, eye + RESTS * (target - eye)


def scene_name(scene: str) -> str:
    """What links call a scene: its name, or its file's without folder and ending."""
    return Path(scene).stem


class Game:
    """One game: the farm, a headset that looks once after every visit, and the player's pointer.

    It is an episode of `FarmToTableEnv` without an end: the hand lifts, nothing limits it, and its trace
    plays again to the same bytes.

    Args:
        seed: of the layout.
        reid: name of the re-identifier.
        jitter: how the starting layout is drawn.
        gaze: where the headset looks, one of `GAZES`.
        beside: a second method that is asked too, "" for none.
        mode: what is played, one of `MODES`.
        scene: "farm", or a scene file with a fixed object.
        rng: that draws what pages call objects; one that nobody can foresee by default.

    Attributes:
        handles: what pages call objects.
        effort_cm: what the visits before this one moved: the straight ways of all buildings, and for a turn
            of angle a the scene's diagonal x sin(a / 2), the price that the paper's method gives it.
        par_cm: what no one can fool the method with less than in one visit; None where that is not known.

    Raises:
        OptionError: a name is not known, or the scene has no fixed object.
        SceneError: the scene file cannot be used.
    """

    def __init__(
        self,
        seed: int = 0,
        reid: str = "spatial",
        jitter: str = "easy",
        gaze: str = "all",
        beside: str = "",
        mode: str = FREE,
        scene: str = "farm",
        *,
        rng: np.random.Generator | None = None,
    ) -> None:
        known_name("reid", reid, METHODS)
        known_name("mode", mode, MODES)
        self.beside = known_name("beside", beside, METHODS) if beside else None
        known_name("gaze", gaze, GAZES)
        self.seed, self.reid, self.jitter, self.gaze, self.scene = seed, reid, jitter, gaze, scene
        self._env = FarmToTableEnv(
            scene=scene,
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
        self._camera, self.rest = camera_of(scene_of(scene, game=True), gaze)
        self.restart()
        self.handles = Handles(self.world.truth, rng or np.random.default_rng())
        self.round = new_round(mode, self)

    def restart(self) -> None:
        """Have everything stand as at the beginning, in a new episode."""
        self._env.reset(seed=self.seed, options={"camera": self._camera})
        self.pointer = Pointer()
        self._news: deque[Json] = deque()
        self.steps = 0
        self.forget_effort()
        self._knew, self._knows = True, True
        self.par_cm = self._least_cm()

    def forget_effort(self) -> None:
        """Count what is moved from now on only."""
        self._stood, self.effort_cm, self._visit_cm = self.world.truth, 0.0, 0.0

    @property
    def world(self) -> FarmGame:
        """The game that is played."""
        world: World = self._env.world
        assert isinstance(world, FarmGame)
        return world

    def way_cm(self, stood: Layout) -> float:
        """How far everything is from where it stood, ways and turns."""
        position, yaw = self.world.tabletop.poses()
        diagonal = self.world.scene.diagonal
        return float(distances(stood, diagonal, position, yaw).sum() * diagonal * CM)

    @property
    def over(self) -> bool:
        """Whether the game has gone on for as long as its trace is kept."""
        return self.steps >= MOST_STEPS

    def step(self) -> None:
        """Let a step pass, or several while an adversary rearranges the table."""
        for _ in range(self.round.pace):
            if not self.over:
                self._step(self.round.steer(self.pointer))

    def obey(self, message: Mapping[str, Any]) -> None:
        """Do what the player's page says.

        Raises:
            OptionError: it cannot be done, or not now.
        """
        if "do" in message:
            self.round.obey(message)
        else:
            self.pointer = Pointer.told(message)

    def _step(self, pointer: Pointer) -> None:
        """The hand goes to where the pointer is, or out of view."""
        world = self.world
        hand = world.tabletop.hand
        assert hand is not None
        width, _ = world.scene.size
        away = pointer.away
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
        self._visit_cm = self.way_cm(self._stood)
        if len(world.sightings) > looked:
            self._looked(knew)

    def hello(self) -> Json:
        """What does not change in a game, as JSON values."""
        return {
            "kind": "hello",
            "scene": scene_name(self.scene),
            "seed": self.seed,
            "reid": self.reid,
            "beside": self.beside,
            "jitter": self.jitter,
            "gaze": self.gaze,
            "gazes": list(GAZES),
            "methods": list(METHODS),
            "round": self.round.told(),
            **told_scene(self.world.scene),
        }

    def state(self) -> Json:
        """What may have changed, as JSON values: metres and radians, rounded to what can be seen.

        What is unseen stands as it is believed to; what is really what is not in it.
        """
        moment = self.world.render_state()
        if self.round.unseen:
            moment = replace(moment, truth=moment.believed, hand=None)
        return {
            "kind": "state",
            "step": self.steps,
            **told_moment(moment, self.handles),
            "effort_cm": round(self.effort_cm + self._visit_cm, 2),
            "visit_cm": round(self._visit_cm, 2),
            "par_cm": self.par_cm,
            "snapshots": len(self.world.sightings),
            "over": self.over,
            **self.round.moment(),
        }

    def truth(self) -> Json:
        """What the last snapshot's detections really are, and the labels that are wrong, by number.

        And whether the headset knew where everything was when that visit began: else it may have been fooled
        by an earlier one.
        """
        sightings, belief = self.world.sightings, self.world.tracker.belief
        labels = true_labels(sightings[-1], self.world.truth.labels) if sightings else []
        wrong = np.flatnonzero(belief.wrong).tolist()
        fresh = self._knew
        return {"kind": "truth", "number": len(sightings), "labels": labels, "wrong": wrong, "fresh": fresh}

    def news(self) -> Json | None:
        """What happened, as JSON values, once each; None where there is nothing new.

        A snapshot's answers; with them goes what a second method would have said, and how far the visit has
        moved things. Or how a round stands.
        """
        return self._news.popleft() if self._news else None

    def tell(self, news: Json) -> None:
        """Have the pages get to know something."""
        self._news.append(news)

    def play_freely(self) -> None:
        """Have everything stand as at the beginning, and the player play."""
        self.restart()
        self.round = new_round(FREE, self)
        self.tell(self.round.told())

    def _looked(self, knew: Layout) -> None:
        """The headset has looked, when it believed everything to be as in a layout."""
        world, names = self.world, self.world.truth.labels
        sighting, number = world.sightings[-1], len(world.sightings)
        news = told_answers(sighting, names, number, self.handles)
        cm = news["visit_cm"] = round(self._visit_cm, 2)
        if self.beside is not None:
            reid = reid_factory(self.beside)(world.scene.knowing(knew))
            other = replace(sighting, identification=reid.identify(sighting.snapshot))
            detections = told_answers(other, names, number, self.handles)["detections"]
            news["beside"] = {"reid": self.beside, "detections": detections}
        self.effort_cm += self._visit_cm
        self._stood, self._visit_cm = world.truth, 0.0
        way = distances(world.believed, world.scene.diagonal, *world.tabletop.poses())
        self._knew, self._knows = self._knows, bool(way.max() <= SAME)
        self.par_cm = self._least_cm()
        self.tell(news)
        self.round.looked(cm)

    def trace(self) -> Json:
        """The game so far as JSON values, for `farm-ar replay`."""
        return self.trace_so_far()()

    def trace_so_far(self) -> Callable[[], Json]:
        """What makes that trace, also later and in another thread, while the game goes on."""
        return self._env.trace_so_far()

    def _least_cm(self) -> float | None:
        """What no one can fool the headset with less than in this visit; None where nothing is proven."""
        scene, camera = self.world.scene, self.world.camera
        if not self._knows:
            return None  # it may be fooled already
        case = Case(scene.knowing(self.world.truth), camera)
        bound = lower_bound(case, reid_factory(self.reid)(case.scene))
        least = bound.total * scene.diagonal * CM
        known = bound.theorem != NO_BOUND and np.isfinite(least)
        return math.floor(10 * least) / 10 if known else None  # rounded up somebody might beat it
