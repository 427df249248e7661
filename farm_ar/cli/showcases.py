"""`farm-ar showcase`: what the paper shows beside its game, with numbers and films."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from farm_ar.cli.options import Results, Seed, whole

SHOWCASES = {"delivery": 200, "storytelling": 200, "live": 60, "characters": 100, "shadows": 1, "doubt": 100}
"""Their names, and the layouts that each tries by default."""


def showcase(
    name: Annotated[str, typer.Argument(metavar="NAME", help=f"One of {', '.join(SHOWCASES)}.")],
    out: Results = Path("out"),
    layouts: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            parser=whole(1, 100_000),
            help="Number of random layouts, visits or views; 200, 60 or 100 by default.",
        ),
    ] = None,
    film: Annotated[bool, typer.Option("--film/--no-film", help="Whether to make films.")] = True,
    seed: Seed = 0,
) -> None:
    """Run one of the showcases: a table by method with 95% intervals, files of the trials, and a film.

    delivery: a robot brings something to one of several chairs that look alike and were moved.
    storytelling: virtual characters sit on the same chairs after somebody moved them.
    live: the game takes snapshots while the hand moves buildings, and does not pause.
    characters: opening a gate lets animals out, removing stairs makes them move, as seen in the image.
    shadows: virtual objects and their shadows, before and after a building is moved.
    doubt: wrong poses from pixels that lead to wrong labels, and the confidence of these.
    """
    from farm_ar.cli.options import make_folder
    from farm_ar.cli.output import print_line, print_table, progress
    from farm_ar.errors import known_name
    from farm_ar.showcases.all import show

    known_name("name", name, SHOWCASES)
    make_folder("--out", out)
    with progress(f"Showing {name}") as report:
        shown = show(name, out, layouts or SHOWCASES[name], seed, film, report)
    print_line(shown.title)
    if shown.rows:
        print_table(list(shown.rows[0]), [[str(value) for value in row.values()] for row in shown.rows])
    for line in shown.notes:
        print_line(line)
    for path in shown.paths:
        print_line(f"Wrote {path}")
