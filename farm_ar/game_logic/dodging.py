"""Compiled: lanes that are bowed out to lead past other buildings."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.game_logic import arc_length, entering
from farm_ar.game_logic.arc_length import Polynomial
from farm_ar.kernels import compiled

LANE = 11
"""Columns of a lane: label, building where it ends, length up to there, control points."""

_LOOKS = 8  # at a curve, at equal steps of the parameter


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
def glimpsed(p: Polynomial, box: FloatArray) -> float:
    """A parameter at which a curve is in a footprint (8,), if a quick look finds one; else 2."""
    for k in range(1, _LOOKS):
        t = k / _LOOKS
        dx, dz = arc_length.point_at(p, t)
        dx, dz = dx - box[0], dz - box[1]
        if abs(dx * box[3] - dz * box[2]) <= box[4] and abs(dx * box[2] + dz * box[3]) <= box[5]:
            return t
    return 2.0


@compiled
def in_the_way(p: Polynomial, goal: int, own: FloatArray, box: FloatArray, likely: int) -> int:
    """A footprint that a curve is in before it is in its goal's; NOWHERE if there is none.

    Args:
        p: the curve.
        goal: the building it leads to.
        own: (8,) the footprint of that.
        box: (N, 8) the footprints.
        likely: the one to look at first, because it was in the way of a similar curve; NOWHERE for none.
    """
    least_x, most_x = entering.hull(p[0], p[1], p[2], p[3], 0.0, 1.0)
    least_z, most_z = entering.hull(p[4], p[5], p[6], p[7], 0.0, 1.0)
    for k in range(-1, len(box)):
        i = likely if k < 0 else k
        if i in (goal, entering.NOWHERE) or (k >= 0 and i == likely):
            continue
        x, z, reach_x, reach_z = box[i, 0], box[i, 1], box[i, 6], box[i, 7]
        if (
            x - reach_x <= most_x
            and x + reach_x >= least_x
            and z - reach_z <= most_z
            and z + reach_z >= least_z
        ):
            # Quick: in it by now and never at the goal so far, whenever it came in.
            t = glimpsed(p, box[i])
            if t <= 1 and entering.footprint_entry(p, 0.0, t, own) > t:
                return i
            t = entering.footprint_entry(p, 0.0, 1.0, box[i])
            if t <= 1 and entering.footprint_entry(p, 0.0, t, own) > t:
                return i
    return entering.NOWHERE


@compiled
def footprints_to_dodge(
    position: FloatArray,
    yaw: FloatArray,
    size: FloatArray,
    enterable: BoolArray,
    clearance: float,
    wall: float,
) -> FloatArray:
    """The (3, N, 8) footprints that `dodge` keeps clear of.

    Args:
        position: (N, 2) centres, metres.
        yaw: (N,) headings, radians.
        size: (N, 3) width, height, depth, metres.
        enterable: (N,) buildings that an animal can enter.
        clearance: how far to keep from these at first, metres.
        wall: how far a curve may run inside the front of others, metres.
    """
    n = len(yaw)
    wide, narrow, box = size.copy(), size.copy(), np.empty((3, n, 8))
    for i in range(n):
        if enterable[i]:
            wide[i] += 2 * clearance
        else:
            wide[i] -= 2 * wall
            narrow[i] -= 2 * wall
    everything = np.ones(n, dtype=np.bool_)
    box[0], box[1] = (
        entering.boxes(position, yaw, wide, everything),
        entering.boxes(position, yaw, narrow, everything),
    )
    box[2] = entering.boxes(position, yaw, narrow, enterable)
    return box


@compiled
def dodge(
    curve: FloatArray, aside: FloatArray, bows: FloatArray, goal: IntArray, box: FloatArray, table: FloatArray
) -> None:
    """Bow curves out so that they lead past other buildings; those for which no bow does stay as they are.

    Args:
        curve: (K, 4, 2) control points, metres; the inner two are moved.
        aside: (K, 2) unit vectors along which they are moved.
        bows: (C,) by how much they may be, in order of preference, metres.
        goal: (K,) the building that each curve leads to.
        box: (3, N, 8) footprints to keep clear of: at first; if no bow does; and if that may leave the table.
            The goal's own is taken from the last.
        table: (2,) width and depth of the table, metres.
    """
    for k in range(len(curve)):
        dodge_one(curve[k], aside[k, 0], aside[k, 1], bows, goal[k], box, table)


@compiled
def dodge_one(
    curve: FloatArray,
    aside_x: float,
    aside_z: float,
    bows: FloatArray,
    goal: int,
    box: FloatArray,
    table: FloatArray,
) -> None:
    """`dodge` for one curve, (4, 2)."""
    bowed, own = np.empty((4, 2)), box[2, goal]
    for ask in range(len(box)):
        blocker = entering.NOWHERE
        for bow in bows:
            bowed[:] = curve
            for i in range(1, 3):
                bowed[i, 0] += bow * aside_x
                bowed[i, 1] += bow * aside_z
            p = arc_length.polynomial(bowed)
            if ask < 2 and not stays_on(p, table):
                continue
            # What was in the way of the last is most likely in the way of the next.
            blocker = in_the_way(p, goal, own, box[ask], blocker)
            if blocker == entering.NOWHERE:
                curve[:] = bowed
                return


@compiled
def lead(
    lane: FloatArray,
    spread: FloatArray,
    shed: int,
    position: FloatArray,
    yaw: FloatArray,
    size: FloatArray,
    enterable: BoolArray,
    shape: FloatArray,
    bows: FloatArray,
    table: FloatArray,
) -> None:
    """Lead lanes from the shed's door to buildings, as `paths.running_curve` and `paths.clear_curve` do.

    Args:
        lane: (n, L, LANE) lanes; their curves are filled in.
        spread: (n, L) how far each bows out to the right, metres.
        shed: index of the shed.
        position: (N, 2) centres of the buildings, metres.
        yaw: (N,) headings, radians.
        size: (N, 3) width, height, depth, metres.
        enterable: (N,) buildings that an animal can enter.
        shape: (4,) a handle's length as a part of the way, by how much more control points move than the
            curve's middle, the clearance and the wall.
        bows: (C,) by how much curves may be bowed, in order of preference, metres.
        table: (2,) width and depth of the table, metres.
    """
    box = footprints_to_dodge(position, yaw, size, enterable, shape[2], shape[3])
    sine, cosine = np.sin(yaw[shed]), np.cos(yaw[shed])
    start_x, start_z = (
        position[shed, 0] + size[shed, 2] / 2 * sine,
        position[shed, 1] + size[shed, 2] / 2 * cosine,
    )
    curve = np.empty((4, 2))
    for k in range(lane.shape[0]):
        goal = int(lane[k, 0, 0])
        way_x, way_z = position[goal, 0] - start_x, position[goal, 1] - start_z
        way = np.sqrt(way_x * way_x + way_z * way_z)
        handle = shape[0] * way
        right_x, right_z = (way_z / way, -way_x / way) if way > 0 else (1.0, 0.0)
        end_sine, end_cosine = np.sin(yaw[goal]), np.cos(yaw[goal])
        for i in range(lane.shape[1]):
            bow = shape[1] * spread[k, i]
            curve[0, 0], curve[0, 1] = start_x, start_z
            curve[1, 0], curve[1, 1] = (
                start_x + handle * sine + bow * right_x,
                start_z + handle * cosine + bow * right_z,
            )
            curve[2, 0] = position[goal, 0] + handle * end_sine + bow * right_x
            curve[2, 1] = position[goal, 1] + handle * end_cosine + bow * right_z
            curve[3, 0], curve[3, 1] = position[goal, 0], position[goal, 1]
            dodge_one(curve, right_x, right_z, bows, goal, box, table)
            lane[k, i, 3:] = curve.reshape(8)
