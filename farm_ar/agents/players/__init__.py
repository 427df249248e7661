"""Players that act in the environments: random, one constant action, greedy, analytic, CMA-ES."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from farm_ar.agents.players.analytic import AnalyticPlayer
from farm_ar.agents.players.constant import ConstantPlayer, best_constant
from farm_ar.agents.players.greedy import GreedyPlayer
from farm_ar.agents.players.player import Episode, Player, play_episode, play_episodes
from farm_ar.agents.players.random import RandomPlayer
from farm_ar.agents.players.searching import CmaPlayer

PLAYERS: dict[str, Callable[[np.random.Generator], Player]] = {
    "random": RandomPlayer,
    "greedy": GreedyPlayer,
    "analytic": AnalyticPlayer,
    "cma": CmaPlayer,
}
"""The players that need nothing but a generator, by name."""

__all__ = [
    "PLAYERS",
    "AnalyticPlayer",
    "CmaPlayer",
    "ConstantPlayer",
    "Episode",
    "GreedyPlayer",
    "Player",
    "RandomPlayer",
    "best_constant",
    "play_episode",
    "play_episodes",
]
