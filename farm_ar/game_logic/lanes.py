"""The lanes on which the game's animals leave the shed: a few to each label, worked out once for all who take them."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.game_logic import kernels
from farm_ar.game_logic.paths import clear_curve, door, running_curve
from farm_ar.scenes import Layout

LANES = 5
"""Lanes to each label."""

PATH_SPREAD_M = 0.03
"""How far to the side of one another animals of one colour run, standard deviation."""


class Lanes:
    """Curves from the shed to where each label is believed to be, side by side.

    Args:
        goals: (n,) the labels that send animals.
        shed: the building from whose door they come.
        rng: where the lanes' spread comes from.

    Attributes:
        lane: (n, LANES, `kernels.LANE`) as `kernels.run` wants them.
        table: (n, LANES, 2 `kernels.KNOTS`) their tables of arc length.
    """

    def __init__(self, goals: IntArray, shed: int, rng: np.random.Generator) -> None:
        self._goals, self._shed = goals, shed
        self._spread = PATH_SPREAD_M * rng.normal(size=len(goals) * LANES)
        self.lane = np.zeros((len(goals), LANES, kernels.LANE))
        self.table = np.zeros((len(goals), LANES, 2 * kernels.KNOTS))
        self.lane[..., 0] = goals[:, None]

    def lead_to(self, believed: Layout, table: tuple[float, float]) -> None:
        """Lead to where the labels are believed to be now, past other buildings, on a table of that size."""
        goals, shed = np.repeat(self._goals, LANES), self._shed
        place, turned, size = believed.position, believed.yaw, believed.size
        curve = running_curve(
            door(place[shed], turned[shed], size[shed]),
            turned[shed],
            place[goals],
            turned[goals],
            self._spread,
        )
        curve = clear_curve(curve, goals, place, turned, size, believed.movable, table)
        self.lane[..., 3:] = curve.reshape(len(self._goals), LANES, 8)
        kernels.tabulate(curve, self.table.reshape(-1, 2 * kernels.KNOTS))

    def look_ahead(self, box: FloatArray) -> None:
        """Find out where whoever takes a lane arrives, if buildings stand as in `box`, (N, 8) from `kernels.boxes`."""
        kernels.lanes_end(self.lane, self.table, box)
