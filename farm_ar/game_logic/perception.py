"""How the game perceives: detections from what stands on the table, and whether the hand is in view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from farm_ar.arrays import IntArray
from farm_ar.game_logic import visibility
from farm_ar.game_logic.physics.gripper import HandState
from farm_ar.game_logic.render_state import RenderState
from farm_ar.scenes import PERFECT, Camera, Detections, Detector, Layout, Snapshot, observe_many


@dataclass(frozen=True, eq=False)
class Perceived:
    """A snapshot, and what only the referee knows of it.

    Args:
        snapshot: what the game gets to see, K detections.
        source: (K,) index of the object that each detection really is, -1 for a false one.
    """

    snapshot: Snapshot
    source: IntArray


@runtime_checkable
class Perception(Protocol):
    """Anything that makes a snapshot of what stands on the table."""

    def perceive(self, truth: Layout, camera: Camera, rng: np.random.Generator) -> Perceived:
        """The snapshot that the camera takes of the objects where they truly are."""
        ...


@dataclass(frozen=True, eq=False)
class HandView:
    """What a hand detector gets to look at: one moment, through the headset's camera.

    Args:
        camera: the headset's camera.
        hand: the true hand, for oracles; None while there is none.
        render_state: gives all there is to see, for detectors that look at a picture of it.
    """

    camera: Camera
    hand: HandState | None
    render_state: Callable[[], RenderState]


@runtime_checkable
class HandDetector(Protocol):
    """Anything that says whether the player's hand is in view."""

    def sees_hand(self, view: HandView) -> bool:
        """Whether a hand, or its forearm, is in the camera's view."""
        ...


@dataclass(frozen=True)
class OraclePerception:
    """True poses of what is in view, with what the detector makes of them.

    Args:
        detector: noise, misses, false detections, occlusion; by default none.
    """

    detector: Detector = PERFECT

    def perceive(self, truth: Layout, camera: Camera, rng: np.random.Generator) -> Perceived:
        """The snapshot that the camera takes of the objects where they truly are."""
        if self.detector == PERFECT and not (truth.batch_shape or camera.batch_shape):
            return _exactly(truth, camera)
        batch = observe_many(truth, camera, self.detector, rng)
        assert batch.truth is not None
        return Perceived(batch.snapshot(0), batch.truth[0, : batch.count[0]])


def _exactly(truth: Layout, camera: Camera) -> Perceived:
    """What `observe_many` gives without noise, in less time: what is in view, from left to right."""
    _, source = visibility.seen_by(camera, truth)
    numbers = source.tolist()
    detections = Detections.trusted(
        category=tuple([truth.category[i] for i in numbers]),
        position=truth.position[source],
        yaw=truth.yaw[source],
        size=truth.size[source],
        elevation=truth.elevation[source],
        confidence=np.ones(len(numbers)),
        ids=tuple([str(i) for i in range(len(numbers))]),
        track_id=(None,) * len(numbers),
    )
    return Perceived(Snapshot.trusted(camera=camera, detections=detections), source)


@dataclass(frozen=True)
class GeometricHandDetector:
    """Sees the hand when any part of hand or forearm is inside the camera's view volume; an oracle."""

    def sees_hand(self, view: HandView) -> bool:
        """Whether the true hand, or its forearm, is in the camera's view."""
        if view.hand is None:
            return False
        x, z = view.hand.position.tolist()
        return bool(visibility.sees_arm(visibility.eye_of(view.camera), x, z))
