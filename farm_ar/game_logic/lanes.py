"""The lanes on which the game's animals leave the shed: a few to each label, worked out once."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.game_logic import dodging, running
from farm_ar.game_logic.paths import SHAPE, bows
from farm_ar.scenes import Layout

LANES = 4
"""Lanes to each label."""

PATH_SPREAD_M = 0.03
"""How far to the side of one another animals of one colour run, standard deviation."""


@lru_cache(maxsize=16)
def _room(table: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """How far curves may bow out on a table of that size, and the size; not to be written to."""
    return bows(table), np.array(table, dtype=np.float64)


class Lanes:
    """Curves from the shed to where each label is believed to be, side by side.

    Args:
        goals: (n,) the labels that send animals.
        shed: the building from whose door they come.
        rng: where the lanes' spread comes from.

    Attributes:
        lane: (n, LANES, `dodging.LANE`) as `running.run` wants them.
    """

    def __init__(self, goals: IntArray, shed: int, rng: np.random.Generator) -> None:
        self._shed = shed
        self._spread = PATH_SPREAD_M * rng.normal(size=(len(goals), LANES))
        self.lane = np.zeros((len(goals), LANES, dodging.LANE))
        self.lane[..., 0] = goals[:, None]

    def lead_to(self, believed: Layout, table: tuple[float, float]) -> None:
        """Lead to where the labels are believed to be now, past other buildings, on a table of that size."""
        dodging.lead(
            self.lane,
            self._spread,
            self._shed,
            # Copies, because read-only arrays would have the kernel compiled once more.
            believed.position.copy(),
            believed.yaw.copy(),
            believed.size.copy(),
            believed.movable.copy(),
            SHAPE,
            *_room(table),
        )

    def look_ahead(self, box: FloatArray) -> None:
        """Find out where lanes end, if buildings stand as in `box`, (N, 8) from `entering.boxes`."""
        running.lanes_end(self.lane, box)
