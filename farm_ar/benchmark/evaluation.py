"""Asking methods: each snapshot of a suite put to each method, in parts that a sweep keeps."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.benchmark.frozen import authors_rows, frozen_suite
from farm_ar.benchmark.scores import FAILED, Scored, brier_scores, outcomes
from farm_ar.benchmark.suite import Suite, made_examples, read_folder
from farm_ar.benchmark.worlds import ROWS
from farm_ar.benchmark.worlds.base import Example
from farm_ar.errors import SnapshotError
from farm_ar.reid import REIDENTIFIERS, ReidFactory, as_reidentifier, load_reid
from farm_ar.sweeps import Executor, Outcome, Store, Sweep, Watcher, run_sweep
from farm_ar.sweeps.unit import code_version

SIMPLE = ("nearest", "distance", "squared-distance")
"""Assignments that everything has to beat: the nearest label, and the least sums of distances and squares."""

PART = 10
"""Snapshots of a unit of work."""


@dataclass(frozen=True)
class Source:
    """Where a suite comes from, as JSON values from which any process makes it again.

    Args:
        kind: "frozen", "authors" or "data" (folders), or "worlds" (made anew).
        place: the folder.
        digest: of the content, where that is not frozen.
        seed: of the worlds.
        count: snapshots in each row of the worlds.
    """

    kind: str = "frozen"
    place: str = ""
    digest: str = ""
    seed: int = 0
    count: int = 0

    def examples(self, row: str) -> Sequence[Example]:
        """The snapshots of a row."""
        if self.kind == "worlds":
            return _world(row, self.seed, self.count)
        return _suite(self).by_name[row].examples


@lru_cache(maxsize=2)
def _world(name: str, seed: int, count: int) -> Sequence[Example]:
    return made_examples(ROWS[name], seed, count)


@lru_cache(maxsize=3)
def _suite(source: Source) -> Suite:
    if source.kind == "frozen":
        return frozen_suite()
    if source.kind == "authors":
        suite = Suite("authors", authors_rows(Path(source.place)))
    else:
        suite = read_folder(source.place)
    if suite.digest != source.digest:
        expected = "must stay as it is while methods are asked"
        raise SnapshotError("folder", expected, "another content", source.place)
    return suite


class Answered(NamedTuple):
    """One method's answers to one row: what they score, seconds of each snapshot, what went wrong."""

    scored: Scored
    seconds: list[float]
    problems: list[str]


Answers = dict[tuple[str, str], Answered]
"""The answers by method and row."""


def ask_all(
    sources: Sequence[tuple[Source, Mapping[str, int]]],
    methods: Sequence[str],
    store: Store,
    executor: Executor | None = None,
    watch: Watcher = lambda standing: None,
    fresh: bool = False,
    version: str | None = None,
) -> Answers:
    """Put all snapshots to all methods. What is in the store is not asked again.

    A method that fails on a snapshot, or a part that is not finished in time, leaves it without an answer.

    Args:
        sources: each with the number of snapshots to take of each of its rows.
        methods: names, as `load_reid` takes them.
        store: where answers are kept.
        executor: where the work is done; by default in this process.
        watch: is called with the progress.
        fresh: whether to forget what is in the store.
        version: of the code, given by the caller; by default the hash of all of it.

    Raises:
        StoreError: the store cannot be used.
    """
    calls, sizes = [], {}
    for source, counts in sources:
        for row, count in counts.items():
            for method in methods:
                for first in range(0, count, PART):
                    part = {"first": first, "last": min(first + PART, count)}
                    code = "" if method in REIDENTIFIERS else code_version(method)
                    calls.append({"source": vars(source), "row": row, "method": method, "code": code, **part})
                sizes[method, row] = source, count
    sweep = Sweep("benchmark", answer_part, calls, version=version)
    found = run_sweep(sweep, store, executor, fresh=fresh, watch=watch)
    parts: dict[tuple[str, str], list[tuple[int, Mapping[str, Any], float]]] = {}
    for _, outcome in found.finished():
        for values, measured in zip(outcome.rows, outcome.measured, strict=True):
            key = str(values["method"]), str(values["row"])
            parts.setdefault(key, []).append((int(values["index"]), values, float(measured["seconds"])))
    reasons = [failure.problem.strip().splitlines()[-1] for failure in found.failures]
    return {
        key: _assembled(source, key[1], count, parts.get(key, []), reasons)
        for key, (source, count) in sizes.items()
    }


