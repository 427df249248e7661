"""The attack by covariance matrix adaptation (CMA-ES)."""

from __future__ import annotations

import warnings

import numpy as np

from farm_ar.agents.attacks.base import NOT_ASKED, Attack, QueryOracle
from farm_ar.agents.attacks.cost_model import least_margins
from farm_ar.agents.attacks.displacements import NOT_ALLOWED, displaced, search_objects
from farm_ar.agents.packages import package
from farm_ar.arrays import FloatArray, IntArray


class CmaEs(Attack):
    """CMA-ES on the displacements of the objects in view, begun anew when it has converged."""

    def __call__(self, oracle: QueryOracle, rng: np.random.Generator) -> None:
        """See `Attack`.

        Raises:
            MissingPackageError: the package cma is not installed.
        """
        cma = package("cma")
        movers = search_objects(oracle)
        while oracle.left > 0 and movers.size:
            options = {"seed": int(rng.integers(1, 2**31)), "verbose": -9, "maxfevals": 20 * oracle.left}
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                search = cma.CMAEvolutionStrategy(rng.normal(0.0, 0.5, 3 * len(movers)), 1.0, options)
                stale = 0
                while oracle.left > 0 and not search.stop() and stale < 20:
                    asked = oracle.asked
                    points = search.ask()
                    search.tell(points, _values(oracle, movers, np.array(points)).tolist())
                    stale = stale + 1 if oracle.asked == asked else 0
            if stale >= 20:
                return


def _values(oracle: QueryOracle, movers: IntArray, points: FloatArray) -> FloatArray:
    """(B,) what CMA-ES makes small: the distance of a failure; 2 + the margin of what is none."""
    position, yaw = displaced(oracle, movers, points)
    wrong = oracle.query(position, yaw)
    distance = oracle.distance(position, yaw)
    margin = least_margins(oracle, position, yaw)
    clear = 2.0 + margin + 0.1 * distance
    return np.where(wrong == NOT_ASKED, NOT_ALLOWED + distance, np.where(wrong > 0, distance, clear))
