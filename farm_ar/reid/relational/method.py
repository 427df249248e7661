"""Identities where objects may have moved together, or the frame of the camera may have drifted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray
from farm_ar.errors import SnapshotError
from farm_ar.reid.answers import Identification
from farm_ar.reid.likelihood.kernels import decide
from farm_ar.reid.likelihood.method import LikelihoodReid
from farm_ar.reid.likelihood.records import Answer, Found
from farm_ar.reid.relational.groups import anchors_of, groups_of, usual_distance
from farm_ar.reid.relational.options import Relation, RelationalOptions
from farm_ar.reid.relational.search import Hypothesis, Setting, hypotheses
from farm_ar.scenes import Camera, Detections, Scene, Snapshot

_LEAST_WEIGHT = 1e-9


class RelationalReid(LikelihoodReid):
    """`LikelihoodReid` that also thinks of motions that objects share.

    Three kinds of explanation compete by evidence: each label moved alone; the frame in which cameras and
    detections are given has drifted, by a small rigid motion; labels near one another moved as one, rigidly,
    each with a probability that falls with its distance from the group's middle. Groups are looked for in
    the likeliest frame, from every pair, and every two pairs, of label and detection. Each motion is fitted
    together with the assignment, by expectation and maximisation, and weighted by its evidence, integrated
    over the motions like it. Probabilities are averaged over all explanations.

    Args:
        scene: the reference layout and its room.
        options: what is assumed.

    Raises:
        SceneError: the scene has no labels.
    """

    def __init__(self, scene: Scene, options: RelationalOptions | None = None) -> None:
        self.shared = options or RelationalOptions()
        super().__init__(scene, self.shared.alone)
        self._spacing = usual_distance(scene, self._lengths)
        self._groups = groups_of(self._labels, self._lengths, self._spacing, self.shared)
        self._anchors = anchors_of(self._labels, self._lengths, self.shared)
        self._between: Camera | None = None
        self._told: list[Relation] | None = None

    def __reduce__(self) -> Any:
        return type(self), (self.scene, self.shared)

    def _twin(self) -> RelationalReid:
        """The same method, sharing its arrays, which may know objects that this one does not."""
        twin = object.__new__(type(self))
        twin.__dict__.update(self.__dict__)
        return twin

    @classmethod
    def without_relations(cls, reid: LikelihoodReid) -> RelationalReid:
        """A method that answers as `LikelihoodReid` does, and knows what several cameras see between them."""
        return cls(reid.scene, RelationalOptions(alone=reid.options, drift=0.0, group=0.0))

    def identify_objects(self, objects: Detections, cameras: Sequence[Camera]) -> Identification:
        """The label of each object, all seen by one camera or another; see `identify`.

        Raises:
            SnapshotError: an object's category is not one of the scene's, there is no camera, or they differ
                in their field of view or in whether their height is known.
        """
        # The same method, which knows more cameras than the snapshot's own.
        twin = self._twin()
        twin._between = _batch(cameras)
        return twin.identify(Snapshot(cameras[-1], objects))

    def relations(self, snapshot: Snapshot) -> tuple[Relation, ...]:
        """The motions that objects may have shared in a snapshot, the most probable first.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        twin = self._twin()
        twin._told = []
        twin.identify(snapshot)
        return tuple(sorted(twin._told, key=lambda one: -one.probability))

    def _answer(
        self, cameras: Camera, found: Found, details: bool, p_value: FloatArray | None = None
    ) -> Answer:
        answer = super()._answer(cameras, found, details=True)  # shared motions may explain what does not fit
        for b in range(len(found.number)):
            n = int(found.number[b])
            if n:
                eyes = _batch([cameras.at(b)]) if self._between is None else self._between
                self._relate(eyes, _repeated(found, b, n, len(eyes.yaw)), answer, b)
        if details:
            return answer
        return answer._replace(
            probability=answer.probability[:0], gone=answer.gone[:0], posterior=answer.posterior[:0]
        )

    def _relate(self, cameras: Camera, found: Found, answer: Answer, b: int) -> None:
        """Replace row b of an answer, which knows of one camera and no relations, by one that does."""
        setting = Setting(
            known=self._known(cameras),
            names=self.scene.layout.labels,
            options=self.shared,
            lengths=self._lengths,
            middle=self._position(np.array(self._lengths.middle)),
            spacing=self._spacing,
            groups=self._groups,
            anchors=self._anchors,
        )
        found_out = hypotheses(setting, self._eyes(cameras), found)
        evidence = np.array([one.log_prior + one.outcome.evidence for one in found_out])
        weight = np.exp(evidence - evidence.max())
        weight /= weight.sum()
        share = weight.sum(axis=1)
        n = found.yaw.shape[1]
        every = [
            _averaged(one, w, self._detecting.gone_rate) for one, w in zip(found_out, weight, strict=True)
        ]
        if self._between is None:
            # What was found of labels that move alone is exact where that can be.
            every[0] = share[0] * answer.probability[b, :n], share[0] * answer.gone[b]
        answer.probability[b, :n] = sum(probability for probability, _ in every)
        answer.gone[b] = sum(gone for _, gone in every)
        answer.posterior[b] = weight.sum(axis=0)
        decide(answer.probability[b, :n], float(self.options.min_confidence), 0.0, answer, b)
        if self._told is not None:
            for one, probability in zip(found_out, share, strict=True):
                self._told.append(self._in_world(replace(one.relation, probability=float(probability))))

    def _in_world(self, relation: Relation) -> Relation:
        """A motion as it is in the world, not in the frame of the kernels."""
        if self._room is None or relation.kind == "alone":
            return relation
        pivot, shift = self._room.world(np.array(relation.pivot)), self._room.shift(np.array(relation.shift))
        return replace(
            relation, pivot=(float(pivot[0]), float(pivot[1])), shift=(float(shift[0]), float(shift[1]))
        )


