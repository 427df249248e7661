"""From what stands on the table to what the game believes: perceive, identify, take over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import BoolArray, IntArray
from farm_ar.game_logic.belief import Belief
from farm_ar.game_logic.perception import OraclePerception, Perception
from farm_ar.reid import Identification, ReidFactory, SpatialReid
from farm_ar.scenes import Camera, Layout, Scene, Snapshot


@dataclass(frozen=True, eq=False)
class Sighting:
    """One snapshot and what became of it.

    Args:
        snapshot: what was seen, K detections.
        identification: the label of each.
        source: (K,) the object that each really is, -1 for a false detection.
        changed: (N,) labels whose believed pose changed.
        accuracy: correct labels as a share of the detections (Eq. 10); 1 where nothing was detected.
    """

    snapshot: Snapshot
    identification: Identification
    source: IntArray
    changed: BoolArray
    accuracy: float


class Tracker:
    """Keeps the belief: the only way from what is true to what is believed is a snapshot.

    Args:
        scene: the room, its sites and weights.
        layout: where everything is at the start, truth and belief alike.
        make_reid: makes the re-identifier for the scene as it is believed to be.
        perception: makes the snapshots.
    """

    def __init__(
        self,
        scene: Scene,
        layout: Layout,
        make_reid: ReidFactory = SpatialReid,
        perception: Perception | None = None,
    ) -> None:
        self.scene = scene
        self.belief = Belief(layout)
        self._make_reid = make_reid
        self._perception = perception or OraclePerception()

    def look(self, truth: Layout, camera: Camera, rng: np.random.Generator) -> Sighting:
        """Take a snapshot, identify what is in it, and believe the answer."""
        perceived = self._perception.perceive(truth, camera, rng)
        believed_scene = self.scene.knowing(self.belief.layout)
        answer = self._make_reid(believed_scene).identify(perceived.snapshot)
        changed = self.belief.read(answer.labels, perceived.snapshot.detections, perceived.source)
        names = [None if i < 0 else truth.labels[i] for i in perceived.source]
        right = [given == real for given, real in zip(answer.labels, names, strict=True)]
        accuracy = sum(right) / len(right) if right else 1.0
        return Sighting(perceived.snapshot, answer, perceived.source, changed, accuracy)
