"""A policy that searches its moves by CMA-ES, on what the paper's method would make of them."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from farm_ar.agents.packages import package
from farm_ar.agents.policies.base import Policy, action_of, moves_left, possible
from farm_ar.agents.policies.lookahead import effort_of, look_ahead, placed
from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import Move
from farm_ar.geometry import deepest_overlap

AMBIGUITY_SHARE = 0.5
"""Weight of a unit of ambiguity, a wrong label being 1, so that the search has a slope to follow."""

OVERLAP_PRICE = 20.0
"""What a metre of overlap costs in the search: the hand would push instead."""


class CmaPolicy(Policy):
    """Before every move, searches the moves that are left of the visit, and makes the largest of them.

    Args:
        rng: where the randomness comes from.
        tries: how many sets of moves each search looks at.
    """

    def __init__(self, rng: np.random.Generator, tries: int = 200) -> None:
        self._rng, self._tries = rng, tries

    def act(self, env: FarmToTableEnv) -> Any:
        """The largest move of the best set found, or the whole set; the end of the turn where none pays.

        Raises:
            OptionError: the hand is steered.
            MissingPackageError: the package cma is not installed.
        """
        cma = package("cma")
        view = env.view
        movers: IntArray = view.movable[view.in_view[view.movable]]
        best: tuple[float, list[Move]] = (self._values(env, [[]])[0], [])
        if not movers.size or moves_left(env) == 0:
            return action_of(env, [])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            options = {"seed": int(self._rng.integers(1, 2**31)), "verbose": -9}
            search = cma.CMAEvolutionStrategy(self._rng.normal(0.0, 0.5, 3 * len(movers)), 1.0, options)
            done = 0
            while done < self._tries and not search.stop():
                points = search.ask()
                moves = [self._moves(env, movers, np.asarray(point)) for point in points]
                values = self._values(env, moves)
                search.tell(points, values.tolist())
                done += len(points)
                k = int(np.argmin(values))
                if values[k] < best[0]:
                    best = float(values[k]), moves[k]
        return action_of(env, best[1])

    def _moves(self, env: FarmToTableEnv, movers: IntArray, point: FloatArray) -> list[Move]:
        """The moves of a point of the search, the largest first, as many as are left; small ones are none."""
        values = np.sign(point) * np.maximum(np.abs(point) - 0.5, 0.0)
        steps = values.reshape(len(movers), 3) * [0.1, 0.1, np.pi / 8]
        reach = env.view.scene.diagonal
        wanted = [
            possible(env, Move(int(i), reach * step[:2], float(step[2])))
            for i, step in zip(movers, steps, strict=True)
            if np.any(step)
        ]
        order = np.argsort([-effort_of(env.view, [move]) for move in wanted], kind="stable")
        return [wanted[k] for k in order[: moves_left(env)]]

    def _values(self, env: FarmToTableEnv, plans: list[list[Move]]) -> FloatArray:
        """(B,) what is to be made small: effort and overlaps less the harm, by the environment's weights."""
        view, option = env.view, env.config
        fitted = [env.budget.fitted(moves) for moves in plans]
        poses = [placed(view, moves) for moves in fitted]
        seen = look_ahead(env, np.array([p for p, _ in poses]), np.array([y for _, y in poses]))
        effort = np.array([effort_of(view, moves) for moves in fitted])
        depth = np.array([deepest_overlap(p, y, view.truth.size) for p, y in poses])
        harm = seen.wrong + AMBIGUITY_SHARE * seen.ambiguity
        cost: FloatArray = option.effort_weight * effort + OVERLAP_PRICE * depth - option.sign * harm
        return cost
