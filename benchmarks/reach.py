"""How far methods reach: every world of the benchmark with many detections, and what is asked of a method.

    python benchmarks/reach.py adaptive --detections 20000 --store out/reach.sqlite --out out/reach.json

asks each method, the simple assignments and a method that is given each row's true motions, and prints for
the first method which of the criteria it reaches. It resumes where it was stopped. `--rows` and
`--detections` make it small.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from rich.console import Console
from told import Motion, ToldReid

from farm_ar.benchmark.evaluation import SIMPLE, Answers, Source, answer, ask_all
from farm_ar.benchmark.scores import (
    Interval,
    Score,
    Scored,
    mean_score,
    paired_difference,
    score,
    selective,
)
from farm_ar.benchmark.suite import made_examples
from farm_ar.benchmark.worlds import ROWS, Example
from farm_ar.sweeps import Store, make_executor
from farm_ar.sweeps.progress import shown

PRESENT = ("spatial", "likelihood", "relational")
"""Methods whose Brier score must not be exceeded."""

LEAST_GAIN, LEAST_MEAN, MOST_ERROR, MOST_NONE = -0.01, 0.05, 0.03, 0.01
SURE_RIGHT, SURE_COVERAGE = 0.95, 0.8


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("methods", nargs="+")
    parser.add_argument("--detections", type=int, default=20_000, help="in each row, at least")
    parser.add_argument("--rows", default="", help="names with commas between them, or how they begin")
    parser.add_argument("--seed", type=int, default=20)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--store", type=Path, default=Path("out/reach.sqlite"))
    parser.add_argument("--version", default=None, help="of the code, by hand: keeps results of other code")
    parser.add_argument("--out", type=Path, default=Path("out/reach.json"))
    options = parser.parse_args()
    beginnings = tuple(options.rows.split(","))
    rows = [name for name in ROWS if name.startswith(beginnings)]
    methods = list(dict.fromkeys([*options.methods, *SIMPLE]))
    options.store.parent.mkdir(parents=True, exist_ok=True)
    executor = make_executor("process" if options.workers > 1 else "serial", options.workers)
    answers: Answers = {}
    told: dict[str, Scored] = {}
    with Store(options.store) as store, executor, shown(Console(stderr=True)) as watch:
        for row in rows:
            count = snapshots_for(row, options.detections)
            source = Source("worlds", seed=options.seed, count=count)
            answers |= ask_all(
                [(source, {row: count})], methods, store, executor, watch, version=options.version
            )
            told[row] = told_answers(source.examples(row))
    found = {(method, row): scored_row(answers, method, row) for method in methods for row in rows}
    print_rows(found, told, rows, methods)
    print_criteria(answers, found, told, rows, options.methods[0])
    options.out.write_text(json.dumps([asdict(one) for one in found.values()], indent=1))


def snapshots_for(row: str, detections: int) -> int:
    """How many snapshots of a row have so many detections, with some to spare."""
    each = np.mean([len(example.truth) for example in made_examples(ROWS[row], 0, 40)])
    return int(np.ceil(1.05 * detections / each))


def told_answers(examples: Sequence[Example]) -> Scored:
    """The answers of the method that is given the row's motions."""
    motion = Motion(examples)
    parts = []
    for example in examples:
        found = answer(lambda scene: ToldReid(scene, motion), example)
        if found.problem:
            raise RuntimeError(found.problem)
        first = np.zeros(len(found.outcome), dtype=np.int64)
        parts.append(Scored(first, found.outcome, found.confidence, found.brier))
    return Scored.joined(parts)


def scored_row(answers: Answers, method: str, row: str) -> Score:
    """The score of one method on one row."""
    mine = answers[method, row]
    for problem in mine.problems[:1]:
        print(f"{method}, {row}: {len(mine.problems)} snapshots failed, the first with {problem}")
    simple = {name: answers[name, row].scored for name in SIMPLE}
    return score(method, row, mine.scored, simple, mine.seconds, np.random.default_rng(0))


