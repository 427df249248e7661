"""The attack that does the same in every case."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.attacks.base import Attack, QueryOracle
from farm_ar.envs.table import meeting_order

CONSTANT_SEED = 20251
"""Of the displacements that are tried, the same in every case."""

CONSTANTS = 24
"""How many those are."""


class Constant(Attack):
    """The same few displacements in every case, by place in the camera's order, each at many scales.

    What they reach is reached without looking; the generator is not used.
    """

    def __call__(self, oracle: QueryOracle, rng: np.random.Generator) -> None:
        """See `Attack`."""
        case, layout = oracle.case, oracle.case.layout
        order = meeting_order(case.layout, case.camera)
        order = order[case.in_view[order] & case.layout.movable[order]]
        shared = np.random.default_rng(CONSTANT_SEED)
        for _ in range(CONSTANTS):
            shift, turn = np.zeros((len(layout), 2)), np.zeros(len(layout))
            step = shared.normal(size=(12, 3)) * (shared.random(12) < 0.3)[:, None]
            number = min(12, len(order))
            shift[order[:number]] = 0.1 * case.scene.diagonal * step[:number, :2]
            turn[order[:number]] = 0.3 * step[:number, 2]
            scale = np.linspace(0.0, 2.0, 33)[1:]
            oracle.query(layout.position + scale[:, None, None] * shift, layout.yaw + scale[:, None] * turn)
