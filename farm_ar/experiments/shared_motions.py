"""Ways in which things move together, or the frame drifts, with snapshots of what has happened."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.experiments.setting import path_cameras
from farm_ar.game_logic.headset import random_camera
from farm_ar.reid.registration import RigidMotion
from farm_ar.scenes import Camera, Layout, LayoutNoise, Scene, SnapshotBatch, observe_many

AROUND = 40
"""Cameras that are drawn around the game's table."""

MEMBERS = (3, 6)
"""How many labels near one another move together, at least and at most."""

SHIFT, MOST_TURNED = (0.06, 0.2), float(np.deg2rad(45.0))
"""How far they move, as shares of the room's diagonal, and how far they turn."""

DRIFT_M, DRIFT_TURN = 0.1, float(np.deg2rad(5.0))
"""Farthest that a frame drifts."""

CALM, USUAL = (0.014, 15.0), (0.042, 30.0)
"""SDs of how each label moves on its own, by the room's diagonal and in degrees: .1, .3 m in one of 7 m."""


class Seen(NamedTuple):
    """Snapshots, and (B,) the number of the layout that each is of."""

    batch: SnapshotBatch
    layout: IntArray


def calm(scene: Scene, layouts: int, poses: int, rng: np.random.Generator) -> Seen:
    """Each label moves a little on its own, and nothing else happens."""
    return _seen(_noisy(scene, scene.layout, layouts, CALM, rng), scene, poses, rng)


def usual(scene: Scene, layouts: int, poses: int, rng: np.random.Generator) -> Seen:
    """Each label moves on its own, and nothing else happens."""
    return _seen(_noisy(scene, scene.layout, layouts, USUAL, rng), scene, poses, rng)


def group_moved(scene: Scene, layouts: int, poses: int, rng: np.random.Generator) -> Seen:
    """Labels near one another are pushed and turned together, in snapshots that see two of them or more."""
    moved = [_one_group_moved(scene, rng) for _ in range(layouts)]
    together = scene.layout.with_poses(
        np.stack([layout.position for layout, _ in moved]), np.stack([layout.yaw for layout, _ in moved])
    )
    noisy = _noisy(scene, together, layouts, CALM, rng)
    return _seen(noisy, scene, poses, rng, np.stack([members for _, members in moved]))


def frame_drifted(scene: Scene, layouts: int, poses: int, rng: np.random.Generator) -> Seen:
    """The frame of camera and detections has drifted: turned about the camera, and shifted."""
    batch, layout = calm(scene, layouts, poses, rng)
    return Seen(drifted(batch, batch.camera.position, rng), layout)


def frame_turned(scene: Scene, layouts: int, poses: int, rng: np.random.Generator) -> Seen:
    """The frame has drifted: turned about its origin, a corner of the room, and shifted."""
    batch, layout = calm(scene, layouts, poses, rng)
    return Seen(drifted(batch, np.zeros((len(batch), 2)), rng), layout)


PATTERNS: dict[str, Callable[[Scene, int, int, np.random.Generator], Seen]] = {
    "calm": calm,
    "usual": usual,
    "group moved": group_moved,
    "frame drifted": frame_drifted,
    "frame turned": frame_turned,
}


def drifted(batch: SnapshotBatch, pivot: FloatArray, rng: np.random.Generator) -> SnapshotBatch:
    """Snapshots whose frames have drifted, each by a motion of its own about a pivot, (B, 2)."""
    angle, far = rng.uniform(-np.pi, np.pi, len(batch)), DRIFT_M * np.sqrt(rng.random(len(batch)))
    shift = far[:, None] * np.stack([np.sin(angle), np.cos(angle)], axis=-1)
    motion = RigidMotion(pivot, shift, rng.uniform(-DRIFT_TURN, DRIFT_TURN, len(batch)))
    eye = motion.position(batch.camera.position[:, None])[:, 0]
    camera = replace(batch.camera, position=eye, yaw=batch.camera.yaw + motion.turn)
    return replace(batch, camera=camera, position=motion.position(batch.position), yaw=motion.yaw(batch.yaw))


