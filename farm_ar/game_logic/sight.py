"""What the headset's camera sees of single points and of the player's arm, compiled."""

from __future__ import annotations

from functools import lru_cache
from math import atan2, cos, pi, sin, sqrt, tan

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry.angles import wrap_angle
from farm_ar.kernels import compiled
from farm_ar.scenes import Camera, Layout

ARM_HEIGHT_M = 0.06
"""Height of hand and forearm above the table."""

ARM_HALF_WIDTH_M = 0.03

ELBOW_Z = -0.45
"""z where the forearm ends, metres."""

ARM_POINTS = 48
"""Points along each side of the forearm that are looked for where the view is no simple wedge."""

(
    EYE_X,
    EYE_Z,
    YAW,
    LEFT,
    RIGHT,
    RANGE,
    HEIGHT,
    PITCH,
    UP,
    DOWN,
    VERTICAL,
    SINE,
    COSINE,
    LEFT_SINE,
    LEFT_COSINE,
    RIGHT_SINE,
    RIGHT_COSINE,
    WEDGE,
    LOOKS,
) = range(19)
"""Places in an eye: the camera's position and heading; its field of view; whether that has vertical limits;
sine and cosine of its heading and of the two edges of its view; whether that is a wedge; how many places
there are."""


@lru_cache(maxsize=16)
def eye_of(camera: Camera) -> FloatArray:
    """(LOOKS,) a camera, for the kernels below; nobody may write to it."""
    fov, eye = camera.fov, np.zeros(LOOKS)
    eye[EYE_X], eye[EYE_Z] = camera.position
    yaw = float(camera.yaw)
    eye[YAW], eye[LEFT], eye[RIGHT], eye[RANGE] = yaw, fov.left, fov.right, fov.range_m
    eye[SINE], eye[COSINE] = sin(yaw), cos(yaw)
    eye[LEFT_SINE], eye[LEFT_COSINE] = sin(yaw - fov.left), cos(yaw - fov.left)
    eye[RIGHT_SINE], eye[RIGHT_COSINE] = sin(yaw + fov.right), cos(yaw + fov.right)
    # Half a turn or more is no wedge; straight up the tangent ends.
    eye[WEDGE] = fov.left + fov.right < pi and max(fov.up or 0.0, fov.down or 0.0) < 1.5
    if fov.up is not None and fov.down is not None and camera.height is not None:
        eye[VERTICAL], eye[UP], eye[DOWN] = 1.0, fov.up, fov.down
        eye[HEIGHT], eye[PITCH] = camera.height, camera.pitch
    return eye


def seen_by(camera: Camera, layout: Layout) -> tuple[BoolArray, IntArray]:
    """What `scenes.visible` says, of one camera and one arrangement, in less time.

    Returns:
        (N,) which objects are in view; and the numbers of these, from left to right.
    """
    seen, number = np.empty(len(layout), dtype=np.bool_), np.empty(len(layout), dtype=np.int64)
    count = look_over(eye_of(camera), layout.position, layout.elevation, seen, number)
    return seen, number[:count]


@compiled
def look_over(
    eye: FloatArray, place: FloatArray, height: FloatArray, seen: BoolArray, number: IntArray
) -> int:
    """Look for points, (N, 2) and (N,) metres: fill in which are seen, and their numbers from left to right.

    Returns:
        How many are seen.
    """
    count, angle = 0, np.empty(len(place))
    for i in range(len(place)):
        seen[i] = in_sight(eye, place[i, 0], height[i], place[i, 1])
        if seen[i]:
            angle[i] = turned_to(eye, place[i, 0] - eye[EYE_X], place[i, 1] - eye[EYE_Z])
            k = count
            while k > 0 and angle[number[k - 1]] > angle[i]:
                number[k] = number[k - 1]
                k -= 1
            number[k] = i
            count += 1
    return count


