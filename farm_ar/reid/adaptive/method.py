"""Identities where it is unknown how far objects move: an average over families of motion."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import RANGE, FloatArray, IntArray
from farm_ar.errors import SceneError, SnapshotError
from farm_ar.reid.adaptive.detection_model import detection_model_of, motion_prior
from farm_ar.reid.adaptive.disorder import Disorder
from farm_ar.reid.adaptive.fit import MISFIT, doubted, predictive_p_value
from farm_ar.reid.adaptive.hypotheses import MOST_SCALES, Hypotheses, hypotheses, scales_for
from farm_ar.reid.adaptive.inference import infer
from farm_ar.reid.adaptive.learning import motion_evidence, rates_evidence
from farm_ar.reid.adaptive.options import AdaptiveOptions
from farm_ar.reid.adaptive.pairs import Problem, Surroundings, problem_of
from farm_ar.reid.answers import Assurance, Identification, expected_errors
from farm_ar.reid.base import Reidentifier
from farm_ar.reid.categories import codes_in, declared_codes
from farm_ar.reid.likelihood.kernels import decide
from farm_ar.reid.likelihood.records import Answer
from farm_ar.scenes import UNKNOWN, Camera, Detections, FieldOfView, Scene, Snapshot

LIKELIER_THAN_NOT = 0.5
"""Probability of being none from which a detection may be answered none: that needs evidence, as naming the
likeliest of many improbable labels does not."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """What a snapshot says of the hypotheses.

    Args:
        problem: the pairs of detections and labels.
        every: the motions.
        which: (K, 3) the hypotheses that count: indices of motion, sizes and rates.
        share: (K,) the probability of each.
        exact: whether the marginals under the most probable one are exact.
        probability: (N, M + 1) of each of the problem's labels, and of none.
    """

    problem: Problem
    every: Hypotheses
    which: IntArray
    share: FloatArray
    exact: bool
    probability: FloatArray


class AdaptiveReid(Reidentifier):
    """Identities for one scene, where neither how far objects move nor the unit is known.

    Hypotheses about how objects moved (how, how far, with their headings or not), about how reliable sizes
    are, and about how much is missed, gone or new are averaged, weighted by the evidence of the snapshot.
    Labels are then given so that as many as possible are right on average. No length is assumed: all are
    measured in the distance of look-alikes.

    Costs are expected errors: 1 less the probability of the label given.

    Args:
        scene: the reference layout.
        options: what is assumed.
        disorder: what has been learnt of how far objects of the place move.

    Raises:
        SceneError: the scene has no labels, or the disorder was learnt under other options.
    """

    def __init__(
        self, scene: Scene, options: AdaptiveOptions | None = None, disorder: Disorder | None = None
    ) -> None:
        if not len(scene.layout):
            raise SceneError("objects", "must be at least one", len(scene.layout))
        self.scene = scene
        self.options = options or AdaptiveOptions()
        self.disorder = (disorder or Disorder.unknown(self.options)).fitting(self.options)
        self._declared = declared_codes(scene.layout)
        self._known = Surroundings.of(scene.layout, scene.symmetry)

    def __reduce__(self) -> tuple[type, tuple[Scene, AdaptiveOptions, Disorder]]:
        # Unpickled arrays can be written to, for which the kernels would be compiled a second time.
        return type(self), (self.scene, self.options, self.disorder)

    def identify(self, snapshot: Snapshot, hint: FloatArray | None = None) -> Identification:
        """The label of each detection, with its probability, margin and runner-up.

        Args:
            snapshot: camera and detections.
            hint: (N, M) log-odds of each label for each detection, known from elsewhere; minus infinity
                rules it out.

        Raises:
            SnapshotError: a detection's category is not one of the scene's, or the hint has another shape.
        """
        begin = time.perf_counter()
        seen, names = snapshot.detections, self.scene.layout.labels
        if hint is not None and np.shape(hint) != (len(seen), len(names)):
            raise SnapshotError("hint", f"must have shape {(len(seen), len(names))}", np.shape(hint))
        probability, warnings = np.zeros((len(seen), len(names) + 1)), tuple[str, ...]()
        if len(seen):
            posterior = self._posterior(snapshot, hint)
            found = posterior.probability
            fits = _fit(posterior, _decided(found, 0.0).label[0]) >= MISFIT
            found = found if fits else doubted(found)
            probability[:, posterior.problem.labels] = found[:, :-1]
            probability[:, -1] = found[:, -1]
            warnings = _warnings(len(seen), posterior.exact, fits)
        answer = _decided(probability, self.options.min_confidence)
        assurance = Assurance(
            margin=answer.margin[0],
            runner_up=tuple([None if j == UNKNOWN else names[j] for j in answer.runner_up[0].tolist()]),
            confidence=answer.confidence[0],
            probability=probability,
            warnings=warnings,
        )
        labels = tuple([None if j == UNKNOWN else names[j] for j in answer.label[0].tolist()])
        solve_time = time.perf_counter() - begin
        return Identification(labels, answer.cost[0], names, solve_time=solve_time, assurance=assurance)

    def identify_objects(self, objects: Detections, cameras: Sequence[Camera]) -> Identification:
        """The label of each object, seen by one camera or another.

        They are taken for what a single camera sees all round, from amid these and as far as the farthest
        object: by the last camera alone, what only others saw would be out of view, and so not what it is.
        """
        if len(cameras) == 1 or not len(objects):
            return self.identify(Snapshot(cameras[-1], objects))
        amid = np.mean([camera.position for camera in cameras], axis=0)
        reach = 1.001 * float(np.linalg.norm(objects.position - amid, axis=1).max())
        all_round = FieldOfView(np.pi, np.pi, float(np.clip(reach, RANGE.low, RANGE.high)))
        return self.identify(Snapshot(Camera(amid, cameras[-1].yaw, all_round), objects))

    def problem(self, snapshot: Snapshot) -> tuple[FloatArray, tuple[str | None, ...]]:
        """(N, M + N) expected errors of each label and of each detection's being none; the columns' labels.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        probability = np.array(self.identify(snapshot).probability)
        none = probability[:, -1]
        none[none < LIKELIER_THAN_NOT] = 0.0
        return expected_errors(probability, self.scene.layout.labels)

    def learn(self, snapshot: Snapshot, labels: Sequence[str | None]) -> Disorder:
        """What is known of the disorder after one more snapshot whose labels were confirmed.

        Args:
            snapshot: camera and detections.
            labels: of each detection; None for what is none of the scene's.

        Raises:
            SnapshotError: there is not one label for each detection.
            SceneError: a label is not one of the scene's.
        """
        seen = snapshot.detections
        if len(labels) != len(seen):
            raise SnapshotError("labels", f"must be one, or None, for each of {len(seen)} detections", labels)
        confirmed = [
            (i, self.scene.layout.index(label)) for i, label in enumerate(labels) if label is not None
        ]
        if not confirmed:
            return self.disorder
        every = hypotheses(self.options, MOST_SCALES)
        problem = self._problem(snapshot, None)
        detecting, _ = detection_model_of(snapshot, problem, self._known, every, self.options, self.disorder)
        place = {j: k for k, j in enumerate(problem.labels.tolist())}
        pairs, chosen = problem.pairs, []
        for i, j in confirmed:
            row = np.arange(pairs.start[i], pairs.start[i + 1])
            chosen += row[pairs.label[row] == place.get(j, -1)].tolist()
        index = np.array(chosen, dtype=np.int64)
        motion = motion_evidence(pairs, index, every)
        # What is in view is asked on the scale that the confirmed pairs show.
        scale = int(np.unravel_index(motion.argmax(), motion.shape)[2])
        known = [place[j] for _, j in confirmed if j in place]
        rates = rates_evidence(
            detecting, detecting.in_view[scale], np.array(known, dtype=np.int64), len(seen) - len(confirmed)
        )
        sizes = np.log(pairs.size[:, index]).sum(axis=1)
        if len(sizes) != len(self.disorder.sizes):
            sizes = np.zeros(len(self.disorder.sizes))
        return self.disorder.after(motion, rates, sizes)

    def _problem(self, snapshot: Snapshot, hint: FloatArray | None) -> Problem:
        seen = snapshot.detections
        codes = np.array(codes_in(seen, self._declared), dtype=np.int64).reshape(len(seen))
        return problem_of(self._known, seen, codes, hint, self.options)

    def _posterior(self, snapshot: Snapshot, hint: FloatArray | None) -> Posterior:
        problem = self._problem(snapshot, hint)
        every = hypotheses(self.options, scales_for(problem.extent))
        detecting, closed = detection_model_of(
            snapshot, problem, self._known, every, self.options, self.disorder
        )
        prior = motion_prior(problem, every, self.disorder, closed)
        probability = np.zeros((len(snapshot.detections), len(problem.labels) + 1))
        which, share, exact = infer(
            problem.pairs,
            every.profiles,
            every.angles,
            every.motions._replace(log_prior=prior),
            detecting,
            self.options.most_exact,
            probability,
        )
        return Posterior(problem, every, which, share, bool(exact), probability)


