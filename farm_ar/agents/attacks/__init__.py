"""Attacks on re-identifiers: displacements of a scene's objects after which a snapshot is read wrongly."""

from farm_ar.agents.attacks.analytic import analytic
from farm_ar.agents.attacks.ladder import ladder
from farm_ar.agents.attacks.learned import Learned
from farm_ar.agents.attacks.planned import planned
from farm_ar.agents.attacks.sampling import constant, halton, random_noise
from farm_ar.agents.attacks.searching import cma_es, greedy, ribs
from farm_ar.agents.attacks.trial import Attack, Failure, Trial, wrong_labels
from farm_ar.errors import known_name

ATTACKS: dict[str, Attack] = {
    "random": random_noise,
    "halton": halton,
    "constant": constant,
    "greedy": greedy,
    "cma": cma_es,
    "ribs": ribs,
    "planned": planned,
    "analytic": analytic,
    "ladder": ladder,
}
"""The attacks that need nothing but a trial, by name, the ladder of them all last."""

LEARNED = "learned"
"""The attack of trained players: those that come with farm-ar, or after a colon the folder of a run."""


def attack_named(name: str) -> Attack:
    """An attack by name: one of `ATTACKS`, `learned`, or `learned:RUN`.

    Raises:
        OptionError: there is no such attack.
    """
    kind, _, run = name.partition(":")
    if kind == LEARNED:
        return Learned((run,)) if run else Learned()
    return ATTACKS[known_name("attack", name, (*ATTACKS, LEARNED))]


__all__ = ["ATTACKS", "LEARNED", "Attack", "Failure", "Learned", "Trial", "attack_named", "wrong_labels"]
