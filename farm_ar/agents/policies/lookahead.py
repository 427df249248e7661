"""What a snapshot would say if the table stood otherwise, by the paper's method, for many tables."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.actions import Move
from farm_ar.envs.env import FarmToTableEnv
from farm_ar.envs.features import MARGIN_SCALE
from farm_ar.envs.table import TableView
from farm_ar.reid.assignment import CostModel, assess, known_at, seen_at
from farm_ar.scenes import visible


class LookAhead(NamedTuple):
    """What B tables would come to.

    Args:
        wrong: (B,) wrong labels after a snapshot.
        ambiguity: (B,) half the sum over movable objects in view of 1 - margin / 0.3, from 0 to 1 each.
    """

    wrong: IntArray
    ambiguity: FloatArray


def look_ahead(env: FarmToTableEnv, position: FloatArray, yaw: FloatArray) -> LookAhead:
    """What the paper's method would make of B tables, of which each would be seen from the visit's camera.

    Args:
        env: an environment in an episode.
        position: (B, N, 2) metres.
        yaw: (B, N) radians.
    """
    view, belief = env.view, env.world.tracker.belief
    truth, believed, code = view.truth, view.believed, view.truth.category_code
    weights = view.scene.cost_weights
    seen = visible(truth.with_poses(position, yaw), view.camera)
    found = assess(
        seen_at(position, yaw, code, seen),
        known_at(believed.position, believed.yaw, code),
        CostModel(weights.translation / view.scene.diagonal, float(weights.rotation)),
        margins=True,
    )
    wrong = np.tile(belief.wrong, (len(yaw), 1))
    b, i = np.nonzero(seen)
    wrong[b, found.label[b, i]] = found.label[b, i] != i
    counted = truth.movable & np.isfinite(found.margin)
    closeness = 1.0 - np.minimum(np.where(counted, found.margin, MARGIN_SCALE) / MARGIN_SCALE, 1.0)
    return LookAhead(wrong.sum(axis=1), closeness.sum(axis=1) / 2)


def placed(view: TableView, moves: list[Move]) -> tuple[FloatArray, FloatArray]:
    """(N, 2) and (N,) the poses after moves that push nothing and stay on the table."""
    position, yaw = view.truth.position.copy(), view.truth.yaw.copy()
    for move in moves:
        position[move.index] = np.clip(position[move.index] + move.displacement, 0.0, view.size)
        yaw[move.index] += move.turn
    return position, yaw


def effort_of(view: TableView, moves: list[Move]) -> float:
    """The effort of moves, as the rewards count it: metres by the diagonal, radians by half a turn."""
    metres = sum(float(np.linalg.norm(move.displacement)) for move in moves)
    return metres / view.scene.diagonal + sum(abs(move.turn) for move in moves) / float(np.pi)