def print_rows(
    found: dict[tuple[str, str], Score], told: dict[str, Scored], rows: Sequence[str], methods: Sequence[str]
) -> None:
    """A Markdown table: accuracy of all methods by row, ECE less its expectation in brackets."""
    print(f"| row | {' | '.join(methods)} | known motions |\n|---|{'--:|' * (len(methods) + 1)}")
    for row in rows:
        cells = []
        for method in methods:
            one = found[method, row]
            error = "" if np.isnan(one.calibration_error) else f" ({one.calibration_error:.3f})"
            cells.append(f"{one.accuracy:.3f}{error}")
        print(f"| {row} | {' | '.join(cells)} | {told[row].right.mean():.3f} |")
    means = [np.mean([found[method, row].accuracy for row in rows]) for method in methods]
    print(f"| mean | {' | '.join(f'{mean:.3f}' for mean in means)} | |")
    times = [np.mean([found[method, row].milliseconds for row in rows]) for method in methods]
    print(f"| ms a snapshot | {' | '.join(f'{time:.1f}' for time in times)} | |")


def print_criteria(
    answers: Answers,
    found: dict[tuple[str, str], Score],
    told: dict[str, Scored],
    rows: Sequence[str],
    method: str,
) -> None:
    """Each criterion of a method in each row, and whether it is reached."""
    rng = np.random.default_rng(1)
    print(f"\n{method}: in each row the value, and * where a goal is not reached")
    head = (
        "row",
        "gain (95%)",
        "ECE less expected",
        "right at 0.9",
        "coverage / known motions",
        "Brier less best (95%)",
        "none",
    )
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    missed = dict.fromkeys(head[1:], 0)
    for row in rows:
        one, mine = found[method, row], answers[method, row].scored
        wanted = told[row]
        sure = selective(wanted)
        ratio = one.coverage / sure.coverage if sure.coverage > 0 else float("nan")
        worst = Interval(float("nan"), float("nan"), float("nan"))
        for other in PRESENT:
            if (
                other != method
                and (other, row) in answers
                and np.isfinite(answers[other, row].scored.brier).all()
            ):
                more = paired_difference(mine.brier, answers[other, row].scored.brier, mine, rng)
                if not np.isnan(more.low) and not worst.low >= more.low:
                    worst = more
        gain = one.difference
        all_seen = ROWS[row].all_in_view
        cells = [
            (f"{gain.value:+.3f} ({gain.low:+.3f} to {gain.high:+.3f})", gain.low > LEAST_GAIN),
            (f"{one.calibration_error:.3f}", one.calibration_error <= MOST_ERROR),
            (f"{one.coverage_right:.3f}", one.coverage_right >= SURE_RIGHT or one.coverage == 0),
            (f"{one.coverage:.2f} / {sure.coverage:.2f}", not ratio < SURE_COVERAGE or sure.coverage < 0.01),
            (f"{worst.value:+.3f} ({worst.low:+.3f} to {worst.high:+.3f})", not worst.low > 0),
            (f"{one.wrongly_none:.3f}", one.wrongly_none <= MOST_NONE or not all_seen),
        ]
        for name, (_, reached) in zip(head[1:], cells, strict=True):
            missed[name] += not reached
        print(f"| {row} | {' | '.join(text + ('' if reached else ' *') for text, reached in cells)} |")
    everything = Scored.joined([answers[method, row].scored for row in rows])
    mean = mean_score(method, [found[method, row] for row in rows], everything, rng)
    for name, number in missed.items():
        print(f"{'reached' if not number else f'NOT reached in {number} of {len(rows)} rows'}: {name}")
    gain = mean.difference
    verdict = "reached" if gain.value >= LEAST_MEAN else "NOT reached"
    print(f"{verdict}: mean gain over rows {gain.value:+.3f} ({gain.low:+.3f} to {gain.high:+.3f})")


if __name__ == "__main__":
    main()
