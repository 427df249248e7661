"""`farm-ar reproduce`: the paper's tables and figures."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from farm_ar.cli.options import Seed, whole

EXPERIMENTS = (
    "all",
    "table1",
    "table2",
    "table3",
    "fig5",
    "fig7",
    "fig9",
    "headroom",
    "relations",
    "sequences",
)


def reproduce(
    what: Annotated[str, typer.Argument(metavar="WHAT", help=f"One of {', '.join(EXPERIMENTS)}.")] = "all",
    scenes: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Use its L1.json to H2.json in place of our own scenes."),
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the results go.")] = Path("out"),
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
    seed: Seed = 0,
    quick: Annotated[bool, typer.Option("--quick", help="A smaller version, in under two minutes.")] = False,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Start over; do not use the finished work in DIR.")
    ] = False,
    reid: Annotated[
        str | None,
        typer.Option(
            metavar="MODULE:CLASS", help="Your own re-identifier, beside the others in the last three."
        ),
    ] = None,
) -> None:
    """Repeat the paper's experiments.

    Each writes CSV, JSON and a picture; a summary sets our numbers beside the paper's. After an
    interruption the same command continues where it stopped.
    """
    from farm_ar.cli.output import console
    from farm_ar.cli.places import make_folder
    from farm_ar.experiments import reproduce as run

    make_folder("--out", out)
    run(
        what=what,
        scenes=scenes,
        out=out,
        layouts=layouts,
        workers=os.cpu_count() or 2 if workers is None else workers,
        seed=seed,
        quick=quick,
        fresh=fresh,
        console=console(),
        reid=reid,
    )
