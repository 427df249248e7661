"""`farm-ar demo`, `play`, `play-script` and `replay`: the Farm-to-Table game and episodes of it."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from farm_ar.cli.options import REID_HELP, Seed, whole

if TYPE_CHECKING:
    from farm_ar.game_logic.render_state import RenderState
    from farm_ar.reid import ReidFactory
    from farm_ar.showcases import Film
    from farm_ar.showcases.draft import Draft


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


HELP = """\
The hand's moves, one a line; metres from the table's near left corner, degrees clockwise:
  cyan-hutch to 0.42 0.34           carries a building to x, z
  blue-coop by -0.1 0.05 turn 30    carries it so far, and turns it
  look       the hand leaves: one snapshot is taken, and the game says what it believes
  where      what stands where, as far as you know
  help       this text
  end        the game is over (quit and exit say the same, and so does the end of the input)"""

ENDS = (None, "end", "quit", "exit")
"""Lines after which the game is over; None where the input has ended."""


def play(
    scene: Annotated[
        str, typer.Option(metavar="SCENE", help='"farm", or a scene file with a fixed object.')
    ] = "farm",
    gaze: Annotated[str, typer.Option(metavar="SITE", help='The site you look at, or "sweep".')] = "S1",
    seed: Seed = 0,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the pictures go.")] = Path("out"),
    reid: Annotated[str, typer.Option(metavar="NAME", help=REID_HELP)] = "spatial",
    save: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Save the moves as a script for `farm-ar demo`.")
    ] = None,
    terminal: Annotated[
        bool,
        typer.Option(
            "--terminal", help="Type the moves instead of using the page; with --gaze, --out, --save."
        ),
    ] = False,
    port: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            parser=whole(0, 65535),
            help="Serve the page on this port, also without a display; 0 for any that is free.",
        ),
    ] = None,
    lan: Annotated[
        bool,
        typer.Option("--lan", help="Serve the page to the local network, too, with TLS and a token."),
    ] = False,
    gallery: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="A stress test's folder, whose failures the page shows."),
    ] = None,
) -> None:
    """Play the Farm-to-Table game: move buildings while the headset waits, and see what it believes.

    Opens a page on which you drag the buildings. Where there is no display, or its packages are not
    installed, or with --terminal, you type the hand's moves, visit by visit; after each visit the game prints
    the identification of its one snapshot, and draws a picture. Can you make it take one building for
    another?
    """
    from farm_ar.cli.page import can_show_page, serve_page
    from farm_ar.envs.window import has_display
    from farm_ar.errors import OptionError

    asked = {"--lan": lan, "--port": port is not None, "--gallery": gallery is not None}
    if page := [name for name, given in asked.items() if given]:
        for other, value in (("--terminal", terminal), ("--save", save)):
            if value:
                raise OptionError(other, f"must not be given with {page[0]}, which is the page's", str(value))
        show = not lan and _at_a_terminal() and has_display()
        serve_page(seed, reid, port or 0, lan=lan, gallery=gallery, show=show)
        return
    if not terminal and save is None and _at_a_terminal() and can_show_page():
        serve_page(seed, reid, 0)
        return
    from farm_ar.cli.options import check_file, make_folder, writing
    from farm_ar.cli.output import print_line
    from farm_ar.reid import load_reid
    from farm_ar.showcases.draft import Draft

    draft, make_reid = Draft(scene, gaze, seed), load_reid(reid)
    make_folder("--out", out)
    if save is not None:
        check_file("--save", save)
    if not terminal and save is None and not _at_a_terminal():
        typer.echo("The moves come from the input, which is no terminal, so there is no page", err=True)
    _print_help()
    moment = _show(draft, make_reid, out)
    _take_lines(draft, make_reid, moment, out)
    if draft.visits:
        _print_end(draft, make_reid)
    if save is not None:
        from farm_ar.scenes.files import write_text

        with writing("--save", save):
            write_text(save, draft.text())
        print_line(f"Saved {save}; film it with: farm-ar demo {save}")


def _take_lines(draft: Draft, make_reid: ReidFactory, moment: RenderState, out: Path) -> None:
    """Do what the lines of the input say, until they end."""
    from farm_ar.cli.output import print_line
    from farm_ar.errors import InputError

    pending = 0
    while (line := _ask(f"visit {draft.visits + (not pending)}> ")) not in ENDS:
        if line == "help":
            _print_help()
        elif line == "where":
            _print_table(moment)
        elif line == "look":
            if not pending:
                draft.begin_visit()
            pending, moment = 0, _show(draft, make_reid, out)
        elif line:
            if not pending:
                draft.begin_visit()
            try:
                draft.add(line)
                pending += 1
            except InputError as problem:
                # Where in the script the move would have stood is nothing that was typed in.
                print_line(str(InputError(problem.field.split(".")[-1], problem.expected, problem.got)))
                if not pending:
                    draft.drop_visit()
    if pending:
        _show(draft, make_reid, out)


def _print_help() -> None:
    from farm_ar.cli.output import print_line

    for line in HELP.splitlines():
        print_line(line)


def _ask(prompt: str) -> str | None:
    """A line of the input without spaces around it; None at its end."""
    if _at_a_terminal():
        print(prompt, end="", flush=True)
    line = sys.stdin.readline()
    return line.strip() if line else None


def _at_a_terminal() -> bool:
    return sys.stdin.isatty()


def _show(draft: Draft, make_reid: ReidFactory, out: Path) -> RenderState:
    """Play what has been written so far, from the beginning, and print and draw how things stand."""
    import numpy as np

    from farm_ar.cli.output import print_line, print_table, saying
    from farm_ar.drawing.game.frames import GameFrames
    from farm_ar.drawing.video import write_png
    from farm_ar.showcases.film import outcome

    with saying("Playing the visits"):
        film, moment = outcome(draft.script(), make_reid)
    seen = [row for row in film.detections if row["visit"] == draft.visits]
    if draft.visits:
        columns = ("category", "x", "z", "given", "truth", "cost")
        rows = [["none" if row[name] is None else str(row[name]) for name in columns] for row in seen]
        print_table(columns, rows, numbers=("x", "z", "cost"))
        right = sum(row["given"] == row["truth"] for row in seen)
        wrong = [moment.truth.labels[i] for i in np.flatnonzero(moment.wrong)]
        print_line(
            f"Right: {right} of {len(seen)} detections. On the wrong building: {', '.join(wrong) or 'none'}"
        )
    else:
        _print_table(moment)
    picture = out / f"play-{draft.visits}.png"
    write_png(picture, GameFrames(moment.scene).frame(moment))
    print_line(f"Wrote {picture}")
    return moment


def _print_table(moment: RenderState) -> None:
    """Print where every building really is and which label the game has on the wrong one."""
    import numpy as np

    from farm_ar.cli.output import print_table

    layout = moment.truth
    rows = [
        [
            layout.labels[i],
            f"{layout.position[i, 0]:.3f}",
            f"{layout.position[i, 1]:.3f}",
            f"{np.rad2deg(layout.yaw[i]):.0f}",
            "wrong" if moment.wrong[i] else "",
        ]
        for i in np.flatnonzero(layout.movable)
    ]
    print_table(["building", "x", "z", "yaw_deg", "label"], rows, numbers=("x", "z", "yaw_deg"))


def _print_end(draft: Draft, make_reid: ReidFactory) -> None:
    from farm_ar.showcases.film import outcome

    film, _ = outcome(draft.script(), make_reid, to_the_end=True)
    _print_counters(film)


def _print_counters(film: Film) -> None:
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
    _print_counters(film)


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
