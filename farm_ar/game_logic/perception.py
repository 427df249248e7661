"""How the game perceives: detections from what stands on the table, and whether the hand is in view."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry import in_vertical_view, in_view
from farm_ar.scenes import PERFECT, Camera, Detector, Layout, Snapshot, observe_many

ARM_HEIGHT_M = 0.06
"""Height of hand and forearm above the table."""

ARM_POINTS = 48
"""Points along each side of the forearm that are looked for."""

ARM_HALF_WIDTH_M = 0.03

_ALONG = np.linspace(0.0, 1.0, ARM_POINTS)


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


@runtime_checkable
class HandDetector(Protocol):
    """Anything that says whether the player's hand is in view."""

    def sees_hand(self, hand: FloatArray, camera: Camera) -> bool:
        """Whether a hand at (2,) metres, or its forearm, is in the camera's view."""
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
        batch = observe_many(truth, camera, self.detector, rng)
        assert batch.truth is not None
        return Perceived(batch.snapshot(0), batch.truth[0, : batch.count[0]])


def forearm(hand: FloatArray, reach_from: float = -0.45) -> FloatArray:
    """(P, 2) points of hand and forearm: both sides of it, from the hand, (2,), to the elbow.

    The elbow is at the player's side, at z = `reach_from` metres or where the hand is, if that is nearer.
    """
    far = hand[1] + ARM_HALF_WIDTH_M
    points = np.empty((2 * ARM_POINTS, 2))
    points[:ARM_POINTS, 0] = hand[0] - ARM_HALF_WIDTH_M
    points[ARM_POINTS:, 0] = hand[0] + ARM_HALF_WIDTH_M
    points[:ARM_POINTS, 1] = points[ARM_POINTS:, 1] = far + _ALONG * (min(reach_from, hand[1]) - far)
    return points


@dataclass(frozen=True)
class GeometricHandDetector:
    """Sees the hand when any part of hand or forearm is inside the camera's view volume."""

    def sees_hand(self, hand: FloatArray, camera: Camera) -> bool:
        """Whether a hand at (2,) metres, or its forearm, is in the camera's view."""
        points, fov = forearm(np.asarray(hand, dtype=np.float64)), camera.fov
        seen = in_view(points, camera.position, camera.yaw, fov.left, fov.right, fov.range_m)
        if fov.up is not None and fov.down is not None and camera.height is not None:
            x, z = points.T
            raised = np.stack([x, np.full(len(points), ARM_HEIGHT_M), z], axis=-1)
            eye = np.array([camera.position[0], float(camera.height), camera.position[1]])
            seen = seen & in_vertical_view(raised, eye, camera.yaw, camera.pitch, fov.up, fov.down)
        return bool(seen.any())
