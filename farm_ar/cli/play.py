"""`farm-ar play`: the Farm-to-Table game by hand, on a page, or by typing."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farm_ar.cli.options import REID_HELP, Seed, whole

if TYPE_CHECKING:
    from farm_ar.game_logic.render_state import RenderState
    from farm_ar.reid import ReidFactory
    from farm_ar.showcases.draft import Draft

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
    gaze: Annotated[
        str | None,
        typer.Option(metavar="SITE", help='Type the moves; the site you look at (S1), or "sweep".'),
    ] = None,
    seed: Seed = 0,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Where the pictures go where moves are typed.")
    ] = Path("out"),
    reid: Annotated[str, typer.Option(metavar="NAME", help=REID_HELP)] = "spatial",
    save: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Type the moves, and save them as a script for `farm-ar demo`."),
    ] = None,
    terminal: Annotated[
        bool, typer.Option("--terminal", help="Type the moves instead of using the page.")
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
    installed, or with --terminal, --gaze or --save, you type the hand's moves, visit by visit; after each
    visit the game prints the identification of its one snapshot, and draws a picture. Can you make it take
    one building for another?
    """
    from farm_ar.cli.page import can_show_page, serve_page
    from farm_ar.envs.window import has_display
    from farm_ar.errors import OptionError

    asked = {"--lan": lan, "--port": port is not None, "--gallery": gallery is not None}
    typed = {"--terminal": terminal, "--gaze": gaze, "--save": save}
    page = [name for name, given in asked.items() if given]
    for name, value in typed.items():
        if page and value:
            raise OptionError(name, f"must not be given with {page[0]}, which is the page's", str(value))
    if page:
        show = not lan and _at_a_terminal() and has_display()
        serve_page(seed, reid, port or 0, lan=lan, gallery=gallery, show=show, scene=scene)
    elif not any(typed.values()) and _at_a_terminal() and can_show_page():
        serve_page(seed, reid, 0, scene=scene)
    else:
        if not any(typed.values()) and not _at_a_terminal():
            typer.echo("The moves come from the input, which is no terminal, so there is no page", err=True)
        _type_moves(scene, gaze or "S1", seed, out, reid, save)


def _type_moves(scene: str, gaze: str, seed: int, out: Path, reid: str, save: Path | None) -> None:
    """Play the game by typing, until the input ends."""
    from farm_ar.cli.options import check_file, make_folder, writing
    from farm_ar.cli.output import print_line
    from farm_ar.reid import load_reid
    from farm_ar.scenes.files import write_text
    from farm_ar.showcases.draft import Draft

    draft, make_reid = Draft(scene, gaze, seed), load_reid(reid)
    make_folder("--out", out)
    if save is not None:
        check_file("--save", save)
    _print_help()
    moment = _show(draft, make_reid, out)
    _take_lines(draft, make_reid, moment, out)
    if draft.visits:
        _print_end(draft, make_reid)
    if save is not None:
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
    from farm_ar.cli.game import print_counters
    from farm_ar.showcases.film import outcome

    film, _ = outcome(draft.script(), make_reid, to_the_end=True)
    print_counters(film)
