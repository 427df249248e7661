"""Whether the game's hand can carry a failure out: gripping, dragging and pushing, in one visit."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice, permutations

import numpy as np

from farm_ar.agents.attacks import wrong_labels
from farm_ar.agents.cases import Case
from farm_ar.agents.effort import effort_of
from farm_ar.arrays import FloatArray
from farm_ar.envs.config import EnvConfig
from farm_ar.game_logic.tabletop import Most, Tabletop
from farm_ar.reid import Reidentifier
from farm_ar.scenes import visible

FURTHER = (1.0, 1.01, 1.03, 1.06, 1.1, 1.2)
"""How far a failure is carried on: the cheapest stand on the very border, which a hand may just miss."""

ORDERS = 6
"""In how many orders the hand tries to move the objects."""


def by_hand(case: Case, reid: Reidentifier, position: FloatArray, yaw: FloatArray) -> float | None:
    """The least effort with which the hand brings a failure about, what it pushes included.

    None where it cannot. Tried are several orders of the objects, and going a little further. A visit has the
    moves and the budget of `FarmToTable-v0`; what is out of view when its turn comes cannot be gripped.

    Args:
        case: what stands where, on a table with physics.
        reid: that is to give a wrong label.
        position: (N, 2) where the objects stand in the failure, metres.
        yaw: (N,) how they are turned.
    """
    layout = case.layout
    moved = np.flatnonzero(np.any(position != layout.position, axis=1) | (yaw != layout.yaw))
    if len(moved) > EnvConfig().moves:
        return None
    efforts = [
        _carried(
            case,
            reid,
            layout.position + further * (position - layout.position),
            layout.yaw + further * (yaw - layout.yaw),
            order,
        )
        for further in FURTHER
        for order in islice(permutations(moved.tolist()), ORDERS)
    ]
    return min((effort for effort in efforts if effort is not None), default=None)


def _carried(
    case: Case, reid: Reidentifier, goal: FloatArray, heading: FloatArray, order: Sequence[int]
) -> float | None:
    """The effort of carrying the objects over in turn; None if no label is wrong after it."""
    table = Tabletop(case.layout, case.scene.size)
    options = EnvConfig()
    for i in order:
        if not visible(table.layout, case.camera)[i]:
            return None
        spent = table.moved
        left = Most(options.budget_m - spent.metres, options.budget_rad - spent.radians)
        table.carry(i, goal[i], float(heading[i]), most=left)
    after = table.layout
    if not wrong_labels(case, reid, after.position[None], after.yaw[None])[0]:
        return None
    return effort_of(case.layout, case.scene.diagonal, after.position, after.yaw).total
