"""How others write a world down: its frame, its units, where its origin stands, and poses in any form.

All of it is read into ours: metres, x to the right, y up, z forward, yaw clockwise seen from above.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray
from farm_ar.errors import InputError, SceneError, known_name
from farm_ar.geometry import convert_points, convert_pose, planar_pose, tilt_of
from farm_ar.scenes.bounds import turned

WORLD_FRAMES = ("unity", "openxr", "ros")
"""Frames that a world may be written in; OpenXR's is that of WebXR, ARKit and ARCore, too."""

_OTHER_NAMES = {
    "unity": ("unity3d", "arfoundation", "mrtk", "babylonjs"),
    "openxr": ("webxr", "arkit", "arcore", "realitykit", "visionos", "threejs", "opengl", "openvr", "godot"),
    "ros": ("ros1", "ros2", "rep103", "rviz", "nav2", "gazebo", "enu"),
}
"""Names by which the same frames go elsewhere."""

_NOT_THE_SAME = {
    "opencv": "must be a world's frame (unity, openxr or ros): opencv is a camera's axes, with y down",
    "unreal": "must be one of unity, openxr, ros: as unity, give Unreal's Y, Z, X as x, y, z, and units cm",
}


def frame_hint(name: str) -> str | None:
    """What is said of a frame's name that is not one of `WORLD_FRAMES`; None for one never heard of."""
    plain = "".join(sign for sign in name.lower() if sign.isalnum())
    for frame, others in _OTHER_NAMES.items():
        if plain == frame:
            return f"must be {frame}, written like this"
        if plain in others:
            return f"must be {frame}, which is that frame's name here"
    return _NOT_THE_SAME.get("unreal" if plain.startswith(("unreal", "ue4", "ue5")) else plain)


UNITS: dict[str, tuple[float, float]] = {
    "m": (1.0, 1.0),
    "cm": (1.0, 100.0),
    "mm": (1.0, 1000.0),
    "km": (1000.0, 1.0),
    "in": (254.0, 10_000.0),
    "ft": (3048.0, 10_000.0),
    "yd": (9144.0, 10_000.0),
}
"""Metres in a unit, as a fraction, so that 35 cm is the same number as 0.35 m."""

DECIMALS = {"m": 2, "cm": 1, "mm": 0, "km": 5, "in": 2, "ft": 2, "yd": 2}
"""Decimals of lengths and places that are printed."""

_YAW = {
    "unity": "clockwise from above, 0 along +z",
    "openxr": "counter-clockwise from above, 0 along -z",
    "ros": "counter-clockwise from above, 0 along +x",
}

UPRIGHT = 1e-9
"""A body that is tilted less than this stands upright, radians."""

UNIT_LENGTH = 0.01
"""By how much the length of a quaternion, or a column of a matrix, may differ from 1."""


class Poses(NamedTuple):
    """Poses as our records have them: positions (..., 2), yaws, heights, pitches and rolls (...)."""

    position: FloatArray
    yaw: FloatArray
    elevation: FloatArray
    pitch: FloatArray
    roll: FloatArray

    @property
    def tilt(self) -> FloatArray | None:
        """(..., 2) pitch and roll; None where all stand upright."""
        tilt = np.stack([self.pitch, self.roll], axis=-1)
        return tilt if (np.abs(tilt) > UPRIGHT).any() else None


