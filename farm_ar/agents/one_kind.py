"""The objects of one category: what the labels cost, which are given, and by what margin."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.kernels import assign_most
from farm_ar.reid.margins import find_margins


@compiled
def identify_kind(
    code: int,
    category: IntArray,
    seen: BoolArray,
    position: FloatArray,
    yaw: FloatArray,
    label_position: FloatArray,
    label_yaw: FloatArray,
    translation_weight: float,
    rotation_weight: float,
) -> tuple[IntArray, IntArray, FloatArray]:
    """Give the objects of a category that are seen labels of that category, at the least cost (Eqs. 4, 5, 7).

    Args:
        code: the category.
        category: (M,) of each object, whose own label has the same number.
        seen: (M,) objects that are detected.
        position: (M, 2) where they are, metres.
        yaw: (M,) how they are turned, radians.
        label_position: (M, 2) where the labels are believed to be, metres.
        label_yaw: (M,) how these are turned, radians.
        translation_weight: cost of a metre.
        rotation_weight: cost of sin(turn / 2).

    Returns:
        (N,) the objects; (N,) the label that each is given; (N,) its margin, as in `find_margins`.
    """
    rows, columns = np.flatnonzero(seen & (category == code)), np.flatnonzero(category == code)
    cost = np.empty((len(rows), len(columns)))
    for x in range(len(rows)):
        i = rows[x]
        for y in range(len(columns)):
            j = columns[y]
            dx = position[i, 0] - label_position[j, 0]
            dz = position[i, 1] - label_position[j, 1]
            turn = abs(np.sin((yaw[i] - label_yaw[j]) / 2))
            cost[x, y] = translation_weight * np.sqrt(dx * dx + dz * dz) + rotation_weight * turn
    column_of = np.empty(len(rows), dtype=np.int64)
    if len(rows) == 0:
        return rows, column_of, np.empty(0)
    assign_most(cost, column_of, np.empty(len(rows)), np.empty(len(rows) + len(columns)))
    return rows, columns[column_of], find_margins(cost, column_of)[0]
