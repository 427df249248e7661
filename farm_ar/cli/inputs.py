"""What the options name: scenes, snapshots and cameras, from files or built in."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from farm_ar.arrays import number_in
from farm_ar.errors import OptionError
from farm_ar.scenes import (
    BUILTIN,
    Camera,
    FieldOfView,
    Scene,
    Snapshot,
    builtin_scene,
    load_scene,
    load_scene_csv,
    load_snapshot,
    load_snapshot_csv,
)

ROOM, POSE, VIEW = "width,depth", "x,z,yaw_deg", "x,z,yaw_deg,fov_deg,range_m"
"""The forms of a room, of a camera where its field of view is known, and of a camera where it is not."""


def read_scene(name: str, room: str | None) -> Scene:
    """A scene by the name of its file, or by its own name if it is built in.

    Raises:
        OptionError: it is neither, or the room is missing where it is needed, or given where it is not.
        SceneError: the file cannot be used.
    """
    if Path(name).suffix.lower() in (".json", ".csv"):
        return read_scene_file(name, room)
    refuse([("--room", room)], "with a built-in scene")
    if name not in BUILTIN:
        raise OptionError("scene", f"must be a .json or .csv file or one of {', '.join(BUILTIN)}", name)
    return builtin_scene(name)


def read_scene_file(path: str, room: str | None) -> Scene:
    """A scene from its file, JSON or CSV.

    Raises:
        OptionError: it is neither, or the room is missing where it is needed, or given where it is not.
        SceneError: the file cannot be used.
    """
    if _is_csv("scene", path):
        return load_scene_csv(path, room_size(need("--room", room, f"with a scene in CSV, as {ROOM}")))
    refuse([("--room", room)], "with a scene in JSON, which has its own size_m")
    return load_scene(path)


def read_snapshot(path: Path, camera: str | None) -> Snapshot:
    """A snapshot from its file, JSON or CSV.

    Raises:
        OptionError: it is neither, or the camera is missing where it is needed, or given where it is not.
        SnapshotError: the file cannot be used.
    """
    if _is_csv("snapshot", path):
        view = camera_view(need("--camera", camera, f"with a snapshot in CSV, as {VIEW}"))
        return load_snapshot_csv(path, view)
    refuse([("--camera", camera)], "with a snapshot in JSON, which has its own camera")
    return load_snapshot(path)


def room_size(text: str) -> tuple[float, float]:
    """A room's width and depth, metres, from "width,depth".

    Raises:
        OptionError: it is not two positive numbers.
    """
    width, depth = numbers("--room", text, ROOM)
    if width <= 0 or depth <= 0:
        raise OptionError("--room", f"must be {ROOM}, positive numbers of metres", text)
    return width, depth


def camera_pose(text: str, fov: FieldOfView) -> Camera:
    """A camera from "x,z,yaw_deg" and what it sees.

    Raises:
        OptionError: it is not three numbers.
    """
    x, z, yaw_deg = numbers("--camera", text, POSE)
    return Camera(np.array([x, z]), np.deg2rad(yaw_deg), fov)


def camera_view(text: str) -> Camera:
    """A camera from "x,z,yaw_deg,fov_deg,range_m".

    Raises:
        OptionError: it is not five numbers, or one is out of its limits.
    """
    *pose, fov_deg, range_m = numbers("--camera", text, VIEW)
    if not 0 < fov_deg <= 360 or range_m <= 0:
        raise OptionError("--camera", f"must be {VIEW} with 0 < fov_deg <= 360 and range_m > 0", text)
    view = FieldOfView.symmetric(math.radians(fov_deg), range_m)
    return Camera(np.array(pose[:2]), np.deg2rad(pose[2]), view)


def numbers(option: str, text: str, form: str) -> list[float]:
    """As many finite numbers, between commas, as the form has names.

    Raises:
        OptionError: there are more or fewer, or one is not a finite number.
    """
    values = [value for part in text.split(",") if (value := number_in(part)) is not None]
    right = len(values) == len(form.split(",")) == text.count(",") + 1
    if not right or not all(math.isfinite(value) for value in values):
        raise OptionError(option, f"must be {form}, all of them numbers", text)
    return values


def refuse(options: Iterable[tuple[str, object]], reason: str) -> None:
    """Refuse options that were given though they do not apply.

    Args:
        options: the name and the value of each, None where it was not given.
        reason: when they do not apply, as in "with --json".

    Raises:
        OptionError: one was given.
    """
    for option, value in options:
        if value is not None:
            raise OptionError(option, f"must not be given {reason}", value)


def need(option: str, value: str | None, reason: str) -> str:
    """The value of an option that has to be given.

    Args:
        option: its name.
        value: its value, None where it was not given.
        reason: when it has to be given, and in which form.

    Raises:
        OptionError: it was not given.
    """
    if value is None:
        raise OptionError(option, f"must be given {reason}", None)
    return value


def _is_csv(field: str, path: str | Path) -> bool:
    suffix = Path(path).suffix.lower()
    if suffix not in (".json", ".csv"):
        raise OptionError(field, "must be a .json or .csv file", str(path))
    return suffix == ".csv"
