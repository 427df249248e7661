"""What a snapshot would say if the table stood otherwise, by the paper's method, for many tables."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.agents.one_kind import identify_kind
from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.actions import Move
from farm_ar.envs.env import FarmToTableEnv
from farm_ar.envs.table import TableView
from farm_ar.kernels import compiled
from farm_ar.scenes import visible

CLEAR_MARGIN = 0.3
"""The margin from which on a label counts as clear."""


class Foreseen(NamedTuple):
    """What B tables would come to.

    Args:
        wrong: (B,) wrong labels after a snapshot.
        ambiguity: (B,) half the sum over movable objects in view of 1 - margin / 0.3, from 0 to 1 each.
    """

    wrong: IntArray
    ambiguity: FloatArray


def foresee(env: FarmToTableEnv, position: FloatArray, yaw: FloatArray) -> Foreseen:
    """What the paper's method would make of B tables, of which each would be seen from the visit's camera.

    Args:
        env: an environment in an episode.
        position: (B, N, 2) metres.
        yaw: (B, N) radians.
    """
    view, belief = env.view, env.world.tracker.belief
    truth, believed = view.truth, view.believed
    weights = view.scene.cost_weights
    seen = visible(truth.with_poses(position, yaw), view.camera)
    wrong = np.zeros(len(yaw), dtype=np.int64)
    ambiguity = np.zeros(len(yaw))
    _foresee(
        np.ascontiguousarray(position, dtype=np.float64),
        np.ascontiguousarray(yaw, dtype=np.float64),
        seen,
        believed.position,
        believed.yaw,
        truth.category_code,
        truth.movable,
        belief.wrong,
        weights.translation / view.scene.diagonal,
        weights.rotation,
        wrong,
        ambiguity,
    )
    return Foreseen(wrong, ambiguity)


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


@compiled
def _foresee(
    position: FloatArray,
    yaw: FloatArray,
    seen: BoolArray,
    label_position: FloatArray,
    label_yaw: FloatArray,
    category: IntArray,
    movable: BoolArray,
    wrong_before: BoolArray,
    translation_weight: float,
    rotation_weight: float,
    wrong: IntArray,
    ambiguity: FloatArray,
) -> None:
    """Fill in `wrong` and `ambiguity`; the other arguments are those of `foresee`, category by category."""
    n = len(category)
    wrong_now = np.empty(n, dtype=np.bool_)
    for b in range(len(yaw)):
        wrong_now[:] = wrong_before
        for code in range(category.max() + 1):
            found, label, margin = identify_kind(
                code,
                category,
                seen[b],
                position[b],
                yaw[b],
                label_position,
                label_yaw,
                translation_weight,
                rotation_weight,
            )
            for x in range(len(found)):
                i = found[x]
                wrong_now[label[x]] = label[x] != i
                if movable[i] and np.isfinite(margin[x]):
                    ambiguity[b] += (1.0 - min(margin[x] / CLEAR_MARGIN, 1.0)) / 2
        for i in range(n):
            wrong[b] += wrong_now[i]
