"""What says which detection is which label: the contract of every re-identifier, and its defaults."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError, SnapshotError
from farm_ar.reid.answers import Assurance, Certificate, Identification, IdentificationBatch
from farm_ar.scenes import UNKNOWN, Camera, Detections, Scene, Snapshot, SnapshotBatch

__all__ = [  # pickles have known the answers by this module, too
    "Assurance",
    "Certificate",
    "Identification",
    "IdentificationBatch",
    "Reidentifier",
    "as_reidentifier",
]


def _confidence_of(answers: Sequence[Identification], shape: tuple[int, ...]) -> FloatArray:
    """The confidence of several answers, rows padded with NaN to a shape (B, K)."""
    confidence = np.full(shape, np.nan)
    for row, answer in zip(confidence, answers, strict=True):
        row[: len(answer.labels)] = answer.confidence
    return confidence


class Reidentifier(ABC):
    """What says which detection is which label: the contract of every re-identifier.

    A class that has `identify` and does not inherit counts as one, too; `as_reidentifier` gives it the rest.

    Attributes:
        scene: the reference layout and its room.
    """

    scene: Scene

    @abstractmethod
    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection of a snapshot."""

    def identify_many(self, batch: SnapshotBatch, margins: bool = False) -> IdentificationBatch:
        """The labels of the detections of many snapshots; by default one by one.

        Args:
            batch: the snapshots.
            margins: whether margins and runners-up are found too.

        Raises:
            SnapshotError: an answer has not one label of the scene, or None, for each detection.
        """
        names, shape = self.scene.layout.labels, batch.yaw.shape
        index = {name: j for j, name in enumerate(names)} | {None: UNKNOWN}
        label, second = np.full(shape, UNKNOWN), np.full(shape, UNKNOWN)
        cost, rise = np.full(shape, np.nan), np.full(shape, np.nan)
        answers: list[Identification] = []
        every, widened = np.empty(len(batch), dtype=np.int64), np.zeros(len(batch), dtype=bool)
        for b in range(len(batch)):
            answer = self.identify(batch.snapshot(b))
            n = int(batch.count[b])
            if len(answer.labels) != n:
                expected = f"must have an entry for each of {n} detections"
                raise SnapshotError("labels", expected, len(answer.labels))
            for name in answer.labels:
                if name not in index:
                    raise SnapshotError("labels", "must be labels of the scene, or None", name)
            label[b, :n] = [index[name] for name in answer.labels]
            cost[b, :n] = answer.cost
            answers.append(answer)
            every[b], widened[b] = len(answer.candidates), answer.widened
            if margins:
                rise[b, :n] = answer.margin
                second[b, :n] = [index[name] for name in answer.runner_up]
        confidence = partial(_confidence_of, answers, shape)
        return IdentificationBatch(names, label, cost, every, widened, rise, second, confidence)

    def identify_objects(self, objects: Detections, cameras: Sequence[Camera]) -> Identification:
        """The label of each object, all detected from one camera or another; by default from the last one."""
        return self.identify(Snapshot(cameras[-1], objects))

    def problem(self, snapshot: Snapshot) -> tuple[FloatArray, tuple[str | None, ...]]:
        """(N, K) costs of which the answer is the cheapest assignment; the label of each column, or None.

        Raises:
            OptionError: the answer is not one, which is the default.
        """
        raise OptionError("reid", "must assign labels by costs", type(self).__name__)

    def cost_terms(self, snapshot: Snapshot) -> Mapping[str, FloatArray]:
        """(N, M) of each term of the costs of all labels, by name. What is lower speaks for the label.

        Raises:
            OptionError: the costs have no terms, which is the default.
        """
        raise OptionError("reid", "must have costs that are sums of terms", type(self).__name__)

    @classmethod
    def __subclasshook__(cls, other: type) -> bool:
        duck = cls is Reidentifier and any("identify" in vars(one) for one in other.__mro__)
        return True if duck else NotImplemented


def as_reidentifier(reid: Reidentifier, scene: Scene | None = None) -> Reidentifier:
    """A re-identifier with all methods: itself, or what has `identify` with the defaults for what it lacks.

    Args:
        reid: the re-identifier.
        scene: the scene that it knows; its own by default.
    """
    return reid if Reidentifier in type(reid).__mro__ else _Adapted(reid, scene)


class _Adapted(Reidentifier):
    """Something with `identify` that does not inherit from `Reidentifier`."""

    def __init__(self, reid: Reidentifier, scene: Scene | None) -> None:
        self._reid = reid
        known = getattr(reid, "scene", scene)
        if known is not None:
            self.scene = known

    def identify(self, snapshot: Snapshot) -> Identification:
        return self._checked(self._reid.identify(snapshot), len(snapshot.detections))

    def _checked(self, answer: Identification, detections: int) -> Identification:
        """An answer, if it is one.

        Raises:
            OptionError: it is no `Identification`, or has not one label of the scene, or None, per detection.
        """
        field = f"{type(self._reid).__name__}.identify"
        if not isinstance(answer, Identification):
            raise OptionError(field, "must return an Identification", answer)
        if len(answer.labels) != detections:
            expected = f"must return a label, or None, for each of {detections} detections"
            raise OptionError(field, expected, answer.labels)
        scene = getattr(self, "scene", None)
        known = answer.labels if scene is None else scene.layout.labels
        strange = [label for label in answer.labels if label is not None and label not in known]
        if strange:
            raise OptionError(field, "must return labels of the scene", strange[0])
        return answer

    def identify_many(self, batch: SnapshotBatch, margins: bool = False) -> IdentificationBatch:
        own: Callable[..., IdentificationBatch] | None = getattr(self._reid, "identify_many", None)
        if own is None:
            return super().identify_many(batch, margins)
        return own(batch, margins=True) if margins else own(batch)

    def identify_objects(self, objects: Detections, cameras: Sequence[Camera]) -> Identification:
        own: Callable[..., Identification] | None = getattr(self._reid, "identify_objects", None)
        return super().identify_objects(objects, cameras) if own is None else own(objects, cameras)

    def problem(self, snapshot: Snapshot) -> tuple[FloatArray, tuple[str | None, ...]]:
        own: Callable[[Snapshot], tuple[FloatArray, tuple[str | None, ...]]] = getattr(
            self._reid, "problem", super().problem
        )
        return own(snapshot)

    def cost_terms(self, snapshot: Snapshot) -> Mapping[str, FloatArray]:
        own: Callable[[Snapshot], Mapping[str, FloatArray]] = getattr(
            self._reid, "cost_terms", super().cost_terms
        )
        return own(snapshot)
