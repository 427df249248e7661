"""Objects that moved together, and frames that drifted: every method on the same snapshots."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.experiments.headroom import METHODS as EVERY_RULE
from farm_ar.experiments.headroom_report import PAPER_METHOD
from farm_ar.experiments.report import (
    OTHER,
    OURS,
    PAPER,
    TEXT_SIZE,
    Comparison,
    Report,
    new_figure,
    set_up_chart,
)
from farm_ar.experiments.setting import SCENES, Setting, named_scene, path_cameras, piece_rng
from farm_ar.game_logic.headset import random_camera
from farm_ar.reid import ReidFactory, as_reidentifier, load_reid
from farm_ar.reid.registration import RigidMotion
from farm_ar.scenes import Camera, Layout, LayoutNoise, Scene, SnapshotBatch, observe_many
from farm_ar.sweeps import Row

FARM = "farm"
"""The game's table: ten buildings that move and a shed that does not."""

POSES, QUICK_POSES = 10, 4
"""Snapshots of each layout, drawn from those along the path that see two objects or more."""

MEMBERS = (3, 6)
"""How many labels near one another move together, at least and at most."""

SHIFT, MOST_TURNED = (0.06, 0.2), float(np.deg2rad(45.0))
"""How far they move, as shares of the room's diagonal, and how far they turn."""

DRIFT_M, DRIFT_TURN = 0.1, float(np.deg2rad(5.0))
"""Farthest that a frame drifts."""

CALM, USUAL = (0.014, 15.0), (0.042, 30.0)
"""SDs of how each label moves on its own, by the room's diagonal and in degrees: .1, .3 m in one of 7 m."""

METHODS: dict[str, ReidFactory] = {name: make for name, make in EVERY_RULE.items() if name != "spatial"}


class Unit(NamedTuple):
    """One piece of the experiment: a scene and a pattern."""

    scene: str
    pattern: str


def calm(scene: Scene, layouts: int, poses: int, rng: np.random.Generator) -> SnapshotBatch:
    """Each label moves a little on its own, and nothing else happens."""
    return _seen(_noisy(scene, scene.layout, layouts, CALM, rng), scene, poses, rng)


def usual(scene: Scene, layouts: int, poses: int, rng: np.random.Generator) -> SnapshotBatch:
    """Each label moves on its own, and nothing else happens."""
    return _seen(_noisy(scene, scene.layout, layouts, USUAL, rng), scene, poses, rng)


def group_moved(scene: Scene, layouts: int, poses: int, rng: np.random.Generator) -> SnapshotBatch:
    """Labels near one another are pushed and turned together, in snapshots that see two of them or more."""
    moved = [_one_group_moved(scene, rng) for _ in range(layouts)]
    together = scene.layout.with_poses(
        np.stack([layout.position for layout, _ in moved]), np.stack([layout.yaw for layout, _ in moved])
    )
    noisy = _noisy(scene, together, layouts, CALM, rng)
    return _seen(noisy, scene, poses, rng, np.stack([members for _, members in moved]))


def frame_drifted(scene: Scene, layouts: int, poses: int, rng: np.random.Generator) -> SnapshotBatch:
    """The frame of camera and detections has drifted: turned about the camera, and shifted."""
    batch = _seen(_noisy(scene, scene.layout, layouts, CALM, rng), scene, poses, rng)
    return drifted(batch, batch.camera.position, rng)


def frame_turned(scene: Scene, layouts: int, poses: int, rng: np.random.Generator) -> SnapshotBatch:
    """The frame has drifted: turned about its origin, a corner of the room, and shifted."""
    batch = _seen(_noisy(scene, scene.layout, layouts, CALM, rng), scene, poses, rng)
    return drifted(batch, np.zeros((len(batch), 2)), rng)


