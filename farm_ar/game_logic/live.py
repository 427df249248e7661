"""The game without its pause: identification runs while the hand moves objects, and animals go on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.game_logic.belief import Sighting
from farm_ar.game_logic.farm_game import TICK_S, FarmGame
from farm_ar.game_logic.perception import OraclePerception, Perceived, Perception
from farm_ar.game_logic.phases import Phase
from farm_ar.game_logic.physics.gripper import HandState
from farm_ar.game_logic.physics.limits import Motion, MotionLimit
from farm_ar.game_logic.physics.tabletop import Tabletop
from farm_ar.game_logic.render_state import RenderState
from farm_ar.scenes import Camera, Layout, Scene, visible

UPDATES = ("pause", "live")
"""When the game looks: once, after the hand has left, while all else waits; or all the time."""

LOOK_TICKS = 12
"""Ticks from one look to the next: a fifth of a second."""

GLIDE_M_S = 0.3
"""How fast the ends of paths move to where their buildings are believed to be."""

ARM_M, ARM_LENGTH_M, ELBOW_M, HAND_HEIGHT_M = 0.045, 0.3, 0.16, 0.05
"""Of the arm before the camera: its radius, its length towards the player, the heights of elbow and hand."""


def hidden_by_hand(layout: Layout, camera: Camera, hand: HandState | None) -> BoolArray:
    """Which objects the hand holds or hides: the line of sight to their middle meets the arm.

    Args:
        layout: N objects.
        camera: the headset's; where its height is not known, only what the hand holds is hidden.
        hand: the hand, None for none.

    Returns:
        (N,) whether each is hidden.
    """
    hidden = np.zeros(len(layout), dtype=bool)
    if hand is None:
        return hidden
    if hand.gripped is not None:
        hidden[hand.gripped] = True
    if camera.height is None:
        return hidden
    eye = np.array([camera.position[0], float(camera.height), camera.position[1]])
    x, z = hand.position.tolist()
    palm, elbow = np.array([x, HAND_HEIGHT_M, z]), np.array([x, ELBOW_M, z - ARM_LENGTH_M])
    for i, (place, size) in enumerate(zip(layout.position, layout.size, strict=True)):
        middle = np.array([place[0], layout.elevation[i] + size[1] / 2, place[1]])
        hidden[i] |= _segments_apart(eye, middle, palm, elbow) < ARM_M
    return hidden


@dataclass
class HandBefore:
    """Perception with the hand before the camera.

    Args:
        perception: what would be perceived without it.
        hand: the hand, None while there is none.
    """

    perception: Perception
    hand: HandState | None = None

    def perceive(self, truth: Layout, camera: Camera, rng: np.random.Generator) -> Perceived:
        """What is perceived of the objects that the hand does not hide."""
        found = self.perception.perceive(truth, camera, rng)
        hidden = hidden_by_hand(truth, camera, self.hand)
        kept = np.flatnonzero((found.source < 0) | ~hidden[found.source])
        if len(kept) == len(found.source):
            return found
        seen = found.snapshot.detections.at(kept)
        return Perceived(replace(found.snapshot, detections=seen), found.source[kept])


class LiveGame(FarmGame):
    """The game with `update="live"`: five looks a second, from which every label follows its building.

    During a visit animals wait whose building the last look did not show where it should be: it is in the
    hand, behind the arm, or lost.

    Args:
        scene: as for `FarmGame`.
        camera: likewise.
        rng: likewise.
        layout: likewise.
        perception: makes the snapshots; by default from the true poses. What the hand hides is left out.
        named: the others, by name.
    """

    def __init__(
        self,
        scene: Scene,
        camera: Camera,
        rng: np.random.Generator,
        layout: Layout | None = None,
        perception: Perception | None = None,
        **named: Any,
    ) -> None:
        self._before = HandBefore(perception or OraclePerception())
        self._until_look = LOOK_TICKS
        self._ends: FloatArray = np.empty((0, 2))  # while the routes are filled
        self._waiting = np.zeros(len(scene.layout), dtype=bool)
        super().__init__(scene, camera, rng, layout, perception=self._before, **named)
        self._ends = self.believed.position.copy()

    @property
    def ends(self) -> FloatArray:
        """(N, 2) where paths end now, on their way to where buildings are believed to be, metres."""
        return self._ends

    def move(
        self,
        index: int,
        displacement: FloatArray,
        turn: float,
        record: Callable[[Tabletop], None] | None = None,
        *,
        most: MotionLimit | None = None,
    ) -> Motion:
        """The hand carries one building, while the game goes on; arguments as for `FarmGame.move`."""

        def at_tick(table: Tabletop) -> None:
            self.pass_tick()
            if record is not None:
                record(table)

        return super().move(index, displacement, turn, at_tick, most=most)

    def steer(
        self, vx: float, vz: float, twist: float, grip: bool, ticks: int
    ) -> tuple[Motion, int, Sighting | None]:
        """Ticks under a hand that is steered, while the game goes on; arguments as for `FarmGame.steer`."""
        motion, passed = Motion(), 0
        while passed < ticks:
            more, _, sighting = super().steer(vx, vz, twist, grip, 1)
            motion, passed = motion + more, passed + 1
            if sighting is not None:
                return motion, passed, sighting
            if self.phase is Phase.HAND:
                self.pass_tick()
        return motion, passed, None

    def wait(self, ticks: int) -> None:
        """Let time pass within a visit, as while the hand is out of view but may come again."""
        for _ in range(ticks):
            self.pass_tick()

    def play(self, seconds: float) -> None:
        """Let the animals run; the ends of their paths glide on where they are not there yet."""
        if self.phase is Phase.PLAY and self._gliding():
            whole = min(int(seconds / TICK_S + 1e-9), 600)
            for _ in range(whole):
                self._glide()
                super().play(TICK_S)
            seconds = max(seconds - whole * TICK_S, 0.0)
        super().play(seconds)

    def pass_tick(self) -> None:
        """A tick of a visit: animals run, ends glide, and now and then a look."""
        self._until_look -= 1
        if self._until_look <= 0:
            self._until_look = LOOK_TICKS
            self._before.hand = self.tabletop.hand
            named = self.look().identification.labels
            missing = [label not in named for label in self.believed.labels]
            self._waiting = missing & self.believed.movable & visible(self.believed, self.camera)
        self._glide()
        if self._waiting.any():
            self.flock.hold(self._waiting, TICK_S)
        self._run(TICK_S)

    def end_visit(self, camera: Camera | None = None) -> Sighting:
        """The hand has left: a last look, at all that is in view."""
        self._before.hand = None
        self._waiting = np.zeros_like(self._waiting)
        return super().end_visit(camera)

    def _follow(self, changed: BoolArray) -> None:
        """Ends of paths do not jump, they glide."""

    def render_state(self, caption: str = "") -> RenderState:
        """All there is to see now; nobody is frozen while the hand is in view."""
        return replace(super().render_state(caption), phase=Phase.PLAY.text)

    def state(self) -> dict[str, FloatArray | float]:
        """All that may change, by name."""
        return {
            **super().state(),
            "path_ends": self._ends,
            "waiting": self._waiting.astype(np.float64),
            "ticks_to_look": float(self._until_look),
        }

    def _gliding(self) -> bool:
        return bool(len(self._ends) and np.any(self._ends != self.believed.position))

    def _glide(self) -> None:
        """Move the ends of paths towards where buildings are believed to be."""
        way = self.believed.position - self._ends
        far = np.linalg.norm(way, axis=1)
        if not far.any():
            return
        step = GLIDE_M_S * TICK_S
        share = np.minimum(step / np.where(far > 0, far, step), 1.0)[:, None]
        self._ends = np.where(share >= 1, self.believed.position, self._ends + share * way)
        self._redirect(self._ends, far > 0)


def game_class(update: str) -> type[FarmGame]:
    """The game of an update, one of `UPDATES`."""
    return LiveGame if update == "live" else FarmGame


def _segments_apart(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> float:
    """The least distance of two segments in space, a to b and c to d, metres."""
    u, v, w = b - a, d - c, a - c
    uu, uv, vv, uw, vw = u @ u, u @ v, v @ v, u @ w, v @ w
    across = uu * vv - uv * uv
    s = np.clip((uv * vw - vv * uw) / across, 0.0, 1.0) if across > 1e-12 else 0.0
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0) if vv > 1e-12 else 0.0
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0) if uu > 1e-12 else 0.0
    return float(np.linalg.norm(w + s * u - t * v))


__all__ = ["GLIDE_M_S", "LOOK_TICKS", "UPDATES", "HandBefore", "LiveGame", "game_class", "hidden_by_hand"]
