"""`farm-ar reproduce` and `sweeps`: the paper's tables and figures, and the stores of long runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farm_ar.cli.options import OWN_CLUSTER, Address, AsJson, Fresh, Results, Seed, Where, executor_of, whole

if TYPE_CHECKING:
    from farm_ar.sweeps import Store

EXPERIMENTS = (
    "all",
    "table1",
    "table2",
    "table3",
    "table4",
    "table5",
    "fig5",
    "fig7",
    "fig9",
    "fig13",
    "fig14",
    "shelf",
    "headroom",
    "relations",
    "sequences",
)


def reproduce(
    what: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[WHAT]...",
            help=f"One of {', '.join(EXPERIMENTS)}. Or any table or figure of the paper, or several.",
        ),
    ] = None,
    scenes: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Use its L1.json to H2.json instead of the built-in scenes."),
    ] = None,
    out: Results = Path("out"),
    layouts: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            parser=whole(1),
            help="Noisy layouts at each noise level; 20 by default, 5 with --quick.",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            metavar="N", parser=whole(1, 1000), help="Processes that share the work; one per core by default."
        ),
    ] = None,
    executor: Where = None,
    address: Address = OWN_CLUSTER,
    seed: Seed = 0,
    quick: Annotated[bool, typer.Option("--quick", help="A smaller version, in under two minutes.")] = False,
    fresh: Fresh = False,
    reid: Annotated[
        str | None,
        typer.Option(
            metavar="MODULE:CLASS",
            help="Your own re-identifier, beside the others in headroom, relations and sequences.",
        ),
    ] = None,
) -> None:
    """Repeat the paper's experiments.

    Each writes CSV, JSON and a picture; a summary compares the numbers with the paper's. After an
    interruption the same command continues where it stopped. For a figure that another command shows, or
    that cannot be reproduced, a line says so.
    """
    from farm_ar.cli.options import make_folder
    from farm_ar.cli.output import console, print_line
    from farm_ar.experiments import reproduce as run
    from farm_ar.experiments import setting_of
    from farm_ar.experiments.catalogue import elsewhere

    wanted = what or ["all"]
    for line in filter(None, map(elsewhere, wanted)):
        print_line(line)
    run_here = [one for one in wanted if elsewhere(one) is None]
    if not run_here:
        return
    chosen = run_here[0] if len(run_here) == 1 else run_here
    setting = setting_of(
        chosen, scenes=scenes, layouts=layouts, seed=seed, quick=quick, fresh=fresh, reid=reid
    )
    make_folder("--out", out)
    with executor_of(executor, workers, address) as units:
        run(what=chosen, setting=setting, out=out, console=console(), executor=units)


app = typer.Typer(no_args_is_help=True, help="Inspect the store of a sweep.")

StoreFile = Annotated[Path, typer.Argument(metavar="STORE", help="The store's file, as DIR/sweeps.sqlite.")]


@app.command()
def status(
    store: StoreFile,
    as_json: AsJson = False,
) -> None:
    """Report the progress of each sweep, and name the units without a result."""
    from dataclasses import asdict

    from farm_ar.cli.output import print_json, print_line, print_table
    from farm_ar.sweeps import Store
    from farm_ar.sweeps.results import COLUMNS, summarise

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
        str | None, typer.Option(metavar="NAME", help="Name of the sweep; optional if there is only one.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The CSV file; the standard output by default.")
    ] = None,
    times: Annotated[bool, typer.Option("--times", help="Measured times instead of results.")] = False,
) -> None:
    """Write the rows of a sweep as CSV, in the order of its units.

    Unfinished units are left out; "status" lists them.
    """
    from farm_ar.cli.options import writing
    from farm_ar.cli.output import print_line
    from farm_ar.scenes.files import write_text
    from farm_ar.sweeps import Store
    from farm_ar.sweeps.results import as_csv

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