@compiled
def turned_to(eye: FloatArray, dx: float, dz: float) -> float:
    """Angle in [-pi, pi) from a camera's heading to a point so far from it, positive to the right."""
    return wrap_angle(atan2(dx, dz) - eye[YAW])


@compiled
def in_sight(eye: FloatArray, x: float, y: float, z: float) -> bool:
    """Whether a camera sees a point (x, z), metres, y above the table, as `geometry.in_view` says."""
    dx, dz = x - eye[EYE_X], z - eye[EYE_Z]
    if dx * dx + dz * dz > eye[RANGE] * eye[RANGE]:
        return False
    if dx != 0 or dz != 0:
        angle = turned_to(eye, dx, dz)
        ahead = -eye[LEFT] <= angle <= eye[RIGHT]
        if not (ahead or angle + 2 * pi <= eye[RIGHT] or -eye[LEFT] <= angle - 2 * pi):
            return False
    if eye[VERTICAL] != 0:
        dy = y - eye[HEIGHT]
        level = dx * eye[SINE] + dz * eye[COSINE]
        up = dy * cos(eye[PITCH]) - level * sin(eye[PITCH])
        forward = dy * sin(eye[PITCH]) + level * cos(eye[PITCH])
        if forward <= 0:
            return bool(dx == 0 and dy == 0 and dz == 0)
        return bool(-eye[DOWN] <= atan2(up, forward) <= eye[UP])
    return True


@compiled
def cut_off(at_zero: float, slope: float, low: float, high: float) -> tuple[float, float]:
    """The part of [low, high] where at_zero + slope t is not negative; from 1 to 0 where it nowhere is."""
    if slope == 0:
        return (low, high) if at_zero >= 0 else (1.0, 0.0)
    root = -at_zero / slope
    return (max(low, root), high) if slope > 0 else (low, min(high, root))


@compiled
def side_in_sight(eye: FloatArray, x: float, near: float, far: float) -> bool:
    """Whether a camera with a wedge of a view sees any of a side of the arm, at x, z from near to far."""
    dx, dy = x - eye[EYE_X], ARM_HEIGHT_M - eye[HEIGHT]
    low, high = near - eye[EYE_Z], far - eye[EYE_Z]
    if eye[RANGE] < abs(dx):
        return False
    reach = sqrt(eye[RANGE] * eye[RANGE] - dx * dx)
    low, high = max(low, -reach), min(high, reach)
    # To the right of the left edge, and to the left of the right one.
    low, high = cut_off(dx * eye[LEFT_COSINE], -eye[LEFT_SINE], low, high)
    low, high = cut_off(-dx * eye[RIGHT_COSINE], eye[RIGHT_SINE], low, high)
    if eye[VERTICAL] != 0:
        sine, cosine = sin(eye[PITCH]), cos(eye[PITCH])
        up, up_slope = dy * cosine - dx * eye[SINE] * sine, -eye[COSINE] * sine
        ahead, ahead_slope = dy * sine + dx * eye[SINE] * cosine, eye[COSINE] * cosine
        most, least = tan(eye[UP]), tan(eye[DOWN])
        low, high = cut_off(ahead, ahead_slope, low, high)
        low, high = cut_off(most * ahead - up, most * ahead_slope - up_slope, low, high)
        low, high = cut_off(least * ahead + up, least * ahead_slope + up_slope, low, high)
    return low <= high


@compiled
def arm_in_sight(eye: FloatArray, x: float, z: float) -> bool:
    """Whether a camera sees any of a hand at (x, z), metres, or of its forearm."""
    far, near = z + ARM_HALF_WIDTH_M, min(ELBOW_Z, z)
    for side in (x - ARM_HALF_WIDTH_M, x + ARM_HALF_WIDTH_M):
        if eye[WEDGE] != 0:
            if side_in_sight(eye, side, near, far):
                return True
        else:
            for k in range(ARM_POINTS):
                if in_sight(eye, side, ARM_HEIGHT_M, far + k / (ARM_POINTS - 1) * (near - far)):
                    return True
    return False
