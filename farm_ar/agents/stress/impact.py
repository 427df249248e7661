"""What a failure means in the game: whether the hand can bring it about, and what the animals then do."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np

from farm_ar.agents.attacks import wrong_labels
from farm_ar.agents.cases import Case
from farm_ar.agents.distance import distance_of
from farm_ar.arrays import FloatArray
from farm_ar.envs.config import EnvConfig
from farm_ar.game_logic.belief import Tracker
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.game_logic.physics.tabletop import MotionLimit, Tabletop
from farm_ar.reid import Reidentifier, ReidFactory
from farm_ar.scenes import visible

EXTENSIONS = (1.0, 1.01, 1.03, 1.06, 1.1, 1.2)
"""How far a failure is carried on: the cheapest stand on the very border, which a hand may just miss."""

ORDERS = 6
"""In how many orders the hand tries to move the objects."""

PLAY_SECONDS = 8.0
"""How long the game is played on after the snapshot."""


def realizable_distance(
    case: Case, reid: Reidentifier, position: FloatArray, yaw: FloatArray, rng: np.random.Generator
) -> float | None:
    """The least distance with which the hand brings a failure about, what it pushes included.

    None where it cannot. Tried are several orders of the objects, and going a little further. A visit has the
    moves and the budget of `FarmToTable-v0`; what is out of view when its turn comes cannot be gripped.

    Args:
        case: what stands where, on a table with physics.
        reid: that is to give a wrong label.
        position: (N, 2) where the objects stand in the failure, metres.
        yaw: (N,) their headings, radians.
        rng: draws the orders.
    """
    layout = case.layout
    moved = np.flatnonzero(np.any(position != layout.position, axis=1) | (yaw != layout.yaw))
    if len(moved) > EnvConfig().moves:
        return None
    orders = orders_of(moved.tolist(), rng)
    distances = [
        _carried(
            case,
            reid,
            layout.position + further * (position - layout.position),
            layout.yaw + further * (yaw - layout.yaw),
            order,
        )
        for further in EXTENSIONS
        for order in orders
    ]
    return min((distance for distance in distances if distance is not None), default=None)


def orders_of(objects: Sequence[int], rng: np.random.Generator) -> list[tuple[int, ...]]:
    """`ORDERS` different orders of objects at random; all of them where there are no more."""
    every = list(permutations(objects))  # a visit has so few moves that they can be listed
    if len(every) <= ORDERS:
        return every
    return [every[k] for k in rng.choice(len(every), ORDERS, replace=False)]


def _carried(
    case: Case, reid: Reidentifier, goal: FloatArray, heading: FloatArray, order: Sequence[int]
) -> float | None:
    """The distance of carrying the objects over in turn; None if no label is wrong after it."""
    table = Tabletop(case.layout, case.scene.size)
    options = EnvConfig()
    for i in order:
        if not visible(table.layout, case.camera)[i]:
            return None
        spent = table.moved
        left = MotionLimit(options.budget_m - spent.metres, options.budget_rad - spent.radians)
        table.carry(i, goal[i], float(heading[i]), most=left)
    after = table.layout
    if not wrong_labels(case, reid, after.position[None], after.yaw[None])[0]:
        return None
    return distance_of(case.layout, case.scene.diagonal, after.position, after.yaw).total


class Impact(NamedTuple):
    """What a snapshot does to the game.

    Args:
        endpoint_error_m: from where labels are believed to be to where their own objects are, summed, metres.
        miscounts: animals in the seconds after it that did not get into the building of their colour, or None
            in a scene without the game's shed.
    """

    endpoint_error_m: float
    miscounts: int | None


def downstream_impact(
    case: Case, make: ReidFactory, position: FloatArray, yaw: FloatArray, rng: np.random.Generator
) -> Impact:
    """What becomes of a game in which objects were moved, unseen, to other poses, and a snapshot was taken.

    Args:
        case: where everything is known to be, and the camera.
        make: makes the re-identifier.
        position: (N, 2) where the objects then are, metres.
        yaw: (N,) their headings, radians.
        rng: where the game's randomness comes from.
    """
    truth = case.layout.with_poses(position, yaw)
    if not case.layout.fixed.any():
        tracker = Tracker(case.scene, case.layout, make)
        tracker.look(truth, case.camera, rng)
        return Impact(float(tracker.belief.endpoint_error(truth).sum()), None)
    game = FarmGame(case.scene, case.camera, rng, case.layout, make)
    game.rearrange(truth)
    before = game.miscounts
    game.end_visit()
    game.play(PLAY_SECONDS)
    error = float(game.tracker.belief.endpoint_error(truth).sum())
    return Impact(error, int(game.miscounts - before))
