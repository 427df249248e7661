"""Attacks on re-identifiers: displacements of a scene's objects after which a snapshot is read wrongly."""

from farm_ar.agents.attacks.analytic import analytic
from farm_ar.agents.attacks.ladder import ladder
from farm_ar.agents.attacks.sampling import constant, halton, random_noise
from farm_ar.agents.attacks.searching import cma_es, greedy, ribs
from farm_ar.agents.attacks.trial import Attack, Failure, Trial, wrong_labels

ATTACKS: dict[str, Attack] = {
    "random": random_noise,
    "halton": halton,
    "constant": constant,
    "greedy": greedy,
    "cma": cma_es,
    "ribs": ribs,
    "analytic": analytic,
    "ladder": ladder,
}
"""The attacks by name, the ladder of them all last."""

__all__ = ["ATTACKS", "Attack", "Failure", "Trial", "wrong_labels"]
