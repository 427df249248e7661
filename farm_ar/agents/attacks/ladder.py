"""The ladder: every attack in turn within one number of queries, and the least effort of them all."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.attacks.analytic import analytic
from farm_ar.agents.attacks.planned import planned
from farm_ar.agents.attacks.refining import refine
from farm_ar.agents.attacks.sampling import constant, halton, random_noise
from farm_ar.agents.attacks.searching import cma_es, greedy, ribs
from farm_ar.agents.attacks.trial import Attack, Trial

RUNGS: tuple[tuple[Attack, float], ...] = (
    (constant, 0.03),
    (random_noise, 0.04),
    (halton, 0.05),
    (greedy, 0.06),
    (ribs, 0.06),
    (cma_es, 0.12),
    (planned, 0.14),
    (analytic, 0.42),
)
"""The attacks and the share of the queries that each may spend; what is left refines the cheapest failure."""


def ladder(trial: Trial, rng: np.random.Generator) -> None:
    """Run the attacks one after the other, each on what it has for itself, and refine what they found."""
    whole = trial.queries
    generators = rng.spawn(len(RUNGS) + 1)
    for (attack, share), own in zip(RUNGS, generators, strict=False):
        trial.queries = min(whole, trial.asked + max(1, int(share * whole)))
        attack(trial, own)
        trial.refused = 0  # what one attack cannot move, another may
    trial.queries = whole
    refine(trial, generators[-1])
