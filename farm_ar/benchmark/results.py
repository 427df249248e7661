"""Results of a benchmark: the scores of every method in every row, and what they look like as values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from farm_ar import __version__
from farm_ar.agents.stress import StressOptions, run_stress, summarise
from farm_ar.benchmark.evaluation import SIMPLE, Answers
from farm_ar.benchmark.scores import (
    Calibration,
    Interval,
    Score,
    Scored,
    calibration,
    coverage_curve,
    mean_score,
    paired_difference,
    score,
)
from farm_ar.envs.generator import scene_of
from farm_ar.errors import UnfinishedError
from farm_ar.scenes.files import json_values
from farm_ar.sweeps import Executor, Store, Watcher

BREAKING_SCENE, BREAKING_CASES, BREAKING_QUERIES = "farm", 6, 150
"""Where the least breaking effort is looked for: the game's table, so many cases, so many snapshots each."""


@dataclass(frozen=True, eq=False)
class Results:
    """What a benchmark found.

    Args:
        suite: the suite's name.
        digest: its hash.
        quick: whether only the first snapshots of each row were asked.
        methods: names, those that were asked for first, then the simple ones.
        rows: each row's name and what it is.
        scores: by method and row; the row "all" is the mean.
        calibrations: of each method, over all rows.
        curves: coverage and accuracy of each method's most confident answers.
        breaking: least effort of each method that breaks it; None where it was not looked for.
        paired: accuracy of the first method less that of each other one asked for, by that and row; the row
            "all" is of all detections.
        notes: what must be known before the numbers are believed, one sentence each.
    """

    suite: str
    digest: str
    quick: bool
    methods: tuple[str, ...]
    rows: Mapping[str, str]
    scores: Mapping[tuple[str, str], Score]
    calibrations: Mapping[str, Calibration]
    curves: Mapping[str, tuple[Any, Any]]
    breaking: Mapping[str, float] = field(default_factory=dict)
    paired: Mapping[tuple[str, str], Interval] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def values(self) -> dict[str, Any]:
        """All of it as JSON values; what is not known is null."""
        found = [asdict(one) for one in self.scores.values()]
        values: dict[str, Any] = json_values(
            {
                "version": __version__,
                "suite": self.suite,
                "digest": self.digest,
                "quick": self.quick,
                "rows": dict(self.rows),
                "scores": found,
                "breaking_effort": dict(self.breaking),
                "paired": [
                    {"method": self.methods[0], "other": other, "row": row, **one._asdict()}
                    for (other, row), one in self.paired.items()
                ],
                "calibration": {
                    name: {
                        "answers": one.answers.tolist(),
                        "confidence": one.confidence.tolist(),
                        "right": one.right.tolist(),
                    }
                    for name, one in self.calibrations.items()
                },
                "notes": list(self.notes),
            }
        )
        return values


def results_of(
    suite: str,
    digest: str,
    answers: Answers,
    methods: Sequence[str],
    rows: Mapping[str, str],
    quick: bool = False,
) -> Results:
    """The scores of answers.

    Args:
        suite: the suite's name.
        digest: its hash.
        answers: by method and row, those of the simple methods among them.
        methods: names, in the order in which they are shown.
        rows: each row's name and what it is.
        quick: whether only the first snapshots of each row were asked.
    """
    scores, calibrations, curves, notes = {}, {}, {}, []
    for number, method in enumerate(methods):
        rng = np.random.default_rng([7, number])
        for row in rows:
            simple = {name: answers[name, row].scored for name in SIMPLE}
            mine = answers[method, row]
            scores[method, row] = score(method, row, mine.scored, simple, mine.seconds, rng)
        together = Scored.joined([answers[method, row].scored for row in rows])
        scores[method, "all"] = mean_score(method, [scores[method, row] for row in rows], together, rng)
        calibrations[method] = calibration(together, rng)
        curves[method] = coverage_curve(together)
        problems = [problem for row in rows for problem in answers[method, row].problems]
        if problems:
            total = sum(int(answers[method, row].scored.snapshot.max(initial=-1)) + 1 for row in rows)
            first = problems[0] if len(problems[0]) < 200 else f"{problems[0][:200]} ..."
            notes.append(
                f"{method} failed on {len(problems)} of {total} snapshots, which count as wrong: {first}"
            )
    paired = {
        (other, row): interval
        for other in methods[1:]
        if other not in SIMPLE
        for row, interval in _paired(answers, methods[0], other, tuple(rows))
    }
    return Results(
        suite,
        digest,
        quick,
        tuple(methods),
        rows,
        scores,
        calibrations,
        curves,
        paired=paired,
        notes=tuple(notes),
    )


def _paired(answers: Answers, first: str, other: str, rows: Sequence[str]) -> Iterator[tuple[str, Interval]]:
    """How much oftener one method is right than another, on the same snapshots, by row and in all."""
    rng = np.random.default_rng(11)
    both = [[answers[method, row].scored for row in rows] for method in (first, other)]
    for row, mine, theirs in zip(
        (*rows, "all"), *([*each, Scored.joined(each)] for each in both), strict=True
    ):
        yield row, paired_difference(mine.right, theirs.right, mine, rng)


def breaking_effort(
    methods: Sequence[str], quick: bool, store: Store, executor: Executor, watch: Watcher
) -> dict[str, float]:
    """Least effort that breaks each method: the median over some cases, infinite where no attack did.

    NaN for a method that fails there.
    """
    found = {}
    for method in methods:
        options = StressOptions(
            BREAKING_SCENE,
            reids=(method,),
            cases=BREAKING_CASES // (2 if quick else 1),
            queries=BREAKING_QUERIES // (2 if quick else 1),
            noise_draws=2,
        )
        try:
            study = run_stress(options, store, executor, watch)
        except UnfinishedError:
            found[method] = float("nan")
            continue
        labels = scene_of(BREAKING_SCENE, game=False).layout.labels
        found[method] = summarise(study, labels).reids[0].best.median
    return found
