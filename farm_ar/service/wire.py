"""Bodies of requests: files' own fields, in a frame that has to be said, with what a session needs beside."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from farm_ar.arrays import SHARE, FloatArray
from farm_ar.errors import OptionError, SceneError, SnapshotError
from farm_ar.scenes import WORLD_FRAMES, Scene, Snapshot, scene_from_dict, snapshot_from_dict
from farm_ar.scenes.documents import Document, Named, Object
from farm_ar.scenes.files import json_in
from farm_ar.scenes.kinds import NEEDED, Flag, Kind, MismatchError, Number, OrNull, Text, Whole
from farm_ar.scenes.streams import tolerant_snapshot
from farm_ar.scenes.worlds import rigid, rotation_of
from farm_ar.service.limits import ServiceLimits, check_texts
from farm_ar.service.methods import DEFAULT, method_of
from farm_ar.service.refusals import NO_JSON, TOO_LARGE, WRONG, RefusedError

SESSION_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
"""What a session may be called."""

MOST_TILT_DEG = 5.0
"""Tilt of a detection beyond which it is said that only headings count."""

REVISION = Whole(0, 10**12, about="The session's revision that this is decided on; another is answered 409.")
"""In a body that decides something."""

_OF_SESSION = ("method", "options", "switch_rate", "checks", "revision")

BESIDE: dict[str, Kind] = {
    "switch_rate": Number(
        SHARE, default=0.02, about="How often a track is on another thing at the next snapshot."
    ),
    "checks": Flag(default=True, about="Whether layout and snapshots are checked, for warnings."),
}
"""Fields of a layout's body beside those of a scene file, the method, its options, and the revision."""

_TURN = re.compile(r"detections\[\d+\]\.(quaternion|matrix)")
_UNREADABLE = ("must be 4 numbers [x, y, z, w]", "must be 4 rows of 4 numbers", "must be finite")
"""What is said of a rotation that is no rotation at all, and not one in another convention."""

CONFIRM = Document(
    "confirmation",
    Object(
        {
            "revision": REVISION,
            "snapshot": Text(about="Whose labels are confirmed; one that is not the last is answered 409."),
            "labels": Named(
                OrNull(Text(), "a label"),
                default={},
                about="Labels that were wrong, by detection; null for none; a new label enrols an object.",
            ),
            "force": Flag(default=False, about="Whether a label may go to a detection of another category."),
            "commit": Flag(default=True, about="Whether this is the layout from here on."),
        }
    ),
    OptionError,
)
UNDO = Document("undoing", Object({"revision": REVISION}), OptionError)


class LayoutBody(NamedTuple):
    """What a session begins with; the revision of the one that it replaces, or None."""

    scene: Scene
    method: str
    options: Mapping[str, Any]
    switch_rate: float
    checks: bool
    revision: int | None


class SnapshotBody(NamedTuple):
    """Snapshots to be identified together, mostly one; their frame, and what to say of tilted things."""

    snapshots: tuple[Snapshot, ...]
    frame: str
    tilts: tuple[str, ...]


class AlignBody(NamedTuple):
    """A snapshot whose frame is to be found, and a pose that is known there and in the map, if any."""

    snapshot: Snapshot
    anchor: tuple[tuple[float, float, float], tuple[float, float, float]] | None
    frame: str
    revision: int