PATTERNS: dict[str, Callable[[Scene, int, int, np.random.Generator], SnapshotBatch]] = {
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


def units() -> list[Unit]:
    """All pieces."""
    return [Unit(scene, pattern) for scene in (*SCENES, FARM) for pattern in PATTERNS]


def run_unit(
    unit: Unit,
    scene: Scene,
    layouts: int,
    poses: int,
    rng: np.random.Generator,
    methods: Mapping[str, ReidFactory] = METHODS,
) -> list[Row]:
    """A row for each method; all get the same snapshots."""
    batch = PATTERNS[unit.pattern](scene, layouts, poses, rng)
    assert batch.truth is not None
    exists = np.arange(batch.yaw.shape[1]) < batch.count[:, None]
    rows: list[Row] = []
    for name, make in methods.items():
        found = as_reidentifier(make(scene), scene).identify_many(batch)
        right = (found.label == batch.truth)[exists]
        confidence = found.confidence[exists]
        rows.append(
            {
                "scene": unit.scene,
                "pattern": unit.pattern,
                "rule": name,
                "accuracy": float(right.mean()) if len(right) else float("nan"),
                "calibration_error": calibration_error(confidence, right),
                "snapshots": len(batch),
                "detections": int(exists.sum()),
            }
        )
    return rows


def calibration_error(confidence: FloatArray, right: BoolArray, bins: int = 10) -> float:
    """Expected calibration error over bins of confidence; NaN without confidences."""
    if not len(confidence) or np.isnan(confidence).any():
        return float("nan")
    which = np.minimum((confidence * bins).astype(int), bins - 1)
    return float(np.abs(np.bincount(which, confidence - right)).sum() / len(right))


def relations(setting: Setting) -> Report:
    """Every method where objects moved together or the frame drifted, and where neither happened."""
    poses = QUICK_POSES if setting.quick else POSES
    places = {name: setting.scene_parameters(name) for name in SCENES} | {FARM: {"scene": FARM, "file": None}}
    parameters = [
        places[unit.scene]
        | {"pattern": unit.pattern, "layouts": setting.layouts, "poses": poses}
        | setting.own_reids
        for unit in units()
    ]
    outcomes = setting.sweep("relations", every_rule, parameters)
    rows = [row for outcome in outcomes for row in outcome.rows]
    return Report(
        "relations",
        f"Things that moved together, and frames that drifted: {setting.layouts} layouts",
        rows,
        [
            Comparison(
                f"accuracy, {pattern}",
                f"{_mean(rows, PAPER_METHOD, pattern):.3f}",
                f"{_mean(rows, 'relational', pattern):.3f}",
                f"likelihood: {_mean(rows, 'likelihood', pattern):.3f}",
            )
            for pattern in PATTERNS
        ],
        _figure(rows),
        note="Means over the six scenes and the farm, of snapshots that see two objects or more. In the "
        "column of the paper stands the paper's method, run here; ours is the relational method.",
        tables=_tables(rows),
    )


def every_rule(
    seed: int,
    scene: str,
    file: str | None,
    layouts: int,
    poses: int,
    pattern: str,
    own: Iterable[str] = (),
) -> list[Row]:
    """A unit of the sweep: a row for each method, the user's own included."""
    rng = piece_rng(seed, 12, [*SCENES, FARM].index(scene), list(PATTERNS).index(pattern))
    methods = METHODS | {name: load_reid(name) for name in own}
    return run_unit(Unit(scene, pattern), named_scene(scene, file), layouts, poses, rng, methods)


def _mean(rows: list[Row], method: str, pattern: str, scene: str | None = None) -> float:
    found = [
        float(row["accuracy"] or 0.0)
        for row in rows
        if row["rule"] == method and row["pattern"] == pattern and scene in (None, row["scene"])
    ]
    return float(np.mean(found))


def _tables(rows: list[Row]) -> str:
    scenes = list(dict.fromkeys(str(row["scene"]) for row in rows))
    methods = list(dict.fromkeys(str(row["rule"]) for row in rows))
    lines = [f"| pattern | method | {' | '.join(scenes)} | mean |", "|---" * (len(scenes) + 3) + "|"]
    for pattern in PATTERNS:
        for method in methods:
            values = [_mean(rows, method, pattern, scene) for scene in scenes] + [
                _mean(rows, method, pattern)
            ]
            lines.append(f"| {pattern} | {method} | {' | '.join(f'{value:.3f}' for value in values)} |")
    return "\n".join(lines) + "\n"


def _figure(rows: list[Row]) -> Figure:
    figure = new_figure(7.2, 3.2)
    axes = figure.subplots()
    set_up_chart(axes, "Accuracy, mean of the six scenes and the farm", "", "accuracy")
    place = np.arange(len(PATTERNS))
    for offset, method, colour in (
        (-0.27, PAPER_METHOD, PAPER),
        (0.0, "likelihood", OTHER),
        (0.27, "relational", OURS),
    ):
        axes.bar(place + offset, [_mean(rows, method, p) for p in PATTERNS], 0.25, color=colour, label=method)
    axes.set_xticks(place, list(PATTERNS))
    axes.grid(visible=False, axis="x")
    figure.legend(frameon=False, fontsize=TEXT_SIZE, ncols=3, loc="outside lower center")
    return figure


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
) -> SnapshotBatch:
    """Some snapshots of each layout that see two objects, of its members where there are any."""
    cameras = path_cameras(scene) if scene.camera_path is not None else _around(scene, rng)
    each_pose = noisy.with_poses(noisy.position[:, None], noisy.yaw[:, None])
    batch = observe_many(each_pose, cameras)
    layouts, number = len(noisy.yaw), len(cameras.yaw)
    assert batch.truth is not None
    exists = np.arange(batch.yaw.shape[1]) < batch.count[:, None]
    counts = exists
    if members is not None:
        of_layout = np.repeat(np.arange(layouts), number)
        counts = exists & members[of_layout[:, None], np.where(exists, batch.truth, 0)]
    enough = counts.sum(axis=1) >= 2
    draw = np.where(enough, rng.random(len(batch)), np.inf).reshape(layouts, number)
    last = np.sort(draw, axis=1)[:, min(poses, number) - 1 :][:, :1]
    index = np.flatnonzero(np.isfinite(draw) & (draw <= last))
    return _some(batch, index)


def _around(scene: Scene, rng: np.random.Generator) -> Camera:
    """Cameras around the game's table, as its visits draw them."""
    cameras = [random_camera(scene, scene.fov, rng) for _ in range(4 * POSES)]
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
