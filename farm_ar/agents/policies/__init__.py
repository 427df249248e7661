"""Policies that act in the environments: random, one constant action, greedy, analytic, CMA-ES."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from farm_ar.agents.policies.analytic import AnalyticPolicy
from farm_ar.agents.policies.base import Episode, Policy, play_episode, play_episodes, shipped
from farm_ar.agents.policies.cma_es import CmaPolicy
from farm_ar.agents.policies.constant import ConstantPolicy, best_constant
from farm_ar.agents.policies.greedy import GreedyPolicy
from farm_ar.agents.policies.random import RandomPolicy
from farm_ar.errors import OptionError, known_name

POLICIES: dict[str, Callable[[np.random.Generator], Policy]] = {
    "random": RandomPolicy,
    "greedy": GreedyPolicy,
    "analytic": AnalyticPolicy,
    "cma": CmaPolicy,
}
"""The policies that need nothing but a generator, by name."""

CONSTANT = "constant"
"""The policy that always does the same, which is looked for in an environment."""


def check_request(runs: Sequence[str], beside: Sequence[str] | None, which: str) -> None:
    """See that a comparison of trained policies with others makes sense, before anything is loaded.

    Args:
        runs: folders of trainings, or names of policies that come with farm-ar.
        beside: names of other policies; None for the usual ones.
        which: "best" or "last" of each run.

    Raises:
        OptionError: a name is not known, or a folder is no run's.
    """
    for name in beside or ():
        known_name("beside", name, (CONSTANT, *POLICIES, *shipped()))
    known_name("which", which, ("best", "last"))
    for run in runs:
        if run not in shipped() and not (Path(run) / "run.json").exists():
            raise OptionError("run", f"must be the folder of a run, or one of {', '.join(shipped())}", run)


__all__ = [
    "CONSTANT",
    "POLICIES",
    "AnalyticPolicy",
    "CmaPolicy",
    "ConstantPolicy",
    "Episode",
    "GreedyPolicy",
    "Policy",
    "RandomPolicy",
    "best_constant",
    "check_request",
    "play_episode",
    "play_episodes",
    "shipped",
]
