"""Disorder and detection errors beyond the paper's noise, under which methods are compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.experiments.setting import path_cameras
from farm_ar.reid import Motion, Rates
from farm_ar.scenes import (
    PERFECT,
    UNKNOWN,
    Camera,
    Detector,
    Layout,
    LayoutNoise,
    Scene,
    SnapshotBatch,
    observe_many,
    visible,
)

FEW, FAR, STAYING = 0.2, LayoutNoise.of(1.5, 90.0), LayoutNoise.of(0.02, 2.0)
CLUSTER_SHIFT_M, CLUSTER_TURN = 0.7, float(np.deg2rad(45.0))
DRIFT_M, DRIFT_TURN = 0.1, float(np.deg2rad(5.0))
SHARE_WRONG = 0.2
NEW_OBJECTS = 2
USUAL, CALM, SLIGHT = LayoutNoise.of(0.3, 30.0), LayoutNoise.of(0.1, 15.0), LayoutNoise.of(0.05, 5.0)


@dataclass(frozen=True, eq=False)
class Case:
    """Snapshots of noisy layouts, and what a method with full knowledge of the noise would be given.

    Args:
        snapshots: of L layouts, each seen from P poses, L x P of them in this order.
        noise: the motions that made the layouts; None where no model of single objects describes them.
        rates: of misses and of detections without a label.
    """

    snapshots: SnapshotBatch
    noise: tuple[Motion, ...] | None
    rates: Rates = field(default_factory=Rates)


def jitter(scene: Scene, noise: LayoutNoise, layouts: int, rng: np.random.Generator) -> Case:
    """Everything moves a little: the paper's noise."""
    return Case(_seen(scene, noise.disturb(scene.layout, scene.size, rng, (layouts,))), (_motion(noise),))


def few_move_far(scene: Scene, layouts: int, rng: np.random.Generator) -> Case:
    """A fifth of the objects are moved far, the rest stays where it was."""
    stay = STAYING.disturb(scene.layout, scene.size, rng, (layouts,))
    far = FAR.disturb(scene.layout, scene.size, rng, (layouts,))
    moved = rng.random(far.yaw.shape) < FEW
    noisy = stay.with_poses(
        np.where(moved[..., None], far.position, stay.position), np.where(moved, far.yaw, stay.yaw)
    )
    return Case(_seen(scene, noisy), (_motion(STAYING, 1 - FEW), _motion(FAR, FEW)))


def cluster_moved(scene: Scene, layouts: int, rng: np.random.Generator) -> Case:
    """All objects around one site, a table and its chairs, are pushed and turned together."""
    noisy = SLIGHT.disturb(scene.layout, scene.size, rng, (layouts,))
    position, yaw = noisy.position.copy(), noisy.yaw.copy()
    for k in range(layouts):
        together = scene.object_site == scene.object_site[rng.integers(len(scene.layout))]
        middle = position[k, together].mean(axis=0)
        turn, shift = rng.uniform(-CLUSTER_TURN, CLUSTER_TURN), rng.normal(0.0, CLUSTER_SHIFT_M, 2)
        position[k, together] = middle + shift + turned(position[k, together] - middle, turn)
        yaw[k, together] += turn
    return Case(_seen(scene, noisy.with_poses(np.clip(position, 0.0, scene.size), yaw)), None)


def camera_drift(scene: Scene, layouts: int, rng: np.random.Generator) -> Case:
    """The headset's frame has drifted: each snapshot is shifted and turned, the camera's pose with it."""
    seen = jitter(scene, CALM, layouts, rng).snapshots
    turn = rng.uniform(-DRIFT_TURN, DRIFT_TURN, len(seen))
    shift = rng.uniform(-DRIFT_M, DRIFT_M, (len(seen), 2))
    eye = seen.camera.position
    camera = Camera(eye + shift, seen.camera.yaw + turn, seen.camera.fov)
    position = (eye + shift)[:, None] + turned(seen.position - eye[:, None], turn[:, None])
    return Case(replace(seen, camera=camera, position=position, yaw=seen.yaw + turn[:, None]), None)


def seen_badly(scene: Scene, layouts: int, rng: np.random.Generator) -> Case:
    """A fifth of the objects in view are missed, and there are as many false detections."""
    noisy = USUAL.disturb(scene.layout, scene.size, rng, (layouts,))
    in_view = visible(noisy.with_poses(noisy.position[:, None], noisy.yaw[:, None]), path_cameras(scene))
    false_rate = SHARE_WRONG * float(in_view.sum(axis=-1).mean())
    seen = _seen(scene, noisy, Detector(miss_rate=SHARE_WRONG, false_rate=false_rate), rng)
    return Case(seen, (_motion(USUAL),), Rates(1.0, SHARE_WRONG, false_rate))


def two_new(scene: Scene, layouts: int, rng: np.random.Generator) -> Case:
    """Two new objects, of categories of the scene, anywhere in the room."""
    known = scene.layout
    noisy = USUAL.disturb(known, scene.size, rng, (layouts,))
    like = rng.integers(len(known), size=NEW_OBJECTS)
    place = rng.uniform(0.0, scene.size, (layouts, NEW_OBJECTS, 2))
    heading = rng.uniform(-np.pi, np.pi, (layouts, NEW_OBJECTS))
    more = Layout(
        labels=known.labels + tuple(f"new {k}, of which nobody knows" for k in range(NEW_OBJECTS)),
        category=known.category + tuple(known.category[i] for i in like),
        position=np.concatenate([noisy.position, place], axis=1),
        yaw=np.concatenate([noisy.yaw, heading], axis=1),
        size=np.concatenate([known.size, known.size[like]]),
    )
    seen = _seen(scene, more)
    assert seen.truth is not None
    truth = np.where(seen.truth < len(known), seen.truth, UNKNOWN)
    in_view = (scene.fov.left + scene.fov.right) / 2 * scene.fov.range_m**2 / scene.area
    rates = Rates(1.0, 0.0, NEW_OBJECTS * min(in_view, 1.0))
    return Case(replace(seen, truth=truth), (_motion(USUAL),), rates)


PATTERNS: dict[str, Callable[[Scene, int, np.random.Generator], Case]] = {
    "few move far": few_move_far,
    "cluster moved together": cluster_moved,
    "camera drift": camera_drift,
    "missed and false": seen_badly,
    "two new objects": two_new,
}
"""The patterns by name; each makes the snapshots of some layouts of a scene."""


def turned(offset: FloatArray, turn: float | FloatArray) -> FloatArray:
    """Offsets (..., 2) in the plane after a turn (...) clockwise, as yaw goes."""
    sine, cosine = np.sin(turn), np.cos(turn)
    x, z = offset[..., 0], offset[..., 1]
    return np.stack([x * cosine + z * sine, z * cosine - x * sine], axis=-1)


def _seen(
    scene: Scene, noisy: Layout, detector: Detector = PERFECT, rng: np.random.Generator | None = None
) -> SnapshotBatch:
    each_pose = noisy.with_poses(noisy.position[:, None], noisy.yaw[:, None])
    return observe_many(each_pose, path_cameras(scene), detector, rng)


def _motion(noise: LayoutNoise, share: float = 1.0) -> Motion:
    return Motion(share, noise.translation.sd, noise.rotation.sd)
