"""The headset's camera as a pinhole: from places in space to pixels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.game_logic.headset import EYE_HEIGHT_M
from farm_ar.geometry import camera_frame
from farm_ar.scenes import Camera

NEAR_M = 0.03
"""What is nearer to the eye is not drawn."""

_STEP = np.log(1.03)
"""Sizes of what stands upright are rounded to steps of 3%."""

_TOO_NEAR_M = 0.05
_LEAST_SCALE = 20.0
_FARTHEST_PX = 4000.0
_MARGIN_PX = 200.0

_WIDEST = np.deg2rad(75.0)
_DOWN = np.array([1.0, -1.0])


@dataclass(frozen=True, eq=False)
class Pinhole:
    """A camera with a flat picture, its pixels square.

    Args:
        eye: (3,) where it is (x, y, z), metres.
        yaw: heading, radians.
        pitch: of the line of sight, radians, positive upwards.
        focal: pixels for each unit of sideways over forwards.
        middle: (2,) the pixel that the line of sight meets.
    """

    eye: FloatArray
    yaw: float
    pitch: float
    focal: float
    middle: FloatArray

    @classmethod
    def of(cls, camera: Camera, width: int, height: int) -> Pinhole:
        """The camera's picture of that size: its left and right are those of the view, up and down follow.

        A camera that does not know its height is taken to be where a player's eyes are.
        """
        left, right = (np.tan(min(angle, _WIDEST)) for angle in (camera.fov.left, camera.fov.right))
        focal = width / max(left + right, 1e-3)
        level = EYE_HEIGHT_M if camera.height is None else float(camera.height)
        eye = np.array([camera.position[0], level, camera.position[1]])
        middle = np.array([focal * left, height / 2])
        return cls(eye, float(camera.yaw), float(camera.pitch), float(focal), middle)

    @cached_property
    def turn(self) -> FloatArray:
        """(3, 3) matrix from the world's axes to the camera's own: right, up, forward in its rows."""
        return camera_frame(np.eye(3), np.zeros(3), self.yaw, self.pitch).T

    def frame(self, points: FloatArray) -> FloatArray:
        """Points (..., 3) in the camera's own axes: right, up, forward, metres."""
        local: FloatArray = (points - self.eye) @ self.turn.T
        return local

    def pixels(self, frame: FloatArray) -> FloatArray:
        """(..., 2) columns and rows of points (..., 3) in the camera's own axes, before the camera."""
        across = frame[..., :2] / np.maximum(frame[..., 2:], 1e-9)
        place: FloatArray = self.middle + self.focal * across * _DOWN
        return place


def before_camera(frame: FloatArray) -> FloatArray:
    """(V, 3) the part of a polygon (U, 3), in the camera's own axes, that is before the camera."""
    depth = frame[:, 2] - NEAR_M
    if (depth >= 0).all():
        return frame
    kept = []
    for k in range(len(frame)):
        following = (k + 1) % len(frame)
        if depth[k] >= 0:
            kept.append(frame[k])
        if (depth[k] >= 0) != (depth[following] >= 0):
            part = depth[k] / (depth[k] - depth[following])
            kept.append(frame[k] + part * (frame[following] - frame[k]))
    return np.array(kept).reshape(-1, 3)


def upright_scale(size: int) -> float:
    """Pixels a metre of what stands upright in one of the sizes that `upright_places` gives."""
    return round(float(np.exp(_STEP * size)), 4)


def upright_places(
    view: Pinhole, feet: FloatArray, picture: tuple[int, int]
) -> tuple[FloatArray, IntArray, FloatArray, BoolArray]:
    """Where things are seen that stand upright and face the eye.

    Args:
        view: the camera.
        feet: (F, 3) where they stand, metres.
        picture: its width and height, pixels.

    Returns:
        (F, 2) columns and rows; (F,) sizes, whole numbers for `upright_scale`; (F,) how far away they are,
        metres; and (F,) whether they may be in the picture.
    """
    frame = view.frame(feet)
    distance = frame[:, 2]
    scale = view.focal / np.maximum(distance, _TOO_NEAR_M)
    pixels = view.pixels(frame)
    inside = (pixels > -_MARGIN_PX).all(axis=1) & (pixels < np.array(picture) + _MARGIN_PX).all(axis=1)
    seen = inside & (distance > _TOO_NEAR_M) & (scale > _LEAST_SCALE)
    size = np.rint(np.log(np.maximum(scale, 1.0)) / _STEP).astype(np.int64)
    return pixels, size, distance, seen
