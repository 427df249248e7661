"""Running a benchmark: which snapshots are put to which methods, and what comes of it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from farm_ar.benchmark.answers import read_answers
from farm_ar.benchmark.evaluation import SIMPLE, Source, ask_all
from farm_ar.benchmark.frozen import QUICK, authors_rows, frozen_suite
from farm_ar.benchmark.results import Results, breaking_effort, results_of
from farm_ar.benchmark.suite import Suite, read_folder, write_folder
from farm_ar.errors import OptionError
from farm_ar.reid import load_reid
from farm_ar.sweeps import Executor, Store, Watcher

AUTHORS = "FARM_AR_PAPER_SCENES"
"""The environment variable that names the folder with the layouts of the paper's authors, if there is one."""


@dataclass(frozen=True)
class Request:
    """The options of a benchmark.

    Args:
        methods: names, as `load_reid` takes them.
        quick: whether only the first snapshots of each row are used.
        rows: names of rows; None for all.
        data: a folder of snapshots in place of the frozen suite.
        scored: files of answers that are scored, too.
        fresh: whether what is in the store is forgotten.
    """

    methods: tuple[str, ...]
    quick: bool = False
    rows: tuple[str, ...] | None = None
    data: Path | None = None
    scored: tuple[Path, ...] = ()
    fresh: bool = False


def check_methods(methods: Sequence[str]) -> None:
    """See that all methods can be found before any work begins.

    Raises:
        OptionError: a name is not known, or given twice.
    """
    for method in methods:
        load_reid(method, "method")
    if len(set(methods)) < len(methods):
        raise OptionError("method", "must be given once each", list(methods))


def export_suite(folder: Path, data: Path | None, rows: Sequence[str] | None) -> tuple[Suite, int]:
    """Write the snapshots of a suite without the truth: the suite, and how many there are.

    Raises:
        OptionError: there is no such row, or the folder of data is none.
    """
    suite = frozen_suite() if data is None else read_folder(data)
    suite = suite if rows is None else suite.only(rows)
    return suite, write_folder(suite, folder, truth=False)


def run_benchmark(
    request: Request, store: str | os.PathLike[str], executor: Executor, watch: Watcher
) -> Results:
    """Put the snapshots to the methods and the simple ones, and score the answers.

    Args:
        request: the options.
        store: the file that keeps what is finished.
        executor: where the work is done.
        watch: is called with the progress.

    Raises:
        OptionError: a row, a folder or a file of answers cannot be used.
        StoreError: the store cannot be used.
    """
    parts = _sources(request)
    suite = parts[0][1]
    counts = [
        (source, {row.name: min(len(row), QUICK) if request.quick else len(row) for row in one.rows})
        for source, one in parts
    ]
    methods = tuple(dict.fromkeys((*request.methods, *SIMPLE)))
    given = [read_answers(path, suite) for path in request.scored]
    with Store(store) as opened:
        answers = ask_all(counts, methods, opened, executor, watch, request.fresh)
        asked = [method for method in request.methods if method not in SIMPLE]
        breaking = breaking_effort(asked, request.quick, opened, executor, watch) if _whole(request) else {}
    notes = []
    named: list[str] = []
    for path, one in zip(request.scored, given, strict=True):
        name = one.method if one.method not in (*methods, *named) else f"{one.method} ({path.name})"
        named.append(name)
        answers |= {(name, row): found for (_, row), found in one.answers.items()}
        if one.missing:
            notes.append(f"{path.name} leaves out {one.missing} snapshots, which count as wrong.")
    rows = {row.name: row.about for _, each in parts for row in each.rows}
    results = results_of(
        suite.name, suite.digest, answers, (*request.methods, *named, *SIMPLE), rows, request.quick
    )
    return replace(results, breaking=breaking, notes=(*notes, *results.notes))


def _whole(request: Request) -> bool:
    """Whether it is the whole benchmark, with the breaking effort."""
    return request.data is None and request.rows is None


def _sources(request: Request) -> list[tuple[Source, Suite]]:
    """Where the snapshots come from, and the rows that are selected."""
    if request.data is not None:
        suite = read_folder(request.data)
        for row in suite.rows:
            _ = row.examples  # what cannot be used is named before the work begins
        found = [(Source("data", str(request.data.resolve()), suite.digest), suite)]
    else:
        found = [(Source(), frozen_suite())]
        place = os.environ.get(AUTHORS)
        if place and not request.scored:
            theirs = Suite("authors", authors_rows(Path(place)))
            found.append((Source("authors", str(Path(place).resolve()), theirs.digest), theirs))
    if request.rows is not None:
        every = Suite(found[0][1].name, tuple(row for _, suite in found for row in suite.rows))
        chosen = {row.name for row in every.only(request.rows).rows}
        found = [
            (source, suite.only([name for name in suite.by_name if name in chosen]))
            for source, suite in found
        ]
        found = [(source, suite) for source, suite in found if suite.rows]
    return found
