"""What an environment's moves act on: the farm with its physics and game, or any scene as plain poses."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.perceptions import UnsteadyHead, perception_of
from farm_ar.game_logic.belief import Sighting, Tracker
from farm_ar.game_logic.farm_game import Phase
from farm_ar.game_logic.live import game_class
from farm_ar.game_logic.physics.limits import Motion
from farm_ar.game_logic.physics.tabletop import MotionLimit
from farm_ar.game_logic.render_state import RenderState
from farm_ar.geometry import to_pymunk, wrap
from farm_ar.geometry.rectangles import length
from farm_ar.reid import reid_factory
from farm_ar.reid.session import SessionReid
from farm_ar.scenes import Camera, Layout, Scene


class World(Protocol):
    """The part of `FarmGame` that the environment plays with."""

    camera: Camera
    tracker: Tracker

    @property
    def phase(self) -> Phase:
        """What is going on."""
        ...

    @property
    def truth(self) -> Layout:
        """Where everything really is."""
        ...

    @property
    def miscounts(self) -> int:
        """Animals so far that did not get into the building of their colour."""
        ...

    def begin_visit(self, camera: Camera | None = None) -> None:
        """The hand comes."""
        ...

    @property
    def places(self) -> FloatArray:
        """(N, 3 or more) true x and z, metres, and pymunk's angle, radians, of all objects."""
        ...

    @property
    def changes(self) -> float:
        """How often that has changed."""
        ...

    def move(
        self, index: int, displacement: FloatArray, turn: float, *, most: MotionLimit | None = None
    ) -> Motion:
        """Move one object, and all objects together by no more than so much."""
        ...

    def end_visit(self, camera: Camera | None = None) -> Sighting:
        """The hand has left; a snapshot is taken."""
        ...

    def play(self, seconds: float) -> None:
        """Let time pass."""
        ...

    def render_state(self, caption: str = "") -> RenderState:
        """All there is to see now."""
        ...

    def state(self) -> dict[str, FloatArray | float]:
        """All that may change, by name."""
        ...


class PlainScene:
    """Any scene without physics and without the game: a move sets a pose, within the room.

    Args:
        layout: where everything is at the start.
        camera: the first visit's.
        tracker: keeps the belief.
        rng: where the randomness comes from.
    """

    miscounts = 0

    def __init__(self, layout: Layout, camera: Camera, tracker: Tracker, rng: np.random.Generator) -> None:
        self.camera, self.tracker, self.phase = camera, tracker, Phase.PLAY
        self._position, self._yaw, self._rng = layout.position.copy(), layout.yaw.copy(), rng
        self._truth: Layout | None = layout
        self.changes = 0.0

    @property
    def places(self) -> FloatArray:
        """(N, 3) x and z, metres, and pymunk's angle, radians."""
        return np.column_stack(to_pymunk(self._position, self._yaw))

    @property
    def truth(self) -> Layout:
        """Where everything really is."""
        if self._truth is None:
            self._truth = self.tracker.scene.layout.placed(self._position.copy(), self._yaw.copy())
        return self._truth

    def begin_visit(self, camera: Camera | None = None) -> None:
        """From now on this camera looks."""
        self.camera, self.phase = camera or self.camera, Phase.HAND

    def move(
        self, index: int, displacement: FloatArray, turn: float, *, most: MotionLimit | None = None
    ) -> Motion:
        """Set one object's pose; its pivot stays in the room. It moves nothing else."""
        before = self._position[index].copy()
        self._position[index] = np.clip(before + displacement, 0.0, self.tracker.scene.size)
        self._yaw[index] += turn
        self._truth = None
        self.changes += 1
        metres = float(length(*(self._position[index] - before).tolist()))
        return Motion(metres, float(np.abs(wrap(np.asarray(turn)))))

    def end_visit(self, camera: Camera | None = None) -> Sighting:
        """Take a snapshot and believe the identification."""
        self.phase = Phase.PLAY
        return self.tracker.look(self.truth, camera or self.camera, self._rng)

    def play(self, seconds: float) -> None:
        """Nothing plays here."""

    def render_state(self, caption: str = "") -> RenderState:
        """All there is to see now."""
        scene, belief = self.tracker.scene, self.tracker.belief
        return RenderState(
            scene,
            self.truth,
            belief.layout,
            belief.wrong,
            self.camera,
            phase=self.phase.text,
            caption=caption,
        )

    def state(self) -> dict[str, FloatArray | float]:
        """All that may change, by name."""
        camera = {"camera_position": self.camera.position, "camera_yaw": self.camera.yaw}
        return {"position": self._position, "yaw": self._yaw, **camera, **self.tracker.belief.state()}


def new_world(
    scene: Scene, layout: Layout, camera: Camera, config: EnvConfig, rng: np.random.Generator
) -> World:
    """The game, or the plain scene, with everything where it starts."""
    make_reid = reid_factory(config.reid)
    perception = perception_of(config.perception, scene, config.oracle_noise)
    if config.session == "learn":
        make_reid = SessionReid(make_reid)
    if config.head_noise_deg > 0:
        perception = UnsteadyHead(perception, float(np.deg2rad(config.head_noise_deg)))
    if config.game:
        return game_class(config.update)(
            scene,
            camera,
            rng,
            layout,
            make_reid=make_reid,
            perception=perception,
            animals_a_second=config.animals_a_second,
            carry=config.carry,
        )
    return PlainScene(layout, camera, Tracker(scene, layout, make_reid, perception), rng)
