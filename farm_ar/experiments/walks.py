"""A person who walks through a room with a headset: what it sees, frame by frame, and how it drifts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.geometry import heading, wrap
from farm_ar.scenes import (
    Camera,
    Detector,
    FieldOfView,
    Layout,
    LayoutNoise,
    Scene,
    SnapshotBatch,
    observe_many,
)
from farm_ar.vision.measured_noise import disturbed, measured_noise

VIEWS: Mapping[str, FieldOfView] = MappingProxyType(
    {
        "camera": FieldOfView.symmetric(np.deg2rad(64.69), 20.0, np.deg2rad(39.2)),
        "display": FieldOfView.symmetric(np.deg2rad(43.0), 20.0, np.deg2rad(29.0)),
    }
)
"""What a HoloLens 2 sees: its photo and video camera, 64.7 by 39.2 degrees, or its display, 43 by 29.

The paper does not say in which of them a box must be. Its view ends at the walls, well within 20 m.
"""

DETECTOR = Detector(occlusion=True, whole=True)
"""A chair counts only when all of its box is in view and no other hides its middle."""


class Walked(NamedTuple):
    """What W walks through W rearranged layouts give.

    Args:
        layouts: (W,) of them: where everything stands.
        cameras: (W, P) true poses of the headset.
        snapshots: W x P of them, in order, as the headset has them.
    """

    layouts: Layout
    cameras: Camera
    snapshots: SnapshotBatch


@dataclass(frozen=True)
class Walk:
    """How a person walks and looks, and what is wrong with what the headset says.

    The errors of the poses are those measured on pictures of the farm, for chairs at the distance at which
    they look as large (`MeasuredNoise.for_sizes`). All else is assumed.

    Args:
        eye_m: height of the eyes above the floor, metres.
        speed: along the scene's camera path, metres a second.
        frames_per_second: frames that are identified.
        look: at what: `"table"`, the nearest one ahead, or `"middle"`, that of all tables.
        nearest_m: what is nearer than this is looked past, metres.
        look_m: height of what is looked at, metres: the middle of a chair.
        sway: SD of the heading about what is looked at, radians; the pitch sways half as much.
        sway_s: how long a glance lasts, seconds.
        detector: what is detected.
        measured: whether detections have the measured errors and misses.
        drift_m: SD of the headset's own place, metres, in each coordinate.
        drift_rad: SD of its heading, radians.
        drift_s: how long an error of the headset's pose lasts, seconds.
        fov: what the headset sees.
    """

    eye_m: float = 1.65
    speed: float = 0.7
    frames_per_second: float = 2.0
    look: Literal["table", "middle"] = "table"
    nearest_m: float = 1.5
    look_m: float = 0.45
    sway: float = float(np.deg2rad(8.0))
    sway_s: float = 1.5
    detector: Detector = DETECTOR
    measured: bool = True
    drift_m: float = 0.02
    drift_rad: float = float(np.deg2rad(0.5))
    drift_s: float = 20.0
    fov: FieldOfView = VIEWS["camera"]

    def cameras(self, scene: Scene, walks: int, rng: np.random.Generator) -> Camera:
        """(walks, P) true poses of the headset along the scene's camera path, which it must have."""
        assert scene.camera_path is not None
        path = scene.camera_path
        count = max(2, round(path.length / self.speed * self.frames_per_second))
        along = path.cameras(count, self.fov)
        yaw, pitch = self.gaze(along, scene.site_positions)
        glance = self.sway * wandering((2, walks, count), self.frames_per_second * self.sway_s, rng)
        return Camera(
            np.broadcast_to(along.position, (walks, count, 2)),
            yaw + glance[0],
            self.fov,
            np.full((walks, count), self.eye_m),
            pitch + glance[1] / 2,
        )

    def gaze(self, along: Camera, tables: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(P,) headings and pitches of somebody who walks and looks at what `look` says, radians.

        What is nearer than `nearest_m` is looked past: then, and where no table is ahead, the look goes along
        the path.
        """
        targets = tables if self.look == "table" else tables.mean(axis=0)[None]
        offset = targets - along.position[:, None]  # (P, K, 2)
        away = np.hypot(offset[..., 0], offset[..., 1])
        ahead = np.abs(wrap(heading(offset) - along.yaw[:, None])) < np.pi / 2
        away = np.where((ahead | (self.look == "middle")) & (away > self.nearest_m), away, np.inf)
        target, some = away.argmin(axis=1), np.isfinite(away).any(axis=1)
        chosen = offset[np.arange(len(target)), target]
        far = np.where(some, np.hypot(chosen[:, 0], chosen[:, 1]), 4.0)
        yaw: FloatArray = np.where(some, heading(chosen), along.yaw)
        return yaw, np.arctan2(self.look_m - self.eye_m, far)

    def through(self, scene: Scene, noise: LayoutNoise, walks: int, rng: np.random.Generator) -> Walked:
        """A walk along the scene's camera path through each of as many rearranged layouts."""
        moved = noise.disturb(scene.layout, scene.size, rng, (walks,))
        every = moved.placed(moved.position[:, None], moved.yaw[:, None])
        cameras = self.cameras(scene, walks, rng)
        batch = observe_many(every, cameras, self.detector, rng)
        if self.measured:
            measured = measured_noise().for_sizes(scene.layout.size)
            batch = disturbed(batch, len(scene.layout), measured, rng)
        error = wandering((3, *cameras.batch_shape), self.frames_per_second * self.drift_s, rng)
        seen = drifted(batch, error.reshape(3, -1) * [[self.drift_m], [self.drift_m], [self.drift_rad]])
        return Walked(moved, cameras, seen)


def wandering(shape: tuple[int, ...], steps: float, rng: np.random.Generator) -> FloatArray:
    """Gaussian walks of SD 1 that forget where they were after so many steps, along the last axis (AR(1))."""
    keep = float(np.exp(-1.0 / steps)) if steps > 0 else 0.0
    fresh = rng.standard_normal(shape) * np.sqrt(1 - keep**2)
    fresh[..., 0] /= np.sqrt(1 - keep**2)
    found = np.empty(shape)
    found[..., 0] = fresh[..., 0]
    for k in range(1, shape[-1]):
        found[..., k] = keep * found[..., k - 1] + fresh[..., k]
    return found


def drifted(batch: SnapshotBatch, error: FloatArray) -> SnapshotBatch:
    """The snapshots as a headset has them that is wrong about its own pose: what it sees goes along.

    Args:
        batch: B snapshots, by the true poses.
        error: (3, B) of x and z, metres, and of the heading, radians.
    """
    x, z, turn = error
    cosine, sine = np.cos(turn)[:, None], np.sin(turn)[:, None]
    offset = batch.position - batch.camera.position[:, None]
    turned = np.stack(
        [cosine * offset[..., 0] + sine * offset[..., 1], cosine * offset[..., 1] - sine * offset[..., 0]],
        axis=-1,
    )
    place = batch.camera.position + np.stack([x, z], axis=-1)
    camera = replace(batch.camera, position=place, yaw=batch.camera.yaw + turn)
    return replace(
        batch,
        camera=camera,
        position=place[:, None] + turned,
        yaw=batch.yaw + turn[:, None],
        uncertainty=batch.uncertainty and batch.uncertainty.turned(turn[:, None]),
    )