def _averaged(one: Hypothesis, weight: FloatArray, gone_rate: float) -> tuple[FloatArray, FloatArray]:
    """(N, M + 1) probabilities of labels, (M,) of being gone: weighted by the (K,) weights of its models."""
    counts = weight > _LEAST_WEIGHT
    chance, unseen = one.outcome.chance[counts], one.outcome.unseen[counts]
    gone = (1.0 - chance[:, :, :-1].sum(axis=1)) * gone_rate / unseen
    return np.tensordot(weight[counts], chance, 1), weight[counts] @ gone


def _repeated(found: Found, b: int, n: int, rows: int) -> Found:
    """The detections of one snapshot, as often as there are cameras."""

    def repeat(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return np.repeat(values[b : b + 1, :n], rows, axis=0)

    return Found(
        number=np.full(rows, n),
        position=repeat(found.position),
        yaw=repeat(found.yaw),
        category=repeat(found.category),
        sides=repeat(found.sides),
        half=repeat(found.half),
        elevation=repeat(found.elevation),
        false=repeat(found.false),
        spread=repeat(found.spread),
        cross=repeat(found.cross),
        rival=repeat(found.rival),
        rival_weight=repeat(found.rival_weight),
    )


def _batch(cameras: Sequence[Camera]) -> Camera:
    """Cameras as a batch."""
    if not cameras:
        raise SnapshotError("cameras", "must be at least one", len(cameras))
    first = cameras[0]
    for i, camera in enumerate(cameras):
        if camera.fov != first.fov:
            raise SnapshotError(f"cameras[{i}].fov", f"must be the first one's, {first.fov}", camera.fov)
        if (camera.height is None) != (first.height is None):
            raise SnapshotError(f"cameras[{i}].height", "must be known of all or of none", camera.height)
    return replace(
        first,
        position=np.stack([one.position for one in cameras]),
        yaw=np.stack([one.yaw for one in cameras]),
        height=None
        if first.height is None
        else np.stack([one.height for one in cameras if one.height is not None]),
        pitch=np.stack([one.pitch for one in cameras]),
    )
