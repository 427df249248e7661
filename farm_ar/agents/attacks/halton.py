"""The attack by a quasi-random sequence."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm, qmc

from farm_ar.agents.attacks.base import Attack, QueryOracle
from farm_ar.agents.attacks.displacements import BATCH, query_scaled


class Halton(Attack):
    """Displacements of one to three objects in view, spread evenly by a scrambled Halton sequence."""

    def __call__(self, oracle: QueryOracle, rng: np.random.Generator) -> None:
        """See `Attack`."""
        case, layout = oracle.case, oracle.case.layout
        seen = np.flatnonzero(case.in_view & layout.movable)
        sequence = qmc.Halton(13, seed=rng)
        while oracle.left > 0 and seen.size:
            values = sequence.random(BATCH)
            shift, turn = np.zeros((BATCH, len(layout), 2)), np.zeros((BATCH, len(layout)))
            number = 1 + np.floor(3 * values[:, 12]).astype(np.int64)
            for k in range(3):
                mover = seen[np.floor(values[:, 4 * k] * len(seen)).astype(np.int64)]
                row = np.flatnonzero(number > k)
                step = norm.ppf(np.clip(values[:, 4 * k + 1 : 4 * k + 4], 1e-6, 1 - 1e-6))
                shift[row, mover[row]] = 0.1 * case.scene.diagonal * step[row, :2]
                turn[row, mover[row]] = 0.3 * step[row, 2]
            if not query_scaled(oracle, shift, turn, values[:, 11]):
                return
