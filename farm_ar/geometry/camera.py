"""What a camera sees: bearings, fields of view and the camera's own axes; one camera also for kernels.

Camera arrays have batch dimensions (...), points have one more, (..., N, 2) or (..., N, 3): every camera of a
batch meets its own N points and results are (..., N). One camera and N points is the case without batch
dimensions; one set of points for many cameras, and one camera for many sets of points, broadcast.
"""

from __future__ import annotations

from math import atan2, cos, pi, sin

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.geometry.angles import FULL_TURN, direction, heading, wrap, wrap_angle
from farm_ar.kernels import compiled
from farm_ar.structs import Struct


def bearing(camera_position: FloatArray, camera_yaw: float | FloatArray, points: FloatArray) -> FloatArray:
    """Angle from a camera's heading to each point, positive to the right.

    Args:
        camera_position: (..., 2) cameras, metres.
        camera_yaw: (...) headings, radians.
        points: (..., N, 2) points, metres. One exactly at the camera has no meaningful bearing.

    Returns:
        (..., N) bearings in [-pi, pi), radians.
    """
    return wrap(heading(_from_camera(camera_position, points)) - np.asarray(camera_yaw)[..., None])


def distance(camera_position: FloatArray, points: FloatArray) -> FloatArray:
    """Distance on the plane from a camera to each point.

    Args:
        camera_position: (..., 2) cameras, metres.
        points: (..., N, 2) points, metres.

    Returns:
        (..., N) distances, metres.
    """
    offset = _from_camera(camera_position, points)
    length: FloatArray = np.hypot(offset[..., 0], offset[..., 1])
    return length


def in_view(
    points: FloatArray,
    camera_position: FloatArray,
    camera_yaw: float | FloatArray,
    fov_left: float | FloatArray,
    fov_right: float | FloatArray,
    range_m: float | FloatArray,
) -> BoolArray:
    """Whether a camera sees each point: near enough, and between the two ends of its field of view.

    Both ends and the range are inclusive. A point exactly at the camera is in view. Either side may be more
    than half a turn, and a field of a full turn or more sees all round.

    Args:
        points: (..., N, 2) points, metres.
        camera_position: (..., 2) cameras, metres.
        camera_yaw: (...) headings, radians.
        fov_left: (...) how far the view reaches to the left of the heading, radians.
        fov_right: (...) how far it reaches to the right, radians.
        range_m: (...) how far it reaches, metres; may be infinite.

    Returns:
        (..., N) true where the point is in view.
    """
    left, right, reach = (np.asarray(value)[..., None] for value in (fov_left, fov_right, range_m))
    angle = bearing(camera_position, camera_yaw, points)
    away = distance(camera_position, points)
    ahead = (-left <= angle) & (angle <= right)
    beyond_half_a_turn = (angle + FULL_TURN <= right) | (-left <= angle - FULL_TURN)
    seen: BoolArray = (ahead | beyond_half_a_turn | (away == 0)) & (away <= reach)
    return seen


def camera_frame(
    points3: FloatArray, eye: FloatArray, yaw: float | FloatArray, pitch: float | FloatArray
) -> FloatArray:
    """Points in a camera's own axes: right, up, forward.

    Args:
        points3: (..., N, 3) points (x, y, z), metres.
        eye: (..., 3) cameras (x, y, z), metres.
        yaw: (...) headings, radians.
        pitch: (...) how far each camera looks *up*, radians; negative looks down.

    Returns:
        (..., N, 3) right, up and forward of the camera, metres.
    """
    offset = np.asarray(points3) - np.asarray(eye)[..., None, :]
    yaw, pitch = np.asarray(yaw)[..., None], np.asarray(pitch)[..., None]
    x, y, z = offset[..., 0], offset[..., 1], offset[..., 2]
    right = x * np.cos(yaw) - z * np.sin(yaw)
    level = x * np.sin(yaw) + z * np.cos(yaw)
    up = y * np.cos(pitch) - level * np.sin(pitch)
    forward = y * np.sin(pitch) + level * np.cos(pitch)
    return np.stack(np.broadcast_arrays(right, up, forward), axis=-1)


def in_vertical_view(
    points3: FloatArray,
    eye: FloatArray,
    yaw: float | FloatArray,
    pitch: float | FloatArray,
    fov_up: float | FloatArray,
    fov_down: float | FloatArray,
) -> BoolArray:
    """Whether each point is before a camera and between the upper and lower edges of its picture.

    The vertical angle is atan2(up, forward) in the camera's own axes, as for a camera with a flat picture.
    Both edges are inclusive. A point exactly at the eye is in view.

    Args:
        points3: (..., N, 3) points (x, y, z), metres.
        eye: (..., 3) cameras (x, y, z), metres.
        yaw: (...) headings, radians.
        pitch: (...) how far each camera looks up, radians.
        fov_up: (...) how far the view reaches above the camera's forward axis, radians.
        fov_down: (...) how far it reaches below, radians.

    Returns:
        (..., N) true where the point is in the vertical view.
    """
    local = camera_frame(points3, eye, yaw, pitch)
    up, forward = local[..., 1], local[..., 2]
    angle = np.arctan2(up, forward)
    upper, lower = np.asarray(fov_up)[..., None], np.asarray(fov_down)[..., None]
    at_eye = np.all(local == 0, axis=-1)
    seen: BoolArray = at_eye | ((forward > 0) & (-lower <= angle) & (angle <= upper))
    return seen


