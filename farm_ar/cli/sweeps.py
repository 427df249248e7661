"""`farm-ar sweeps`: what is in the store of a sweep."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from farm_ar.sweeps import Store

app = typer.Typer(no_args_is_help=True, help="Inspect the store of a sweep.")

StoreFile = Annotated[Path, typer.Argument(metavar="STORE", help="The store's file, as DIR/sweeps.sqlite.")]


@app.command()
def status(
    store: StoreFile,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Report the progress of each sweep, and name the units without a result."""
    from dataclasses import asdict

    from farm_ar.cli.output import print_json, print_line, print_table
    from farm_ar.sweeps import Store
    from farm_ar.sweeps.status import COLUMNS, summarise

    with Store(store, create=False) as opened:
        results = [opened.results(name) for name in opened.sweeps()]
        counts = [summarise(each, opened.claimed(each)) for each in results]
    if as_json:
        failures = {each.sweep: [str(failure) for failure in each.failures] for each in results}
        print_json([asdict(count) | {"problems": failures[count.sweep]} for count in counts])
        return
    print_table(COLUMNS, (count.cells() for count in counts), COLUMNS[1:])
    for each in results:
        for failure in each.failures:
            print_line(f"{each.sweep}: {failure.line()}")


@app.command()
def export(
    store: StoreFile,
    sweep: Annotated[
        str | None, typer.Option(metavar="NAME", help="Which sweep; not needed where there is but one.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The CSV file; the standard output by default.")
    ] = None,
    times: Annotated[
        bool, typer.Option("--times", help="Measured times, which no run repeats, in place of results.")
    ] = False,
) -> None:
    """Write the rows of a sweep as CSV, in the order of its units.

    What is not finished is left out; "status" tells.
    """
    from farm_ar.cli.output import print_line
    from farm_ar.cli.places import writing
    from farm_ar.scenes.files import write_text
    from farm_ar.sweeps import Store
    from farm_ar.sweeps.export import as_csv

    with Store(store, create=False) as opened:
        results = opened.results(_only_sweep(opened) if sweep is None else sweep)
    text = as_csv(results, measured=times)
    if out is None:
        typer.echo(text, nl=False)
        return
    with writing("--out", out):
        write_text(out, text)
    print_line(f"Wrote {out}: {len(results)} of {len(results.units)} units of {results.sweep}")


def _only_sweep(store: Store) -> str:
    from farm_ar.errors import OptionError

    names = store.sweeps()
    if len(names) != 1:
        raise OptionError("--sweep", "must be given, where the store has not exactly one", ", ".join(names))
    return names[0]