def parsed(body: bytes, most_text: int) -> dict[str, Any]:
    """The JSON object in a body.

    Args:
        body: of a request.
        most_text: characters of a string in it.

    Raises:
        RefusedError: there is none, or a string in it is too long.
    """
    try:
        data = json_in(body.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise RefusedError(NO_JSON, "body", "must be JSON in UTF-8", "another encoding") from None
    except (ValueError, RecursionError) as problem:
        raise RefusedError(NO_JSON, "body", "must be JSON", str(problem)) from None
    if not isinstance(data, dict):
        raise RefusedError(WRONG, "body", "must be a JSON object", data)
    check_texts(body, data, most_text)
    return data


def read_layout(data: dict[str, Any], limits: ServiceLimits) -> LayoutBody:
    """The layout of a session: the fields of a scene file, with method, options, switch_rate and revision.

    Raises:
        InputError: a value cannot be used.
    """
    frame_of(data)
    _check_count(data.get("objects"), limits.most_objects, "objects")
    method = data.get("method", DEFAULT)
    _, options = method_of(method, data.get("options", {}))
    given = dict[str, Any]()
    for name, kind in BESIDE.items():
        try:
            given[name] = kind.check(data.get(name, kind.default))
        except MismatchError as problem:
            raise OptionError(name, problem.expected, problem.got) from None
    revision = data.get("revision")
    if revision is not None:
        revision = _whole("revision", revision)
    scene = scene_from_dict({name: value for name, value in data.items() if name not in _OF_SESSION})
    return LayoutBody(scene, method, options, given["switch_rate"], given["checks"], revision)


def read_snapshots(data: dict[str, Any], limits: ServiceLimits) -> SnapshotBody:
    """One snapshot, with the fields of its file; or several under `snapshots`, to be fused.

    A detection whose pose is broken is kept, with NaN for its pose.

    Raises:
        InputError: a value cannot be used.
    """
    if "snapshots" not in data:
        frame = frame_of(data)
        _check_count(data.get("detections"), limits.most_detections, "detections")
        return SnapshotBody((_read_snapshot(data, ""),), frame, _tilts(data, ""))
    every = data["snapshots"]
    if not isinstance(every, list) or not every or len(data) > 1:
        raise SnapshotError("snapshots", "must be a list of at least one snapshot, and nothing else", every)
    _check_count(every, limits.most_fused, "snapshots")
    read, tilts, frames = list[Snapshot](), list[str](), set[str]()
    total = 0
    for k, one in enumerate(every):
        place = f"snapshots[{k}]"
        if not isinstance(one, dict):
            raise SnapshotError(place, "must be a JSON object", one)
        frames.add(frame_of(one, f"{place}."))
        total += len(one["detections"]) if isinstance(one.get("detections"), list) else 0
        if total > limits.most_detections:
            _check_count([0] * total, limits.most_detections, "snapshots, all detections")
        read.append(_read_snapshot(one, f"{place}."))
        tilts += _tilts(one, f"{place}.")
    if len(frames) > 1:
        raise SnapshotError("snapshots", "must all be in one frame", sorted(frames))
    return SnapshotBody(tuple(read), frames.pop(), tuple(tilts))


def read_align(data: dict[str, Any], limits: ServiceLimits) -> AlignBody:
    """A snapshot with the fields of its file, an anchor, and the revision.

    With an anchor the snapshot may be left out.

    Raises:
        InputError: a value cannot be used.
    """
    frame = frame_of(data)
    data = dict(data)
    given, revision = data.pop("anchor", None), _whole("revision", data.pop("revision", NEEDED))
    anchor = None if given is None else _anchor(given, data)
    if anchor is not None and "camera" not in data and "detections" not in data:
        x, z, yaw = anchor[0]
        camera = {"x": x, "z": z, "yaw_rad": yaw}
        return AlignBody(snapshot_from_dict({"camera": camera, "detections": []}), anchor, frame, revision)
    _check_count(data.get("detections"), limits.most_detections, "detections")
    return AlignBody(_read_snapshot(data, ""), anchor, frame, revision)


def frame_of(data: Mapping[str, Any], place: str = "") -> str:
    """The frame that a body says it is in.

    Raises:
        SceneError: it says none, or one that is not known.
    """
    frame = data.get("frame", NEEDED)
    if not isinstance(frame, str) or frame not in WORLD_FRAMES:
        raise SceneError(f"{place}frame", f"must be one of {', '.join(WORLD_FRAMES)}", frame)
    return frame


def _check_count(items: object, most: int, field: str) -> None:
    if isinstance(items, list) and len(items) > most:
        raise RefusedError(TOO_LARGE, field, f"must be at most {most}", len(items))


def _whole(field: str, value: object) -> int:
    try:
        return REVISION.check(value)
    except MismatchError as problem:
        raise OptionError(field, problem.expected, problem.got) from None


def _read_snapshot(data: dict[str, Any], place: str) -> Snapshot:
    try:
        return snapshot_from_dict(data)
    except SnapshotError as problem:
        if _TURN.fullmatch(problem.field) and problem.expected not in _UNREADABLE:
            raise SnapshotError(f"{place}{problem.field}", problem.expected, problem.got) from None
    try:
        return tolerant_snapshot(data)
    except SnapshotError as problem:
        raise SnapshotError(f"{place}{problem.field}", problem.expected, problem.got) from None


def _tilts(data: Mapping[str, Any], place: str) -> tuple[str, ...]:
    """What is said of detections whose upward axes lean; the methods compare headings only."""
    found = list[str]()
    most, up = 0.0, 2 if data.get("frame") == "ros" else 1
    for i, one in enumerate(data["detections"]):
        try:
            if "quaternion" in one:
                turn = rotation_of(one["quaternion"])
            elif "matrix" in one:
                turn = rigid(one["matrix"])[1]
            else:
                continue
        except (ValueError, TypeError):  # a pose that is broken, and kept as such
            continue
        tilt = float(np.rad2deg(np.arccos(np.clip(turn[up, up], -1.0, 1.0))))
        if tilt > MOST_TILT_DEG:
            found.append(str(one.get("id", i)))
            most = max(most, tilt)
    if not found:
        return ()
    named = ", ".join(found[:5]) + (f" and {len(found) - 5} more" if len(found) > 5 else "")
    return (f"{place}detections {named}: tilted by up to {most:.0f}°, of which only the heading counts",)


def _anchor(
    given: object, data: Mapping[str, Any]
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """The two poses of an anchor, (x, z, yaw) in our frame."""
    if not isinstance(given, dict) or set(given) != {"here", "map"}:
        raise SnapshotError("anchor", "must be an object with here and map, a pose each", given)
    common = {name: data[name] for name in ("frame", "units") if name in data}
    poses = []
    for name in ("here", "map"):
        pose = given[name]
        if not isinstance(pose, dict):
            raise SnapshotError(f"anchor.{name}", "must be a pose", pose)
        try:
            eye = snapshot_from_dict({**common, "camera": pose, "detections": []}).camera
        except SnapshotError as problem:
            field = problem.field.replace("camera", f"anchor.{name}", 1)
            raise SnapshotError(field, problem.expected, problem.got) from None
        poses.append((float(eye.position[0]), float(eye.position[1]), float(eye.yaw)))
    return poses[0], poses[1]


def pose_in(frame: str, position: FloatArray, yaw: float, elevation: float) -> dict[str, Any]:
    """A pose of ours as a reply has it: in metres, with a quaternion, in one of the frames.

    Args:
        frame: one of `WORLD_FRAMES`.
        position: (2,) metres.
        yaw: radians; the orientation is null where it is NaN.
        elevation: metres.
    """
    x, z = position.tolist()
    y, half = float(elevation), float(yaw) / 2
    sine, cosine = float(np.sin(half)), float(np.cos(half))
    if frame == "ros":
        place, turn = (z, -x, y), (0.0, 0.0, -sine)
    elif frame == "openxr":
        place, turn = (x, y, -z), (0.0, -sine, 0.0)
    else:
        place, turn = (x, y, z), (0.0, sine, 0.0)
    orientation = None if np.isnan(yaw) else dict(zip("xyzw", (*turn, cosine), strict=True))
    return {"position": dict(zip("xyz", place, strict=True)), "orientation": orientation}
