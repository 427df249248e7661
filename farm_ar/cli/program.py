"""The program `farm-ar`: its commands, what it is called, and how it ends when something goes wrong."""

from __future__ import annotations

import errno
import io
import sys
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from farm_ar import __version__
from farm_ar.cli.benchmark import benchmark, convert
from farm_ar.cli.compile import compile_kernels
from farm_ar.cli.experiments import app as sweeps
from farm_ar.cli.experiments import reproduce
from farm_ar.cli.game import demo, play_script, replay
from farm_ar.cli.identify import identify
from farm_ar.cli.output import saying
from farm_ar.cli.page import app as web
from farm_ar.cli.play import play
from farm_ar.cli.plot import plot
from farm_ar.cli.scenes import app as scenes
from farm_ar.cli.scenes import schema
from farm_ar.cli.serve import conformance_vectors, serve, serve_replay
from farm_ar.cli.showcases import showcase
from farm_ar.cli.stress import design, stress, stress_replay
from farm_ar.cli.training import evaluate, train, watch
from farm_ar.cli.vision import app as vision
from farm_ar.errors import InputError, MissingPackageError, OptionError, UnfinishedError, escaped

MISTAKE, UNFINISHED, INTERRUPTED = 2, 3, 130
"""Exit codes: the user's mistake, work of which some gave no result, and Ctrl-C."""

UsageError: Any = typer.BadParameter.__bases__[0]
"""Typer's own error about a command line; where it is defined depends on Typer's version."""


class OneLineMistakes(TyperGroup):
    """The program as a command that reports mistakes and interruptions in one line on the error stream."""

    def make_context(self, *args: Any, **named: Any) -> Any:
        """Read the options that stand before a command."""
        try:
            return super().make_context(*args, **named)
        except UsageError as problem:
            raise _misused(problem) from None

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was asked for."""
        try:
            result = super().invoke(ctx)
            sys.stdout.flush()  # a reader who went away is noticed here, where Typer ends the program quietly
            return result
        except UsageError as problem:
            raise _misused(problem) from None
        except (InputError, MissingPackageError, MemoryError) as problem:
            said = self._as_typed(ctx, problem) if isinstance(problem, OptionError) else problem
            raise _ended(f"{type(problem).__name__}: {said}", MISTAKE) from None
        except UnfinishedError as problem:
            raise _ended(f"{type(problem).__name__}: {problem}", UNFINISHED) from None
        except OSError as problem:  # a full disk, a place that may not be written, ...
            if problem.errno in (None, errno.EPIPE):
                raise
            raise _ended(f"{type(problem).__name__}: {problem}", MISTAKE) from None
        except KeyboardInterrupt as stopped:
            raise _ended(" ".join(["Interrupted.", *stopped.args]), INTERRUPTED) from None

    def _as_typed(self, ctx: Any, problem: OptionError) -> OptionError:
        """The error, in which an option of the command is called what it is called on the command line."""
        command = self.get_command(ctx, ctx.invoked_subcommand or "")
        for one in (command, *getattr(command, "commands", {}).values()):
            for parameter in getattr(one, "params", ()):
                optional = parameter.param_type_name == "option"
                if optional and parameter.name == problem.field and problem.source is None:
                    return OptionError(max(parameter.opts, key=len), problem.expected, problem.got)
        return problem


def _misused(problem: Any) -> BaseException:
    """The end of the program for a command line that makes no sense; help where nothing was asked for."""
    if "NoArgs" in type(problem).__name__:
        return problem  # type: ignore[no-any-return]
    line = problem.format_message()
    if problem.ctx is not None:
        line = f"{line.rstrip('.')}. Try '{problem.ctx.command_path} --help'."
    return _ended(escaped(f"Error: {line}"), MISTAKE)


def _ended(line: str, code: int) -> typer.Exit:
    typer.echo("\n".join(map(escaped, line.split("\n"))), err=True)
    return typer.Exit(code)


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
app.add_typer(vision, name="vision")
app.add_typer(web, name="web")
app.command("compile")(compile_kernels)
app.command()(saying("Loading the benchmark")(benchmark))
app.command("conformance-vectors")(saying("Writing vectors")(conformance_vectors))
app.command()(saying("Reading tracks")(convert))
app.command()(saying("Loading the game")(demo))
app.command()(saying("Searching for a layout")(design))
app.command()(saying("Playing held-out episodes with each policy")(evaluate))
app.command()(saying("Identifying")(identify))
app.command()(play)
app.command()(saying("Reading the runs")(plot))
app.command("play-script")(saying("Playing and filming")(play_script))
app.command()(saying("Replaying")(replay))
app.command()(saying("Running the experiments")(reproduce))
app.command()(schema)
app.command()(serve)
app.command("serve-replay")(saying("Replaying")(serve_replay))
app.command()(saying("Loading the showcase")(showcase))
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
