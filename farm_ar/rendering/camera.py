"""The camera of a picture: intrinsics in pixels, and where it stands and looks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from farm_ar.arrays import ANGLE, POSITION, FloatArray, Record, read_only
from farm_ar.errors import SnapshotError
from farm_ar.geometry import camera_frame
from farm_ar.scenes import Camera

MOST_PIXELS = 4096 * 4096
"""In one picture."""

NEAR_M = 0.01
"""What is nearer to the eye than this is not drawn, metres: nothing is in focus there."""

_LEAST_FOCAL, _MOST_FOCAL = 1.0, 1e6


@dataclass(frozen=True)
class Intrinsics:
    """A camera without distortion, as OpenCV writes it: the first pixel's middle is (0, 0).

    Args:
        fx: focal length along rows, pixels.
        fy: along columns, pixels.
        cx: column that the line of sight meets, pixels.
        cy: row that it meets.
        width: of the picture, pixels.
        height: of the picture.

    Raises:
        SnapshotError: a focal length is not from 1 to 1e6 pixels, the middle is not finite, or the picture
            has no pixels or more than `MOST_PIXELS`.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        for name in ("fx", "fy"):
            value = getattr(self, name)
            if not _LEAST_FOCAL <= value <= _MOST_FOCAL:
                raise SnapshotError(f"intrinsics.{name}", "must be from 1 to 1e6 pixels", value)
        for name in ("cx", "cy"):
            value = getattr(self, name)
            if not POSITION.allow(value):
                raise SnapshotError(f"intrinsics.{name}", "must be pixels, from -1e6 to 1e6", value)
        size = (self.width, self.height)
        if not (min(size) >= 1 and self.width * self.height <= MOST_PIXELS):
            expected = f"must be at least 1 pixel each, and {MOST_PIXELS} in all at most"
            raise SnapshotError("intrinsics.width, intrinsics.height", expected, size)

    @classmethod
    def of_view(cls, width: int, height: int, angle: float) -> Intrinsics:
        """Square pixels, the line of sight in the middle.

        Args:
            width: of the picture, pixels.
            height: of the picture.
            angle: seen from its left edge to its right, radians.
        """
        focal = width / 2 / np.tan(angle / 2)
        return cls(float(focal), float(focal), (width - 1) / 2, (height - 1) / 2, width, height)

    def resized(self, width: int, height: int) -> Intrinsics:
        """The same camera with more or fewer pixels."""
        across, down = width / self.width, height / self.height
        cx, cy = (self.cx + 0.5) * across - 0.5, (self.cy + 0.5) * down - 0.5
        return Intrinsics(self.fx * across, self.fy * down, cx, cy, width, height)

    @property
    def matrix(self) -> FloatArray:
        """(3, 3) from the camera's axes (right, down, forward) to pixels, homogeneous."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


HOLOLENS_2 = Intrinsics.of_view(640, 360, np.deg2rad(64.69))
"""The HoloLens 2's photo and video camera: 64.69 degrees across, at a third of its 1920 x 1080 pixels."""


@dataclass(frozen=True, eq=False)
class View(Record):
    """A camera in its place.

    Args:
        intrinsics: of the camera.
        eye: (3,) where it is (x, y, z), metres; y is its height.
        yaw: heading, radians.
        pitch: of the line of sight, radians, positive upwards.
        roll: about the line of sight, radians, positive where the picture's content turns anticlockwise.

    Raises:
        SnapshotError: a value is out of its limits.
    """

    intrinsics: Intrinsics
    eye: FloatArray
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "eye", read_only(self.eye, np.float64))
        if self.eye.shape != (3,) or not POSITION.allow(self.eye).all():
            raise SnapshotError("view.eye", "must be (x, y, z), each from -1e6 to 1e6 metres", self.eye)
        for name in ("yaw", "pitch", "roll"):
            if not ANGLE.allow(getattr(self, name)):
                raise SnapshotError(f"view.{name}", ANGLE.expected, getattr(self, name))

    @classmethod
    def of(cls, camera: Camera, intrinsics: Intrinsics, height: float | None = None) -> View:
        """What a scene's camera sees.

        Args:
            camera: a single one.
            intrinsics: of its picture.
            height: of the eye, metres, where the camera does not know its own.

        Raises:
            SnapshotError: neither knows the height.
        """
        level = height if camera.height is None else float(camera.height)
        if level is None:
            raise SnapshotError("camera.height", "must be known to draw what it sees", None)
        eye = np.array([camera.position[0], level, camera.position[1]])
        return cls(intrinsics, eye, float(camera.yaw), float(camera.pitch))

    @cached_property
    def rotation(self) -> FloatArray:
        """(3, 3) from the world's axes to the camera's own: right, down, forward in its rows."""
        right, up, forward = camera_frame(np.eye(3), np.zeros(3), self.yaw, self.pitch).T
        cosine, sine = np.cos(self.roll), np.sin(self.roll)
        return np.ascontiguousarray(
            [cosine * right + sine * up, sine * right - cosine * up, forward], dtype=np.float64
        )

    def axes(self, points: FloatArray) -> FloatArray:
        """Points (..., 3) of the world in the camera's axes: right, down, forward, metres."""
        local: FloatArray = (points - self.eye) @ self.rotation.T
        return local

    def pixels(self, points: FloatArray) -> FloatArray:
        """(..., 2) columns and rows of points (..., 3) of the world that are before the camera."""
        local = self.axes(points)
        lens = self.intrinsics
        away = np.maximum(local[..., 2:], 1e-9)
        place: FloatArray = local[..., :2] / away * [lens.fx, lens.fy] + [lens.cx, lens.cy]
        return place
