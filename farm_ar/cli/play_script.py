"""`farm-ar play-script`: a game's tables without its film."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from farm_ar.cli.options import REID_HELP

if TYPE_CHECKING:
    from farm_ar.showcases import Film


def play_script(
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="A TOML file, or the name of one that comes with farm-ar.")
    ],
    as_json: Annotated[
        bool, typer.Option("--json", help="Print title, snapshots and counters as JSON, and nothing else.")
    ] = False,
    reid: Annotated[str, typer.Option(metavar="NAME", help=REID_HELP)] = "spatial",
) -> None:
    """Play a script of the Farm-to-Table game without filming it.

    Prints what `farm-ar demo` does: what every snapshot said, and the counters.
    """
    from farm_ar.cli.output import print_json
    from farm_ar.reid import load_reid
    from farm_ar.showcases import ScriptRecorder, load_script

    film = ScriptRecorder(load_script(file), load_reid(reid), make_pictures=None).play()
    if as_json:
        print_json({"title": film.title, "snapshots": film.detections, "counters": film.counters})
    else:
        print_film(film)


def print_film(film: Film) -> None:
    """Print the identification of every snapshot of a game, and its counters at the end."""
    from farm_ar.cli.output import print_line, print_table

    print_line(film.title)
    if film.detections:
        rows = [["none" if v is None else str(v) for v in row.values()] for row in film.detections]
        print_table(list(film.detections[0]), rows, numbers=("x", "z", "yaw_deg", "cost"))
    print_line(f"Right: {film.right} of {len(film.detections)} detections")
    final = [row for row in film.counters if row["after"] == "end"]
    print_line("Counters at the end: " + ", ".join(row["label"] for row in final))
    astray = sum(row["misplaced"] + row["stranded"] for row in final)
    print_line(f"Animals that did not get into the building of their colour: {astray}")
