"""How small a displacement makes a re-identifier of your own give wrong labels.

The same from the command line, with a report on one page:
farm-ar stress --scene lab --compare spatial,mypackage.module:MyReid
"""

from collections.abc import Callable

import numpy as np

from farm_ar.agents.attacks import ATTACKS, QueryOracle
from farm_ar.agents.cases import draw_case
from farm_ar.agents.certificates import lower_bound
from farm_ar.reid import Identification, Reidentifier, SpatialReid
from farm_ar.scenes import Scene, Snapshot, builtin_scene


class GreedyReid:
    """Gives each detection, from left to right, the nearest label that is still free."""

    def __init__(self, scene: Scene) -> None:
        self.layout = scene.layout

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection, with the distance in metres as its cost."""
        free, labels, cost = list(range(len(self.layout))), [], []
        for place in snapshot.detections.position:
            away = np.linalg.norm(self.layout.position - place, axis=1)
            nearest = min(free, key=away.__getitem__)
            free.remove(nearest)
            labels.append(self.layout.labels[nearest])
            cost.append(away[nearest])
        return Identification(tuple(labels), np.array(cost), self.layout.labels)


def main() -> None:
    scene = builtin_scene("lab")
    methods: dict[str, Callable[[Scene], Reidentifier]] = {
        "the paper's": SpatialReid,
        "my own": GreedyReid,
    }
    for name, make in methods.items():
        for number in range(2):
            case = draw_case(scene, number, seed=0)
            reid = make(case.scene)
            oracle = QueryOracle(case, reid, queries=400, budget=1.0)
            ATTACKS["analytic"](oracle, np.random.default_rng(number))
            bound = lower_bound(case, reid)
            certified = "no certificate" if bound.theorem == "none" else f"certified {bound.total:.4f}"
            print(f"{name}, case {number}: least D {oracle.least:.4f}, {certified}")


if __name__ == "__main__":
    main()
