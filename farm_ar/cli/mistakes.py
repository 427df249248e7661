"""How the program ends when something goes wrong: one line for a user's mistake, a traceback for ours."""

from __future__ import annotations

import errno
import sys
from typing import Any

import typer
from typer.core import TyperGroup

from farm_ar.errors import InputError, MissingPackageError, UnfinishedError, escaped

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
            raise _ended(f"{type(problem).__name__}: {problem}", MISTAKE) from None
        except UnfinishedError as problem:
            raise _ended(f"{type(problem).__name__}: {problem}", UNFINISHED) from None
        except OSError as problem:  # a full disk, a place that may not be written, ...
            if problem.errno in (None, errno.EPIPE):
                raise
            raise _ended(f"{type(problem).__name__}: {problem}", MISTAKE) from None
        except KeyboardInterrupt as stopped:
            raise _ended(" ".join(["Interrupted.", *stopped.args]), INTERRUPTED) from None


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
