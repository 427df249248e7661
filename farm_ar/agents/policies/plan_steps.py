"""Steps of plans: what stands where, what a step does and costs, and whether its way is clear; compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.actions import SlotAction
from farm_ar.geometry.rectangles import overlap_depth
from farm_ar.kernels import compiled

WAY_POINTS = 6
"""At how many places of its way an object must not stand in another."""

SHARES = np.array(SlotAction.SHARES)
"""How far an object may go of its way to a label's place."""

FULL_TURN = 2 * np.pi


class Table(NamedTuple):
    """What stands where, and where it is believed to stand.

    Args:
        position: (M, 2) metres.
        yaw: (M,) radians.
        label_position: (M, 2) of the labels, metres.
        label_yaw: (M,) radians.
        wrong: (M,) labels that are wrong already.
        category: (M,) numbers.
        movable: (M,) objects that may be moved.
        size: (M, 3) width, height, depth, metres.
        elevation: (M,) of the pivots, metres.
    """

    position: FloatArray
    yaw: FloatArray
    label_position: FloatArray
    label_yaw: FloatArray
    wrong: BoolArray
    category: IntArray
    movable: BoolArray
    size: FloatArray
    elevation: FloatArray


class Terms(NamedTuple):
    """What objects cost, and what one action can do.

    Args:
        metre: cost (Eq. 7) of a metre.
        turn: cost of the sine of half a turn.
        effort_metre: price of a metre of motion beside a wrong label.
        effort_radian: price of a radian.
        width: of the table, metres.
        depth: of the table, metres.
        reach_m: farthest that an action carries along x and along z, metres.
        reach_rad: farthest that it turns, radians.
        levels: how many levels lie between the two ends of either reach; 0 where all values are possible.
    """

    metre: float
    turn: float
    effort_metre: float
    effort_radian: float
    width: float
    depth: float
    reach_m: float
    reach_rad: float
    levels: int


class Allowance(NamedTuple):
    """What is left for a visit.

    Args:
        metres: of all ways together.
        radians: of all turns together.
        effort: of both; infinite where they are counted apart.
        diagonal: what a unit of effort is in metres.
        moves: how many objects.
    """

    metres: float
    radians: float
    effort: float
    diagonal: float
    moves: int


@compiled
def target(
    table: Table, terms: Terms, allowed: Allowance, spent: FloatArray, i: int, j: int, share: int
) -> tuple[float, float, float, float, float]:
    """Where object i comes to stand by a share of its way to label j: x, z, yaw, metres and radians."""
    part = SHARES[share]
    x = _possible(part * (table.label_position[j, 0] - table.position[i, 0]), terms.reach_m, terms.levels)
    z = _possible(part * (table.label_position[j, 1] - table.position[i, 1]), terms.reach_m, terms.levels)
    turn = (table.label_yaw[j] - table.yaw[i] + np.pi) % FULL_TURN - np.pi
    turn = _possible(part * turn, terms.reach_rad, terms.levels)
    metres, radians = np.hypot(x, z), abs(turn)
    by_way = _scale(allowed.metres - spent[0], metres)
    by_turn = _scale(allowed.radians - spent[1], radians)
    left = allowed.effort - spent[0] / allowed.diagonal - spent[1] / np.pi
    both = _scale(left, metres / allowed.diagonal + radians / np.pi)
    by_way, by_turn = min(by_way, both), min(by_turn, both)
    return (
        table.position[i, 0] + by_way * x,
        table.position[i, 1] + by_way * z,
        table.yaw[i] + by_turn * turn,
        by_way * metres,
        by_turn * radians,
    )


@compiled
def _possible(value: float, reach: float, levels: int) -> float:
    """What an action can ask for in place of a value."""
    value = min(max(value, -reach), reach)
    if levels == 0:
        return value
    apart = 2 * reach / (levels - 1)
    return np.ceil((value + reach) / apart - 0.5) * apart - reach  # type: ignore[no-any-return]


@compiled
def _scale(left: float, asked: float) -> float:
    left = max(left, 0.0)
    return left / asked if asked > left else 1.0


@compiled
def is_clear(
    table: Table, terms: Terms, place: FloatArray, yaw: FloatArray, i: int, x: float, z: float, heading: float
) -> bool:
    """Whether object i stands in no other at several places of its way, and on the table at its end."""
    if not (0.0 <= x <= terms.width and 0.0 <= z <= terms.depth):
        return False
    half = table.size[i] / 2
    radius = np.hypot(half[0], half[2])
    dx, dz = x - place[i, 0], z - place[i, 1]
    length = dx * dx + dz * dz
    for j in range(len(yaw)):
        if j == i:
            continue
        other = table.size[j] / 2
        to_x, to_z = place[j, 0] - place[i, 0], place[j, 1] - place[i, 1]
        along = min(max((to_x * dx + to_z * dz) / length, 0.0), 1.0) if length > 0.0 else 0.0
        if np.hypot(to_x - along * dx, to_z - along * dz) > radius + np.hypot(other[0], other[2]):
            continue
        for k in range(1, WAY_POINTS + 1):
            part = k / WAY_POINTS
            turned = yaw[i] + part * (heading - yaw[i])
            if overlap_depth(to_x - part * dx, to_z - part * dz, turned, yaw[j], half, other) > 0:
                return False
    return True
