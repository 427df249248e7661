"""Conversions between our frame and those of other software; nowhere else are axes renamed or mirrored.

| frame | x | y | z | handedness |
|---|---|---|---|---|
| `unity` (ours) | right | up | forward | left |
| `opencv` (camera) | right | down | forward | right |
| `ros` (body, REP 103) | forward | left | up | right |
| `openxr` | right | up | backward | right |

pymunk is a plane, not a space: its x is our x, its y is our z, and its angle turns the other way.
"""

from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray

# Each row is an axis of the frame, in our axes: frame = matrix @ ours.
FRAMES: dict[str, FloatArray] = {
    "unity": np.eye(3),
    "opencv": np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]),
    "ros": np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "openxr": np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]),
}

# A forward axis whose level part is shorter than this looks straight up or down.
_VERTICAL = 1e-9


class PlanarPose(NamedTuple):
    """Where something stands and looks, in our frame, without the roll about its forward axis.

    Attributes:
        position: (..., 2) place on the plane (x, z), metres.
        yaw: (...) heading, radians.
        height: (...) y, metres.
        pitch: (...) how far it looks up, radians.
    """

    position: FloatArray
    yaw: FloatArray
    height: FloatArray
    pitch: FloatArray


def convert_points(points: FloatArray, source: str, target: str) -> FloatArray:
    """The same points (or directions) in the axes of another frame with the same origin.

    Args:
        points: (..., 3) points in the source frame, metres.
        source: name of their frame, one of `FRAMES`.
        target: name of the frame wanted.

    Returns:
        (..., 3) points in the target frame, metres.

    Raises:
        ValueError: If a frame is not known.
    """
    return np.asarray(points) @ _basis_change(source, target).T


def convert_pose(pose: FloatArray, source: str, target: str) -> FloatArray:
    """The same rigid pose, from a body's own axes to the world's, with both in another frame's convention.

    Each rotation and translation is conjugated, so a rotation stays one also where the handedness changes.

    Args:
        pose: (..., 4, 4) homogeneous matrices in the source frame, metres.
        source: name of their frame, one of `FRAMES`.
        target: name of the frame wanted.

    Returns:
        (..., 4, 4) homogeneous matrices in the target frame, metres.

    Raises:
        ValueError: If a frame is not known.
    """
    change = np.eye(4)
    change[:3, :3] = _basis_change(source, target)
    return change @ np.asarray(pose) @ change.T


def pose_matrix(
    position: FloatArray,
    yaw: float | FloatArray,
    height: float | FloatArray = 0.0,
    pitch: float | FloatArray = 0.0,
) -> FloatArray:
    """Matrix that takes a body's own coordinates (right, up, forward) to the world's, both in our frame.

    Args:
        position: (..., 2) places on the plane (x, z), metres.
        yaw: (...) headings, radians.
        height: (...) y, metres.
        pitch: (...) how far each body looks up, radians.

    Returns:
        (..., 4, 4) homogeneous matrices, metres.
    """
    position = np.asarray(position)
    x, z, yaw, height, pitch = np.broadcast_arrays(position[..., 0], position[..., 1], yaw, height, pitch)
    sine, cosine = np.sin(yaw), np.cos(yaw)
    rise, level = np.sin(pitch), np.cos(pitch)
    pose = np.zeros((*x.shape, 4, 4))
    pose[..., 0, 0], pose[..., 2, 0] = cosine, -sine
    pose[..., 0, 1], pose[..., 1, 1], pose[..., 2, 1] = -rise * sine, level, -rise * cosine
    pose[..., 0, 2], pose[..., 1, 2], pose[..., 2, 2] = level * sine, rise, level * cosine
    pose[..., 0, 3], pose[..., 1, 3], pose[..., 2, 3] = x, height, z
    pose[..., 3, 3] = 1.0
    return pose


