"""`farm-ar demo`: gameplay to watch."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from farm_ar.cli.options import REID_HELP


def demo(
    scripts: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SCRIPT]...", help="TOML files, or names of those that come with farm-ar."),
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the films go.")] = Path("out"),
    gif: Annotated[bool, typer.Option("--gif/--no-gif", help="Whether to make GIFs too.")] = True,
    reid: Annotated[str, typer.Option(metavar="NAME", help=REID_HELP)] = "spatial",
) -> None:
    """Play scripts of the Farm-to-Table game and film them.

    By default the two gameplay demonstrations of the paper. Each becomes a video, a GIF, key frames and two
    tables: the identification of each snapshot, and the counters.
    """
    from farm_ar.cli.output import print_line
    from farm_ar.cli.places import make_folder
    from farm_ar.cli.play_script import print_film
    from farm_ar.cli.progress import progress
    from farm_ar.reid import load_reid
    from farm_ar.showcases import builtin_scripts, film_script, load_script

    names, make_reid = _file_names(scripts or list(builtin_scripts())), load_reid(reid)
    make_folder("--out", out)
    loaded = {name: load_script(script) for name, script in names.items()}
    for name, script in loaded.items():
        with progress(f"Filming {name}") as report:
            film, paths = film_script(script, name, out, make_reid, gif, report)
        print_line("")
        print_film(film)
        print_line(f"Wrote {paths[0]} and {len(paths) - 1} more files beside it")


def _file_names(scripts: list[str]) -> dict[str, str]:
    """The scripts by the name that the files of each get."""
    from farm_ar.errors import OptionError

    names = {Path(script).stem: script for script in scripts}
    if len(names) < len(scripts):
        expected = "must have file names that differ before the ending, for their films are named after them"
        raise OptionError("scripts", expected, scripts)
    return names
