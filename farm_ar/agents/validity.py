"""What a perturbation has to keep to: inside the room, no object in another's footprint, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.geometry.rectangles import overlap_depth
from farm_ar.kernels import compiled


class Constraints(NamedTuple):
    """What perturbations of N objects have to keep to.

    Args:
        home: (N, 2) where the objects were, metres.
        home_yaw: (N,) their headings, radians.
        half: (N, 3) half of their sizes, metres.
        fixed: (N,) objects that must not move.
        keeps_clear: (N, N) pairs that must not stand in each other.
        stays_inside: (N,) objects of which no part may be outside the room; of the others the pivot.
        room: (2,) width and depth, metres.
    """

    home: FloatArray
    home_yaw: FloatArray
    half: FloatArray
    fixed: BoolArray
    keeps_clear: BoolArray
    stays_inside: BoolArray
    room: FloatArray


@compiled
def outside_by(
    x: float, z: float, yaw: float, half: FloatArray, width: float, depth: float, whole: bool
) -> float:
    """How far an object reaches beyond the room, metres; the whole footprint, or only its pivot."""
    reach_x, reach_z = 0.0, 0.0
    if whole:
        cosine, sine = abs(np.cos(yaw)), abs(np.sin(yaw))
        reach_x, reach_z = half[0] * cosine + half[2] * sine, half[0] * sine + half[2] * cosine
    beyond_x = max(reach_x - x, x + reach_x - width)
    beyond_z = max(reach_z - z, z + reach_z - depth)
    return max(beyond_x, beyond_z, 0.0)


@compiled
def settle(position: FloatArray, yaw: FloatArray, limits: Constraints) -> None:
    """Make B perturbations allowed, in place: an object whose new pose is taken or outside keeps its old one.

    Objects take their new poses in turn, the others standing where they were or already are. Fixed ones are
    taken to be left where they are.

    Args:
        position: (B, N, 2) metres; changed.
        yaw: (B, N) radians; changed.
        limits: what the perturbations have to keep to.
    """
    home, home_yaw, half = limits.home, limits.home_yaw, limits.half
    for b in range(len(yaw)):
        for i in range(len(home_yaw)):
            x, z, heading = position[b, i, 0], position[b, i, 1], yaw[b, i]
            room = limits.room
            taken = outside_by(x, z, heading, half[i], room[0], room[1], limits.stays_inside[i]) > 0
            for j in range(len(home_yaw)):
                if j != i and limits.keeps_clear[i, j] and not taken:
                    settled = j < i
                    dx = (position[b, j, 0] if settled else home[j, 0]) - x
                    dz = (position[b, j, 1] if settled else home[j, 1]) - z
                    other = yaw[b, j] if settled else home_yaw[j]
                    taken = overlap_depth(dx, dz, heading, other, half[i], half[j]) > 0
            if taken:
                position[b, i] = home[i]
                yaw[b, i] = home_yaw[i]


@compiled
def are_valid(position: FloatArray, yaw: FloatArray, limits: Constraints) -> BoolArray:
    """Which of B perturbations are allowed.

    Args:
        position: (B, N, 2) metres.
        yaw: (B, N) radians.
        limits: what they have to keep to.

    Returns:
        (B,) true where only movable objects have moved, within the room, and none into another.
    """
    tolerance = 1e-9
    home, half, room = limits.home, limits.half, limits.room
    n = len(limits.fixed)
    result = np.ones(len(yaw), dtype=np.bool_)
    moved = np.empty(n, dtype=np.bool_)
    for b in range(len(yaw)):
        for i in range(n):
            moved[i] = (
                position[b, i, 0] != home[i, 0]
                or position[b, i, 1] != home[i, 1]
                or yaw[b, i] != limits.home_yaw[i]
            )
            if moved[i]:
                x, z = position[b, i, 0], position[b, i, 1]
                beyond = outside_by(x, z, yaw[b, i], half[i], room[0], room[1], limits.stays_inside[i])
                if limits.fixed[i] or not beyond <= tolerance:
                    result[b] = False
        for i in range(n):
            if not (result[b] and moved[i]):
                continue
            for j in range(n):
                if j == i or not limits.keeps_clear[i, j] or (moved[j] and j < i):
                    continue
                dx = position[b, j, 0] - position[b, i, 0]
                dz = position[b, j, 1] - position[b, i, 1]
                reach = half[i, 0] + half[i, 2] + half[j, 0] + half[j, 2]
                near = dx * dx + dz * dz < reach * reach
                if near and overlap_depth(dx, dz, yaw[b, i], yaw[b, j], half[i], half[j]) > tolerance:
                    result[b] = False
                    break
    return result