def _noisy(
    scene: Scene, layout: Layout, layouts: int, noise: tuple[float, float], rng: np.random.Generator
) -> Layout:
    sd = LayoutNoise.of(noise[0] * scene.diagonal, noise[1])
    return sd.disturb(layout, scene.size, rng, (layouts,))


def _one_group_moved(scene: Scene, rng: np.random.Generator) -> tuple[Layout, BoolArray]:
    """The reference layout after a group has moved within the room, and (N,) its members."""
    layout = scene.layout
    members = np.zeros(len(layout), dtype=bool)
    for _ in range(1000):
        apart = np.linalg.norm(layout.position - layout.position[rng.integers(len(layout))], axis=-1)
        nearest = np.argsort(np.where(layout.fixed, np.inf, apart), kind="stable")
        group = nearest[: rng.integers(MEMBERS[0], MEMBERS[1] + 1)]
        angle, far = rng.uniform(-np.pi, np.pi), scene.diagonal * rng.uniform(*SHIFT)
        shift = far * np.array([np.sin(angle), np.cos(angle)])
        turn = np.asarray(rng.uniform(-MOST_TURNED, MOST_TURNED))
        motion = RigidMotion(layout.position[group].mean(axis=0), shift, turn)
        position, yaw = layout.position.copy(), layout.yaw.copy()
        position[group], yaw[group] = motion.position(position[group]), motion.yaw(yaw[group])
        if (position[group] >= 0).all() and (position[group] <= scene.size).all():
            members[group] = True
            return layout.with_poses(position, yaw), members
    return layout, members


def _seen(
    noisy: Layout,
    scene: Scene,
    poses: int,
    rng: np.random.Generator,
    members: BoolArray | None = None,
) -> Seen:
    """Some snapshots of each layout that see two objects, of its members where there are any."""
    cameras = path_cameras(scene) if scene.camera_path is not None else _around(scene, rng)
    each_pose = noisy.with_poses(noisy.position[:, None], noisy.yaw[:, None])
    batch = observe_many(each_pose, cameras)
    layouts, number = len(noisy.yaw), len(cameras.yaw)
    assert batch.truth is not None
    exists = np.arange(batch.yaw.shape[1]) < batch.count[:, None]
    counts, of_layout = exists, np.repeat(np.arange(layouts), number)
    if members is not None:
        counts = exists & members[of_layout[:, None], np.where(exists, batch.truth, 0)]
    enough = counts.sum(axis=1) >= 2
    draw = np.where(enough, rng.random(len(batch)), np.inf).reshape(layouts, number)
    last = np.sort(draw, axis=1)[:, min(poses, number) - 1 :][:, :1]
    index = np.flatnonzero(np.isfinite(draw) & (draw <= last))
    return Seen(_some(batch, index), of_layout[index])


def _around(scene: Scene, rng: np.random.Generator) -> Camera:
    """Cameras around the game's table, as its visits draw them."""
    cameras = [random_camera(scene, scene.fov, rng) for _ in range(AROUND)]
    return Camera(
        np.stack([one.position for one in cameras]), np.stack([one.yaw for one in cameras]), scene.fov
    )


def _some(batch: SnapshotBatch, index: np.typing.NDArray[np.int64]) -> SnapshotBatch:
    """The snapshots at some indices."""
    camera = batch.camera
    height = None if camera.height is None else camera.height[index]
    assert batch.truth is not None
    return SnapshotBatch(
        replace(
            camera,
            position=camera.position[index],
            yaw=camera.yaw[index],
            height=height,
            pitch=camera.pitch[index],
        ),
        batch.count[index],
        batch.categories,
        batch.category[index],
        batch.position[index],
        batch.yaw[index],
        batch.size[index],
        batch.elevation[index],
        batch.truth[index],
    )
