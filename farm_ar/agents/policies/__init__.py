"""Policies that act in the environments: random, one constant action, greedy, analytic, CMA-ES."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path

import numpy as np

from farm_ar.agents.policies.analytic import AnalyticPolicy
from farm_ar.agents.policies.base import (
    SHIPPED_ENV,
    Episode,
    Policy,
    play_episode,
    play_episodes,
    shipped,
)
from farm_ar.agents.policies.cma_es import CmaPolicy
from farm_ar.agents.policies.constant import ConstantPolicy, best_constant
from farm_ar.agents.policies.greedy import GreedyPolicy
from farm_ar.agents.policies.random import RandomPolicy
from farm_ar.envs.registration import check_arguments
from farm_ar.errors import InputError, OptionError, known_name
from farm_ar.scenes.files import read_json

POLICIES: dict[str, Callable[[np.random.Generator], Policy]] = {
    "random": RandomPolicy,
    "greedy": GreedyPolicy,
    "analytic": AnalyticPolicy,
    "cma": CmaPolicy,
}
"""The policies that need nothing but a generator, by name."""

CONSTANT = "constant"
"""The policy that always does the same, which is looked for in an environment."""


def check_request(
    runs: Sequence[str], beside: Sequence[str] | None, which: str, arguments: Collection[str] = ()
) -> None:
    """See that a comparison of trained policies with others makes sense, before anything is loaded.

    Args:
        runs: folders of trainings, or names of policies that come with farm-ar.
        beside: names of other policies; None for the usual ones.
        which: "best" or "last" of each run.
        arguments: of the environment, by name.

    Raises:
        OptionError: a name is not known, or a folder is no run's.
        InputError: a run's description cannot be read.
    """
    for name in beside or ():
        known_name("beside", name, (CONSTANT, *POLICIES, *shipped()))
    known_name("which", which, ("best", "last"))
    for run in runs:
        if run not in shipped() and not (Path(run) / "run.json").exists():
            raise OptionError("run", f"must be the folder of a run, or one of {', '.join(shipped())}", run)
        about = {"env": SHIPPED_ENV} if run in shipped() else read_json(Path(run) / "run.json", InputError)
        check_arguments(str(about.get("env")) if isinstance(about, dict) else "", arguments)


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
