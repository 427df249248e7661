"""A re-identifier of your own is a class with `identify`; here it stands beside the paper's method.

In this folder, `farm-ar stress --reid your_own_reidentifier:GreedyReid` measures how little defeats it.
"""

import numpy as np

from farm_ar.reid import Identification, Reidentifier, SpatialReid, accuracy
from farm_ar.scenes import LayoutNoise, Scene, Snapshot, builtin_scene, observe


class GreedyReid:
    """The closest pair of a detection and a label is taken first, then the closest of what is left."""

    def __init__(self, scene: Scene) -> None:
        self.layout = scene.layout

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection, with the distance in metres as its cost."""
        seen = snapshot.detections
        distance = np.linalg.norm(seen.position[:, None] - self.layout.position, axis=-1)
        labels: list[str | None] = [None] * len(seen)
        cost = np.full(len(seen), np.nan)
        left = distance.copy()
        for _ in range(min(left.shape)):
            i, j = np.unravel_index(left.argmin(), left.shape)
            labels[i], cost[i] = self.layout.labels[j], distance[i, j]
            left[i, :] = left[:, j] = np.inf
        return Identification(tuple(labels), cost, self.layout.labels)


def main() -> None:
    scene = builtin_scene("M1")
    methods: dict[str, Reidentifier] = {"greedy": GreedyReid(scene), "spatial": SpatialReid(scene)}
    cameras = scene.camera_path.cameras(40, scene.fov)
    rng = np.random.default_rng(0)

    print(f"Mean accuracy in {scene.name}, over 10 layouts seen from 40 places, for each translation noise:")
    print("".join(f"{heading:>10}" for heading in ("SD, m", *methods)))
    for sd in (0.1, 0.3, 0.5):
        noise = LayoutNoise.of(translation_sd=sd, rotation_sd_deg=20)
        scores: dict[str, list[float]] = {name: [] for name in methods}
        for _ in range(10):
            layout = noise.disturb(scene.layout, scene.size, rng)
            for i in range(40):
                snapshot, truth = observe(layout, cameras.at(i))
                for name, method in methods.items():
                    scores[name].append(accuracy(method.identify(snapshot), truth))
        print(f"{sd:10}" + "".join(f"{np.nanmean(score):10.2f}" for score in scores.values()))


if __name__ == "__main__":
    main()
