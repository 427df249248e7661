"""What options name: scenes, snapshots, cameras and re-identifiers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import number_in
from farm_ar.errors import OptionError
from farm_ar.reid import (
    AdaptiveOptions,
    DistanceReid,
    Identification,
    LikelihoodOptions,
    LikelihoodReid,
    NearestReid,
    Reidentifier,
    SpatialOptions,
    SpatialReid,
    SquaredDistanceReid,
    explain,
    identify,
    load_reid,
)
from farm_ar.reid.checked import usable
from farm_ar.reid.partly_named import adaptive_for
from farm_ar.reid.plausibility import some
from farm_ar.reid.registry import MOST_PAIRS
from farm_ar.scenes import (
    BUILTIN,
    Camera,
    FieldOfView,
    Scene,
    Snapshot,
    Weights,
    World,
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
        OptionError: it is neither, or the room is given where it is not needed.
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
        OptionError: it is neither, or the room is given where it is not needed.
        SceneError: the file cannot be used.
    """
    if _is_csv("scene", path):
        return load_scene_csv(path, None if room is None else room_size(room))
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
        seen = load_snapshot_csv(path, view)  # in the table's frame and units
        place, yaw = seen.world.floor(view.position), seen.world.yaws(view.yaw)
        return replace(seen, camera=replace(view, position=place, yaw=yaw))
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


def pose_in(world: World, option: str, text: str) -> tuple[float, float, float]:
    """A pose (x, z, yaw) of ours, metres and radians, from "x,z,yaw_deg" of a world, or "x,y,yaw_deg" of ros.

    Raises:
        OptionError: it is not three numbers.
    """
    *place, yaw_deg = numbers(option, text, POSE)
    x, z = world.floor(place).tolist()
    return x, z, float(world.yaws(math.radians(yaw_deg)))


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


class Choices(NamedTuple):
    """What is chosen for a re-identifier on the command line; None leaves an option at its own default."""

    threshold: float | None = None
    weights: str | None = None
    gate: bool | None = None
    solver: str | None = None
    min_confidence: float | None = None
    confusion: float | None = None


def make_method(scene: Scene, name: str, choices: Choices) -> Reidentifier:
    """A re-identifier for a scene.

    Raises:
        OptionError: it is not known, or an option does not apply to it or has a wrong value.
        SceneError: the scene has no objects, or a weight is negative.
    """
    make, with_it = load_reid(name, "--reid"), f"with --reid {name}"
    threshold, weights, gate, solver, min_confidence, confusion = choices
    if name not in ("adaptive", "likelihood"):
        refuse([("--min-confidence", min_confidence), ("--confusion", confusion)], with_it)
    if name not in ("spatial", "spatial-ungated"):
        refuse({"--threshold": threshold, "--weights": weights, "--solver": solver}.items(), with_it)
    if name not in ("spatial", "distance", "squared-distance", "nearest"):
        refuse([("--gate", gate)], with_it)
    if name == "adaptive":
        return adaptive_for(scene)(
            scene, AdaptiveOptions(min_confidence=min_confidence or 0.0, confusion=confusion or 0.0)
        )
    if name == "likelihood":
        return LikelihoodReid(
            scene, LikelihoodOptions(min_confidence=min_confidence or 0.0, confusion=confusion or 0.0)
        )
    if name == "nearest" and gate is not None:
        return NearestReid(scene, gate)
    if name == "distance" and gate is not None:
        return DistanceReid(scene, gate_categories=gate)
    if name == "squared-distance" and gate is not None:
        return SquaredDistanceReid(scene, gate)
    made = make(scene)
    if name not in ("spatial", "spatial-ungated") or not isinstance(made, SpatialReid):
        return made
    default = made.options
    options = SpatialOptions(
        threshold=default.threshold if threshold is None else threshold,
        weights=default.weights if weights is None else Weights(*numbers("--weights", weights, "wt,wr")),
        gate_categories=default.gate_categories if gate is None else gate,
        solver=default.solver if solver is None else solver,
    )
    return SpatialReid(scene, options)


def check_size(name: str, labels: int, detections: int) -> None:
    """See that a re-identifier that looks at every motion of every pair is not asked about too many.

    Raises:
        OptionError: it would take gigabytes.
    """
    most = MOST_PAIRS.get(name, np.inf)
    if labels * detections > most:
        expected = f"must be spatial, distance or nearest where labels times detections are more than {most}"
        raise OptionError("--reid", expected, f"{name} ({labels} x {detections})")


def decided_by_category(reid: Reidentifier, snapshot: Snapshot, found: Identification) -> list[str]:
    """The ids of the detections that would have other labels if categories were not kept apart."""
    if isinstance(reid, NearestReid | SquaredDistanceReid) and reid.gate_categories:
        ungated: Reidentifier = type(reid)(reid.scene, gate_categories=False)
    elif isinstance(reid, SpatialReid) and reid.options.gate_categories:
        ungated = SpatialReid(reid.scene, replace(reid.options, gate_categories=False))
    else:
        return []
    others = identify(reid.scene, snapshot, ungated, checks=False).labels
    named = zip(snapshot.detections.ids, found.labels, others, strict=True)
    return [name for name, label, other in named if label != other]


def explanation(method: Reidentifier, snapshot: Snapshot, detection: str, answer: Identification) -> str:
    """Why a detection, by its id, gets the label that a method gives it, or none.

    Args:
        method: the method.
        snapshot: in the scene's frame.
        detection: its id.
        answer: what `identify` made of it, which may doubt what the method says.

    Raises:
        SnapshotError: there is no such detection.
    """
    kept, aside = usable(method.scene, snapshot)
    reasons = dict(zip(snapshot.detections.ids, aside, strict=True))
    if reasons.get(detection):
        return f"{detection} has no label: {reasons[detection]}"
    index = [i for i, reason in enumerate(aside) if reason is None]
    found = explain(method, some(kept, np.array(index, dtype=np.int64)), detection)
    sure = float(answer.confidence[snapshot.detections.ids.index(detection)])
    if abs(sure - found.confidence) < 0.005 or np.isnan(found.confidence):
        return found.words()
    return f"If the snapshot were right as it is, which the warnings doubt: {found.words()}"