def _fit(posterior: Posterior, label: IntArray) -> float:
    """The predictive p-value of labels, (N,) indices among the problem's, `UNKNOWN` for none."""
    pairs = posterior.problem.pairs
    chosen = []
    for i, j in enumerate(label.tolist()):
        row = np.arange(pairs.start[i], pairs.start[i + 1])
        chosen += row[pairs.label[row] == j].tolist()
    best = int(posterior.which[posterior.share.argmax(), 0])
    return predictive_p_value(pairs, np.array(chosen, dtype=np.int64), posterior.every, best)


def _warnings(detections: int, exact: bool, fits: bool) -> tuple[str, ...]:
    said = []
    if not exact:
        said.append(f"{detections} detections: probabilities are by belief propagation, mostly within .02")
    if not fits:
        said.append(
            "no way of moving that is known explains these poses, so confidence was lowered: "
            "check the frame, the units and the headings of the snapshot"
        )
    return tuple(said)


def _decided(probability: FloatArray, least: float) -> Answer:
    n = len(probability)
    answer = Answer(
        label=np.full((1, n), UNKNOWN),
        cost=np.full((1, n), np.nan),
        margin=np.full((1, n), np.nan),
        runner_up=np.full((1, n), UNKNOWN),
        confidence=np.full((1, n), np.nan),
        exact=np.zeros(1, dtype=np.bool_),
        probability=np.zeros((0, n, probability.shape[1])),
        gone=np.zeros((0, probability.shape[1] - 1)),
        posterior=np.zeros((0, 0)),
    )
    if n:
        decide(probability, float(least), LIKELIER_THAN_NOT, answer, 0)
    return answer
