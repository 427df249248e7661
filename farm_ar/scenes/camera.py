"""The headset's camera: its field of view, its pose, and the path it wanders."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from farm_ar.arrays import ANGLE, POSITION, RANGE, FloatArray, Record, first_wrong, read_only
from farm_ar.errors import SceneError, SnapshotError
from farm_ar.geometry import equally_spaced, polyline_length, sample_chain


@dataclass(frozen=True)
class FieldOfView:
    """What a camera can see, relative to where it looks.

    Args:
        left: angle seen to the left of the heading, radians, 0 to pi.
        right: angle seen to the right of the heading, radians, 0 to pi.
        range_m: how far it sees on the plane, metres, 1e-6 to 1e9.
        up: angle seen above the line of sight, radians, 0 to pi / 2; None for no vertical limits.
        down: angle seen below the line of sight, radians, likewise; given with `up` or not at all.

    Raises:
        SnapshotError: an angle or the range is not a number in those limits, or only one of up and down
            is given.
    """

    left: float
    right: float
    range_m: float
    up: float | None = None
    down: float | None = None

    def __post_init__(self) -> None:
        if (self.up is None) != (self.down is None):
            raise SnapshotError("fov.up, fov.down", "must be given both or neither", (self.up, self.down))
        limits = {"left": 180, "right": 180, "up": 90, "down": 90}
        for name, limit in limits.items():
            if getattr(self, name) is not None:
                angle = float(getattr(self, name)) + 0.0  # of views that are equal all bits are: no -0
                if not 0 <= angle <= np.deg2rad(limit):
                    raise SnapshotError(f"fov.{name}", f"must be an angle from 0 to {limit} degrees", angle)
                object.__setattr__(self, name, angle)
        object.__setattr__(self, "range_m", float(self.range_m))
        if not RANGE.allow(self.range_m):
            raise SnapshotError("fov.range_m", RANGE.expected, self.range_m)

    @classmethod
    def symmetric(cls, angle: float, range_m: float, vertical: float | None = None) -> FieldOfView:
        """Field of view of `angle` radians across, half on either side; `vertical` likewise."""
        half = None if vertical is None else vertical / 2
        return cls(angle / 2, angle / 2, range_m, half, half)


PAPER_FIELD_OF_VIEW = FieldOfView(np.deg2rad(35.0), np.deg2rad(34.0), 3.0)
"""The field of view of the paper's synthetic experiments: 35 degrees left, 34 right, 3 m."""


@dataclass(frozen=True, eq=False)
class Camera(Record):
    """The headset's pose and field of view, or a batch of poses with one field of view.

    Args:
        position: (..., 2) as (x, z), metres, at most 1e6 either way. It may lie outside the room.
        yaw: (...) heading, radians, at most 1e6 turns either way.
        fov: what it sees.
        height: (...) of the eye above the floor, metres, or one for all; None where it is not known.
        pitch: (...) of the line of sight, radians, positive upwards, or one for all; 0 by default.

    Raises:
        SnapshotError: a value is out of its limits, or the shapes do not agree.
    """

    position: FloatArray
    yaw: FloatArray
    fov: FieldOfView = PAPER_FIELD_OF_VIEW
    height: FloatArray | None = None
    pitch: FloatArray = 0.0  # type: ignore[assignment]  # made an array below

    def __post_init__(self) -> None:
        yaw = read_only(self.yaw, np.float64)
        position = read_only(self.position, np.float64, empty=(0, 2))
        if position.shape != (*yaw.shape, 2):
            shapes = (position.shape, yaw.shape)
            raise SnapshotError("camera.position, camera.yaw", "must have shapes (..., 2) and (...)", shapes)
        values = {"position": position, "yaw": yaw, "pitch": _broadcast("pitch", self.pitch, yaw.shape)}
        if self.height is not None:
            values["height"] = _broadcast("height", self.height, yaw.shape)
        for name, value in values.items():
            limits = ANGLE if name in ("yaw", "pitch") else POSITION
            where = first_wrong(limits.allow(value))
            if where is not None:
                place = f"{list(where)}" if where else ""
                raise SnapshotError(f"camera.{name}{place}", limits.expected, float(value[where]))
            object.__setattr__(self, name, value)

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """Shape of the batch of poses; () for a single one."""
        return self.yaw.shape

    def at(self, index: int | tuple[int, ...]) -> Camera:
        """One camera of a batch, or the smaller batch at `index` along the first of several dimensions."""
        height = None if self.height is None else self.height[index]
        return replace(
            self, position=self.position[index], yaw=self.yaw[index], height=height, pitch=self.pitch[index]
        )


def _broadcast(name: str, value: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    try:
        return read_only(np.broadcast_to(array, shape), np.float64)
    except ValueError:
        raise SnapshotError(f"camera.{name}", f"must fit the yaw's shape {shape}", array.shape) from None


@dataclass(frozen=True, eq=False)
class CameraPath(Record):
    """The path that the camera wanders, looking where it goes.

    Args:
        points: (3 K + 1, 2) anchor, control, control, anchor, ... of K cubic Béziers, metres.
        closed: whether the end leads back to the start: in a straight line, where the two do not meet.

    Raises:
        SceneError: the number of points is not 3 K + 1, a point is out of its limits, or the path has no
            length.
    """

    points: FloatArray
    closed: bool = False

    def __post_init__(self) -> None:
        points = read_only(self.points, np.float64)
        if points.ndim != 2 or points.shape[1:] != (2,) or len(points) < 4 or len(points) % 3 != 1:
            expected = "must be 4, 7, 10, ... points (x, z), an array of shape (3 K + 1, 2)"
            raise SceneError("camera_path.bezier_points", expected, points.shape)
        where = first_wrong(POSITION.allow(points))
        if where is not None:
            field = f"camera_path.bezier_points[{where[0]}]"
            raise SceneError(field, POSITION.expected, points[where[0]].tolist())
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "closed", bool(self.closed))
        if self.length == 0:
            expected = "must not all be the same point"
            raise SceneError("camera_path.bezier_points", expected, points[0].tolist())

    @cached_property
    def polyline(self) -> FloatArray:
        """(P, 2) points close together along the path, from its first anchor to its last."""
        return read_only(sample_chain(self.points), np.float64)

    @cached_property
    def length(self) -> float:
        """Length, metres; of a closed path with the way back to its start."""
        return polyline_length(self.polyline, closed=self.closed)

    def cameras(self, count: int, fov: FieldOfView = PAPER_FIELD_OF_VIEW) -> Camera:
        """A batch of `count` cameras equally spaced along the path, each looking along it."""
        position, yaw = equally_spaced(self.polyline, count, closed=self.closed)
        return Camera(position, yaw, fov)
