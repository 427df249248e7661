"""The objects of one category: what the labels cost, which are given, and by what margin."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import assign_most, find_margins, pose_cost


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
            at, turned = label_position[j], label_yaw[j]
            cost[x, y] = pose_cost(
                position[i, 0], position[i, 1], yaw[i], at, turned, translation_weight, rotation_weight
            )
    column_of = np.empty(len(rows), dtype=np.int64)
    if len(rows) == 0:
        return rows, column_of, np.empty(0)
    assign_most(cost, column_of, np.empty(len(rows)), np.empty(len(rows) + len(columns)))
    return rows, columns[column_of], find_margins(cost, column_of)[0]
