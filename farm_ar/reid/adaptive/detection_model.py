"""What a camera sees of a scene, and what is known of detecting, for `AdaptiveReid`."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray, read_only
from farm_ar.reid.adaptive.densities import view_probability
from farm_ar.reid.adaptive.disorder import Disorder, sharpened
from farm_ar.reid.adaptive.hypotheses import Hypotheses
from farm_ar.reid.adaptive.options import AdaptiveOptions
from farm_ar.reid.adaptive.pairs import Problem, Surroundings
from farm_ar.reid.adaptive.records import (
    DetectionModel,
    Profile,
)
from farm_ar.scenes import Camera, Snapshot

_POINTS = 32
_GOLDEN_ANGLE = float(np.pi * (3 - np.sqrt(5)))

_DOUBT = 0.1
"""Least probability that a detection is false, with which others are compared: no detector is certain."""

AMONG = 0.6
"""Share of what goes anywhere that goes to where its look-alikes are, if as many are seen as are known."""

COME_AND_GONE, SHARED_ALL, SHARED_SOME = 0.02, 8.0, 0.1
"""By how much likelier it is that objects come and go, or that all move together, where as many are seen as
are known and all is in view; and that all move together where it is not so."""


def detection_model_of(
    snapshot: Snapshot,
    problem: Problem,
    known: Surroundings,
    every: Hypotheses,
    options: AdaptiveOptions,
    disorder: Disorder,
) -> tuple[DetectionModel, float]:
    """What is known of detecting; and the probability that all that is known is in view and accounted for.

    Args:
        snapshot: with N detections.
        problem: its pairs, with M labels.
        known: the scene.
        every: the motions.
        options: what is assumed.
        disorder: what has been learnt.
    """
    n, labels = len(snapshot.detections), len(problem.labels)
    scale = np.append(every.scale, problem.extent / np.sqrt(2))
    inside = np.zeros((len(scale), labels))
    view_of(snapshot.camera, known, problem.labels, scale, inside)
    # What has gone anywhere goes as far as the extent; if none is missing, mostly to among its look-alikes.
    among = AMONG * problem.complete
    anywhere = float((among * inside[0] + (1 - among) * inside[-1]).mean()) if labels else 1.0
    area = problem.area * max(anywhere, 1 / (n + 1))
    doubt = 1 - snapshot.detections.confidence + _DOUBT
    rates = np.array(options.rates)
    told = len(problem.pairs.size) > 1
    shares = np.array(options.size_shares)
    closed = float(np.exp(-(1 - inside[0]).sum())) * problem.complete
    log_rates = sharpened(disorder, "rates", rates[:, 0])
    log_rates = log_rates + np.log(COME_AND_GONE) * closed * (rates[:, 1] > 0.1)
    detecting = DetectionModel(
        in_view=inside,
        anywhere=np.full(labels, anywhere),
        none=doubt / doubt.mean() / (area * 2 * np.pi),
        unseen=rates[:, 1].copy(),
        new=rates[:, 2] * n,
        log_rates=log_rates - np.log(np.exp(log_rates).sum()),
        log_sizes=sharpened(disorder, "sizes", shares) if told else np.zeros(1),
    )
    return detecting, closed


def motion_prior(problem: Problem, every: Hypotheses, disorder: Disorder, closed: float) -> FloatArray:
    """(H,) log prior of the motions for a snapshot.

    No scale is much larger than the extent. In a part of a scene a shared motion is hard to distinguish from
    other labels; where all is seen, it is what explains a common drift.
    """
    motions = every.motions
    cut = -0.5 * (every.scale[motions.scale] / problem.extent) ** 2
    together = every.profiles.kind[motions.profile] >= Profile.TOGETHER
    shared = np.log(SHARED_SOME + (SHARED_ALL - SHARED_SOME) * closed)
    result = disorder.motion_prior(every, motions.log_prior + cut + np.where(together, shared, 0.0))
    if not (problem.pairs.turned.any() or problem.pairs.course_known.any()):
        # No heading is known: hypotheses that differ in headings only are one.
        result = np.where(motions.heading == 0, result, -np.inf)
    normed: FloatArray = result - np.log(np.exp(result).sum())
    return normed


def view_of(
    camera: Camera, known: Surroundings, labels: IntArray, scale: FloatArray, inside: FloatArray
) -> None:
    """Fill (A, M): how probable it is that each label's object is in view, having moved on each scale."""
    fov = camera.fov
    away = known.place[labels] - (camera.position - known.centre) / known.spacing
    sine, cosine = np.sin(camera.yaw), np.cos(camera.yaw)
    right, ahead = away[:, 0] * cosine - away[:, 1] * sine, away[:, 0] * sine + away[:, 1] * cosine
    vertical = fov.up is not None and fov.down is not None and camera.height is not None
    eye = float(camera.height) / known.spacing if camera.height is not None else 0.0
    up, down = (fov.up, fov.down) if vertical else (0.0, 0.0)
    limits = np.array([fov.left, fov.right, up, down, fov.range_m / known.spacing, float(camera.pitch)])
    place = np.stack([right, ahead], axis=1)
    view_probability(place, known.height[labels] - eye, scale, OFFSETS, limits, vertical, inside)


def _offsets(points: int) -> FloatArray:
    """(points, 2) places that stand for the standard normal distribution, the same seen in a mirror."""
    half = points // 2
    order = np.arange(half) + 0.5
    radius, angle = np.sqrt(-2 * np.log(1 - order / half)), order * _GOLDEN_ANGLE
    x, z = radius * np.cos(angle), radius * np.sin(angle)
    return np.stack([np.concatenate([x, -x]), np.concatenate([z, z])], axis=1)


OFFSETS = read_only(_offsets(_POINTS), np.float64)
"""Equally probable shifts on a scale of 1."""
