"""A whole pick-and-place: the hand reaches over, grips, drags, lets go, and leaves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot
from typing import TYPE_CHECKING

import numpy as np

from farm_ar.geometry import wrap

if TYPE_CHECKING:
    from farm_ar.game_logic.tabletop import Most, Pair, Tabletop

    Record = Callable[[Tabletop], None]

CARRY_SPEED = 0.75
"""Fastest that a hand drags a building unless told otherwise, metres a second."""

REACH_SPEED = 1.5
"""Fastest that a hand moves above the buildings on its way in and out, metres a second."""

ENTRY = -0.15
"""z at which a hand comes in and leaves, on the player's side of the table, metres."""

REACHED_M, REACHED_RAD = 0.01, float(np.deg2rad(3.0))
"""How near to where it was to go a building must come to rest to have reached it."""


@dataclass(frozen=True)
class Carry:
    """What became of one pick-and-place.

    Args:
        gripped: whether the building can be gripped at all.
        reached: whether it came to rest within 1 cm and 3 degrees of where it was to go.
        error_m: how far from there, metres.
        error_rad: the same for its heading, radians, not negative.
        ticks: how many ticks it took, from the hand's coming in until it was out and everything at rest.
    """

    gripped: bool
    reached: bool
    error_m: float
    error_rad: float
    ticks: int


def carry(
    table: Tabletop,
    index: int,
    goal: Pair,
    yaw: float,
    record: Record | None,
    speed: float,
    leave: bool,
    most: Most | None,
) -> Carry:
    """Carry a building to a pose, as `Tabletop.carry` describes it."""
    start = table.ticks
    position, heading = table.poses()
    gripped = bool(table.movable[index])
    if gripped:
        x, z = position[index].tolist()
        if table.hand is None:
            table.bring_hand((x, ENTRY), raised=True)
        table.raise_hand()
        table.guide_hand((x, z), 0.0, REACH_SPEED, record)
        table.grip(index)
        table.guide_hand(goal, float(wrap(yaw - heading[index])), speed, record, most)
        table.raise_hand()
        if leave:
            table.guide_hand((x, ENTRY), 0.0, REACH_SPEED, record)
            table.remove_hand()
        table.settle(record=record)
        position, heading = table.poses()
    x, z = position[index].tolist()
    error_m = hypot(x - goal[0], z - goal[1])
    error_rad = abs(float(wrap(heading[index] - yaw)))
    reached = gripped and error_m <= REACHED_M and error_rad <= REACHED_RAD
    return Carry(gripped, reached, error_m, error_rad, table.ticks - start)