@dataclass(frozen=True)
class World:
    """The conventions of a world.

    Args:
        frame: one of `WORLD_FRAMES`.
        units: of lengths, a name in `UNITS`.
        origin: where its origin stands in the world that it is read into, (x, y, z) in its own axes and
            units.
        heading: its heading there, radians, in its own sense of turning.

    Raises:
        OptionError: a name is not known.
    """

    frame: str = "unity"
    units: str = "m"
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    heading: float = 0.0

    def __post_init__(self) -> None:
        if self.frame not in WORLD_FRAMES and (hint := frame_hint(str(self.frame))):
            raise SceneError("frame", hint, self.frame)
        known_name("frame", self.frame, WORLD_FRAMES)
        known_name("units", self.units, UNITS)

    @property
    def plane(self) -> tuple[int, int]:
        """Which two of x, y and z lie on the floor, in the order of points."""
        return (0, 1) if self.frame == "ros" else (0, 2)

    @property
    def up(self) -> int:
        """Which of x, y and z is the height."""
        return 2 if self.frame == "ros" else 1

    @property
    def floor_axes(self) -> tuple[str, str]:
        """The names of the axes along our x and z."""
        return ("y", "x") if self.frame == "ros" else ("x", "z")

    @property
    def yaw_words(self) -> str:
        """How a heading counts, in words."""
        return _YAW[self.frame]

    @property
    def plain(self) -> World:
        """The same axes and units, without an origin of its own."""
        return World(self.frame, self.units)

    def in_units(self, metres: npt.ArrayLike) -> FloatArray:
        """Lengths in its units, from metres."""
        times, over = UNITS[self.units]
        array = np.asarray(metres, dtype=np.float64)
        return array if times == over else array * over / times

    def length(self, metres: float) -> str:
        """A length in words, with its unit, to about a centimetre."""
        return f"{float(self.in_units(metres)):.{DECIMALS[self.units]}f} {self.units}"

    def floor_of(self, position: npt.ArrayLike) -> FloatArray:
        """(..., 2) points as its files give them, of our (x, z) in metres: the inverse of `floor`."""
        ours = np.asarray(position, dtype=np.float64)
        full = np.stack([ours[..., 0], np.zeros(ours.shape[:-1]), ours[..., 1]], axis=-1)
        if any(self.origin):
            full = full - self._axes(self.lengths(self.origin))
        if self.heading:
            level = turned(full[..., [0, 2]], -float(self._sense(np.asarray(self.heading))))
            full = np.stack([level[..., 0], full[..., 1], level[..., 1]], axis=-1)
        theirs = full if self.frame == "unity" else convert_points(full, "unity", self.frame)
        return self.in_units(theirs)[..., list(self.plane)]

    def yaws_of(self, yaw: npt.ArrayLike) -> FloatArray:
        """(...) headings as its files give them, radians: the inverse of `yaws`."""
        ours = np.asarray(yaw, dtype=np.float64)
        return self._sense(ours - self._sense(np.asarray(self.heading)) if self.heading else ours)

    def point(self, position: npt.ArrayLike) -> str:
        """A place (2,) of ours as its files give it, in words."""
        first, second = self.floor_of(position).tolist()
        return f"({first:z.4g}, {second:z.4g})"

    def lengths(self, values: npt.ArrayLike) -> FloatArray:
        """Lengths in metres."""
        times, over = UNITS[self.units]
        array = np.asarray(values, dtype=np.float64)
        return array if times == over else array * times / over

    def places(self, points: npt.ArrayLike) -> FloatArray:
        """(..., 3) points in our axes, metres."""
        ours = self._axes(self.lengths(points))
        if self.heading:
            level = turned(ours[..., [0, 2]], float(self._sense(np.asarray(self.heading))))
            ours = np.stack([level[..., 0], ours[..., 1], level[..., 1]], axis=-1)
        return ours + self._axes(self.lengths(self.origin)) if any(self.origin) else ours

    def floor(self, points: npt.ArrayLike) -> FloatArray:
        """(..., 2) points on the floor, given by their two coordinates there, as (x, z) in metres."""
        flat = np.asarray(points, dtype=np.float64)
        full = np.zeros((*flat.shape[:-1], 3))
        full[..., self.plane] = flat
        return self.places(full)[..., [0, 2]]

    def yaws(self, yaw: npt.ArrayLike) -> FloatArray:
        """(...) headings, radians: 0 is forward, positive the way the frame turns about its upward axis."""
        ours = self._sense(np.asarray(yaw, dtype=np.float64))
        return ours + self._sense(np.asarray(self.heading)) if self.heading else ours

    def covariances(self, covariance: npt.ArrayLike) -> FloatArray:
        """(..., 3, 3) of the errors of our x, z and yaw, from those of its two coordinates and heading."""
        axes = World(self.frame, self.units, heading=self.heading).floor(np.eye(2))
        to_ours = np.eye(3)
        to_ours[:2, :2], to_ours[2, 2] = axes.T, float(self._sense(np.asarray(1.0)))
        return to_ours @ np.asarray(covariance, dtype=np.float64) @ to_ours.T

    def poses(
        self, points: npt.ArrayLike, yaw: npt.ArrayLike, rotation: npt.ArrayLike | None = None
    ) -> Poses:
        """Poses of which some have a rotation in space.

        Args:
            points: (..., 3) places.
            yaw: (...) headings, radians; NaN where not known.
            rotation: (..., 3, 3) from a body's axes to the world's, which say the heading where they are not
                NaN; none by default.
        """
        place, ours = self.places(points), self.yaws(yaw)
        tilt = np.zeros((*ours.shape, 2))
        if rotation is not None:
            turns = np.asarray(rotation, dtype=np.float64)
            full = np.zeros((*turns.shape[:-2], 4, 4))
            full[..., :3, :3], full[..., 3, 3] = turns, 1.0
            converted = convert_pose(full, self.frame, "unity")
            seen = planar_pose(converted)
            given = np.asarray(~np.isnan(turns).any(axis=(-2, -1)))
            own = seen.yaw + self._sense(np.asarray(self.heading)) if self.heading else seen.yaw
            ours = np.where(given, own, ours)
            tilt = np.where(given[..., None], tilt_of(converted[..., :3, :3]), tilt)
        return Poses(place[..., [0, 2]], ours, place[..., 1], tilt[..., 0], tilt[..., 1])

    def read(
        self,
        position: npt.ArrayLike | None = None,
        yaw: npt.ArrayLike | None = None,
        quaternion: npt.ArrayLike | None = None,
        matrix: npt.ArrayLike | None = None,
    ) -> Poses:
        """Poses as arrays of one form, in our frame.

        Args:
            position: (..., 3) places in this world's axes and units, or (..., 2) on its floor; none with
                matrices.
            yaw: (...) headings, radians, NaN where not known; or
            quaternion: (..., 4) as (x, y, z, w), unit, from a body's axes to the world's; or
            matrix: (..., 4, 4) rigid, likewise. Headings are not known where none of them is given.

        Raises:
            SceneError: more than one of them is given, or a position with matrices or none without; a
                quaternion is not unit, a matrix not rigid.
        """
        turns = {"yaw": yaw, "quaternion": quaternion, "matrix": matrix}
        given = [name for name, value in turns.items() if value is not None]
        if len(given) > 1 or (position is None) != (matrix is not None):
            expected = "must be matrices, or a position with yaw, a quaternion or neither"
            raise SceneError("pose", expected, given + ["position"] * (position is not None))
        rotation = None
        try:
            if matrix is not None:
                position, rotation = rigid(matrix)
            elif quaternion is not None:
                rotation = rotation_of(quaternion)
        except InputError:
            raise
        except ValueError as problem:
            shape = np.asarray(turns[given[0]]).shape
            raise SceneError(given[0], str(problem), f"an array of shape {shape}") from None
        points = np.asarray(position, dtype=np.float64)
        if points.shape[-1:] == (2,):
            flat, points = points, np.zeros((*points.shape[:-1], 3))
            points[..., self.plane] = flat
        if points.shape[-1:] != (3,):
            raise SceneError("position", "must have shape (..., 3) or (..., 2)", points.shape)
        return self.poses(points, np.full(points.shape[:-1], np.nan) if yaw is None else yaw, rotation)

    def _axes(self, points: FloatArray) -> FloatArray:
        return points if self.frame == "unity" else convert_points(points, self.frame, "unity")

    def _sense(self, yaw: FloatArray) -> FloatArray:
        """Yaws by our sense of turning: left-handed frames turn as ours does."""
        return yaw if self.frame == "unity" else 0.0 - yaw


