"""A re-identifier of your own in the game's headset, beside the paper's, against random actions."""

import gymnasium as gym
import numpy as np

from farm_ar.reid import Identification
from farm_ar.scenes import Scene, Snapshot


class LeftToRightReid:
    """Gives the labels of each category from left to right, in the order of the reference layout."""

    def __init__(self, scene: Scene) -> None:
        self.layout = scene.layout

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection, with the distance in metres as its cost."""
        seen, before = snapshot.detections, self.layout
        distance = np.linalg.norm(seen.position[:, None] - before.position, axis=-1)
        labels: list[str | None] = [None] * len(seen)
        cost = np.full(len(seen), np.nan)
        for category in set(seen.category) & set(before.category):
            rows = np.flatnonzero([name == category for name in seen.category])
            columns = np.flatnonzero([name == category for name in before.category])
            nearest = columns[np.argsort(distance[rows][:, columns].min(axis=0))[: len(rows)]]
            rows = rows[np.argsort(seen.position[rows, 0])]
            for i, j in zip(rows, nearest[np.argsort(before.position[nearest, 0])], strict=False):
                labels[i], cost[i] = before.labels[j], distance[i, j]
        return Identification(tuple(labels), cost, before.labels)


EPISODES = 40
headsets = {"spatial": "spatial", "left to right": LeftToRightReid}

print(f"{EPISODES} episodes with each headset; the policy takes the same random actions.")
print(f"{'headset':14} {'accuracy':>9} {'wrong labels':>13} {'return of the policy':>21}")
for name, reid in headsets.items():
    env = gym.make("farm_ar:FarmToTable-v0", reid=reid, jitter="easy", play_seconds=0.0)
    env.action_space.seed(0)
    parts = np.cumsum(env.action_space.nvec)[:-1]
    results = []
    for seed in range(EPISODES):
        env.reset(seed=seed)
        total, over = 0.0, False
        while not over:
            mask = env.unwrapped.action_masks().astype(np.int8)
            action = env.action_space.sample(mask=tuple(np.split(mask, parts)))
            _, reward, over, _, info = env.step(action)
            total += reward
        results.append((info["accuracy"], info["wrong_labels"], total))
    accuracy, wrong, mean_return = np.mean(results, axis=0)
    print(f"{name:14} {accuracy:9.2f} {wrong:13.2f} {mean_return:21.2f}")
