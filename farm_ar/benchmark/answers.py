"""Answers from elsewhere: a JSON file of labels, made in any language, scored like a method's own."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from farm_ar.benchmark.evaluation import Answered, Answers
from farm_ar.benchmark.scores import FAILED, Scored, brier_of_confidence, outcomes
from farm_ar.benchmark.suite import ANSWERS, Suite
from farm_ar.benchmark.worlds.base import Example
from farm_ar.errors import OptionError
from farm_ar.scenes.files import read_json


class Given(NamedTuple):
    """What a file holds: the name of what made it, its answers by row, how many snapshots it leaves out."""

    method: str
    answers: Answers
    missing: int


def read_answers(path: str | os.PathLike[str], suite: Suite) -> Given:
    """The answers of a file, scored against a suite.

    A snapshot that the file leaves out counts as if every answer to it were wrong.

    Raises:
        OptionError: the file is not of its form, is for another suite, or names a snapshot, a label or a
            number of detections that the suite has not.
    """
    source = Path(path).name
    content = ANSWERS.read(read_json(path, OptionError), source)
    if content["suite"] != suite.name:
        raise OptionError("suite", f"must be {suite.name}", content["suite"], source)
    given = dict(content["answers"])
    answers: Answers = {}
    missing = 0
    for row in suite.rows:
        parts, seconds = [], []
        for i, example in enumerate(row.examples):
            key = row.key(i)
            one = given.pop(key, None)
            missing += one is None
            parts.append(_scored(one, example, key, source))
            if one is not None and one["seconds"] is not None:
                seconds.append(one["seconds"])
        problems = ["not in the file"] * sum(FAILED in part.outcome for part in parts)
        answers[content["method"], row.name] = Answered(Scored.joined(parts), seconds, problems)
    if given:
        expected = f"must be the name of a snapshot of {suite.name}"
        raise OptionError("answers", expected, next(iter(given)), source)
    return Given(content["method"], answers, missing)


def _scored(one: dict[str, Any] | None, example: Example, key: str, source: str) -> Scored:
    """What the answers to one snapshot score."""
    truth, known = example.truth, example.scene.layout.labels
    place, nothing = np.zeros(len(truth), dtype=np.int64), np.full(len(truth), np.nan)
    if one is None:
        return Scored(place, FAILED * len(truth), nothing, nothing)
    for name in ("labels", "confidence"):
        if one[name] is not None and len(one[name]) != len(truth):
            expected = f"must have an entry for each of {len(truth)} detections"
            raise OptionError(f"answers.{key}.{name}", expected, len(one[name]), source)
    for i, label in enumerate(one["labels"]):
        if label is not None and label not in known:
            raise OptionError(
                f"answers.{key}.labels[{i}]", "must be a label of the scene, or null", label, source
            )
    outcome = outcomes(one["labels"], truth)
    confidence = nothing if one["confidence"] is None else np.array(one["confidence"], dtype=np.float64)
    return Scored(place, outcome, confidence, brier_of_confidence(confidence, outcome, len(known)))
