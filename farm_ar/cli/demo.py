"""`farm-ar demo`: gameplay to watch."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def demo(
    scripts: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SCRIPT]...", help="TOML files, or names of those that come with farm-ar."),
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the films go.")] = Path("out"),
    gif: Annotated[bool, typer.Option("--gif/--no-gif", help="Whether to make GIFs too.")] = True,
) -> None:
    """Play scripts of the Farm-to-Table game and film them.

    By default the two gameplay demonstrations of the paper. Each becomes a video, a GIF, key frames and two
    tables: what every snapshot said, and the counters.
    """
    from farm_ar.cli.output import print_line, print_table
    from farm_ar.cli.places import make_folder
    from farm_ar.showcases import builtin_scripts, film_script, load_script

    make_folder("--out", out)
    loaded = {Path(name).stem: load_script(name) for name in scripts or builtin_scripts()}
    for name, script in loaded.items():
        film, paths = film_script(script, name, out, gif=gif)
        print_line("")
        print_line(film.title)
        if film.detections:
            rows = [["none" if v is None else str(v) for v in row.values()] for row in film.detections]
            print_table(list(film.detections[0]), rows, numbers=("x", "z", "yaw_deg", "cost"))
        print_line(f"Right: {film.right} of {len(film.detections)} detections")
        final = [row for row in film.counters if row["after"] == "end"]
        print_line("Counters at the end: " + ", ".join(row["label"] for row in final))
        astray = sum(row["misplaced"] + row["stranded"] for row in final)
        print_line(f"Animals that did not get into the building of their colour: {astray}")
        print_line(f"Wrote {paths[0]} and {len(paths) - 1} more files beside it")