OURS = World()
"""Our own frame and metres."""


def rotation_of(quaternion: npt.ArrayLike) -> FloatArray:
    """(..., 3, 3) rotations of unit quaternions (..., 4) as (x, y, z, w); made exactly unit first.

    Raises:
        ValueError: one is not of length 1, within `UNIT_LENGTH`; the message says what is right.
    """
    given = np.asarray(quaternion, dtype=np.float64)
    length = np.linalg.norm(given, axis=-1)
    if not np.all(np.abs(length - 1) <= UNIT_LENGTH):
        raise ValueError("must be a unit quaternion [x, y, z, w], whose squares sum to 1")
    x, y, z, w = np.moveaxis(given / length[..., None], -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def rigid(matrix: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """The translations (..., 3) and the nearest rotations (..., 3, 3) of rigid poses (..., 4, 4).

    Raises:
        ValueError: one is not rigid, within `UNIT_LENGTH`; the message says what is right.
    """
    pose = np.asarray(matrix, dtype=np.float64)
    turn = pose[..., :3, :3]
    if not np.isfinite(pose).all():
        raise ValueError("must be finite")
    if np.any(pose[..., 3, :] != [0, 0, 0, 1]):
        columns = np.all(pose[..., :, 3] == [0, 0, 0, 1])
        hint = " (these are its columns)" if columns else ""
        raise ValueError(f"must be 4 rows, the last of them [0, 0, 0, 1]{hint}")
    gap = np.abs(np.swapaxes(turn, -1, -2) @ turn - np.eye(3))
    if not np.all(gap <= 2 * UNIT_LENGTH):
        raise ValueError("must be rigid: a rotation and a translation, without scale or shear")
    if not np.all(np.linalg.det(turn) > 0):
        raise ValueError("must be a rotation, which is right-handed: this one mirrors")
    left, _, right = np.linalg.svd(turn)
    return pose[..., :3, 3], left @ right
