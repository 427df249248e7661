"""The attack that knows the paper's cost: each error in turn, at its cheapest."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.attacks.components import cheapest_components
from farm_ar.agents.attacks.crafting import Crafted, craft, room_of
from farm_ar.agents.attacks.refining import refine
from farm_ar.agents.attacks.surrogate import model_of
from farm_ar.agents.attacks.trial import Trial

COMPONENTS = 60
"""Errors that are looked at."""

STEPS = 2500
"""Children in the search of each."""

MARGINS = (1.0, 1.03, 1.1, 1.3, 1.6)
"""How far a crafted displacement is carried on, for rules that need more than the paper's."""


def analytic(trial: Trial, rng: np.random.Generator) -> None:
    """Craft the cheapest displacements for pairs, short cycles and paths; ask; refine the cheapest failure.

    Crafting needs no queries, being arithmetic on the paper's cost (T2, T3, T5); what it promises is asked of
    the re-identifier at hand, which may be another.
    """
    crafted = craft_all(trial, rng)
    for one in crafted:
        if trial.left <= 0 or (trial.cheapest is not None and one.effort >= trial.least):
            break
        home, home_yaw = trial.case.layout.position, trial.case.layout.yaw
        scale = np.array(MARGINS)
        position = home + scale[:, None, None] * (one.position - home)
        trial.ask(position, home_yaw + scale[:, None] * (one.yaw - home_yaw))
    refine(trial, rng)


def craft_all(trial: Trial, rng: np.random.Generator) -> list[Crafted]:
    """The crafted displacements of the cheapest errors, cheapest first, without hopelessly dear ones."""
    case = trial.case
    model = model_of(trial)
    room = room_of(case, model)
    found: list[Crafted] = []
    least = trial.budget
    for component in cheapest_components(case, model, COMPONENTS):
        if component.guess > 1.02 * least and len(found) > 3:
            break
        one = craft(case, room, component, rng, STEPS)
        if one.effort <= trial.budget:
            found.append(one)
            least = min(least, one.effort)
    return sorted(found, key=lambda one: one.effort)
