"""Identities by likelihood: how probable each label is, with an unknown noise level, averaged over."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from farm_ar.arrays import FloatArray, IntArray, Record
from farm_ar.errors import SceneError
from farm_ar.reid.answers import Assurance, Identification, IdentificationBatch, expected_errors
from farm_ar.reid.base import Reidentifier
from farm_ar.reid.categories import batch_codes, codes_in, declared_codes
from farm_ar.reid.costs import sorted_log_sides
from farm_ar.reid.likelihood.densities import side_error, view_probability
from farm_ar.reid.likelihood.kernels import MISFIT, identify_batch
from farm_ar.reid.likelihood.motions import DetectionNoise, motion_log_density
from farm_ar.reid.likelihood.options import LikelihoodOptions, category_table, model_arrays
from farm_ar.reid.likelihood.records import (
    Answer,
    Detecting,
    Eyes,
    Found,
    Known,
    Labels,
    View,
)
from farm_ar.reid.place import lengths_of, room_of
from farm_ar.scenes import UNKNOWN, Camera, Detections, Scene, Snapshot, SnapshotBatch, Uncertainty

_NEARLY_ALL = 0.8

LEAST_CONFIDENCE = 1e-3
"""What a detector's confidence counts as at the least."""

_AREA = 0.5
"""Area over which what has no label may be, by the square of the scene's length: a paper's camera's view."""

_HEIGHT_SD = 0.1
"""Share of the objects' heights by which these distinguish look-alikes that stand above one another."""


@dataclass(frozen=True, eq=False)
class Posterior(Record):
    """What a snapshot says of its noise.

    Args:
        probability: (K,) of each motion model and rates.
        translation_sd: root mean square of the motion's SD in x and z, over the models, metres.
        rotation_sd: the same of headings, radians.
        none_rate: expected detections a snapshot of what has no label.
    """

    probability: FloatArray
    translation_sd: float
    rotation_sd: float
    none_rate: float


