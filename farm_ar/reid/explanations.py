"""What a user may ask of an answer: why a detection has its label, and which answers are the next best."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from farm_ar.errors import SnapshotError
from farm_ar.reid.assignment import k_best
from farm_ar.reid.base import Identification, Reidentifier, as_reidentifier
from farm_ar.scenes import Snapshot


@dataclass(frozen=True)
class Candidate:
    """One label for a detection.

    Args:
        label: its name.
        shift_m: distance from where it was to the detection, metres.
        turn_deg: by how much it would have turned, degrees, 0 to 180; NaN where a heading is not known.
        terms: of the cost, by name.
    """

    label: str
    shift_m: float
    turn_deg: float
    terms: Mapping[str, float]

    @property
    def total(self) -> float:
        """Sum of the terms."""
        return sum(self.terms.values())


@dataclass(frozen=True)
class Explanation:
    """Why a detection has its label rather than the runner-up.

    Args:
        detection: its id.
        given: the label it has; None where it stays unidentified.
        runner_up: the label it would have without that one; None where there is no other.
        confidence: probability that the answer is right; NaN where not known.
        margin: rise of the total cost without the label given; NaN where not known.
    """

    detection: str
    given: Candidate | None
    runner_up: Candidate | None
    confidence: float
    margin: float

    def words(self) -> str:
        """The explanation in a few sentences."""
        if self.given is None:
            sure = "" if np.isnan(self.confidence) else f" (probability {self.confidence:.2f})"
            return f"{self.detection} is none of the labels{sure}{self._nearest()}."
        text = f"{self.detection} is {_moved(self.given)}"
        if self.runner_up is None and np.isfinite(self.margin):
            return (
                f"{text}; another detection could have that label instead, for {self.margin:.2f} more in all."
            )
        if self.runner_up is None:
            return f"{text}; without that label it would have none."
        text += f"; it could be {_moved(self.runner_up)}."
        gaps = {name: self.runner_up.terms[name] - value for name, value in self.given.terms.items()}
        for_it = [f"{name} (+{gap:.2f})" for name, gap in _largest(gaps) if gap > 0]
        against = [f"{name} ({gap:.2f})" for name, gap in _largest(gaps) if gap < 0]
        if for_it:
            text += f" For {self.given.label}: {', '.join(for_it)}."
        if against:
            text += f" Against it: {', '.join(against)}."
        if sum(gaps.values()) <= 0:
            text += f" {self.runner_up.label} alone would cost no more, but another detection needs it."
        return text

    def _nearest(self) -> str:
        return "" if self.runner_up is None else f"; the likeliest would be {_moved(self.runner_up)}"


def explain(reid: Reidentifier, snapshot: Snapshot, detection: int | str) -> Explanation:
    """Why a detection of a snapshot gets the label that a rule gives it.

    Args:
        reid: the re-identifier.
        snapshot: what was seen.
        detection: its index or its id.

    Raises:
        OptionError: the re-identifier's costs have no terms.
        SnapshotError: there is no such detection, or a category is not one of the scene's.
    """
    reid = as_reidentifier(reid)
    seen, layout = snapshot.detections, reid.scene.layout
    known = dict(zip(seen.ids, range(len(seen)), strict=True))
    i = known.get(detection, -1) if isinstance(detection, str) else detection
    if not 0 <= i < len(seen):
        expected = f"must be one of {', '.join(seen.ids)}, or an index below {len(seen)}"
        raise SnapshotError("detection", expected, detection)
    found, terms = reid.identify(snapshot), reid.cost_terms(snapshot)

    def candidate(label: str | None) -> Candidate | None:
        if label is None:
            return None
        j = layout.index(label)
        shift = float(np.hypot(*(seen.position[i] - layout.position[j])))
        turn = abs(np.rad2deg(seen.yaw[i] - layout.yaw[j])) % 360
        named = {name: float(term[i, j]) for name, term in terms.items()}
        return Candidate(label, shift, float(min(turn, 360 - turn)), named)

    return Explanation(
        seen.ids[i],
        candidate(found.labels[i]),
        candidate(found.runner_up[i]),
        float(found.confidence[i]),
        float(found.margin[i]),
    )


def alternatives(reid: Reidentifier, snapshot: Snapshot, k: int) -> list[Identification]:
    """The k best answers, the best first; fewer where there are not so many different ones.

    Args:
        reid: the re-identifier.
        snapshot: what was seen.
        k: how many.

    Raises:
        OptionError: k is below 1, or the re-identifier has no costs.
        SnapshotError: a detection's category is not one of the scene's.
    """
    cost, names = as_reidentifier(reid).problem(snapshot)
    candidates = tuple(name for name in names if name is not None)
    answers = []
    for column, _ in k_best(cost, k):
        labels = tuple(None if j < 0 else names[j] for j in column.tolist())
        given = np.array([label is not None for label in labels], dtype=bool)
        costs = np.full(len(labels), np.nan)
        costs[given] = cost[given.nonzero()[0], column[given]]
        answers.append(Identification(labels, costs, candidates))
    return answers


def _moved(one: Candidate) -> str:
    turn = "" if np.isnan(one.turn_deg) else f" and turned {one.turn_deg:.0f}°"
    return f"{one.label}, moved {one.shift_m:.2f} m{turn}"


def _largest(gaps: Mapping[str, float]) -> list[tuple[str, float]]:
    """The terms that differ noticeably, those that differ most first."""
    return sorted(((n, g) for n, g in gaps.items() if abs(g) >= 0.005), key=lambda item: -abs(item[1]))
