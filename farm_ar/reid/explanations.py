"""What a user may ask of an answer: why a detection has its label, and which answers are the next best."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError, SnapshotError
from farm_ar.reid.answers import Identification
from farm_ar.reid.assignment import k_best
from farm_ar.reid.base import Reidentifier, as_reidentifier
from farm_ar.reid.beliefs import beliefs
from farm_ar.reid.categories import may_have
from farm_ar.reid.relational.method import RelationalReid
from farm_ar.scenes import Snapshot, World
from farm_ar.scenes.worlds import OURS

TOLD, MOST_TOLD = 0.01, 3
"""The least probability of other labels that are reported, and how many of them."""


@dataclass(frozen=True)
class Candidate:
    """One label for a detection.

    Args:
        label: its name.
        shift_m: distance from where it was to the detection, metres.
        turn_deg: by how much it would have turned, degrees, 0 to 180; NaN where a heading is not known.
        terms: of the cost, by name; none where the method's costs are no sums.
        probability: that it is the right one; NaN where the method gives none.
    """

    label: str
    shift_m: float
    turn_deg: float
    terms: Mapping[str, float]
    probability: float = float("nan")

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
        others: the most probable of the other labels; where there are no probabilities, the nearest one.
        none: probability that it is none of the labels; NaN where the method gives none.
        believed: of how things moved, a sentence each.
        reason: why it has no label, where it has none and that is known.
        world: in whose units lengths are given.
    """

    detection: str
    given: Candidate | None
    runner_up: Candidate | None
    confidence: float
    margin: float
    others: tuple[Candidate, ...] = ()
    none: float = float("nan")
    believed: tuple[str, ...] = ()
    reason: str | None = None
    world: World = OURS

    def words(self) -> str:
        """The explanation in a few sentences, lengths in the units of the snapshot's file."""
        return " ".join([self._decided(), *self._alternatives(), *self.believed])

    def _decided(self) -> str:
        if self.given is None:
            return self._undecided()
        text = f"{self.detection} is {_moved(self.given, self.world)}"
        if self.runner_up is None and np.isfinite(self.margin) and self.given.terms:
            return (
                f"{text}; another detection could have that label instead, for {self.margin:.2f} more in all."
            )
        if self.runner_up is None:
            without = (
                "" if np.isnan(self.margin) or self.others else "; without that label it would have none"
            )
            return f"{text}{without}."
        if not self.given.terms and (self.others or self.runner_up.probability < TOLD):
            return f"{text}."
        text += f"; it could be {_moved(self.runner_up, self.world)}."
        gaps = {name: self.runner_up.terms[name] - value for name, value in self.given.terms.items()}
        for_it = [f"{name} (+{gap:.2f})" for name, gap in _largest(gaps) if gap > 0]
        against = [f"{name} ({gap:.2f})" for name, gap in _largest(gaps) if gap < 0]
        if for_it:
            text += f" For {self.given.label}: {', '.join(for_it)}."
        if against:
            text += f" Against it: {', '.join(against)}."
        if gaps and sum(gaps.values()) <= 0:
            text += f" {self.runner_up.label} alone would cost no more, but another detection needs it."
        return text

    def _undecided(self) -> str:
        sure = "" if np.isnan(self.confidence) else f" (probability {self.confidence:.2f})"
        likeliest = self.runner_up or (self.others[0] if self.others else None)
        other = "" if likeliest is None else f"; the likeliest would be {_moved(likeliest, self.world)}"
        why = "" if self.reason is None else f": {self.reason}"
        if likeliest is not None and likeliest.probability > self.confidence:
            return f"{self.detection} has no label{why}{other}."
        return f"{self.detection} is none of the labels{sure}{why}{other}."

    def _alternatives(self) -> list[str]:
        """The other labels and none, with their probabilities; or the nearest other label."""
        said = {self.runner_up and self.runner_up.label} if self.given is None or self.given.terms else set()
        said |= {self.others[0].label} if self.given is None and self.others else set()
        told = [_moved(one, self.world) for one in self.others if one.label not in said]
        if told and np.isnan(self.none):
            return [f"The nearest other label that it could have: {told[0]}."]
        told += [f"none of the labels ({self.none:.2f})"] if self.given and self.none >= TOLD else []
        return [f"Otherwise {', or '.join(told)}."] if told else []


