"""The usual snapshot, read at once: what is written in another way is left to `wire.read_snapshots`.

Headsets send many of one form: a camera and detections by coordinates and yaw, all fields known and of the
right type. These are read to what `read_snapshots` gives, to the last bit; anything else is not read here, so
that there is one place that says what is wrong with it.
"""

from __future__ import annotations

from functools import lru_cache
from math import pi
from typing import Any

import numpy as np
import orjson

from farm_ar.arrays import POSITION, RANGE, SHARE, SIDE, TIME, FloatArray
from farm_ar.scenes import WORLD_FRAMES, Camera, Detections, FieldOfView, Snapshot
from farm_ar.scenes.camera import PAPER_FIELD_OF_VIEW
from farm_ar.scenes.files import degrees
from farm_ar.scenes.worlds import World
from farm_ar.service.limits import ServiceLimits
from farm_ar.service.wire import SnapshotBody

_NAN = float("nan")
_NUMBERS = (float, int)

_TOP = frozenset(("frame", "timestamp", "camera", "detections"))
_VIEW = {"fov_left_deg": 180.0, "fov_right_deg": 180.0, "fov_up_deg": 90.0, "fov_down_deg": 90.0}
_CAMERA = frozenset(("x", "y", "z", "yaw_deg", "pitch_deg", "range_m", *_VIEW))
_DETECTION = frozenset(("id", "track_id", "category", "x", "y", "z", "yaw_deg", "size_whd", "confidence"))
_ASSUMED = ("fov_left_deg", "fov_right_deg", "range_m")
_UNKNOWN_SIZE = (_NAN, _NAN, _NAN)

_TURNS = 1e6
"""Degrees up to which an angle is read here."""

_LOW: FloatArray = np.array([*3 * [POSITION.low], -_TURNS, *3 * [SIDE.low], SHARE.low])
_HIGH: FloatArray = np.array([*3 * [POSITION.high], _TURNS, *3 * [SIDE.high], SHARE.high])

_PAPER = tuple(degrees(angle) * (pi / 180) for angle in (PAPER_FIELD_OF_VIEW.left, PAPER_FIELD_OF_VIEW.right))

_WORLDS = {frame: World(frame) for frame in WORLD_FRAMES}

_fov = lru_cache(maxsize=256)(FieldOfView)


class _OtherwiseError(Exception):
    """It is written in another way, or wrong."""


def usual_snapshot(body: bytes, limits: ServiceLimits) -> SnapshotBody | None:
    """What `wire.read_snapshots` makes of a body of the usual form; None for any other.

    Args:
        body: of a request.
        limits: of detections and of strings.
    """
    if b"\\" in body:
        return None
    try:
        data = orjson.loads(body)
        return _read(data, body, limits)
    except (orjson.JSONDecodeError, _OtherwiseError, KeyError):
        return None


