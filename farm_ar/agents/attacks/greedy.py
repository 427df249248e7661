"""The attack by the best small step, again and again."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.attacks.base import Attack, QueryOracle
from farm_ar.agents.attacks.cost_model import least_margins
from farm_ar.agents.attacks.displacements import search_objects


class Greedy(Attack):
    """Again and again the small displacement of one object that brings the method nearest to an error.

    When something is wrong, it begins anew from the untouched table with other small displacements.
    """

    def __call__(self, oracle: QueryOracle, rng: np.random.Generator) -> None:
        """See `Attack`."""
        layout, scene = oracle.case.layout, oracle.case.scene
        movers = search_objects(oracle)
        while oracle.left > 0 and movers.size:
            position, yaw = layout.position.copy(), layout.yaw.copy()
            step = float(rng.uniform(0.005, 0.06))
            value, before = np.inf, oracle.asked
            for _ in range(25):
                tries = np.repeat(movers, 8)
                angle = rng.uniform(0, 2 * np.pi, len(tries))
                next_position = np.repeat(position[None], len(tries), axis=0)
                next_yaw = np.repeat(yaw[None], len(tries), axis=0)
                each = np.arange(len(tries))
                way = step * scene.diagonal * np.stack([np.sin(angle), np.cos(angle)], axis=1)
                next_position[each, tries] += way
                next_yaw[each, tries] += step * rng.normal(size=len(tries))
                fits = np.flatnonzero(oracle.allowed(next_position, next_yaw))
                if not fits.size or oracle.distance(position[None], yaw[None])[0] >= oracle.least:
                    break
                margin = least_margins(oracle, next_position[fits], next_yaw[fits])
                best = int(np.argmin(margin))
                if margin[best] >= value:
                    break
                value = float(margin[best])
                position, yaw = next_position[fits[best]], next_yaw[fits[best]]
                if oracle.query(position[None], yaw[None])[0] > 0:
                    break
            if oracle.asked == before:
                return
