"""`farm-ar demo`, `play-script` and `replay`: scripts of the Farm-to-Table game, and episodes of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from farm_ar.cli.options import REID_HELP

if TYPE_CHECKING:
    from farm_ar.showcases import Film


def demo(
    scripts: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SCRIPT]...", help="TOML files, or names of those that come with farm-ar."),
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the films go.")] = Path("out"),
    gif: Annotated[bool, typer.Option("--gif/--no-gif", help="Whether to make GIFs too.")] = True,
    reid: Annotated[str, typer.Option(metavar="NAME", help=REID_HELP)] = "spatial",
    perception: Annotated[
        str,
        typer.Option(metavar="NAME", help="oracle (true poses), or pixels (poses estimated from an image)."),
    ] = "oracle",
) -> None:
    """Play scripts of the Farm-to-Table game and film them.

    By default these are the two gameplay demonstrations of the paper. Each becomes a video, a GIF, key frames
    and two tables: the identification of each snapshot, and the counters.
    """
    from functools import partial

    from farm_ar.cli.options import make_folder
    from farm_ar.cli.output import print_line, progress
    from farm_ar.envs.perceptions import PERCEPTIONS, perception_of
    from farm_ar.errors import known_name
    from farm_ar.reid import load_reid
    from farm_ar.showcases import builtin_scripts, film_script, load_script

    names, make_reid = _file_names(scripts or list(builtin_scripts())), load_reid(reid)
    make_folder("--out", out)
    make = partial(perception_of, known_name("perception", perception, PERCEPTIONS))
    loaded = {name: load_script(script) for name, script in names.items()}
    for name, script in loaded.items():
        with progress(f"Filming {name}") as report:
            film, paths = film_script(script, name, out, make_reid, gif, report, make)
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


def print_counters(film: Film) -> None:
    """Print the counters at the end of a game."""
    from farm_ar.cli.output import print_line

    final = [row for row in film.counters if row["after"] == "end"]
    print_line("Counters at the end: " + ", ".join(row["label"] for row in final))
    astray = sum(row["misplaced"] + row["stranded"] for row in final)
    print_line(f"Animals that did not get into the building of their colour: {astray}")


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

    Prints the same tables as `farm-ar demo`: the identification of every snapshot, and the counters.
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
    print_counters(film)


DIFFERENT = 1
"""Exit code where the episode does not play again as it was."""


def replay(
    trace: Annotated[
        Path, typer.Argument(metavar="TRACE", help="A JSON file that an environment's trace() returned.")
    ],
) -> None:
    """Replay a trace of an environment, and compare the states.

    The exit code is 0 if the episode is bit-exact, 1 if it differs.
    """
    from gymnasium.error import InvalidAction, ResetNeeded

    from farm_ar.cli.output import print_line
    from farm_ar.envs import TraceError, first_difference, load_trace

    episode = load_trace(trace)
    steps = len(episode["actions"])
    _check_arguments(episode, trace.name)
    try:
        difference = first_difference(episode)
    except (InvalidAction, ResetNeeded) as problem:
        expected = "must be actions of an episode with these arguments"
        raise TraceError("actions", expected, str(problem), trace.name) from None
    if difference is not None:
        print_line(f"differs from step {difference} on (of {steps})")
        raise typer.Exit(DIFFERENT)
    print_line(f"{steps} {'step' if steps == 1 else 'steps'}, bit-exact")


def _check_arguments(trace: Mapping[str, Any], source: str) -> None:
    """See that the episode's arguments are an environment's, and raise a `TraceError` if not."""
    import inspect

    from farm_ar.envs import FarmToTableEnv, TraceError

    known = inspect.signature(FarmToTableEnv).parameters
    for name in trace["arguments"]:
        if name not in known:
            raise TraceError("arguments", f"must be among {', '.join(known)}", name, source)
