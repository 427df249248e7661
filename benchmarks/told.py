"""A re-identifier that is given a row's true motions: what can be known of them beforehand, and no more."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.benchmark.worlds import Example
from farm_ar.geometry import wrap
from farm_ar.reid import Identification, Reidentifier
from farm_ar.reid.answers import Assurance
from farm_ar.reid.marginals import association_marginals
from farm_ar.scenes import Scene, Snapshot, visible

PARTS, ROUNDS = 6, 60
"""Normal distributions that stand for a row's shifts, and rounds of fitting them."""

LEAST = 1e-4
"""Of rates, and of an SD as a share of the scene's extent: what stays exactly is not quite exact."""


class Motion:
    """The density of a row's shifts, in the frame of each label's heading, and of its turns.

    Args:
        examples: of the row, whose truth tells the motions.
    """

    def __init__(self, examples: Sequence[Example]) -> None:
        shift, turn, extent = [], [], []
        seen = np.zeros((2, 2))  # by whether the label's old place is in view: labels, and those detected
        unknown = number = 0
        for scene, snapshot, truth in examples:
            there = {label for label in truth if label is not None}
            in_view = visible(scene.layout, snapshot.camera).astype(int)
            for label, view in zip(scene.layout.labels, in_view, strict=True):
                seen[view] += (1, label in there)
            rows = np.array([i for i, label in enumerate(truth) if label is not None], dtype=np.int64)
            column = np.array([scene.layout.index(truth[i]) for i in rows], dtype=np.int64)  # type: ignore[arg-type]
            unknown, number = unknown + len(truth) - len(rows), number + 1
            if len(rows):
                ahead, turned = _relative(scene, snapshot)
                shift.append(ahead[rows, column])
                turn.append(turned[rows, column])
                extent.append(float(np.ptp(scene.layout.position, axis=0).max()))
        self.detected = (seen[:, 1] + 0.5) / (seen[:, 0] + 1)
        self.none_rate = max(unknown / number, LEAST)
        every = np.concatenate(shift)
        self.share, self.mean, self.covariance = _fitted(every, LEAST * float(np.median(extent)))
        turns = np.concatenate(turn)
        known = turns[np.isfinite(turns)]
        middle = np.median(np.abs(known)) / 0.6745 if len(known) else np.inf
        self.turn_sd = max(float(middle), 1e-3)
        self.turn_anyhow = 0.1

    def log_density(self, scene: Scene, snapshot: Snapshot) -> FloatArray:
        """(N, M) of each label's having come to each detection; by square metre and by radian."""
        ahead, turned = _relative(scene, snapshot)
        parts = []
        for share, mean, covariance in zip(self.share, self.mean, self.covariance, strict=True):
            off = ahead - mean
            far = np.einsum("...i,ij,...j->...", off, np.linalg.inv(covariance), off)
            parts.append(np.log(share / (2 * np.pi * np.sqrt(np.linalg.det(covariance)))) - far / 2)
        shift = np.logaddexp.reduce(parts, axis=0)
        narrow = np.exp(-((turned / self.turn_sd) ** 2) / 2) / (np.sqrt(2 * np.pi) * self.turn_sd)
        heading = np.log((1 - self.turn_anyhow) * narrow + self.turn_anyhow / (2 * np.pi))
        return shift + np.where(np.isfinite(turned) & (self.turn_sd < 1.5), heading, 0.0)


class ToldReid(Reidentifier):
    """Marginal probabilities under the true motions; each detection gets its most probable answer.

    Args:
        scene: the reference layout.
        motion: that of the row.
    """

    def __init__(self, scene: Scene, motion: Motion) -> None:
        self.scene, self._motion = scene, motion

    def identify(self, snapshot: Snapshot) -> Identification:
        """The most probable answer for each detection."""
        layout, seen, motion = self.scene.layout, snapshot.detections, self._motion
        density = motion.log_density(self.scene, snapshot)
        allowed = _same_category(seen.category, layout.category)
        rate = motion.detected[visible(layout, snapshot.camera).astype(int)]
        area = float(np.prod(np.ptp(np.concatenate([layout.position, seen.position]), axis=0) + 1e-9))
        none = np.log(motion.none_rate / area) - np.log(2 * np.pi) * (motion.turn_sd < 1.5)
        top = np.maximum(np.where(allowed, density, -np.inf).max(axis=1, initial=none), none)
        weight = np.where(allowed, np.exp(density - top[:, None]), 0.0) * (rate / (1 - rate))
        probability, _, _ = association_marginals(weight, np.exp(none - top), most_exact=15)
        best = probability.argmax(axis=1)
        labels = [None if j == len(layout) else layout.labels[j] for j in best]
        confidence = probability[np.arange(len(best)), best]
        assurance = Assurance(confidence=confidence, probability=probability)
        return Identification(tuple(labels), candidates=layout.labels, assurance=assurance)


def _relative(scene: Scene, snapshot: Snapshot) -> tuple[FloatArray, FloatArray]:
    """(N, M, 2) shifts ahead and to the right of each label's heading; (N, M) turns, NaN where not known."""
    layout, seen = scene.layout, snapshot.detections
    off = seen.position[:, None] - layout.position
    yaw = np.nan_to_num(layout.yaw)
    sine, cosine = np.sin(yaw), np.cos(yaw)
    ahead = off[..., 0] * sine + off[..., 1] * cosine
    right = off[..., 0] * cosine - off[..., 1] * sine
    return np.stack([ahead, right], axis=-1), wrap(seen.yaw[:, None] - layout.yaw)


def _same_category(seen: Sequence[str | None], known: Sequence[str]) -> BoolArray:
    return np.array([[a is None or a == b for b in known] for a in seen], dtype=bool).reshape(
        len(seen), len(known)
    )


def _fitted(shift: FloatArray, least_sd: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A mixture of normal distributions by expectation and maximisation: shares, means, covariances."""
    length = np.linalg.norm(shift, axis=1)
    edges = np.quantile(length, np.linspace(0, 1, PARTS + 1)[1:-1])
    belongs = np.eye(PARTS)[np.searchsorted(edges, length)] * 0.8 + 0.2 / PARTS
    for _ in range(ROUNDS):
        weight = belongs.sum(axis=0) + 1e-9
        mean = belongs.T @ shift / weight[:, None]
        log = []
        covariance = np.empty((PARTS, 2, 2))
        for k in range(PARTS):
            off = shift - mean[k]
            covariance[k] = (belongs[:, k, None] * off).T @ off / weight[k] + least_sd**2 * np.eye(2)
            far = np.einsum("ni,ij,nj->n", off, np.linalg.inv(covariance[k]), off)
            log.append(np.log(weight[k]) - np.log(np.linalg.det(covariance[k])) / 2 - far / 2)
        belongs = np.exp(np.stack(log, axis=1) - np.logaddexp.reduce(log, axis=0)[:, None])
    return weight / weight.sum(), mean, covariance
