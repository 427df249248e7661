"""What the compiled method works in: made once, and used again for every snapshot and every kind."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled


class Workspace(NamedTuple):
    """Room for a problem of N rows (detections) and M columns (labels), arrays as long as needed or longer.

    Args:
        row_of: by column, as the solver has it.
        previous: likewise.
        order: likewise.
        taken: by column, 1 where a row has it.
        column_of: by row, the solver's answer; -1 for none.
        nearest: by row, the free column that is best for it.
        placed: the rows that have a column.
        runner_up: by row, the column that it has in the best assignment without its own.
        rows: the detections of a problem.
        columns: its labels.
        chosen: labels that are candidates.
        every: from 0 on.
        detected: of each category, those of none last.
        offered: likewise, labels.
        changed: objects that are not as they were, 1 where so.
        changed_kinds: of each category, likewise.
        site_order: sites, the likeliest first.
        site_rank: of each site in that order.
        distance: by column, as the solver has it.
        row_dual: of the solver.
        column_dual: likewise.
        margin: by row, the rise of the cost when it gives up its column.
        dimension: by size, the factor of the dimension cost.
        half_sine: by label, of half its yaw.
        half_cosine: likewise.
        cost: (N M,) of a problem.
        paths: (2, N + 2, N + 2) lengths of paths from row to row; (2, 0, 0) where margins are not needed.
    """

    row_of: IntArray
    previous: IntArray
    order: IntArray
    taken: IntArray
    column_of: IntArray
    nearest: IntArray
    placed: IntArray
    runner_up: IntArray
    rows: IntArray
    columns: IntArray
    chosen: IntArray
    every: IntArray
    detected: IntArray
    offered: IntArray
    changed: IntArray
    changed_kinds: IntArray
    site_order: IntArray
    site_rank: IntArray
    distance: FloatArray
    row_dual: FloatArray
    column_dual: FloatArray
    margin: FloatArray
    dimension: FloatArray
    half_sine: FloatArray
    half_cosine: FloatArray
    cost: FloatArray
    paths: FloatArray


@compiled(inline="always")
def workspace_for(n: int, m: int, margins: bool, others: int) -> Workspace:
    """Room for n rows and m columns.

    Args:
        n: rows.
        m: columns.
        margins: whether there is to be room for what margins take.
        others: the most categories, sizes or sites.
    """
    width = max(n + m, others + 1)
    ints, floats = np.empty((18, width), dtype=np.int64), np.empty((7, width))
    nodes = n + 2 if margins else 0
    for k in range(width):
        ints[11, k] = k
    return Workspace(
        ints[0],
        ints[1],
        ints[2],
        ints[3],
        ints[4],
        ints[5],
        ints[6],
        ints[7],
        ints[8],
        ints[9],
        ints[10],
        ints[11],
        ints[12],
        ints[13],
        ints[14],
        ints[15],
        ints[16],
        ints[17],
        floats[0],
        floats[1],
        floats[2],
        floats[3],
        floats[4],
        floats[5],
        floats[6],
        np.empty(n * m),
        np.empty((2, nodes, nodes)),
    )
