"""`farm-ar play`: the game by hand, in the terminal."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farm_ar.cli.options import REID_HELP, Seed

if TYPE_CHECKING:
    from farm_ar.game_logic.render_state import RenderState
    from farm_ar.reid import ReidFactory
    from farm_ar.showcases.draft import Draft

HELP = """\
The hand's moves, one a line; metres from the table's near left corner, degrees clockwise:
  cyan-hutch to 0.42 0.34           carries a building to x, z
  blue-coop by -0.1 0.05 turn 30    carries it so far, and turns it
  look       the hand leaves: one snapshot is taken, and the game says what it believes
  where      what stands where, as far as you have been told
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
) -> None:
    """Play the Farm-to-Table game: move buildings while the headset cannot look, and see what it believes.

    You type the hand's moves, visit by visit. After each visit the game prints
    the identification of its one snapshot, and draws a picture. Can you make it take one building for
    another?
    """
    from farm_ar.cli.output import print_line
    from farm_ar.cli.places import make_folder, writing
    from farm_ar.reid import load_reid
    from farm_ar.showcases.draft import Draft

    draft, make_reid = Draft(scene, gaze, seed), load_reid(reid)
    make_folder("--out", out)
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
    """Play what has been written so far, from the beginning, and tell and draw how things stand."""
    import numpy as np

    from farm_ar.cli.output import print_line, print_table
    from farm_ar.cli.progress import saying
    from farm_ar.drawing.game.frames import GameFrames
    from farm_ar.drawing.video import write_png
    from farm_ar.showcases.outcome import outcome

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
    from farm_ar.cli.output import print_line
    from farm_ar.showcases.outcome import outcome

    film, _ = outcome(draft.script(), make_reid, to_the_end=True)
    final = [row for row in film.counters if row["after"] == "end"]
    print_line("Counters at the end: " + ", ".join(row["label"] for row in final))
    astray = sum(row["misplaced"] + row["stranded"] for row in final)
    print_line(f"Animals that did not get into the building of their colour: {astray}")
