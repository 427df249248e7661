"""When the paper's rule is proven right: how far things may have moved (T1)."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.reid.base import Certificate
from farm_ar.reid.costs import rotation_cost, translation_cost
from farm_ar.scenes import Detections, Layout


def pose_distance(
    first: tuple[FloatArray, FloatArray],
    second: tuple[FloatArray, FloatArray],
    diagonal: float,
    translation_weight: float,
    rotation_weight: float,
) -> FloatArray:
    """D between poses, given as positions (..., N, 2) and yaws (..., N): (..., N, M). It is a metric.

    D(q, p) = w_t |q - p| / l + w_r |sin(yaw difference / 2)|.
    """
    shift = translation_cost(first[0], second[0], diagonal)
    return translation_weight * shift + rotation_weight * rotation_cost(first[1], second[1])


def certified_radius(
    moved: FloatArray, apart: FloatArray, size_factor: FloatArray, possible: BoolArray, offered: BoolArray
) -> float:
    """The r for which, if every object has moved less than r in D, the optimal assignment is right.

    If an object moved less than half the distance from its old pose to any other label's, no assignment is
    as good as the true one (T1). Which labels are the true ones is not known: but a label that lies r or
    farther from every detection is none of them, and any other must be far enough from its neighbours. Sizes
    that were not measured exactly make a true label dearer by a factor C: then 1 / (1 + C) stands for a half.

    Args:
        moved: (N, M) D from each label's pose to each detection.
        apart: (M, M) D between the labels' poses.
        size_factor: (N, M) C_d of each label for each detection, at least 1.
        possible: (N, M) which labels the rule may give to each detection, were all offered.
        offered: (M,) which labels the rule considered.

    Returns:
        The radius; 0 where nothing is proven.
    """
    n, m = moved.shape
    if not n or not m:
        return 0.0
    rivals = np.where(np.eye(m, dtype=bool), np.inf, apart)
    radius = np.inf
    nearest_of: dict[bytes, FloatArray] = {}  # there are few different rows: one for each category
    for i in range(n):
        key = possible[i].tobytes()
        if key not in nearest_of:
            nearest_of[key] = np.where(possible[i] & offered, rivals, np.inf).min(axis=1)
        nearest = nearest_of[key]
        proven = np.where(offered, nearest / (1 + size_factor[i]), 0.0)
        limits = np.where(possible[i], np.maximum(moved[i], proven), np.inf)
        radius = min(radius, float(limits.min()))
    return radius if np.isfinite(radius) else 0.0


def certificate(
    detections: Detections,
    layout: Layout,
    given: list[int],
    diagonal: float,
    translation_weight: float,
    rotation_weight: float,
    size_factor: FloatArray,
    possible: BoolArray,
    offered: BoolArray,
) -> Certificate | None:
    """The certificate of an answer of the paper's rule, or None where nothing is proven.

    Args:
        detections: N of them.
        layout: the M labels.
        given: index of the label of each detection, below 0 for none.
        diagonal: `l`, metres.
        translation_weight: w_t.
        rotation_weight: w_r.
        size_factor: (N, M) C_d.
        possible: (N, M) which labels the rule may give to each detection.
        offered: (M,) which labels it considered.
    """
    if not given or min(given) < 0:
        return None
    known, seen = (layout.position, layout.yaw), (detections.position, detections.yaw)
    weights = (diagonal, translation_weight, rotation_weight)
    moved = pose_distance(seen, known, *weights)
    radius = certified_radius(moved, pose_distance(known, known, *weights), size_factor, possible, offered)
    if not radius > moved[np.arange(len(given)), given].max():
        return None  # the answer itself has something move as far, so what the proof asks for does not hold
    metres = radius * diagonal / translation_weight if translation_weight > 0 else np.inf
    turn = radius / rotation_weight if rotation_weight > 0 else 1.0
    degrees = float(np.rad2deg(2 * np.arcsin(min(turn, 1.0))))
    return Certificate(radius, float(metres), degrees, tuple(range(len(given))))
