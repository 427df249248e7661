"""The attack that looks for many different failures (CMA-MAE)."""

from __future__ import annotations

import warnings

import numpy as np

from farm_ar.agents.attacks.base import DISTANCE_BINS, NOT_ASKED, WRONG_BINS, Attack, QueryOracle
from farm_ar.agents.attacks.cost_model import least_margins
from farm_ar.agents.attacks.displacements import NOT_ALLOWED, displaced, search_objects
from farm_ar.agents.packages import package


class CmaMae(Attack):
    """CMA-MAE: an archive of failures by wrong labels and distance, filled by evolution strategies."""

    def __call__(self, oracle: QueryOracle, rng: np.random.Generator) -> None:
        """See `Attack`.

        Raises:
            MissingPackageError: the package ribs is not installed.
        """
        archives, emitters, schedulers = (
            package(f"ribs.{name}") for name in ("archives", "emitters", "schedulers")
        )
        movers = search_objects(oracle)
        if not movers.size:
            return
        dimension = 3 * len(movers)
        seeds = [int(s) for s in rng.integers(1, 2**31, 4)]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            archive = archives.GridArchive(
                solution_dim=dimension,
                dims=(WRONG_BINS, DISTANCE_BINS),
                ranges=[(0.0, float(WRONG_BINS)), (0.0, oracle.budget)],
                learning_rate=0.1,
                threshold_min=-NOT_ALLOWED - 1,
                seed=seeds[0],
            )
            parts = [
                emitters.EvolutionStrategyEmitter(
                    archive,
                    x0=np.zeros(dimension),
                    sigma0=0.6,
                    ranker="imp",
                    restart_rule="basic",
                    batch_size=16,
                    seed=seed,
                )
                for seed in seeds[1:]
            ]
            scheduler = schedulers.Scheduler(archive, parts)
            stale = 0
            while oracle.left > 0 and stale < 50:
                asked = oracle.asked
                points = scheduler.ask()
                position, yaw = displaced(oracle, movers, points)
                wrong = oracle.query(position, yaw)
                distance = oracle.distance(position, yaw)
                margin = least_margins(oracle, position, yaw)
                worth = np.where(wrong == NOT_ASKED, -NOT_ALLOWED, -margin - distance)
                measures = np.stack([np.maximum(wrong, 0), np.minimum(distance, oracle.budget)], axis=1)
                scheduler.tell(worth, measures)
                stale = stale + 1 if oracle.asked == asked else 0
