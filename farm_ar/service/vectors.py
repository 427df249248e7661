"""Vectors that a client's own method is held to: layouts, snapshots as apps write them, and answers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from farm_ar.arrays import FloatArray
from farm_ar.geometry import convert_pose, pose_matrix
from farm_ar.reid import SpatialReid
from farm_ar.reid.place import stacked
from farm_ar.reid.plausibility import some
from farm_ar.scenes import UNITS, WORLD_FRAMES, Scene, Snapshot
from farm_ar.scenes.json_files import scene_from_dict, snapshot_from_dict
from farm_ar.scenes.snapshot import Detections
from farm_ar.service.wire import pose_in

VERSION = 1
"""Of the form of the file."""

LEAST_MARGIN = 1e-6
"""How much dearer every other answer must be, so that no rounding decides."""

STRANGE = "unicorn"
"""A category that no layout has."""

Values = dict[str, Any]


class _Things(NamedTuple):
    """Things as they are in our frame: N places and headings, heights, sizes in metres, categories."""

    position: FloatArray
    yaw: FloatArray
    elevation: FloatArray
    size: FloatArray
    category: list[str | None]


def vectors(rng: np.random.Generator, number: int) -> Iterator[Values]:
    """Layouts and snapshots in every frame, unit and form of a pose, each with the paper's method's answer.

    Some have unknown headings, sizes and categories, more detections than labels, a category that the layout
    lacks. There is one answer only, by `LEAST_MARGIN`.

    Args:
        rng: of all that is drawn.
        number: of vectors.

    Yields:
        `layout` and `snapshot` as the service takes them, and `labels` and `costs` of the detections.
    """
    made = 0
    while made < number:
        layout, snapshot = _question(rng)
        scene, seen = scene_from_dict(layout), snapshot_from_dict(snapshot)
        if stacked(scene.layout):
            continue
        answer = _answer(scene, seen)
        if answer is not None:
            made += 1
            yield {"layout": layout, "snapshot": snapshot, **answer}


def _answer(scene: Scene, snapshot: Snapshot) -> Values | None:
    """The labels and costs; None where another answer is about as cheap."""
    seen, layout = snapshot.detections, scene.layout
    category: tuple[str | None, ...] = seen.category
    if not layout.names_categories:
        category = (None,) * len(seen)
    kept = [i for i, name in enumerate(category) if name is None or name in layout.categories]
    known = Detections.trusted(**vars(seen) | {"category": category})
    asked = some(Snapshot(snapshot.camera, known), np.array(kept, dtype=np.int64))
    found = SpatialReid(scene).identify(asked)
    margins = [float(margin) for margin, label in zip(found.margin, found.labels, strict=True) if label]
    if any(margin < LEAST_MARGIN for margin in margins):
        return None
    labels: list[str | None] = [None] * len(seen)
    costs: list[float | None] = [None] * len(seen)
    for i, label, cost in zip(kept, found.labels, found.cost.tolist(), strict=True):
        labels[i], costs[i] = label, None if label is None else cost
    return {"labels": labels, "costs": costs}


def _question(rng: np.random.Generator) -> tuple[Values, Values]:
    """A layout and a snapshot of it."""
    known = _things(rng)
    frames = rng.choice(WORLD_FRAMES, 2)
    units = rng.choice(list(UNITS), 2)
    layout: Values = {"frame": str(frames[0]), "units": str(units[0])}
    metres = [np.divide(*UNITS[unit]) for unit in units]
    objects = _written(rng, known, layout["frame"], metres[0])
    for j, one in enumerate(objects):
        one["label"] = f"thing {j}"
    layout["objects"] = objects
    layout |= _bounds(rng, known, layout["frame"], metres[0])
    if rng.random() < 0.2:
        layout["weights"] = {"translation": float(rng.uniform(0, 3)), "rotation": float(rng.uniform(0, 2))}
    seen = _disturbed(rng, known)
    snapshot: Values = {"frame": str(frames[1]), "units": str(units[1])}
    snapshot["camera"] = {**dict.fromkeys("xyz", 0.0), "yaw_deg": 0.0}
    snapshot["detections"] = _written(rng, seen, snapshot["frame"], metres[1])
    for i, one in enumerate(snapshot["detections"]):
        one["id"] = f"seen {i}"
    return layout, snapshot


def _things(rng: np.random.Generator) -> _Things:
    n = int(rng.choice([1, 3, 5, 8, 13, 21, 29]))
    length = float(10 ** rng.uniform(-1, 1.5))
    kinds = int(rng.integers(1, 4))
    code = rng.integers(0, kinds, n)
    sizes = length * rng.uniform(0.02, 0.2, (kinds, 3))
    named = rng.random() < 0.8
    place = rng.uniform(0, length, (n, 2)) + (rng.normal(0, 100, 2) if rng.random() < 0.5 else 0)
    yaw = rng.uniform(-np.pi, np.pi, n)
    yaw[rng.random(n) < 0.05] = np.nan
    size = sizes[code] * rng.lognormal(0, 0.02, (n, 3))
    size[rng.random(n) < 0.05] = np.nan
    names = ["chair", "stool", "lamp"]
    return _Things(
        place, yaw, rng.uniform(0, length / 10, n), size, [names[k] if named else None for k in code]
    )


def _disturbed(rng: np.random.Generator, known: _Things) -> _Things:
    """What is seen of things after they were moved."""
    n = len(known.yaw)
    spread = float(np.ptp(known.position)) or 1.0
    seen = rng.permutation(n)[: int(rng.integers((n + 1) // 2, n + 1))]
    if rng.random() < 0.1:
        seen = np.concatenate([seen, rng.integers(0, n, 3)])
    k = len(seen)
    position = known.position[seen] + rng.normal(0, spread * rng.choice([0.01, 0.1, 0.5]), (k, 2))
    yaw = known.yaw[seen] + rng.normal(0, rng.choice([0.05, 0.5, 2.0]), k)
    yaw[rng.random(k) < 0.05] = np.nan
    size = known.size[seen] * rng.lognormal(0, 0.05, (k, 3))
    size[rng.random(k) < 0.05] = np.nan
    size = np.where(rng.random((k, 1)) < 0.2, size[:, [2, 1, 0]], size)  # a detector that swaps its axes
    category = [known.category[i] for i in seen]
    if known.category[0] is not None:
        category = [None if rng.random() < 0.1 else name for name in category]
        category = [STRANGE if rng.random() < 0.03 else name for name in category]
    return _Things(position, yaw, known.elevation[seen], size, category)


def _written(rng: np.random.Generator, things: _Things, frame: str, metres: float) -> list[Values]:
    """Things as an app writes them: in a frame and a unit, each pose in some form."""
    rows = []
    for i, category in enumerate(things.category):
        yaw, lean = float(things.yaw[i]), rng.uniform(-0.3, 0.3, 2) * (rng.random() < 0.3)
        ours = pose_matrix(things.position[i], np.nan_to_num(yaw), things.elevation[i], lean[0])
        ours[:3, :3] = ours[:3, :3] @ Rotation.from_euler("z", lean[1]).as_matrix()
        full = convert_pose(ours, "unity", frame)
        full[:3, 3] /= metres
        one: Values = dict(zip("xyz", full[:3, 3].tolist(), strict=True))
        sense = 1.0 if frame == "unity" else -1.0
        form = "none" if np.isnan(yaw) else rng.choice(["deg", "rad", "quaternion", "matrix"])
        if form == "deg":
            one["yaw_deg"] = float(np.rad2deg(sense * yaw))
        elif form == "rad":
            one["yaw_rad"] = sense * yaw
        elif form == "quaternion":
            one["quaternion"] = Rotation.from_matrix(full[:3, :3]).as_quat().tolist()
        elif form == "matrix":
            one = {"matrix": full.tolist()}
        if category is not None:
            one["category"] = category
        if np.isfinite(things.size[i]).all():
            one["size_whd"] = (things.size[i] / metres).tolist()
        rows.append(one)
    return rows


def _bounds(rng: np.random.Generator, things: _Things, frame: str, metres: float) -> Values:
    """Bounds in one of the forms, or none."""
    low, high = things.position.min(axis=0) - 1, things.position.max(axis=0) + 1
    sides = (high - low) / metres
    kind = rng.choice(["none", "size", "rectangle", "polygon"])
    if kind == "size":
        return {"size": sides.tolist()}
    if kind == "rectangle":
        return {"bounds": {"size": sides.tolist(), "yaw_deg": float(rng.uniform(-180, 180))}}
    if kind == "none":
        return {}
    angle = (np.arange(5) + rng.uniform(0.1, 0.9, 5)) * 2 * np.pi / 5
    corners = (low + high) / 2 + (high - low) * rng.uniform(0.6, 1.2, (5, 1)) * np.stack(
        [np.sin(angle), np.cos(angle)], axis=1
    )
    plane = "xy" if frame == "ros" else "xz"
    placed = [pose_in(frame, corner, 0.0, 0.0)["position"] for corner in corners]
    return {"bounds": [[point[axis] / metres for axis in plane] for point in placed]}