def points_in_picture(
    points3: FloatArray,
    eye: FloatArray,
    yaw: float | FloatArray,
    pitch: float | FloatArray,
    edges: tuple[float, float, float, float],
) -> BoolArray:
    """Whether each point is before a camera and between all four edges of its flat picture.

    Where a camera looks down, this differs from `in_view` and `in_vertical_view` together: bearings there are
    about the vertical axis, and here about the camera's own.

    Args:
        points3: (..., N, 3) points (x, y, z), metres.
        eye: (..., 3) cameras (x, y, z), metres.
        yaw: (...) headings, radians.
        pitch: (...) how far each camera looks up, radians.
        edges: angles from the line of sight to the left, right, upper and lower edge, radians below pi / 2.

    Returns:
        (..., N) true where the point is in the picture; edges are inclusive.
    """
    right, up, forward = np.moveaxis(camera_frame(points3, eye, yaw, pitch), -1, 0)
    left_edge, right_edge, upper, lower = edges
    across, upwards = np.arctan2(right, forward), np.arctan2(up, forward)
    seen: BoolArray = (forward > 0) & (-left_edge <= across) & (across <= right_edge)
    seen &= (-lower <= upwards) & (upwards <= upper)
    return seen


def view_polygon(
    camera_position: FloatArray,
    camera_yaw: float,
    fov_left: float,
    fov_right: float,
    range_m: float,
    arc_points: int = 32,
) -> FloatArray:
    """Outline of one camera's field of view, for drawing.

    Args:
        camera_position: (2,) camera, metres.
        camera_yaw: heading, radians.
        fov_left: how far the view reaches to the left of the heading, radians.
        fov_right: how far it reaches to the right, radians.
        range_m: how far it reaches, metres; finite.
        arc_points: how many points the arc is drawn with.

    Returns:
        (arc_points + 1, 2) the camera, then the arc from left to right, metres; for a view of a full turn
        or more only the circle, (arc_points, 2), without repeating its first point.
    """
    all_round = fov_left + fov_right >= FULL_TURN
    width = FULL_TURN if all_round else fov_left + fov_right
    bearings = np.linspace(-fov_left, width - fov_left, arc_points, endpoint=not all_round)
    arc = np.asarray(camera_position) + range_m * direction(camera_yaw + bearings)
    return arc if all_round else np.vstack([camera_position, arc])


def _from_camera(camera_position: FloatArray, points: FloatArray) -> FloatArray:
    """(..., N, 2) from each camera to its points."""
    offset: FloatArray = np.asarray(points) - np.asarray(camera_position)[..., None, :]
    return offset


class Eye(Struct):
    """One camera, for kernels."""

    x: float
    """Where it is, metres."""
    z: float
    yaw: float
    left: float
    """How far its view reaches to either side, radians, and how far, metres."""
    right: float
    range_m: float
    vertical: bool
    """Whether its view has an upper and a lower edge."""
    height: float
    pitch: float
    up: float
    down: float
    sine: float
    """Of its heading, and of the edges of its view."""
    cosine: float
    left_sine: float
    left_cosine: float
    right_sine: float
    right_cosine: float
    wedge: bool
    """Whether its view is less than half a turn, and straight lines cross it in one piece."""


@compiled
def bearing_to(eye: Eye, x: float, z: float) -> float:
    """`bearing` of one point (x, z), metres."""
    return wrap_angle(atan2(x - eye.x, z - eye.z) - eye.yaw)


@compiled
def sees(eye: Eye, x: float, y: float, z: float) -> bool:
    """Whether a camera sees a point (x, z), metres, y above the table: `in_view` and `in_vertical_view`."""
    dx, dz = x - eye.x, z - eye.z
    if dx * dx + dz * dz > eye.range_m * eye.range_m:
        return False
    if dx != 0 or dz != 0:
        angle = bearing_to(eye, x, z)
        ahead = -eye.left <= angle <= eye.right
        if not (ahead or angle + 2 * pi <= eye.right or -eye.left <= angle - 2 * pi):
            return False
    if eye.vertical:
        dy = y - eye.height
        level = dx * eye.sine + dz * eye.cosine
        up = dy * cos(eye.pitch) - level * sin(eye.pitch)
        forward = dy * sin(eye.pitch) + level * cos(eye.pitch)
        if forward <= 0:
            return bool(dx == 0 and dy == 0 and dz == 0)
        return bool(-eye.down <= atan2(up, forward) <= eye.up)
    return True
