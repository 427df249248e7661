"""Visibility: what the headset's camera sees of objects and of the player's arm, compiled."""

from __future__ import annotations

from functools import lru_cache
from math import cos, pi, sin, sqrt, tan

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry.camera import Eye, bearing_to, sees
from farm_ar.kernels import compiled
from farm_ar.scenes import Camera, Layout
from farm_ar.structs import Structs, new_structs

ARM_HEIGHT_M = 0.06
"""Height of hand and forearm above the table."""

ARM_HALF_WIDTH_M = 0.03

ELBOW_Z = -0.45
"""z where the forearm ends, metres."""

ARM_POINTS = 48
"""Points along each side of the forearm that are looked for where the view is no simple wedge."""


@lru_cache(maxsize=16)
def eyes_of(camera: Camera) -> Structs[Eye]:
    """(1,) a camera for kernels; nobody may write to it."""
    eyes = new_structs(Eye, 1)
    fov, eye = camera.fov, eyes[0]
    eye.x, eye.z = camera.position
    yaw = float(camera.yaw)
    eye.yaw, eye.left, eye.right, eye.range_m = yaw, fov.left, fov.right, fov.range_m
    eye.sine, eye.cosine = sin(yaw), cos(yaw)
    eye.left_sine, eye.left_cosine = sin(yaw - fov.left), cos(yaw - fov.left)
    eye.right_sine, eye.right_cosine = sin(yaw + fov.right), cos(yaw + fov.right)
    # Half a turn or more is no wedge; straight up the tangent ends.
    eye.wedge = fov.left + fov.right < pi and max(fov.up or 0.0, fov.down or 0.0) < 1.5
    if fov.up is not None and fov.down is not None and camera.height is not None:
        eye.vertical, eye.up, eye.down = True, fov.up, fov.down
        eye.height, eye.pitch = float(camera.height), float(camera.pitch)
    return eyes


def eye_of(camera: Camera) -> Eye:
    """The one of `eyes_of`."""
    return eyes_of(camera)[0]


def seen_by(camera: Camera, layout: Layout) -> tuple[BoolArray, IntArray]:
    """What `scenes.visible` says, of one camera and one arrangement, in less time.

    Returns:
        (N,) which objects are in view; and the numbers of these, from left to right.
    """
    seen, number = np.empty(len(layout), dtype=np.bool_), np.empty(len(layout), dtype=np.int64)
    count = look_over(eyes_of(camera), layout.position, layout.elevation, seen, number)
    return seen, number[:count]


@compiled
def look_over(
    eyes: Structs[Eye], place: FloatArray, height: FloatArray, seen: BoolArray, number: IntArray
) -> int:
    """Look for points, (N, 2) and (N,) metres: fill in which are seen, and their numbers from left to right.

    Returns:
        How many are seen.
    """
    eye, count, angle = eyes[0], 0, np.empty(len(place))
    for i in range(len(place)):
        seen[i] = sees(eye, place[i, 0], height[i], place[i, 1])
        if seen[i]:
            angle[i] = bearing_to(eye, place[i, 0], place[i, 1])
            k = count
            while k > 0 and angle[number[k - 1]] > angle[i]:
                number[k] = number[k - 1]
                k -= 1
            number[k] = i
            count += 1
    return count


@compiled
def cut_off(at_zero: float, slope: float, low: float, high: float) -> tuple[float, float]:
    """The part of [low, high] where at_zero + slope t is not negative; from 1 to 0 where it nowhere is."""
    if slope == 0:
        return (low, high) if at_zero >= 0 else (1.0, 0.0)
    root = -at_zero / slope
    return (max(low, root), high) if slope > 0 else (low, min(high, root))


@compiled
def sees_side(eye: Eye, x: float, near: float, far: float) -> bool:
    """Whether a camera with a wedge of a view sees any of a side of the arm, at x, z from near to far."""
    dx, dy = x - eye.x, ARM_HEIGHT_M - eye.height
    low, high = near - eye.z, far - eye.z
    if eye.range_m < abs(dx):
        return False
    reach = sqrt(eye.range_m * eye.range_m - dx * dx)
    low, high = max(low, -reach), min(high, reach)
    # To the right of the left edge, and to the left of the right one.
    low, high = cut_off(dx * eye.left_cosine, -eye.left_sine, low, high)
    low, high = cut_off(-dx * eye.right_cosine, eye.right_sine, low, high)
    if eye.vertical:
        sine, cosine = sin(eye.pitch), cos(eye.pitch)
        up, up_slope = dy * cosine - dx * eye.sine * sine, -eye.cosine * sine
        ahead, ahead_slope = dy * sine + dx * eye.sine * cosine, eye.cosine * cosine
        most, least = tan(eye.up), tan(eye.down)
        low, high = cut_off(ahead, ahead_slope, low, high)
        low, high = cut_off(most * ahead - up, most * ahead_slope - up_slope, low, high)
        low, high = cut_off(least * ahead + up, least * ahead_slope + up_slope, low, high)
    return low <= high


@compiled
def sees_arm(eye: Eye, x: float, z: float) -> bool:
    """Whether a camera sees any of a hand at (x, z), metres, or of its forearm."""
    far, near = z + ARM_HALF_WIDTH_M, min(ELBOW_Z, z)
    for side in (x - ARM_HALF_WIDTH_M, x + ARM_HALF_WIDTH_M):
        if eye.wedge:
            if sees_side(eye, side, near, far):
                return True
        else:
            for k in range(ARM_POINTS):
                if sees(eye, side, ARM_HEIGHT_M, far + k / (ARM_POINTS - 1) * (near - far)):
                    return True
    return False
