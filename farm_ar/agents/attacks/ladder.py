"""The ladder: every attack in turn within one number of queries, and the least distance of them all."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.attacks.analytic import Analytic
from farm_ar.agents.attacks.base import Attack, QueryOracle
from farm_ar.agents.attacks.boundary_refinement import refine
from farm_ar.agents.attacks.cma_es import CmaEs
from farm_ar.agents.attacks.cma_mae import CmaMae
from farm_ar.agents.attacks.constant import Constant
from farm_ar.agents.attacks.greedy import Greedy
from farm_ar.agents.attacks.halton import Halton
from farm_ar.agents.attacks.planned import Planned
from farm_ar.agents.attacks.random_noise import RandomNoise

RUNGS: tuple[tuple[Attack, float], ...] = (
    (Constant(), 0.03),
    (RandomNoise(), 0.04),
    (Halton(), 0.05),
    (Greedy(), 0.06),
    (CmaMae(), 0.06),
    (CmaEs(), 0.12),
    (Planned(), 0.14),
    (Analytic(), 0.42),
)
"""The attacks and the share of the queries that each may spend; what is left refines the cheapest failure."""


class Ladder(Attack):
    """Run the attacks one after the other, each on what it has for itself, and refine what they found."""

    def __call__(self, oracle: QueryOracle, rng: np.random.Generator) -> None:
        """See `Attack`."""
        whole = oracle.queries
        generators = rng.spawn(len(RUNGS) + 1)
        for (attack, share), own in zip(RUNGS, generators, strict=False):
            oracle.queries = min(whole, oracle.asked + max(1, int(share * whole)))
            attack(oracle, own)
            oracle.refused = 0  # what one attack cannot move, another may
        oracle.queries = whole
        refine(oracle, generators[-1])
