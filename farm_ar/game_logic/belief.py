"""What the game believes: where each label is, and how a snapshot changes that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray, read_only
from farm_ar.game_logic.perception import OraclePerception, Perception
from farm_ar.geometry import wrap
from farm_ar.reid import Identification, ReidFactory, SpatialReid
from farm_ar.scenes import Camera, Detections, Layout, Scene, Snapshot

SAME = 1e-9
"""Metres or radians within which a pose has not changed."""

NOBODY = -1
"""The holder of a label whose believed pose was read from something that is no object at all."""


class Belief:
    """Where the game thinks each of N labels is, and the holder of each label.

    A label's *holder* is the physical object from which its believed pose was last read; at the start its
    own. The label is wrong when the holder is another object. Objects are numbered like the labels that are
    truly theirs.

    Args:
        layout: where the labels are believed to be at the start.
    """

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._holder = np.arange(len(layout))
        self._wrong_labels = 0

    @property
    def layout(self) -> Layout:
        """The labels in their believed poses."""
        return self._layout

    @property
    def holder(self) -> IntArray:
        """(N,) index of the object that holds each label, or `NOBODY`."""
        return read_only(self._holder, np.int64)

    @property
    def wrong(self) -> BoolArray:
        """(N,) labels whose holder is another object."""
        wrong: BoolArray = self._holder != np.arange(len(self._holder))
        return wrong

    @property
    def wrong_labels(self) -> int:
        """How many labels are wrong."""
        return self._wrong_labels

    def state(self) -> dict[str, FloatArray | float]:
        """All that may change, by name."""
        believed = {"believed_position": self._layout.position, "believed_yaw": self._layout.yaw}
        return {**believed, "holder": self._holder.astype(np.float64)}

    def read(
        self, labels: Sequence[str | None], detections: Detections, source: Sequence[int] | IntArray
    ) -> BoolArray:
        """Take over the poses of the detections for the labels they were given.

        A label that was given to none keeps its holder and its believed pose; so does one that never moves.

        Args:
            labels: K labels given to the detections, None for none.
            detections: the K detections.
            source: (K,) the object that each detection really is, `NOBODY` for a false one.

        Returns:
            (N,) labels whose believed pose changed.
        """
        position, yaw = self._layout.position.copy(), self._layout.yaw.copy()
        for k, label in enumerate(labels):
            if label is None:
                continue
            index = self._layout.index(label)
            if not self._layout.fixed[index]:
                position[index], yaw[index] = detections.position[k], detections.yaw[k]
                self._holder[index] = source[k]
        self._wrong_labels = int(self.wrong.sum())
        before = self._layout
        self._layout = before.placed(position, yaw)
        moved = np.abs(position - before.position).max(axis=1, initial=0.0)
        changed: BoolArray = np.maximum(moved, np.abs(wrap(yaw - before.yaw))) > SAME
        return changed

    def endpoint_error(self, truth: Layout) -> FloatArray:
        """(N,) metres from each label's believed position to the true one of its own object."""
        error: FloatArray = np.linalg.norm(self._layout.position - truth.position, axis=-1)
        return error

    def heading_error(self, truth: Layout) -> FloatArray:
        """(N,) radians, 0 to pi, from each label's believed heading to the true one of its own object."""
        error: FloatArray = np.abs(wrap(self._layout.yaw - truth.yaw))
        return error


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