def planar_pose(pose: FloatArray) -> PlanarPose:
    """Place, heading, height and pitch of rigid poses; the reverse of `pose_matrix`. Roll is left out.

    Something that looks straight up or down has no heading of its own: its right-hand side gives it.

    Args:
        pose: (..., 4, 4) homogeneous matrices in our frame, metres.

    Returns:
        The pose on the plane, shapes as in `PlanarPose`.
    """
    pose = np.asarray(pose, dtype=np.float64)
    right, forward = pose[..., :3, 0], pose[..., :3, 2]
    level = np.hypot(forward[..., 0], forward[..., 2])
    by_forward = np.arctan2(forward[..., 0], forward[..., 2])
    by_right = np.arctan2(-right[..., 2], right[..., 0])
    return PlanarPose(
        position=pose[..., [0, 2], 3],
        yaw=np.where(level > _VERTICAL, by_forward, by_right),
        height=pose[..., 1, 3],
        pitch=np.arctan2(forward[..., 1], level),
    )


def rotation_matrix(yaw: FloatArray, tilt: FloatArray | None = None) -> FloatArray:
    """Rotations (..., 3, 3) from a body's axes (right, up, forward) to the world's, both in our frame.

    Args:
        yaw: (...) headings, radians.
        tilt: (..., 2) as (pitch, roll), radians: how far the body then looks up, and how far its right-hand
            side then rises about its forward axis. None for a body that stands upright.
    """
    if tilt is None:
        return pose_matrix(np.zeros((*np.shape(yaw), 2)), yaw)[..., :3, :3]
    base = pose_matrix(np.zeros((*np.shape(yaw), 2)), yaw, pitch=tilt[..., 0])[..., :3, :3]
    cosine, sine = np.cos(tilt[..., 1])[..., None], np.sin(tilt[..., 1])[..., None]
    right, up = base[..., 0], base[..., 1]
    return np.stack([cosine * right + sine * up, cosine * up - sine * right, base[..., 2]], axis=-1)


def tilt_of(rotation: FloatArray) -> FloatArray:
    """(..., 2) pitch and roll, radians, of rotations (..., 3, 3): what `planar_pose`'s heading leaves out."""
    pose = np.zeros((*rotation.shape[:-2], 4, 4))
    pose[..., :3, :3], pose[..., 3, 3] = rotation, 1.0
    flat = planar_pose(pose)
    base = rotation_matrix(flat.yaw, np.stack([flat.pitch, np.zeros_like(flat.pitch)], axis=-1))
    right = rotation[..., 0]
    roll = np.arctan2((right * base[..., 1]).sum(axis=-1), (right * base[..., 0]).sum(axis=-1))
    return np.stack([flat.pitch, roll], axis=-1)


def to_pymunk(position: FloatArray, yaw: float | FloatArray) -> tuple[FloatArray, FloatArray]:
    """Poses on the plane as pymunk has them: the same coordinates, the angle counter-clockwise.

    Args:
        position: (..., 2) places (x, z), metres.
        yaw: (...) headings, radians.

    Returns:
        (..., 2) positions (x, y), metres, and (...) angles, radians, not wrapped.
    """
    return np.asarray(position, dtype=np.float64), -np.asarray(yaw, dtype=np.float64)


def from_pymunk(position: FloatArray, angle: float | FloatArray) -> tuple[FloatArray, FloatArray]:
    """The reverse of `to_pymunk`.

    Args:
        position: (..., 2) positions (x, y) of bodies, metres.
        angle: (...) their angles, radians.

    Returns:
        (..., 2) places (x, z), metres, and (...) headings, radians, not wrapped.
    """
    return np.asarray(position, dtype=np.float64), -np.asarray(angle, dtype=np.float64)


def _basis_change(source: str, target: str) -> FloatArray:
    """(3, 3) matrix from the axes of one frame to those of another."""
    for name in (source, target):
        if name not in FRAMES:
            raise ValueError(f"unknown frame {name!r}, known are {', '.join(FRAMES)}")
    return FRAMES[target] @ FRAMES[source].T
