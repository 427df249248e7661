"""The program `farm-ar`: its commands and what it is called."""

from __future__ import annotations

import io
import sys
from typing import Annotated

import typer

from farm_ar import __version__
from farm_ar.cli.compiling import compile_kernels
from farm_ar.cli.demo import demo
from farm_ar.cli.design import design
from farm_ar.cli.evaluate import evaluate
from farm_ar.cli.identify import identify
from farm_ar.cli.mistakes import OneLineMistakes
from farm_ar.cli.play import play
from farm_ar.cli.play_script import play_script
from farm_ar.cli.progress import saying
from farm_ar.cli.replay import replay
from farm_ar.cli.reproduce import reproduce
from farm_ar.cli.scenes import app as scenes
from farm_ar.cli.scenes import schema
from farm_ar.cli.stress import stress, stress_replay
from farm_ar.cli.sweeps import app as sweeps
from farm_ar.cli.train import train
from farm_ar.cli.watch import watch

app = typer.Typer(
    name="farm-ar",
    cls=OneLineMistakes,
    help="Re-identification of identical objects from one egocentric snapshot, and a game that tests it.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,  # plain text: Typer then needs no rich to print a help page
    pretty_exceptions_enable=False,
)
app.add_typer(scenes, name="scenes")
app.add_typer(sweeps, name="sweeps")
app.command("compile")(compile_kernels)
app.command()(saying("Loading the game")(demo))
app.command()(saying("Searching for a layout")(design))
app.command()(saying("Playing held-out episodes with each policy")(evaluate))
app.command()(saying("Identifying")(identify))
app.command()(play)
app.command("play-script")(saying("Playing and filming")(play_script))
app.command()(saying("Replaying")(replay))
app.command()(saying("Running the experiments")(reproduce))
app.command()(schema)
app.command("stress-replay")(saying("Replaying")(stress_replay))
app.command()(saying("Running the stress test")(stress))
app.command()(saying("Loading the learners")(train))
app.command()(saying("Playing and filming")(watch))


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"farm-ar {__version__}")
        raise typer.Exit


@app.callback()
def program(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Take the options that stand before a command; the help page's text is the program's own."""


def main() -> None:
    """Run the program on the arguments of the process, and end the process."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a sign that the encoding lacks is no reason to fail
    app(prog_name="farm-ar")
