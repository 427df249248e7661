"""Compiled kernels of the surrogate environment: moves on many tables, and the answers of the method."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import Rule, assess, known_at, seen_at

STRIDE_M = 0.01
"""How far a building is carried before what is in its way is pushed."""

TOUCH_M = 1e-9

ROUNDS = 4
"""How often what was pushed may push on; where there is no room then, the hand is held up."""


class Bodies(NamedTuple):
    """M objects, discs that push one another, and fixed boxes, on a table.

    Args:
        radius: (M,) of the discs, metres.
        fixed: (M,) objects that nothing moves.
        half: (M, 2) half width and half depth, metres.
        size: (2,) of the table, metres.
    """

    radius: FloatArray
    fixed: BoolArray
    half: FloatArray
    size: FloatArray


@compiled
def carry_all(
    which: IntArray,
    shift: FloatArray,
    turn: FloatArray,
    position: FloatArray,
    yaw: FloatArray,
    bodies: Bodies,
    moved: FloatArray,
) -> None:
    """Carry one object on each of B tables; what is in its way is pushed along, as discs push one another.

    Args:
        which: (B,) the object, below 0 for none.
        shift: (B, 2) where to, relative to where it is, metres.
        turn: (B,) radians.
        position: (B, M, 2) metres; changed in place.
        yaw: (B, M) radians; changed in place.
        bodies: what the objects are.
        moved: (B, 2) filled with the metres and radians of all objects together.
    """
    radius, size = bodies.radius, bodies.size
    for b in range(len(which)):
        moved[b] = 0.0
        i = which[b]
        if i < 0:
            continue
        place, before, heading = position[b], position[b].copy(), yaw[b].copy()
        steps = int(np.ceil(np.hypot(shift[b, 0], shift[b, 1]) / STRIDE_M))
        goal_x = min(max(place[i, 0] + shift[b, 0], radius[i]), size[0] - radius[i])
        goal_z = min(max(place[i, 1] + shift[b, 1], radius[i]), size[1] - radius[i])
        begin_x, begin_z = place[i, 0], place[i, 1]
        for step in range(1, steps + 1):
            earlier = place.copy()
            place[i, 0] = begin_x + (goal_x - begin_x) * step / steps
            place[i, 1] = begin_z + (goal_z - begin_z) * step / steps
            stride_x, stride_z = (goal_x - begin_x) / steps, (goal_z - begin_z) / steps
            if not _make_room(place, yaw[b], i, stride_x, stride_z, bodies):
                place[:] = earlier
                break
        yaw[b, i] = (yaw[b, i] + turn[b] + np.pi) % (2 * np.pi) - np.pi
        for j in range(len(radius)):
            moved[b, 0] += np.hypot(place[j, 0] - before[j, 0], place[j, 1] - before[j, 1])
            if j != i:
                moved[b, 1] += abs(yaw[b, j] - heading[j])
                yaw[b, j] = (yaw[b, j] + np.pi) % (2 * np.pi) - np.pi
        moved[b, 1] += abs(turn[b])


@compiled
def _make_room(
    place: FloatArray, yaw: FloatArray, carried: int, stride_x: float, stride_z: float, bodies: Bodies
) -> bool:
    """Push what the carried object overlaps, and what that overlaps; False where it cannot go on."""
    radius, fixed, half, size = bodies.radius, bodies.fixed, bodies.half, bodies.size
    n = len(radius)
    pushing = np.zeros(n, dtype=np.bool_)
    pushing[carried] = True
    for _ in range(ROUNDS):
        blocked = False
        for a in range(n):
            if not pushing[a]:
                continue
            for c in range(n):
                if c == a:
                    continue
                if fixed[c]:
                    blocked |= _push_out(place, a, place[c], yaw[c], half[c], radius[a])
                    continue
                dx, dz = place[c, 0] - place[a, 0], place[c, 1] - place[a, 1]
                away, room = np.hypot(dx, dz), radius[a] + radius[c]
                if away >= room - TOUCH_M:
                    continue
                blocked |= pushing[c]
                if away < TOUCH_M:
                    dx, dz, away = 1.0, 0.0, 1.0
                last, other = (c, 1.0) if c != carried else (a, -1.0)
                if a == carried:
                    # What slides along its side turns it, as a wheel on a road.
                    slip = (stride_z * dx - stride_x * dz) / away
                    yaw[c] += slip / radius[c]
                push = other * (room - away) / away
                place[last, 0] += push * dx
                place[last, 1] += push * dz
                for axis in range(2):
                    inside = min(max(place[last, axis], radius[last]), size[axis] - radius[last])
                    blocked |= inside != place[last, axis]
                    place[last, axis] = inside
                pushing[last] = True
        if not blocked:
            return True
    return False


@compiled
def _push_out(
    place: FloatArray, a: int, middle: FloatArray, yaw: float, half: FloatArray, radius: float
) -> bool:
    """Push a disc out of a box; whether it was in it."""
    sine, cosine = np.sin(yaw), np.cos(yaw)
    dx, dz = place[a, 0] - middle[0], place[a, 1] - middle[1]
    right, forward = dx * cosine - dz * sine, dx * sine + dz * cosine
    near_right, near_forward = min(max(right, -half[0]), half[0]), min(max(forward, -half[1]), half[1])
    off_right, off_forward = right - near_right, forward - near_forward
    away = np.hypot(off_right, off_forward)
    if away >= radius:
        return False
    if away < 1e-9:
        off_right, off_forward, away = 0.0, -1.0, 1.0
        right, forward = near_right, -half[1]
    else:
        right, forward = near_right, near_forward
    right += off_right / away * radius
    forward += off_forward / away * radius
    place[a, 0] = middle[0] + right * cosine + forward * sine
    place[a, 1] = middle[1] - right * sine + forward * cosine
    return True


def assess_all(
    position: FloatArray,
    yaw: FloatArray,
    home: FloatArray,
    facing: FloatArray,
    seen: BoolArray,
    starts: IntArray,
    rule: Rule,
    cost: FloatArray,
) -> tuple[FloatArray, IntArray]:
    """What the paper's method would say of B tables on which M objects stand kind by kind.

    Args:
        position: (B, M, 2) metres.
        yaw: (B, M) radians.
        home: (B, M, 2) where each label is believed to be, metres.
        facing: (B, M) its heading, radians.
        seen: (B, M) objects in view.
        starts: (kinds + 1,) where each kind begins, and M.
        rule: the weights.
        cost: (B, M, W) filled with the costs (Eq. 7) of the labels of the object's kind; more are left.

    Returns:
        (B, M) margins of the objects in view, infinite for the others; (B,) labels that would be read from
        another object than their own.
    """
    code = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    found = assess(
        seen_at(position, yaw, code, seen), known_at(home, facing, code), rule, margins=True, costs=True
    )
    for first, last in itertools.pairwise(starts.tolist()):
        cost[:, first:last, : last - first] = found.costs[:, first:last, first:last]
    wrong = (seen & (found.label != np.arange(len(code)))).sum(axis=1)
    return np.where(seen, found.margin, np.inf), wrong