def _assembled(
    source: Source,
    row: str,
    count: int,
    parts: Iterable[tuple[int, Mapping[str, Any], float]],
    reasons: Sequence[str],
) -> Answered:
    """One method's answers to one row, in the order of the snapshots."""
    known = {index: (values, seconds) for index, values, seconds in parts}
    snapshot, outcome, confidence, brier = [], [], [], []
    problems = [values["problem"] for values, _ in known.values() if values["problem"]]
    for i in range(count):
        if i in known:
            values = known[i][0]
        else:
            number = len(source.examples(row)[i].truth)
            values = {"outcome": FAILED * number, "confidence": [np.nan] * number, "brier": [np.nan] * number}
            problems.append(reasons[0] if reasons else "no answer")
        outcome.append(values["outcome"])
        snapshot.append(np.full(len(values["outcome"]), i))
        confidence.append(np.array(values["confidence"], dtype=np.float64))
        brier.append(np.array(values["brier"], dtype=np.float64))
    scored = Scored(
        np.concatenate(snapshot), "".join(outcome), np.concatenate(confidence), np.concatenate(brier)
    )
    return Answered(scored, [seconds for _, seconds in known.values()], problems)


def answer_part(
    seed: int, source: Mapping[str, Any], row: str, method: str, first: int, last: int, code: str = ""
) -> Outcome:
    """A unit of the sweep: one method on some snapshots of a row.

    Args:
        seed: not used; nothing is random.
        source: where the suite comes from.
        row: the row's name.
        method: the method's name.
        first: the first snapshot.
        last: the one after the last.
        code: distinguishes results that other code gave under the same name.
    """
    examples = Source(**source).examples(row)[first:last]
    make = load_reid(method)
    if method not in _warm:  # kernels are compiled before anything is timed
        _warm.add(method)
        answer(make, examples[0])
    rows, measured = [], []
    for index, example in enumerate(examples, start=first):
        begin = time.perf_counter()
        found = answer(make, example)
        seconds = time.perf_counter() - begin
        rows.append({"row": row, "method": method, "index": index, **found._asdict()})
        measured.append({"row": row, "method": method, "index": index, "seconds": seconds})
    return Outcome(rows, measured)


_warm: set[str] = set()
"""Methods that this process has asked before."""


class Answer(NamedTuple):
    """What one method made of one snapshot: as in `Scored`; and what went wrong, "" for nothing."""

    outcome: str
    confidence: FloatArray
    brier: FloatArray
    problem: str = ""


def answer(make: ReidFactory, example: Example) -> Answer:
    """Ask a method, made for the example's scene. What it raises becomes a failed answer."""
    scene, snapshot, truth = example
    try:
        found = as_reidentifier(make(scene), scene).identify(snapshot)
        if len(found.labels) != len(truth):
            expected = f"must be a label or None for each of {len(truth)} detections"
            raise SnapshotError("labels", expected, found.labels)
        strange = [label for label in found.labels if label is not None and label not in scene.layout.labels]
        if strange:
            raise SnapshotError("labels", "must be labels of the scene, or None", strange[0])
        confidence = checked_confidence(found.confidence)
        return Answer(
            outcomes(found.labels, truth), confidence, brier_scores(found, truth, scene.layout.labels)
        )
    except Exception as problem:
        nothing = np.full(len(truth), np.nan)
        return Answer(FAILED * len(truth), nothing, nothing, f"{type(problem).__name__}: {problem}")


def checked_confidence(confidence: FloatArray) -> FloatArray:
    """Confidences, if each is a probability, or NaN for "does not say".

    Raises:
        SnapshotError: one is neither.
    """
    wrong = (confidence < -1e-9) | (confidence > 1 + 1e-9)
    if wrong.any():
        raise SnapshotError("confidence", "must be from 0 to 1", float(confidence[wrong][0]))
    return np.clip(confidence, 0.0, 1.0)
