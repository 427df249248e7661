"""Snapshot files: JSON in degrees and metres, read into a `Snapshot` and written back."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.errors import SnapshotError
from farm_ar.scenes.camera import Camera
from farm_ar.scenes.fields import Fields, degrees, read_json, write_text
from farm_ar.scenes.scene_files import fov_from_fields, fov_to_dict
from farm_ar.scenes.snapshot import Detections, Snapshot


def load_snapshot(path: str | os.PathLike[str]) -> Snapshot:
    """Read a snapshot file.

    Raises:
        SnapshotError: it cannot be read, or a value in it cannot be used; names the file and the field.
    """
    return snapshot_from_dict(read_json(path, SnapshotError), source=Path(path).name)


def save_snapshot(snapshot: Snapshot, path: str | os.PathLike[str]) -> None:
    """Write a snapshot file, whole or not at all."""
    write_text(path, json.dumps(snapshot_to_dict(snapshot), indent=1) + "\n")


def snapshot_from_dict(data: object, source: str | None = None) -> Snapshot:
    """A snapshot from the contents of a snapshot file.

    Raises:
        SnapshotError: a value cannot be used; names the field.
    """
    fields = Fields(data, SnapshotError, source)
    snapshot = Snapshot(_camera(fields.child("camera")), _detections(fields))
    fields.finish()
    return snapshot


def snapshot_to_dict(snapshot: Snapshot) -> dict[str, Any]:
    """The contents of a snapshot file that `snapshot_from_dict` reads back to the same snapshot."""
    camera, seen = snapshot.camera, snapshot.detections
    view = {
        "x": float(camera.position[0]),
        "z": float(camera.position[1]),
        "yaw_deg": degrees(camera.yaw),
        "pitch_deg": degrees(camera.pitch),
        **fov_to_dict(camera.fov),
    }
    if camera.height is not None:
        view["y"] = float(camera.height)
    detections = [
        {
            "id": seen.ids[i],
            "category": seen.category[i],
            "x": float(seen.position[i, 0]),
            "z": float(seen.position[i, 1]),
            "y": float(seen.elevation[i]),
            "yaw_deg": degrees(seen.yaw[i]),
            "size_whd": seen.size[i].tolist(),
            "confidence": float(seen.confidence[i]),
        }
        for i in range(len(seen))
    ]
    return {"camera": view, "detections": detections}


def _camera(fields: Fields) -> Camera:
    camera = Camera(
        position=np.array([fields.number("x"), fields.number("z")]),
        yaw=np.deg2rad(fields.number("yaw_deg")),
        fov=fov_from_fields(fields),
        height=np.array(fields.number("y")) if fields.has("y") else None,
        pitch=np.deg2rad(fields.number("pitch_deg", 0.0)),
    )
    fields.finish()
    return camera


def _detections(fields: Fields) -> Detections:
    ids: list[str] = []
    category: list[str | None] = []
    poses: list[tuple[float, float, float, float]] = []
    size: list[tuple[float, ...]] = []
    confidence: list[float] = []
    for i, item in enumerate(fields.children("detections")):
        name = item.text("id", str(i))
        if name in ids:
            raise item.fail("id", "must not repeat an earlier id", name)
        ids.append(name)
        category.append(_category(item))
        poses.append((item.number("x"), item.number("z"), item.number("yaw_deg"), item.number("y", 0.0)))
        size.append(item.sides("size_whd", 3))
        confidence.append(item.number("confidence", 1.0, limits=(0, 1)))
        item.finish()
    x, z, yaw_deg, elevation = np.reshape(poses, (-1, 4)).T
    return Detections(
        category=tuple(category),
        position=np.stack([x, z], axis=-1),
        yaw=np.deg2rad(yaw_deg),
        size=np.array(size),
        elevation=elevation,
        confidence=np.array(confidence),
        ids=tuple(ids),
    )


def _category(item: Fields) -> str | None:
    category: object = item.raw("category", None)
    if category is None or (isinstance(category, str) and category):
        return category
    raise item.fail("category", "must be a category or null", category)
