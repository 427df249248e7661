"""One moment of the game, for whoever draws it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.game_logic.physics.gripper import HandState
from farm_ar.scenes import Camera, Layout, Scene


@dataclass(frozen=True, eq=False)
class RenderState:
    """All there is to see at one moment, true and believed.

    Args:
        scene: the table, its sites among it.
        truth: where everything really is, N objects.
        believed: where the game believes each label to be.
        wrong: (N,) labels that the game has on the wrong object.
        camera: the headset's camera.
        phase: "play", or "hand" while the animals are frozen.
        seconds: time played so far.
        counts: (N,) the counter of each label.
        misplaced: (N,) those of them that got into another label's building.
        hand: the hand, None while there is none.
        animal: (A, 2) where the animals are, metres.
        animal_heading: (A,) where they run to, radians.
        animal_goal: (A,) the label that each wants to get to.
        caption: a line about what is going on.
        missing: parts, by name, that have been taken off objects, by index: the stairs of a coop.
        open_gates: how far the gates of objects are open, by index, 0 to 1.
    """

    scene: Scene
    truth: Layout
    believed: Layout
    wrong: BoolArray
    camera: Camera
    phase: str = "play"
    seconds: float = 0.0
    counts: IntArray | None = None
    misplaced: IntArray | None = None
    hand: HandState | None = None
    animal: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    animal_heading: FloatArray = field(default_factory=lambda: np.zeros(0))
    animal_goal: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    caption: str = ""
    missing: Mapping[int, tuple[str, ...]] = field(default_factory=dict)
    open_gates: Mapping[int, float] = field(default_factory=dict)
