"""The curves on which animals run: out of the shed's door, past other buildings, to the front of their own.

The door of a building, the shed included, is the middle of its front side, where its yaw points. A curve ends
at the building's centre, not at its door, so that whoever runs to the end of it has entered the footprint.
"""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.game_logic import dodging
from farm_ar.geometry import direction, heading

CLEARANCE_M = 0.01
"""How far a curve keeps from other buildings, where it can."""

WALL_M = 0.002
"""How far a curve may run inside the front of the shed from whose door it comes."""

# Distance of each inner control point from its end, as a part of the way between the ends.
_HANDLE = 0.3

# How far curves may bow out, left and right by turns, as parts of the table's diagonal.
_BOWS = np.array([0.0] + [side * 0.015 * k for k in range(1, 21) for side in (1, -1)])

# Both inner control points moved by this much move the middle of a curve by 1.
_PULL = 4 / 3


def door(position: FloatArray, yaw: float | FloatArray, size: FloatArray) -> FloatArray:
    """Where animals come out of buildings: the middle of the front side.

    Args:
        position: (..., 2) centres, metres.
        yaw: (...) headings, radians.
        size: (..., 3) width, height, depth, metres.

    Returns:
        (..., 2) points, metres.
    """
    return np.asarray(position) + np.asarray(size)[..., 2, None] / 2 * direction(yaw)


def target(position: FloatArray, yaw: float | FloatArray, size: FloatArray) -> FloatArray:
    """Where curves to buildings end: in the middle, however large they are and wherever they face.

    Args:
        position: (..., 2) centres, metres.
        yaw: (...) headings, radians.
        size: (..., 3) width, height, depth, metres.

    Returns:
        (..., 2) points, metres.
    """
    return np.array(position, dtype=np.float64)


def running_curve(
    start: FloatArray,
    start_yaw: float | FloatArray,
    end: FloatArray,
    end_yaw: float | FloatArray,
    spread: float | FloatArray = 0.0,
) -> FloatArray:
    """Curves that leave one building straight out of its door and come up to another from its front.

    Args:
        start: (..., 2) where they begin, the `door` of the shed, metres.
        start_yaw: (...) heading of the shed, radians.
        end: (..., 2) where they end, the `target` in a building, metres.
        end_yaw: (...) heading of that building, radians.
        spread: (...) how far they bow out to the right of that, halfway, metres: with different ones animals
            do not run in single file. It turns the ends of the curve, too.

    Returns:
        (..., 4, 2) control points, metres.
    """
    start, end = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    way = end - start
    handle = _HANDLE * np.hypot(way[..., 0], way[..., 1])[..., None]
    bow = _PULL * np.asarray(spread, dtype=np.float64)[..., None] * direction(heading(way) + np.pi / 2)
    first_control = start + handle * direction(start_yaw) + bow
    second_control = end + handle * direction(end_yaw) + bow
    return np.stack(np.broadcast_arrays(start, first_control, second_control, end), axis=-2)


def clear_curve(
    curve: FloatArray,
    goal: IntArray,
    position: FloatArray,
    yaw: FloatArray,
    size: FloatArray,
    obstacles: BoolArray,
    table: tuple[float, float],
) -> FloatArray:
    """Bow curves out as little as needed for none to lead through a building that is not its goal.

    They also keep to the table, out of the shed, and `CLEARANCE_M` from other buildings, where that is
    possible. A curve that no bow would get past the others is left as it is.

    Args:
        curve: (K, 4, 2) control points, metres.
        goal: (K,) the building that each leads to.
        position: (N, 2) centres of the buildings where they are believed to be, metres.
        yaw: (N,) headings of the buildings there, radians.
        size: (N, 3) width, height, depth of the buildings, metres.
        obstacles: (N,) buildings that an animal can enter; not the shed.
        table: width and depth of the table, metres.

    Returns:
        (K, 4, 2) control points, metres.
    """
    bowed, enterable = np.array(curve, np.float64, order="C"), np.array(obstacles, dtype=np.bool_)
    poses = np.array(position, np.float64, order="C"), np.array(yaw, np.float64, order="C")
    sides = np.array(size, np.float64, order="C")
    dodging.dodge(
        bowed,
        direction(heading(bowed[:, 3] - bowed[:, 0]) + np.pi / 2),
        bows(table),
        np.array(goal, dtype=np.int64),
        dodging.footprints_to_dodge(*poses, sides, enterable, CLEARANCE_M, WALL_M),
        np.array(table, dtype=np.float64),
    )
    return bowed


def bows(table: tuple[float, float]) -> FloatArray:
    """(C,) by how much inner control points are moved to bow a curve out, in order of preference, metres."""
    return _PULL * float(np.hypot(*table)) * _BOWS


SHAPE = np.array([_HANDLE, _PULL, CLEARANCE_M, WALL_M])
"""What `dodging.lead` has to know of these curves."""
