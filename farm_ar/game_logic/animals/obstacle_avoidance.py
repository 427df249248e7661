"""Kernels: curves are bowed out to lead past other buildings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.game_logic.animals.curve_intersection import (
    NOWHERE,
    Footprint,
    footprint_entry,
    footprints,
    hull,
    inside,
)
from farm_ar.geometry import arc_length
from farm_ar.geometry.arc_length import Polynomial
from farm_ar.kernels import compiled
from farm_ar.structs import Structs, struct_dtype

CLEARANCE_M = 0.01
"""How far a curve keeps from other buildings, where it can."""

WALL_M = 0.002
"""How far a curve may run inside the front of the shed from whose door it comes."""

_LOOKS, _MORE_LOOKS, _MANY = 8, 24, 20  # at a curve, at equal steps of the parameter; at many small buildings

_FOOTPRINT = struct_dtype(Footprint)


class Buildings(NamedTuple):
    """N buildings.

    Args:
        position: (N, 2) centres, metres.
        yaw: (N,) headings, radians.
        size: (N, 3) width, height, depth, metres.
        enterable: (N,) those that an animal can enter; not the shed.
    """

    position: FloatArray
    yaw: FloatArray
    size: FloatArray
    enterable: BoolArray


@compiled
def stays_on(p: Polynomial, table: FloatArray) -> bool:
    """Whether a whole curve is on a table from (0, 0) to (2,)."""
    for axis in range(2):
        a, b, c, d = p[4 * axis], p[4 * axis + 1], p[4 * axis + 2], p[4 * axis + 3]
        for turn in arc_length.turning_points(b, c, d):
            t = min(max(turn, 0.0), 1.0)
            if not 0 <= a + t * (b + t * (c + t * d)) <= table[axis]:
                return False
        if not (0 <= a <= table[axis] and 0 <= a + b + c + d <= table[axis]):
            return False
    return True


@compiled
def glimpsed(looks: FloatArray, own: Footprint) -> float:
    """A parameter at which a curve is in a footprint, if a quick look, (P, 2), finds one; else 2."""
    for k in range(len(looks)):
        if inside(own, looks[k, 0], looks[k, 1]):
            return (k + 1) / (len(looks) + 1)
    return 2.0


@compiled
def in_the_way(p: Polynomial, goal: int, own: Footprint, others: Structs[Footprint], likely: int) -> int:
    """A footprint that a curve is in before it is in its goal's; NOWHERE if there is none.

    Args:
        p: the curve.
        goal: the building it leads to.
        own: the footprint of that.
        others: (N,) the footprints.
        likely: the one to look at first, because it was in the way of a similar curve; NOWHERE for none.
    """
    least_x, most_x = hull(p[0], p[1], p[2], p[3], 0.0, 1.0)
    least_z, most_z = hull(p[4], p[5], p[6], p[7], 0.0, 1.0)
    steps = _MORE_LOOKS if len(others) > _MANY else _LOOKS
    looks = np.empty((steps - 1, 2))
    for k in range(len(looks)):
        looks[k, 0], looks[k, 1] = arc_length.point_at(p, (k + 1) / steps)
    for closely in (False, True):  # most of what is in the way is seen at a glance
        for k in range(-1, len(others)):
            i = likely if k < 0 else k
            if i in (goal, NOWHERE) or (k >= 0 and i == likely):
                continue
            other = others[i]
            if (
                other.x - other.reach_x <= most_x
                and other.x + other.reach_x >= least_x
                and other.z - other.reach_z <= most_z
                and other.z + other.reach_z >= least_z
            ):
                # In it by now and never at the goal so far, whenever it came in.
                t = footprint_entry(p, 0.0, 1.0, other) if closely else glimpsed(looks, other)
                if t <= 1 and footprint_entry(p, 0.0, t, own) > t:
                    return i
    return NOWHERE


@compiled
def kept_clear_of(buildings: Buildings) -> Structs[Footprint]:
    """The (3, N) footprints that `avoid` keeps clear of, at first and if it cannot."""
    n = len(buildings.yaw)
    wide, narrow = buildings.size.copy(), buildings.size.copy()
    made: Structs[Footprint] = np.empty((3, n), _FOOTPRINT)  # type: ignore[assignment]
    for i in range(n):
        for axis in range(3):
            if buildings.enterable[i]:
                wide[i, axis] += 2 * CLEARANCE_M
            else:
                wide[i, axis] -= 2 * WALL_M
                narrow[i, axis] -= 2 * WALL_M
    everything = np.empty(n, dtype=np.bool_)
    everything[:] = True
    first = footprints(buildings.position, buildings.yaw, wide, everything)
    second = footprints(buildings.position, buildings.yaw, narrow, everything)
    third = footprints(buildings.position, buildings.yaw, narrow, buildings.enterable)
    for i in range(n):  # not array by array, which takes seconds more to compile
        made[0, i], made[1, i], made[2, i] = first[i], second[i], third[i]
    return made


@compiled
def avoid(
    curve: FloatArray,
    aside: FloatArray,
    bows: FloatArray,
    goal: IntArray,
    obstacles: Structs[Footprint],
    table: FloatArray,
) -> None:
    """Bow curves out so that they lead past other buildings; those for which no bow does stay as they are.

    Args:
        curve: (K, 4, 2) control points, metres; the inner two are moved.
        aside: (K, 2) unit vectors along which they are moved.
        bows: (C,) by how much they may be, in order of preference, metres.
        goal: (K,) the building that each curve leads to.
        obstacles: (3, N) footprints to keep clear of: at first; if no bow does; and if that may leave the
            table. The goal's own is taken from the last.
        table: (2,) width and depth of the table, metres.
    """
    for k in range(len(curve)):
        avoid_with(curve[k], aside[k, 0], aside[k, 1], bows, goal[k], obstacles, table)


@compiled
def avoid_with(
    curve: FloatArray,
    aside_x: float,
    aside_z: float,
    bows: FloatArray,
    goal: int,
    obstacles: Structs[Footprint],
    table: FloatArray,
) -> None:
    """`avoid` for one curve, (4, 2)."""
    bowed, own = np.empty((4, 2)), obstacles[2, goal]
    left = right = NOWHERE
    for ask in range(len(obstacles)):
        for bow in bows:
            for i in range(4):
                bowed[i, 0], bowed[i, 1] = curve[i, 0], curve[i, 1]
            for i in range(1, 3):
                bowed[i, 0] += bow * aside_x
                bowed[i, 1] += bow * aside_z
            p = arc_length.polynomial(bowed)
            if ask < 2 and not stays_on(p, table):
                continue
            # What was in the way of the last on this side is most likely in the way of the next.
            likely = right if bow > 0 else left
            blocker = in_the_way(p, goal, own, obstacles[ask], likely)  # type: ignore[arg-type]  # a row
            left, right = blocker if bow <= 0 else left, blocker if bow >= 0 else right
            if blocker == NOWHERE:
                for i in range(4):
                    curve[i, 0], curve[i, 1] = bowed[i, 0], bowed[i, 1]
                return
