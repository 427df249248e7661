"""How far poses from pixels can be trusted: probabilities and covariances, fitted to measured errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.optimize import minimize

from farm_ar.arrays import BoolArray, FloatArray

GAIN, MOST_MOVED = (-2.0, 6.0), 8.0
"""Bounds of the nats a pixel, and of the move in expected errors, as they count for a score."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is known of N objects beside their poses.

    Args:
        heat: (N,) of the network's peaks.
        visible: (N,) share that is seen, as the network has it.
        flipped: (N,) probability that the heading is the opposite, as the network has it.
        spread: (N, 2) expected absolute errors as the network has them, metres and radians.
        away: (N,) metres from the eye on the plane.
        gain: (N,) nats a pixel by which the thing explains the image better than none; 0 where not refined.
        seen: (N,) share of it that no other thing hides and that is in the image; 1 where not refined.
        moved: (N,) metres by which refinement moved it.
        flip: (N,) nats a pixel by which the opposite heading is worse; NaN where that was not tried.
    """

    heat: FloatArray
    visible: FloatArray
    flipped: FloatArray
    spread: FloatArray
    away: FloatArray
    gain: FloatArray
    seen: FloatArray
    moved: FloatArray
    flip: FloatArray

    @classmethod
    def joined(cls, several: Sequence[Evidence]) -> Evidence:
        """That of several images."""
        return cls(*(np.concatenate([getattr(one, field.name) for one in several]) for field in fields(cls)))

    def for_score(self) -> FloatArray:
        """(N, 5) features by which it is predicted whether there is such a thing."""
        heat = np.clip(self.heat, 1e-4, 1 - 1e-4)
        return np.column_stack(
            [
                np.ones(len(heat)),
                np.log(heat / (1 - heat)),
                np.clip(self.gain, *GAIN),
                np.log(np.clip(self.visible, 0.03, 1)),
                np.minimum(self.moved / np.maximum(self.spread[:, 0], 1e-6), MOST_MOVED),
            ]
        )

    def for_flip(self) -> FloatArray:
        """(N, 3) features by which it is predicted whether the heading is the opposite."""
        share = np.clip(self.flipped, 0.002, 0.5)
        worse = np.arcsinh(2 * np.nan_to_num(self.flip))
        return np.column_stack([np.ones(len(share)), np.log(share / (1 - share)), worse])

    def for_spread(self) -> FloatArray:
        """(N, 7) features by which the size of errors is predicted."""
        moved = self.moved / np.maximum(self.spread[:, 0], 1e-6)
        return np.column_stack(
            [
                np.ones(len(self.heat)),
                np.log(np.maximum(self.spread[:, 0], 1e-6)),
                np.log(np.maximum(self.spread[:, 1], 1e-6)),
                np.log(np.clip(self.visible, 0.03, 1)),
                np.log1p(np.clip(self.gain, 0, 100)),
                np.minimum(moved, 6.0),
                np.log(np.clip(self.heat, 0.01, 1)),
            ]
        )


PLAIN: dict[str, Any] = {
    "score": [0.0, 1.0, 0.0, 0.0, 0.0],
    "flip": [0.0, 1.0, 0.0],
    "along": [0.2, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    "across": [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    "turn": [0.2, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
}
"""What the network says of itself."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Coefficients, each on the columns of `Evidence`'s method of that name.

    Args:
        score: of the logit that there is such a thing.
        flip: of the logit that the heading is the opposite.
        along: of the logarithm of the SD away from the eye, metres.
        across: to its side.
        turn: of the yaw, radians.
        least_rival: probability from which on an opposite heading is reported.
    """

    score_of: FloatArray
    flip_of: FloatArray
    along_of: FloatArray
    across_of: FloatArray
    turn_of: FloatArray
    least_rival: float = 0.01

    @classmethod
    def of(cls, known: Mapping[str, Any], refined: bool) -> Calibration:
        """That of a network's file, or what the network says of itself."""
        values = PLAIN | known.get("refined" if refined else "unrefined", {})
        score, flip, along, across, turn = (np.array(values[name], float) for name in PLAIN)
        return cls(score, flip, along, across, turn)

    def score(self, evidence: Evidence) -> FloatArray:
        """(N,) probability that there is such a thing."""
        return _logistic(evidence.for_score() @ self.score_of)

    def most(self, heat: FloatArray, visible: FloatArray) -> FloatArray:
        """(N,) the highest score that objects may have, whatever refinement makes of them."""
        n, best = len(heat), np.zeros(len(heat))
        nothing, one = np.zeros(n), np.ones(n)
        for gain in (nothing + GAIN[0], nothing, nothing + GAIN[1]):
            for moved in (nothing, one * MOST_MOVED):
                seen = Evidence(heat, visible, nothing, np.ones((n, 2)), one, gain, one, moved, nothing)
                best = np.maximum(best, self.score(seen))
        return best

    def flipped(self, evidence: Evidence) -> FloatArray:
        """(N,) probability that the heading is the opposite."""
        return _logistic(evidence.for_flip() @ self.flip_of)

    def covariance(self, evidence: Evidence, toward: FloatArray) -> FloatArray:
        """(N, 3, 3) of x, z and yaw, for objects that stand in directions (N,) from the eye, radians."""
        columns = evidence.for_spread()
        along, across, turn = (
            np.exp(np.clip(columns @ of, -9, 2)) for of in (self.along_of, self.across_of, self.turn_of)
        )
        sine, cosine = np.sin(toward), np.cos(toward)
        found = np.zeros((len(toward), 3, 3))
        found[:, 0, 0] = (sine * along) ** 2 + (cosine * across) ** 2
        found[:, 1, 1] = (cosine * along) ** 2 + (sine * across) ** 2
        found[:, 0, 1] = found[:, 1, 0] = sine * cosine * (along**2 - across**2)
        found[:, 2, 2] = turn**2
        return found


def fit_logistic(
    columns: FloatArray, right: BoolArray, toward: FloatArray, prior: float = 1.0
) -> list[float]:
    """Coefficients of the logit of a probability, drawn towards some others as if by `prior` observations."""

    def cost(weights: FloatArray) -> float:
        logit = columns @ weights
        return float(
            np.logaddexp(0, np.where(right, -logit, logit)).sum() + prior * ((weights - toward) ** 2).sum()
        )

    found: list[float] = minimize(cost, toward, method="L-BFGS-B").x.round(4).tolist()
    return found


def fit_spread(columns: FloatArray, error: FloatArray, toward: FloatArray, prior: float = 1.0) -> list[float]:
    """Coefficients of the logarithm of the SD of errors (N,), of which a few may be far larger.

    The errors are taken to be of Laplace's distribution, whose tails are long.
    """
    size = np.sqrt(2) * np.abs(error)

    def cost(weights: FloatArray) -> float:
        logs = np.clip(columns @ weights, -12, 3)
        return float((logs + size * np.exp(-logs)).sum() + prior * ((weights - toward) ** 2).sum())

    found: list[float] = minimize(cost, toward, method="L-BFGS-B").x.round(4).tolist()
    return found


def _logistic(logit: FloatArray) -> FloatArray:
    found: FloatArray = 1 / (1 + np.exp(-np.clip(logit, -40, 40)))
    return found