class LikelihoodReid(Reidentifier):
    """Identities by likelihood, for one scene.

    Each label's object moves on its own, by a motion model; it is then seen, if it is in view and not missed;
    and some detections have no label. Motion models and rates that were not given are averaged over, weighted
    by how probable they make the snapshot. What is *not* seen counts: a label whose place is in full view and
    empty has moved, one outside the view says nothing. Labels are then given so that as many as possible are
    right on average.

    Costs are expected errors: 1 less the probability of the label given.

    Args:
        scene: the reference layout and its room.
        options: what is assumed.

    Raises:
        SceneError: the scene has no labels.
    """

    def __init__(self, scene: Scene, options: LikelihoodOptions | None = None) -> None:
        layout = scene.layout
        if not len(layout):
            raise SceneError("objects", "must be at least one", len(layout))
        self.scene = scene
        self.options = options or LikelihoodOptions()
        self._declared = declared_codes(layout)
        periods = np.array([scene.symmetry.get(name, 2 * np.pi) for name in layout.category])
        kinds, kind = np.unique(periods, return_inverse=True)
        self._lengths = lengths_of(scene)
        self._room = room_of(scene.bounds) if self.options.walls else None
        # Arrays that could be written to, like those that the kernels fill, so that these are compiled once.
        self._labels = Labels(
            position=np.array(self._position(layout.position)),
            yaw=np.array(self._heading(layout.yaw)),
            elevation=np.array(layout.elevation),
            category=np.array(layout.category_code, dtype=np.int64),
            sides=sorted_log_sides(layout.size),
            period=periods,
            table=kind.reshape(-1).astype(np.int64),
            fixed=np.array(layout.fixed),
            room=np.array((np.inf, np.inf) if self._room is None else self._room.size),
        )
        self._models, self._motions = model_arrays(self._lengths, self.options, kinds)
        self._noise = self.options.detection or DetectionNoise.usual(self._lengths.fine)
        self._detecting = Detecting(
            position_sd=float(self._noise.position_sd),
            log_side_sd=float(self.options.size_sd),
            category=category_table(len(layout.categories), self.options.confusion),
            gone_rate=float(self.options.gone_rate),
            height_sd=_height_sd(scene),
        )

    def __reduce__(self) -> tuple[type, tuple[Scene, LikelihoodOptions]]:
        return type(self), (self.scene, self.options)

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection, with its probability, margin and runner-up.

        A detection that is probably none of the labels, or whose label is less probable than
        `min_confidence`, stays unidentified.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        seen, found = snapshot.detections, self._found_in(snapshot)
        begin = time.perf_counter()
        p_value = np.ones(1)
        answer = self._answer(_one(snapshot.camera), found, details=True, p_value=p_value)
        solve_time = time.perf_counter() - begin
        names = self.scene.layout.labels
        assurance = Assurance(
            margin=answer.margin[0],
            runner_up=tuple([None if j == UNKNOWN else names[j] for j in answer.runner_up[0].tolist()]),
            confidence=answer.confidence[0],
            probability=answer.probability[0],
            gone=answer.gone[0],
            warnings=self._warnings(len(seen), bool(answer.exact[0]), bool(p_value[0] >= MISFIT)),
        )
        labels = tuple([None if j == UNKNOWN else names[j] for j in answer.label[0].tolist()])
        return Identification(labels, answer.cost[0], names, solve_time=solve_time, assurance=assurance)

    def identify_many(self, batch: SnapshotBatch, margins: bool = True) -> IdentificationBatch:
        """The labels of the detections of many snapshots; confidence, margin and runner-up in any case.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        exists = np.arange(batch.yaw.shape[1]) < batch.count[:, None]
        codes = batch_codes(batch, exists, self._declared)
        size = np.where(exists[..., None], batch.size, 1.0)
        poses = self._position(batch.position), self._heading(batch.yaw), batch.elevation
        found = _found(batch.count, poses, codes, size)
        if batch.uncertainty is not None:
            found = self._uncertain(found, batch.uncertainty)
        answer = self._answer(batch.camera, found, details=False)
        labels = self.scene.layout.labels
        return IdentificationBatch(
            labels,
            answer.label,
            answer.cost,
            candidates=np.full(len(batch), len(labels)),
            widened=np.zeros(len(batch), dtype=bool),
            margin=answer.margin,
            runner_up=answer.runner_up,
            given_confidence=answer.confidence,
        )

    def identify_objects(self, objects: Detections, cameras: Sequence[Camera]) -> Identification:
        """The label of each object, all seen by one camera or another."""
        from farm_ar.reid.relational.method import RelationalReid

        return RelationalReid.without_relations(self).identify_objects(objects, cameras)

    def posterior(self, snapshot: Snapshot) -> Posterior:
        """What a snapshot says of its noise.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        answer = self._answer(_one(snapshot.camera), self._found_in(snapshot), details=True)
        probability = answer.posterior[0]
        square_shift = [sum(m.share * m.translation_sd**2 for m in motions) for motions in self._motions]
        square_turn = [sum(m.share * m.rotation_sd**2 for m in motions) for motions in self._motions]
        return Posterior(
            probability,
            float(np.sqrt(probability @ square_shift)),
            float(np.sqrt(probability @ square_turn)),
            float(probability @ self._models.none_rate),
        )

    def problem(self, snapshot: Snapshot) -> tuple[FloatArray, tuple[str | None, ...]]:
        """(N, M + N) expected errors of each label and of each detection's being none; the columns' labels.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        return expected_errors(self.identify(snapshot).probability, self.scene.layout.labels)

    def cost_terms(self, snapshot: Snapshot) -> dict[str, FloatArray]:
        """Terms that speak against each label for each detection, (N, M) each, by name; natural logarithms.

        They are those of the most probable motion model: negative logarithms of the densities of the place,
        of the heading given the place, of the size and of the category, and that of finding the label's
        place empty, which speaks for a label that should have been seen (negative).
        """
        seen, layout, options = snapshot.detections, self.scene.layout, self.options
        best = int(self.posterior(snapshot).probability.argmax())
        room = None if self._room is None else self._room.size
        labels, found = self._labels, self._found_in(snapshot)
        pose = (found.position[0], found.yaw[0], labels.position, labels.yaw)
        place, both = (
            motion_log_density(*pose, self._motions[best], self._noise, room, period)
            for period in (0.0, labels.period)
        )
        squares = ((sorted_log_sides(seen.size)[:, None] - self._labels.sides) ** 2).sum(axis=-1)
        codes = np.array(codes_in(seen, self._declared), dtype=np.int64)
        table = self._detecting.category
        side_sd = max(options.size_sd, side_error(table, codes, self._labels.category, squares))
        likely = table[codes][:, layout.category_code]
        inside = np.empty((len(self._models.translation_sd), len(layout)))
        camera = _one(snapshot.camera)
        view_probability(self._known(camera), labels, self._eyes(camera), found, 0, 1, inside)
        share, part = self._models.share[best], self._models.part[best, :, 0]
        stay = 1 - options.gone_rate
        seen_if_there = self._models.detect_rate[best] * (share @ inside[part])
        unseen = np.maximum(options.gone_rate + stay * (1 - seen_if_there), 1e-9)
        full_turn = np.log(2 * np.pi)  # a place's density alone is that of any heading
        return {
            "distance": -(place + full_turn),
            "turn": place + full_turn - both,
            "size": np.where(np.isnan(squares), 1.5, 0.5 * squares / side_sd**2),
            "category": -np.log(np.maximum(likely, 1e-300)),
            "its place is empty": np.broadcast_to(np.log(unseen), place.shape),
        }

    def _found_in(self, snapshot: Snapshot) -> Found:
        seen = snapshot.detections
        codes = np.array(codes_in(seen, self._declared), dtype=np.int64)
        poses = self._position(seen.position)[None], self._heading(seen.yaw)[None], seen.elevation[None]
        found = _found(np.array([len(seen)]), poses, codes[None], seen.size[None])
        # Of n detections of this confidence, (1 - confidence) n are false and confidence n are not.
        confidence = np.maximum(seen.confidence[None], LEAST_CONFIDENCE)
        found = found._replace(false=len(seen) * (1 - confidence) / confidence)
        return found if seen.uncertainty is None else self._uncertain(found, seen.uncertainty.at(None))

    def _uncertain(self, found: Found, uncertainty: Uncertainty) -> Found:
        """Detections with what the detector says of its errors."""
        if self._room is not None:
            uncertainty = uncertainty.turned(-self._room.yaw)
        covariance = uncertainty.covariance
        place = (covariance[..., :2, :2] + np.swapaxes(covariance[..., :2, :2], -1, -2)) / 2
        # Known better than is usual in a direction, it counts as usual there, whatever the axes.
        square, along = np.linalg.eigh(place)
        usual = self._noise.position_sd**2
        worse = square[..., 1] > usual
        wide = along * np.maximum(square, usual)[..., None, :] @ np.swapaxes(along, -1, -2)
        spread = np.zeros((*worse.shape, 3))
        spread[..., :2] = np.where(worse[..., None], np.sqrt(np.diagonal(wide, axis1=-2, axis2=-1)), 0.0)
        spread[..., 2] = np.sqrt(np.maximum(covariance[..., 2, 2], 0.0))
        return found._replace(
            spread=spread,
            cross=np.where(worse, wide[..., 0, 1], 0.0),
            rival=np.nan_to_num(uncertainty.runner_up_yaw),
            rival_weight=np.nan_to_num(uncertainty.runner_up_weight),
        )

    def _position(self, place: FloatArray) -> FloatArray:
        """Places in the frame in which the kernels compute."""
        return place if self._room is None else self._room.position(place)

    def _heading(self, yaw: FloatArray) -> FloatArray:
        """Headings in that frame."""
        return yaw if self._room is None else self._room.heading(yaw)

    def _eyes(self, cameras: Camera) -> Eyes:
        """A batch of cameras for the kernels."""
        height = np.zeros(cameras.yaw.shape) if cameras.height is None else np.array(cameras.height)
        position, yaw = self._position(cameras.position), self._heading(cameras.yaw)
        return Eyes(np.array(position), np.array(yaw), np.array(cameras.pitch), height)

    def _answer(
        self, cameras: Camera, found: Found, details: bool, p_value: FloatArray | None = None
    ) -> Answer:
        """The answer to B snapshots; fills (B,) predictive p-values where they are asked for."""
        rows, shape = found.yaw.shape[0] if details else 0, found.yaw.shape
        labels, models = len(self._labels.yaw), len(self._models.log_prior)
        answer = Answer(
            label=np.full(shape, UNKNOWN),
            cost=np.full(shape, np.nan),
            margin=np.full(shape, np.nan),
            runner_up=np.full(shape, UNKNOWN),
            confidence=np.full(shape, np.nan),
            exact=np.zeros(shape[0], dtype=np.bool_),
            probability=np.zeros((rows, shape[1], labels + 1)),
            gone=np.zeros((rows, labels)),
            posterior=np.zeros((rows, models)),
        )
        least, most_exact = float(self.options.min_confidence), self.options.most_exact
        fits = np.ones(shape[0]) if p_value is None else p_value
        identify_batch(self._known(cameras), self._eyes(cameras), found, least, most_exact, answer, fits)
        return answer

    def _known(self, camera: Camera) -> Known:
        """All that does not change between snapshots of cameras alike."""
        return Known(self._labels, self._models, self._detecting, self._view(camera))

    def _view(self, camera: Camera) -> View:
        fov = camera.fov
        vertical = fov.up is not None and fov.down is not None and camera.height is not None
        return View(
            left=float(np.cos(fov.left)),
            right=float(np.cos(fov.right)),
            range_m=fov.range_m,
            up=fov.up if fov.up is not None and vertical else 0.0,
            down=fov.down if fov.down is not None and vertical else 0.0,
            vertical=vertical,
            area=_AREA * self._lengths.scene**2,
            occlusion=bool(self.options.occlusion),
        )

    def _warnings(self, detections: int, exact: bool, fits: bool) -> tuple[str, ...]:
        said = []
        if detections and not exact:
            one = f"{detections} detections: probabilities are by belief propagation, mostly within .02"
            poor = detections > _NEARLY_ALL * len(self._labels.yaw)
            said.append(one + (", but poor where nearly all labels are seen, as here" if poor else ""))
        if not fits:
            said.append(
                "no motion that is thought possible explains these poses, so confidence was lowered: "
                "check the frame, the units and the headings of the snapshot"
            )
        return tuple(said)


def _one(camera: Camera) -> Camera:
    """A batch of one camera."""
    height = None if camera.height is None else camera.height[None]
    return replace(
        camera, position=camera.position[None], yaw=camera.yaw[None], height=height, pitch=camera.pitch[None]
    )


def _height_sd(scene: Scene) -> float:
    """By how much heights may differ, metres; infinite where no look-alikes stand at different ones."""
    layout = scene.layout
    code = layout.category_code
    if all(np.ptp(layout.elevation[code == one]) == 0 for one in np.unique(code)):
        return float(np.inf)
    tall = layout.size[:, 1][np.isfinite(layout.size[:, 1])]
    usual = float(np.median(tall)) if len(tall) else float(np.ptp(layout.elevation))
    return _HEIGHT_SD * usual


def _found(
    count: IntArray, poses: tuple[FloatArray, FloatArray, FloatArray], codes: IntArray, size: FloatArray
) -> Found:
    """Detections of B snapshots for the kernels; poses are positions, headings and heights."""
    position, yaw, elevation = poses
    told = (elevation != 0).any(axis=1, keepdims=True)  # files that say nothing of heights have 0 for all
    return Found(
        number=np.array(count, dtype=np.int64),
        position=np.array(position),
        yaw=np.array(yaw),
        category=np.array(codes, dtype=np.int64),
        sides=np.ascontiguousarray(sorted_log_sides(size)),
        half=np.stack([size[..., 0], size[..., 2]], axis=-1) / 2,
        elevation=np.where(told, elevation, np.nan),
        false=np.zeros(yaw.shape),
        spread=np.zeros((*yaw.shape, 3)),
        cross=np.zeros(yaw.shape),
        rival=np.zeros(yaw.shape),
        rival_weight=np.zeros(yaw.shape),
    )
