"""Identities where nothing is known of how untidy a place is: an average over ways of moving."""

from __future__ import annotations

import time

import numpy as np

from farm_ar.arrays import FloatArray, IntArray, read_only
from farm_ar.errors import SceneError
from farm_ar.reid.adaptive.densities import view_probability
from farm_ar.reid.adaptive.hypotheses import Hypotheses, hypotheses, scales_for
from farm_ar.reid.adaptive.inference import infer
from farm_ar.reid.adaptive.options import AdaptiveOptions
from farm_ar.reid.adaptive.pairs import Problem, Surroundings, problem_of
from farm_ar.reid.adaptive.records import Motions, Seeing
from farm_ar.reid.base import Assurance, Identification, Reidentifier
from farm_ar.reid.categories import codes_of, declared_codes
from farm_ar.reid.likelihood.kernels import decide
from farm_ar.reid.likelihood.records import Answer
from farm_ar.scenes import UNKNOWN, Camera, Scene, Snapshot

_POINTS = 32
_GOLDEN_ANGLE = float(np.pi * (3 - np.sqrt(5)))
_SURE = 0.1
"""By how much at most a detector's being sure lessens the chance that a detection is false."""


class AdaptiveReid(Reidentifier):
    def __init__(self, scene: Scene, options: AdaptiveOptions | None = None) -> None:
        if not len(scene.layout):
            raise SceneError("objects", "must be at least one", len(scene.layout))
        self.scene = scene
        self.options = options or AdaptiveOptions()
        self._declared = declared_codes(scene.layout)
        self._known = Surroundings.of(scene.layout, scene.symmetry)

    def identify(self, snapshot: Snapshot, hint: FloatArray | None = None) -> Identification:
        begin = time.perf_counter()
        names, n = self.scene.layout.labels, len(snapshot.detections)
        codes = np.array(codes_of(snapshot.detections.category, self._declared), dtype=np.int64).reshape(n)
        probability = np.zeros((n, len(names) + 1))
        exact = True
        if n:
            exact = self._marginals(snapshot, codes, hint, probability)[2]
        answer = _decided(probability, self.options.min_confidence)
        assurance = Assurance(
            margin=answer.margin[0],
            runner_up=tuple([None if j == UNKNOWN else names[j] for j in answer.runner_up[0].tolist()]),
            confidence=answer.confidence[0],
            probability=probability,
            warnings=(),
        )
        labels = tuple([None if j == UNKNOWN else names[j] for j in answer.label[0].tolist()])
        solve_time = time.perf_counter() - begin
        return Identification(labels, answer.cost[0], names, solve_time=solve_time, assurance=assurance)

    def _marginals(
        self, snapshot: Snapshot, codes: IntArray, hint: FloatArray | None, probability: FloatArray
    ):
        seen, options = snapshot.detections, self.options
        problem = problem_of(self._known, seen, codes, hint, options)
        every = hypotheses(options, scales_for(problem.extent))
        if len(problem.pairs.vertical) == 0 and np.ptp(np.r_[self._known.height, seen.elevation / self._known.spacing]) > 1e-9:
            problem = problem_of(self._known, seen, codes, hint, options, every.scale)
        motions = every.motions
        cut = -0.5 * (every.scale[motions.scale] / problem.extent) ** 2
        log_prior = motions.log_prior + cut
        log_prior -= np.log(np.exp(log_prior).sum())
        motions = motions._replace(log_prior=log_prior)
        seeing = self._seeing(snapshot, problem, every)
        found = np.zeros((len(seen), len(problem.labels) + 1))
        which, share, exact = infer(
            problem.pairs, every.profiles, every.angles, motions, seeing, options.most_exact, found
        )
        probability[:, problem.labels] = found[:, :-1]
        probability[:, -1] = found[:, -1]
        self._last = (which, share, every)
        return which, share, exact

    def _seeing(self, snapshot: Snapshot, problem: Problem, every: Hypotheses) -> Seeing:
        options, known, seen = self.options, self._known, snapshot.detections
        n = len(seen)
        scale = np.append(every.scale, problem.extent / np.sqrt(2))
        inside = np.zeros((len(scale), len(problem.labels)))
        view_of(snapshot.camera, known, problem.labels, scale, inside)
        # What has gone anywhere is where its look-alikes are.
        anywhere = inside[-1].mean() if len(problem.labels) else 1.0
        area = problem.area * max(anywhere, 1 / (n + 1))
        doubt = 1 - seen.confidence + _SURE
        rates = np.array(options.rates)
        sizes = len(problem.pairs.size)
        shares = np.array(options.size_shares if sizes > 1 else (1.0,))
        return Seeing(
            in_view=inside,
            anywhere=np.full(len(problem.labels), anywhere),
            none=doubt / doubt.mean() / (area * 2 * np.pi),
            unseen=rates[:, 1].copy(),
            new=rates[:, 2] * n,
            log_rates=np.log(rates[:, 0] / rates[:, 0].sum()),
            log_sizes=np.log(shares / shares.sum()),
        )


def view_of(
    camera: Camera, known: Surroundings, labels: IntArray, scale: FloatArray, inside: FloatArray
) -> None:
    """Fill (A, M): how probable it is that each label's object is in view, having moved on each scale."""
    fov = camera.fov
    away = known.place[labels] - (camera.position - known.centre) / known.spacing
    sine, cosine = np.sin(camera.yaw), np.cos(camera.yaw)
    place = np.stack([away[:, 0] * cosine - away[:, 1] * sine, away[:, 0] * sine + away[:, 1] * cosine], axis=1)
    vertical = fov.up is not None and fov.down is not None and camera.height is not None
    rise = known.height[labels] - (float(camera.height) / known.spacing if vertical else 0.0)
    up, down = (fov.up, fov.down) if vertical else (0.0, 0.0)
    limits = np.array([fov.left, fov.right, up, down, fov.range_m / known.spacing, float(camera.pitch)])
    view_probability(place, rise, scale, OFFSETS, limits, vertical, inside)


def _offsets(points: int) -> FloatArray:
    """(points, 2) places that stand for the standard normal distribution, the same seen in a mirror."""
    half = points // 2
    order = np.arange(half) + 0.5
    radius, angle = np.sqrt(-2 * np.log(1 - order / half)), order * _GOLDEN_ANGLE
    x, z = radius * np.cos(angle), radius * np.sin(angle)
    return np.stack([np.concatenate([x, -x]), np.concatenate([z, z])], axis=1)


OFFSETS = read_only(_offsets(_POINTS), np.float64)


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
        decide(probability, float(least), answer, 0)
    return answer
