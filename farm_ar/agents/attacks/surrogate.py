"""How near the paper's rule is to an error, as a number that falls before anything is wrong; for searches."""

from __future__ import annotations

import numba
import numpy as np

from farm_ar.agents.attacks.trial import Trial
from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.reid.kernels import assign_most
from farm_ar.reid.margins import find_margins
from farm_ar.scenes import Weights, visible


def weights_of(trial: Trial) -> Weights:
    """The weights of the costs that the re-identifier uses, if it says so; the scene's otherwise."""
    weights = getattr(trial.reid, "weights", None)
    return weights if isinstance(weights, Weights) else trial.case.scene.cost_weights


def least_margins(trial: Trial, position: FloatArray, yaw: FloatArray) -> FloatArray:
    """(B,) the least by which giving a detection its own label beats giving it another; 0 when it does not.

    By the paper's cost, kind by kind, which is arithmetic and no query: white-box for the paper's rule, and a
    guess for any other.

    Args:
        trial: whose case and re-identifier.
        position: (B, N, 2) metres.
        yaw: (B, N) radians.
    """
    case, layout, weights = trial.case, trial.case.layout, weights_of(trial)
    result = np.ones(len(yaw))
    _least_margins(
        np.ascontiguousarray(position),
        np.ascontiguousarray(yaw),
        visible(layout.with_poses(position, yaw), case.camera),
        layout.position,
        layout.yaw,
        layout.category_code,
        weights.translation / case.scene.diagonal,
        weights.rotation,
        result,
    )
    return result


@numba.njit(cache=True, nogil=True)
def _least_margins(
    position: FloatArray,
    yaw: FloatArray,
    seen: BoolArray,
    label_position: FloatArray,
    label_yaw: FloatArray,
    category: IntArray,
    way_weight: float,
    turn_weight: float,
    result: FloatArray,
) -> None:
    """Fill in the result, (B,), which holds ones."""
    n = len(category)
    rows, columns = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    for b in range(len(yaw)):
        for code in range(category.max() + 1):
            r, c = 0, 0
            for i in range(n):
                if category[i] == code:
                    columns[c] = i
                    c += 1
                    if seen[b, i]:
                        rows[r] = i
                        r += 1
            if r == 0:
                continue
            cost = np.empty((r, c))
            for x in range(r):
                for y in range(c):
                    i, j = rows[x], columns[y]
                    dx = position[b, i, 0] - label_position[j, 0]
                    dz = position[b, i, 1] - label_position[j, 1]
                    turn = abs(np.sin((yaw[b, i] - label_yaw[j]) / 2))
                    cost[x, y] = way_weight * np.sqrt(dx * dx + dz * dz) + turn_weight * turn
            column_of = np.empty(r, dtype=np.int64)
            assign_most(cost, column_of, np.empty(r), np.empty(r + c))
            margin = find_margins(cost, column_of)[0]
            for x in range(r):
                own = columns[column_of[x]] == rows[x]
                result[b] = min(result[b], margin[x] if own else 0.0)
