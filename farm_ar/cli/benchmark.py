"""`farm-ar benchmark` and `convert`: methods on frozen snapshots, and on tracks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from farm_ar.cli.options import (
    OWN_CLUSTER,
    REID_HELP,
    Address,
    AsJson,
    Fresh,
    Results,
    Where,
    Workers,
    executor_of,
    number,
    whole,
)

if TYPE_CHECKING:
    from farm_ar.benchmark.results import Results as Measured

DEFAULT = "adaptive"
"""The method that is measured where none is named."""


def benchmark(
    methods: Annotated[list[str] | None, typer.Argument(metavar="METHOD ...", help=REID_HELP)] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="The first snapshots of each row only: a minute.")
    ] = False,
    rows: Annotated[
        str | None,
        typer.Option(
            metavar="ROW,...", help="Only these rows, or those that begin so: authors-*; all by default."
        ),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Snapshots written by farm-ar convert, instead of benchmark-1."),
    ] = None,
    export: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Only write the snapshots as files, without the truth."),
    ] = None,
    scored: Annotated[
        list[Path] | None,
        typer.Option("--score", metavar="FILE", help="Score a JSON file of labels, too."),
    ] = None,
    out: Results = Path("out/benchmark"),
    workers: Workers = 1,
    executor: Where = None,
    address: Address = OWN_CLUSTER,
    time_limit: Annotated[
        float | None,
        typer.Option(
            metavar="S",
            parser=number(1, 1e6),
            help="Seconds for 10 snapshots, after which they count as unanswered; no limit by default.",
        ),
    ] = None,
    fresh: Fresh = False,
    as_json: AsJson = False,
) -> None:
    """Measure methods on benchmark-1: snapshots of the paper's scenes and of simulated worlds.

    Reports accuracy, calibration, selective accuracy, minimum perturbation and time, beside the simple
    assignments, in ten minutes per method. After an interruption the same command continues where it stopped.
    """
    from rich.console import Console

    from farm_ar.benchmark.run import Request, check_methods, export_suite, run_benchmark
    from farm_ar.cli.inputs import refuse
    from farm_ar.cli.options import make_folder
    from farm_ar.cli.output import print_line
    from farm_ar.sweeps.progress import shown

    chosen = None if rows is None else tuple(rows.split(","))
    if export is not None:
        refuse([("METHOD", methods or None), ("--score", scored or None)], "with --export")
        make_folder("--export", export)
        suite, count = export_suite(export, data, chosen)
        print_line(f"Wrote {count} snapshots of {suite.name} ({suite.digest}) to {export}")
        return
    if scored:
        refuse([("--quick", quick or None)], "with --score, which is of all snapshots")
    asked = tuple(methods or (() if scored else (DEFAULT,)))
    check_methods(asked)
    make_folder("--out", out)
    request = Request(asked, quick, chosen, data, tuple(scored or ()), fresh)
    units = executor_of(executor, workers, address, time_limit)
    with units, shown(Console(stderr=True)) as watch:
        results = run_benchmark(request, out / "benchmark.sqlite", units, watch)
    _show(results, out, as_json)


def _show(results: Measured, out: Path, as_json: bool) -> None:
    """Write the files, and print the tables or the JSON."""
    from farm_ar.benchmark import report
    from farm_ar.cli.options import writing
    from farm_ar.cli.output import print_json, print_line, print_table

    with writing("--out", out):
        files = report.write_results(results, out)
    if as_json:
        print_json(results.values())
        return
    quick = ", the first snapshots of each row only" if results.quick else ""
    print_line(f"{results.suite} ({results.digest}), {len(results.rows)} rows{quick}")
    for method in report.asked_for(results):
        print_line(f"{method} by row")
        head = report.ROW_HEAD[: report.SHORT]
        print_table(head, [row[: report.SHORT] for row in report.method_rows(results, method)], head[1:])
    if results.paired:
        print_line("Difference in accuracy on the same snapshots, with 95%")
        head = report.paired_head(results)
        print_table(head, report.paired_rows(results), head[1:])
    print_line("")
    print_table(report.HEAD, report.summary_rows(results), report.HEAD[1:])
    for line in (*results.notes, *report.LEGEND):
        print_line(line)
    print_line(f"Wrote {', '.join(str(file) for file in files)}")


def convert(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE ...", help="Tracks: MOT-challenge text, or tables.")
    ],
    gap: Annotated[
        float,
        typer.Option(
            metavar="N", parser=number(1e-6, 1e9), help="Frames between scene and snapshot of a pair."
        ),
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the snapshots, with their truth.")],
    form: Annotated[str, typer.Option(metavar="FORM", help="Format: mot or table.")] = "table",
    columns: Annotated[
        str | None,
        typer.Option(
            metavar="WHAT=COLUMN,...",
            help="Columns of frame, id, x, z, heading and category: names, or numbers from 1.",
        ),
    ] = None,
    heading: Annotated[
        str,
        typer.Option(
            metavar="FROM", help="given: from the column heading, if any; motion: from the frame before."
        ),
    ] = "given",
    every: Annotated[
        float | None,
        typer.Option(
            metavar="N",
            parser=number(1e-6, 1e9),
            help="Frames between two pairs, at least; the gap by default.",
        ),
    ] = None,
    most: Annotated[
        int, typer.Option(metavar="N", parser=whole(1), help="Largest number of pairs per file.")
    ] = 1000,
) -> None:
    """Make snapshots from tracks: the objects of one frame are known, those N frames later to be identified.

    farm-ar benchmark --data DIR measures methods on them.
    """
    from farm_ar.benchmark.suite import Suite, write_folder
    from farm_ar.benchmark.tracks import name_of, pairs_of, read_tracks
    from farm_ar.cli.options import make_folder, writing
    from farm_ar.cli.output import print_line
    from farm_ar.errors import OptionError, known_name

    known_name("--form", form, ("mot", "table"))
    known_name("--heading", heading, ("given", "motion"))
    asked = _columns(columns)
    if asked and form == "mot":
        raise OptionError("--columns", "must not be given with --form mot", columns)
    names = [name_of(file) for file in files]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise OptionError("FILE", "must have different names, or folders with different names", twice)
    make_folder("--out", out)
    way: Literal["given", "motion"] = "motion" if heading == "motion" else "given"
    rows = [pairs_of(read_tracks(file, form, asked), gap, every or gap, most, way) for file in files]
    suite = Suite(out.resolve().name or "tracks", tuple(rows))
    with writing("--out", out):
        count = write_folder(suite, out, truth=True)
    seen = sum(len(example.truth) for row in rows for example in row.examples)
    print_line(f"Wrote {count} snapshots with {seen} detections to {out}")


def _columns(text: str | None) -> dict[str, str]:
    """Columns of a table of tracks by what they hold, from "frame=t,id=player"."""
    from farm_ar.benchmark.tracks import COLUMNS
    from farm_ar.errors import OptionError

    asked: dict[str, str] = {}
    for part in text.split(",") if text else []:
        what, equals, column = part.partition("=")
        if not equals or what not in COLUMNS or what in asked:
            raise OptionError("--columns", f"must be WHAT=COLUMN,... with WHAT of {', '.join(COLUMNS)}", part)
        asked[what] = column
    return asked