def explain(reid: Reidentifier, snapshot: Snapshot, detection: int | str) -> Explanation:
    """Why a detection of a snapshot gets the label that a method gives it.

    Of a method whose costs are sums of terms, these are compared; of one that gives probabilities, the
    likeliest labels are listed; and of one that averages over motions, which ones it believed in.

    Args:
        reid: the re-identifier.
        snapshot: what was seen.
        detection: its index or its id.

    Raises:
        SnapshotError: there is no such detection, or a category is not one of the scene's.
    """
    reid = as_reidentifier(reid)
    seen, layout = snapshot.detections, reid.scene.layout
    known = dict(zip(seen.ids, range(len(seen)), strict=True))
    i = known.get(detection, -1) if isinstance(detection, str) else detection
    if not 0 <= i < len(seen):
        expected = f"must be one of {', '.join(seen.ids)}, or an index below {len(seen)}"
        raise SnapshotError("detection", expected, detection)
    found, terms = reid.identify(snapshot), _terms(reid, snapshot)
    chance, none = _probabilities(found, i)

    def candidate(label: str) -> Candidate:
        j = layout.index(label)
        shift = float(np.hypot(*(seen.position[i] - layout.position[j])))
        turn = abs(np.rad2deg(seen.yaw[i] - layout.yaw[j])) % 360
        named = {name: float(term[i, j]) for name, term in terms.items()}
        return Candidate(label, shift, float(min(turn, 360 - turn)), named, chance.get(label, np.nan))

    given, second = found.labels[i], found.runner_up[i]
    others = sorted((label for label in chance if label != given), key=lambda label: -chance[label])
    others = [label for label in others if chance[label] >= TOLD][:MOST_TOLD]
    if not chance and second is None:
        others = _nearest(reid, snapshot, i, given)
    return Explanation(
        seen.ids[i],
        None if given is None else candidate(given),
        None if second is None else candidate(second),
        float(found.confidence[i]),
        float(found.margin[i]),
        tuple(candidate(label) for label in others),
        none,
        beliefs(reid, snapshot),
        found.reason[i],
        snapshot.world,
    )


def _terms(reid: Reidentifier, snapshot: Snapshot) -> Mapping[str, FloatArray]:
    """The terms of a method's costs; none where it has no such costs, or others decide."""
    if isinstance(reid, RelationalReid):  # its terms are those of things that move alone
        return {}
    try:
        return reid.cost_terms(snapshot)
    except OptionError:
        return {}


def _probabilities(found: Identification, i: int) -> tuple[dict[str, float], float]:
    """The probability of each label for a detection, and of none; nothing where the method gives none."""
    if found.probability is None or not np.isfinite(found.probability[i]).all():
        return {}, np.nan
    row = found.probability[i].tolist()
    return dict(zip(found.candidates, row[:-1], strict=True)), row[-1]


def _nearest(reid: Reidentifier, snapshot: Snapshot, i: int, given: str | None) -> list[str]:
    """The label nearest to a detection that it could have beside the one given."""
    seen, layout = snapshot.detections, reid.scene.layout
    away = np.linalg.norm(layout.position - seen.position[i], axis=1)
    may_be = may_have(layout, seen.category[i])
    return [layout.labels[j] for j in np.argsort(away) if may_be[j] and layout.labels[j] != given][:1]


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


def _moved(one: Candidate, world: World) -> str:
    turn = "" if np.isnan(one.turn_deg) else f" and turned {one.turn_deg:.0f}°"
    chance = "" if np.isnan(one.probability) else f" ({one.probability:.2f})"
    return f"{one.label}, moved {world.length(one.shift_m)}{turn}{chance}"


def _largest(gaps: Mapping[str, float]) -> list[tuple[str, float]]:
    """The terms that differ noticeably, those that differ most first."""
    return sorted(((n, g) for n, g in gaps.items() if abs(g) >= 0.005), key=lambda item: -abs(item[1]))
