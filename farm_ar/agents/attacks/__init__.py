"""Attacks on re-identifiers: displacements of a scene's objects after which a snapshot is read wrongly."""

from farm_ar.agents.attacks.analytic import Analytic
from farm_ar.agents.attacks.base import Attack, Failure, QueryOracle, wrong_labels
from farm_ar.agents.attacks.cma_es import CmaEs
from farm_ar.agents.attacks.cma_mae import CmaMae
from farm_ar.agents.attacks.constant import Constant
from farm_ar.agents.attacks.greedy import Greedy
from farm_ar.agents.attacks.halton import Halton
from farm_ar.agents.attacks.ladder import Ladder
from farm_ar.agents.attacks.learned import Learned
from farm_ar.agents.attacks.planned import Planned
from farm_ar.agents.attacks.random_noise import RandomNoise
from farm_ar.errors import known_name

ATTACKS: dict[str, Attack] = {
    "random": RandomNoise(),
    "halton": Halton(),
    "constant": Constant(),
    "greedy": Greedy(),
    "cma": CmaEs(),
    "ribs": CmaMae(),
    "planned": Planned(),
    "analytic": Analytic(),
    "ladder": Ladder(),
}
"""The attacks that need nothing but an oracle, by name, the ladder of them all last."""

LEARNED = "learned"
"""The attack of trained policies: those that come with farm-ar, or after a colon the folder of a run."""

TRUSTED = "learned-trusted"
"""The same of a run whose code is trusted (pickles of an older version); a folder follows always."""


def attack_named(name: str) -> Attack:
    """An attack by name: one of `ATTACKS`, `learned`, `learned:RUN`, or `learned-trusted:RUN`.

    Raises:
        OptionError: there is no such attack.
    """
    kind, _, run = name.partition(":")
    if kind == LEARNED:
        return Learned((run,)) if run else Learned()
    if kind == TRUSTED and run:
        return Learned((run,), trust=True)
    return ATTACKS[known_name("attack", name, (*ATTACKS, LEARNED))]


__all__ = [
    "ATTACKS",
    "LEARNED",
    "TRUSTED",
    "Analytic",
    "Attack",
    "CmaEs",
    "CmaMae",
    "Constant",
    "Failure",
    "Greedy",
    "Halton",
    "Ladder",
    "Learned",
    "Planned",
    "QueryOracle",
    "RandomNoise",
    "attack_named",
    "wrong_labels",
]
