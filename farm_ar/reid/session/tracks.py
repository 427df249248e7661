"""Tracks that go on: what a tracker's name for a thing says of its label in the next snapshot.

While a thing is tracked, that it moves away from where it was says nothing of what it is. So a track that
has moved, or whose label was confirmed, keeps what was believed of it, but for the rate at which tracks
switch to another thing; a track that stands where it began is identified by the picture as it is now.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from farm_ar.arrays import FloatArray, Record
from farm_ar.reid.answers import Assurance, Identification
from farm_ar.reid.assignment import solve_assignment
from farm_ar.scenes import Detections

STILL = 0.1
"""How far a track may be from where it began, by the spacing, and count as standing there."""

JUMP, LEAST_JUMP = 5.0, 0.5
"""A jump is farther than so many times the median of the other tracks, and than so much of the spacing."""

LEAST_BELIEF = 1e-3
"""The least probability that is remembered."""

MOST_ODDS = 20.0
"""The most that a track counts, in logarithms of odds."""

TAKEN_FOR_RIGHT = 0.9
"""Probability of labels from methods that give none."""


@dataclass(frozen=True)
class Track(Record):
    """What is believed of a thing that is tracked.

    Args:
        start: where it was identified, x and z, metres, in the map's frame.
        held: whether it has moved from there, or was confirmed, so that its picture says little.
        belief: probability of each label; what they lack of 1 is that it is none.
    """

    start: tuple[float, float]
    held: bool
    belief: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "belief", MappingProxyType(dict(self.belief)))

    def confirmed(self, label: str | None) -> Track:
        """The same, with a label that is known."""
        return replace(self, held=True, belief={} if label is None else {label: 1.0})


def going_on(
    seen: Detections, tracks: Sequence[Track | None], now: Detections, spacing: float
) -> dict[int, Track]:
    """The tracks that went on without a jump, by the detection now.

    Args:
        seen: what was seen the last time.
        tracks: what was believed of it.
        now: what is seen now, in the same frame.
        spacing: of the place's objects, metres.
    """
    earlier = {name: k for k, name in enumerate(seen.track_id) if name is not None}
    pairs = [(i, earlier[name]) for i, name in enumerate(now.track_id) if name in earlier]
    pairs = [(i, k) for i, k in pairs if np.isfinite([now.position[i], seen.position[k]]).all()]
    away = np.array([np.linalg.norm(now.position[i] - seen.position[k]) for i, k in pairs])
    found = {}
    for p, (i, k) in enumerate(pairs):
        others = np.delete(away, p)
        usual = float(np.median(others)) if len(others) else 0.0
        track = tracks[k]
        if track is not None and away[p] <= max(JUMP * usual, LEAST_JUMP * spacing):
            off = np.linalg.norm(now.position[i] - track.start)
            found[i] = replace(track, held=track.held or bool(off > STILL * spacing))
    return found


def hints(labels: Sequence[str], now: Detections, going: Mapping[int, Track]) -> dict[str, FloatArray]:
    """(M,) log-odds of each label for the detections whose tracks are held, by their ids."""
    found = {}
    for i, track in going.items():
        if track.held:
            belief = np.array([track.belief.get(label, 0.0) for label in labels])
            odds = np.log(np.maximum(belief, 1e-12) / np.maximum(1 - belief, 1e-12))
            found[now.ids[i]] = np.clip(odds, -MOST_ODDS, MOST_ODDS)
    return found


def with_tracks(
    answer: Identification,
    given: Identification | None,
    labels: Sequence[str],
    now: Detections,
    going: Mapping[int, Track],
    switch_rate: float,
) -> tuple[Identification, tuple[Track | None, ...]]:
    """An answer in the light of tracks, and what is then believed of each detection with a track.

    Args:
        answer: by the picture alone.
        given: the same if the tracks are on the objects they were on; None where the method cannot say.
        labels: all labels of the place.
        now: the detections, in the map's frame.
        going: the tracks that went on.
        switch_rate: how probable it is that a track is now on another thing.
    """
    held = [i for i, track in going.items() if track.held]
    if not any(now.track_id):
        return answer, (None,) * len(now)
    belief = _beliefs(answer, labels)
    if held:
        picture = belief.copy()
        told = np.zeros((len(held), len(labels) + 1))
        place = {label: j for j, label in enumerate(labels)}
        for row, i in zip(told, held, strict=True):
            for label, probability in going[i].belief.items():
                if label in place:
                    row[place[label]] = probability
            row[-1] = max(1 - row[:-1].sum(), 0.0)
        belief[held] = (1 - switch_rate) * told + switch_rate * picture[held]
        free = np.setdiff1d(np.arange(len(belief)), held)
        # What a track holds is nothing else's: the method knew that, but for detections that were set aside.
        others, untold = picture, held
        if given is not None:
            others, untold = _beliefs(given, labels), [i for i in held if _set_aside(given, i)]
        left = np.append(np.prod(1 - belief[untold][:, :-1], axis=0), 1.0)
        others = _normalised(others * np.maximum(left, LEAST_BELIEF)) if untold else others
        belief[free] = (1 - switch_rate) * others[free] + switch_rate * picture[free]
        answer = _decided(answer, labels, belief)
    tracks = []
    for i, name in enumerate(now.track_id):
        likely = np.flatnonzero(belief[i, :-1] > LEAST_BELIEF).tolist()
        known = {labels[j]: round(float(belief[i, j]), 6) for j in likely}
        x, z = going[i].start if i in going else now.position[i].tolist()
        lost = name is None or not np.isfinite(x + z)
        tracks.append(None if lost else Track((x, z), i in held, known))
    return answer, tuple(tracks)


def _set_aside(answer: Identification, i: int) -> bool:
    """Whether a detection was set aside from a method that gives probabilities."""
    return answer.probability is not None and not np.isfinite(answer.probability[i]).all()


def _beliefs(answer: Identification, labels: Sequence[str]) -> FloatArray:
    """(N, M + 1) probability of each label and of none; of the given label, where the method gives none."""
    belief = np.zeros((len(answer.labels), len(labels) + 1))
    place = {label: j for j, label in enumerate(labels)}
    for i, label in enumerate(answer.labels):
        belief[i, place.get(label or "", len(labels))] += TAKEN_FOR_RIGHT
        belief[i, -1] += 1 - TAKEN_FOR_RIGHT
    if answer.probability is not None:
        known = np.isfinite(answer.probability).all(axis=1)
        belief[known] = 0.0
        for c, label in enumerate(answer.candidates):
            belief[known, place[label]] = answer.probability[known, c]
        belief[known, -1] = answer.probability[known, -1]
    return belief


def _normalised(rows: FloatArray) -> FloatArray:
    total: FloatArray = rows.sum(axis=-1, keepdims=True)
    return rows / np.where(total > 0, total, 1.0)


def _decided(answer: Identification, labels: Sequence[str], belief: FloatArray) -> Identification:
    """The labels of which as many as possible are right on average."""
    n, m = len(belief), len(labels)
    none = np.where(np.eye(n, dtype=bool), 1 - belief[:, -1:], np.inf)
    chosen = solve_assignment(np.hstack([1 - belief[:, :-1], none]))
    given = tuple(labels[j] if j < m else None for j in chosen)
    sure = belief[np.arange(n), np.minimum(chosen, m)]
    told = answer.probability is not None
    return replace(
        answer,
        labels=given,
        cost=np.where(chosen < m, 1 - sure, np.nan),
        candidates=tuple(labels),
        assurance=Assurance(
            runner_up=tuple(_second(row, j, labels) for row, j in zip(belief, chosen, strict=True)),
            confidence=sure if told else None,  # type: ignore[arg-type]  # filled in
            probability=belief if told else None,
            warnings=answer.warnings,
        ),
    )


def _second(row: FloatArray, chosen: int, labels: Sequence[str]) -> str | None:
    """The most probable label but the one that was given."""
    others = np.delete(np.arange(len(row)), min(int(chosen), len(row) - 1))
    best = int(others[row[others].argmax()]) if len(others) else len(labels)
    return labels[best] if best < len(labels) else None
