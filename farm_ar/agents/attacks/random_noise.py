"""The attack by the paper's noise."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.attacks.base import Attack, QueryOracle
from farm_ar.agents.attacks.displacements import BATCH, query_scaled


class RandomNoise(Attack):
    """The paper's noise on all objects, T and R drawn anew each time, scaled below the least so far."""

    def __call__(self, oracle: QueryOracle, rng: np.random.Generator) -> None:
        """See `Attack`."""
        layout, scene = oracle.case.layout, oracle.case.scene
        while oracle.left > 0:
            shape = (BATCH, len(layout))
            sd = np.exp(rng.uniform(np.log(0.002), np.log(0.3), (2, BATCH, 1)))
            shift = sd[0, ..., None] * scene.diagonal * rng.normal(size=(*shape, 2))
            turn = sd[1] * np.pi * rng.normal(size=shape)
            if not query_scaled(oracle, shift, turn, rng.random(BATCH)):
                return