def _read(data: Any, body: bytes, limits: ServiceLimits) -> SnapshotBody:
    """The snapshot.

    Raises:
        _OtherwiseError: it has another form; a KeyError, too.
    """
    if type(data) is not dict or not _TOP.issuperset(data):
        raise _OtherwiseError
    view, seen, frame = data["camera"], data["detections"], data["frame"]
    right = type(view) is dict and type(seen) is list and len(seen) <= limits.most_detections
    if not right or type(frame) is not str or frame not in _WORLDS:
        raise _OtherwiseError
    fields = len(data) + len(view)
    ids, tracks, categories = list[str](), list[str | None](), list[str | None]()
    rows = list[tuple[float, ...]]()
    up = 2 if frame == "ros" else 1
    for i, one in enumerate(seen):
        if type(one) is not dict or not _DETECTION.issuperset(one):
            raise _OtherwiseError
        fields += len(one)
        get, size = one.get, one.get("size_whd", _UNKNOWN_SIZE)
        if (type(size) is not list and size is not _UNKNOWN_SIZE) or len(size) != 3:
            raise _OtherwiseError
        ids.append(one["id"] if "id" in one else str(i))
        tracks.append(get("track_id"))
        categories.append(get("category"))
        y, z = (get("y", 0.0), one["z"]) if up == 1 else (one["y"], get("z", 0.0))
        rows.append((one["x"], y, z, get("yaw_deg", _NAN), *size, get("confidence", 1.0)))
    # Each field has a colon of its own: so many, and no field is there twice, nor is a colon in a string.
    if body.count(b":") != fields:
        raise _OtherwiseError
    _check_texts(ids, tracks, categories, limits.most_text)
    eye = [view.get(name, 0.0) if k == up else view[name] for k, name in enumerate("xyz")]
    rows.append((*eye, view["yaw_deg"], *_UNKNOWN_SIZE, 1.0))
    values = _numbers(rows)
    world = _WORLDS[frame]
    poses = world.poses(values[:, :3], np.deg2rad(values[:, 3]))
    place, height = poses.position, poses.elevation
    camera, assumed = _camera(
        view, place[-1].copy(), poses.yaw[-1], height[-1] if "xyz"[up] in view else None
    )
    stamp: Any = data.get("timestamp")
    if "timestamp" in data and (type(stamp) not in _NUMBERS or not TIME.low <= stamp <= TIME.high):
        raise _OtherwiseError
    n = len(seen)
    detections = Detections.trusted(
        category=tuple(categories),
        position=np.ascontiguousarray(place[:-1]),
        yaw=np.ascontiguousarray(poses.yaw[:-1]),
        size=np.ascontiguousarray(values[:-1, 4:7]),
        elevation=np.ascontiguousarray(height[:-1]),
        confidence=np.ascontiguousarray(values[:-1, 7]),
        ids=tuple(ids),
        track_id=tuple(tracks),
        broken=(None,) * n,
        tilt=None,
        uncertainty=None,
    )
    snapshot = Snapshot.trusted(
        camera=camera,
        detections=detections,
        timestamp=None if stamp is None else float(stamp),
        world=world,
        assumed=assumed,
    )
    return SnapshotBody((snapshot,), frame, ())


def _check_texts(ids: list[str], tracks: list[str | None], categories: list[str | None], most: int) -> None:
    """See that names are strings, neither empty nor too long, and none is there twice."""
    named = [name for name in tracks if name is not None]
    for name in (*ids, *named, *[name for name in categories if name is not None]):
        if type(name) is not str or not 0 < len(name) <= most:
            raise _OtherwiseError
    if len(set(ids)) != len(ids) or len(set(named)) != len(named):
        raise _OtherwiseError


def _numbers(rows: list[tuple[float, ...]]) -> FloatArray:
    """(N, 8) the numbers of the detections and the camera, within their limits or not given."""
    for row in rows:
        for value in row:
            if type(value) not in _NUMBERS:
                raise _OtherwiseError
    values = np.array(rows, dtype=np.float64).reshape(-1, 8)
    if (values < _LOW).any() or (values > _HIGH).any():  # NaN is neither
        raise _OtherwiseError
    return values


def _camera(
    view: dict[str, Any], position: FloatArray, yaw: float, height: float | None
) -> tuple[Camera, tuple[str, ...]]:
    """The camera, and the fields of its view that are not given.

    Args:
        view: as it is written.
        position: (2,) metres, in our frame.
        yaw: radians, likewise.
        height: metres; None where it is not given.
    """
    if not _CAMERA.issuperset(view) or ("fov_up_deg" in view) != ("fov_down_deg" in view):
        raise _OtherwiseError
    for value in view.values():
        if type(value) not in _NUMBERS:
            raise _OtherwiseError
    angles = list[float | None]()
    for (name, most), usual in zip(_VIEW.items(), (*_PAPER, None, None), strict=True):
        angle = view.get(name)
        if angle is not None and not 0 <= angle <= most:
            raise _OtherwiseError
        angles.append(usual if angle is None else angle * (pi / 180))
    pitch, reach = float(view.get("pitch_deg", 0.0)), float(view.get("range_m", PAPER_FIELD_OF_VIEW.range_m))
    if not RANGE.low <= reach <= RANGE.high or not abs(pitch) <= _TURNS:
        raise _OtherwiseError
    camera = Camera.trusted(
        position=position,
        yaw=np.asarray(yaw),
        fov=_fov(*angles[:2], reach, *angles[2:]),
        height=None if height is None else np.asarray(height),
        pitch=np.asarray(np.deg2rad(pitch)),
    )
    return camera, tuple([name for name in _ASSUMED if name not in view])
