"""The least distance after which one object is taken for a label that no other object holds, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.agents.certificates.nearest import advance_distance
from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled

PARTS = 24
"""Into how many parts the range of turns is cut; the parts that matter once more into as many."""


class Mover(NamedTuple):
    """An object, the label that it is to be taken for, and what that asks of the two.

    Args:
        polygon: (V, 2) where the object's pivot may be in the end, metres.
        home: (2,) where it is, metres.
        goal: (2,) where the label's object was, metres.
        between: sin(theta / 2) of the angle theta between the two headings.
        diagonal: of the room, metres.
        way_weight: of |q - p| / l in the cost, not negative.
        turn_weight: of sin(turn / 2) in the cost, not negative.
        leaving: distance of the label's object to leave the view.
        clear: how far apart the two objects' pivots are at the least, metres.
    """

    polygon: FloatArray
    home: FloatArray
    goal: FloatArray
    between: float
    diagonal: float
    way_weight: float
    turn_weight: float
    leaving: float
    clear: float


@compiled
def turn_gain(turned: float, between: float) -> float:
    """How much nearer a turn brings to another heading than it leads away: r - sin((theta - a) / 2).

    Args:
        turned: r = sin(a / 2) of the turn a, towards the other heading and not beyond it.
        between: sin(theta / 2) of the angle theta between the headings, not above half a turn.
    """
    nearer = turned * (1.0 + np.sqrt(1.0 - between * between)) - between * np.sqrt(1.0 - turned * turned)
    return float(nearer)


@compiled
def distance_at(mover: Mover, ahead: float, clear: float) -> float:
    """Distance of the ways alone, when the way has to win `ahead` (a share of the diagonal).

    The mover goes so far as to be nearer to the goal by `ahead`; the goal's own object first leaves the view,
    if it must. Both have to be `clear` metres apart in the end: |a| >= |q - goal| + ahead, and the goal's
    object moves by clear - |q - goal| at the least.
    """
    metres = advance_distance(mover.polygon, mover.home, mover.goal, ahead * mover.diagonal)
    return max(metres / mover.diagonal + mover.leaving, clear / mover.diagonal + ahead)


@compiled
def single_mover(mover: Mover) -> float:
    """A lower bound of the distance after which one object is as near, in cost, to a label as to its own.

    The turn is cut into parts. Within a part, the turn is not below its lower end, and the way has to win no
    less than at its upper end: so the least over the parts is a bound, and finer parts make it tighter.

    Returns:
        The distance; infinite where no turn and no way is enough.
    """
    reached = np.inf
    for k in range(PARTS + 1):
        turned = mover.between * k / PARTS
        reached = min(reached, turned + _way(mover, turned))
    best = np.inf
    for k in range(PARTS):
        low, high = mover.between * k / PARTS, mover.between * (k + 1) / PARTS
        bound = low + _way(mover, high)
        if bound < reached:
            bound = _least_of_parts(mover, low, high)
        best = min(best, bound)
    return best


@compiled
def _way(mover: Mover, turned: float) -> float:
    """The ways' distance after a turn of sin(a / 2) = `turned`."""
    missing = -mover.turn_weight * turn_gain(turned, mover.between)
    if mover.way_weight > 0:
        return distance_at(mover, missing / mover.way_weight, mover.clear)
    if missing > 1e-12:
        return np.inf
    return distance_at(mover, -1e9, 0.0)


@compiled
def _least_of_parts(mover: Mover, low: float, high: float) -> float:
    """The least bound of the parts of one range of turns."""
    best = np.inf
    for k in range(PARTS):
        start, end = low + (high - low) * k / PARTS, low + (high - low) * (k + 1) / PARTS
        best = min(best, start + _way(mover, end))
    return best
