"""Policies that act in the environments: random, one constant action, greedy, analytic, CMA-ES."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from farm_ar.agents.policies.analytic import AnalyticPolicy
from farm_ar.agents.policies.base import Episode, Policy, play_episode, play_episodes
from farm_ar.agents.policies.cma_es import CmaPolicy
from farm_ar.agents.policies.constant import ConstantPolicy, best_constant
from farm_ar.agents.policies.greedy import GreedyPolicy
from farm_ar.agents.policies.random import RandomPolicy

POLICIES: dict[str, Callable[[np.random.Generator], Policy]] = {
    "random": RandomPolicy,
    "greedy": GreedyPolicy,
    "analytic": AnalyticPolicy,
    "cma": CmaPolicy,
}
"""The policies that need nothing but a generator, by name."""

__all__ = [
    "POLICIES",
    "AnalyticPolicy",
    "CmaPolicy",
    "ConstantPolicy",
    "Episode",
    "GreedyPolicy",
    "Policy",
    "RandomPolicy",
    "best_constant",
    "play_episode",
    "play_episodes",
]
