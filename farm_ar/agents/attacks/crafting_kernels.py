"""Makes a displacement that brings about one given error cheaper, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.agents.attacks.validity import outside_by, overlap_depth
from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.kernels import compiled

GAIN = 1e-6
"""By how much the error is to be the better answer, in cost; and how far inside its limits all is to stay."""

STEEPNESS = 4.0
"""What a violation costs beside effort: no violation is worth the effort that it saves."""


class Room(NamedTuple):
    """What a case says to the kernel.

    Args:
        home: (N, 2) where the objects were, metres.
        home_yaw: (N,) how they were turned.
        half: (N, 3) half sizes, metres.
        keeps_clear: (N, N) pairs that must not stand in each other.
        stays_inside: (N,) objects of which no part may be outside the room.
        normal: (P, 2) of the planes that bound the view.
        offset: (P,) of those planes; in view is normal . q <= offset for all.
        eye: (2,) of the camera.
        reach: how far it sees, metres.
        size: (2,) of the room, metres.
        way_weight: of metres, in cost.
        turn_weight: of sin(turn / 2), in cost.
        rate: the larger weight, in cost per effort.
        diagonal: metres.
        stretch: (N, N) C_d, by which the label of one multiplies the cost of the other; 1 for the own.
    """

    home: FloatArray
    home_yaw: FloatArray
    half: FloatArray
    keeps_clear: BoolArray
    stays_inside: BoolArray
    normal: FloatArray
    offset: FloatArray
    eye: FloatArray
    reach: float
    size: FloatArray
    way_weight: float
    turn_weight: float
    rate: float
    diagonal: float
    stretch: FloatArray


@compiled
def cost_of_label(room: Room, x: float, z: float, yaw: float, i: int, j: int) -> float:
    """What object i costs in a pose as the label of object j."""
    dx, dz = x - room.home[j, 0], z - room.home[j, 1]
    way = room.way_weight * np.sqrt(dx * dx + dz * dz)
    turned = room.turn_weight * abs(np.sin((yaw - room.home_yaw[j]) / 2))
    return float(room.stretch[i, j] * (way + turned))


@compiled
def beyond_view(room: Room, x: float, z: float) -> float:
    """How far a place is out of view, metres; negative in view."""
    beyond = np.hypot(x - room.eye[0], z - room.eye[1]) - room.reach
    for p in range(len(room.offset)):
        beyond = max(beyond, room.normal[p, 0] * x + room.normal[p, 1] * z - room.offset[p])
    return float(beyond)


@compiled
def violation(
    room: Room,
    chain: IntArray,
    goal: IntArray,
    movers: IntArray,
    unseen: int,
    position: FloatArray,
    yaw: FloatArray,
) -> float:
    """By how much a perturbation misses what it is to be, in effort; 0 where it is all of it."""
    gain = 0.0
    metres = 0.0
    for k in range(len(chain)):
        i = chain[k]
        x, z = position[i]
        own = cost_of_label(room, x, z, yaw[i], i, i)
        gain += own - cost_of_label(room, x, z, yaw[i], i, goal[k])
        metres += max(0.0, beyond_view(room, x, z) + GAIN)
    if unseen >= 0:
        metres += max(0.0, GAIN - beyond_view(room, position[unseen, 0], position[unseen, 1]))
    for i in movers:
        x, z = position[i]
        metres += outside_by(x, z, yaw[i], room.half[i], room.size[0], room.size[1], room.stays_inside[i])
        for j in range(len(yaw)):
            if j == i or not room.keeps_clear[i, j]:
                continue
            dx, dz = position[j, 0] - x, position[j, 1] - z
            reach = room.half[i, 0] + room.half[i, 2] + room.half[j, 0] + room.half[j, 2]
            if dx * dx + dz * dz < reach * reach:
                metres += max(0.0, overlap_depth(dx, dz, yaw[i], yaw[j], room.half[i], room.half[j]) + GAIN)
    return max(0.0, GAIN - gain) / room.rate + metres / room.diagonal


@compiled
def effort_in(room: Room, movers: IntArray, position: FloatArray, yaw: FloatArray) -> float:
    """D with weights 1, summed over the movers."""
    total = 0.0
    for i in movers:
        dx, dz = position[i, 0] - room.home[i, 0], position[i, 1] - room.home[i, 1]
        total += np.sqrt(dx * dx + dz * dz) / room.diagonal
        total += abs(np.sin((yaw[i] - room.home_yaw[i]) / 2))
    return total


@compiled
def evolve(
    room: Room,
    chain: IntArray,
    goal: IntArray,
    movers: IntArray,
    unseen: int,
    position: FloatArray,
    yaw: FloatArray,
    normals: FloatArray,
    picks: IntArray,
) -> float:
    """Improve a perturbation in place; its effort afterwards, infinite where it still misses something.

    Args:
        room: the room.
        chain: (K,) the objects of the error.
        goal: (K,) the object whose label each is to be given.
        movers: (M,) objects that may be moved.
        unseen: the object that is not to be detected, -1 for none.
        position: (N, 2) metres; changed.
        yaw: (N,) radians; changed.
        normals: (S, M, 3) normal numbers, for the steps.
        picks: (S,) which mover a step moves: those from M on move all.
    """
    trial_position, trial_yaw = position.copy(), yaw.copy()
    best_position, best_yaw, best = position.copy(), yaw.copy(), np.inf
    spread = 0.05
    missing = violation(room, chain, goal, movers, unseen, position, yaw)
    value = effort_in(room, movers, position, yaw) + STEEPNESS * missing
    for s in range(len(picks)):
        for m in range(len(movers)):
            i = movers[m]
            trial_position[i] = position[i]
            trial_yaw[i] = yaw[i]
            if picks[s] < len(movers) and picks[s] != m:
                continue
            trial_position[i, 0] += spread * room.diagonal * normals[s, m, 0]
            trial_position[i, 1] += spread * room.diagonal * normals[s, m, 1]
            trial_yaw[i] += 2 * spread * normals[s, m, 2]
            # Not to move, or not to turn, is the best there is, and no small step ever hits it.
            if s % 8 == 0:
                trial_position[i] = room.home[i]
            if s % 8 < 2:
                trial_yaw[i] = room.home_yaw[i]
        missing = violation(room, chain, goal, movers, unseen, trial_position, trial_yaw)
        effort = effort_in(room, movers, trial_position, trial_yaw)
        if missing == 0 and effort < best:
            best = effort
            best_position[:] = trial_position
            best_yaw[:] = trial_yaw
        if effort + STEEPNESS * missing < value:
            value = effort + STEEPNESS * missing
            for i in movers:
                position[i] = trial_position[i]
                yaw[i] = trial_yaw[i]
            spread = min(spread * 1.5, 0.2)
        else:
            spread = max(spread * 0.93, 1e-5)
    position[:] = best_position
    yaw[:] = best_yaw
    return best
