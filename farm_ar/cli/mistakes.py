"""How the program ends when something goes wrong: one line for a user's mistake, a traceback for ours."""

from __future__ import annotations

import sys
from typing import Any

import typer
from typer.core import TyperGroup

from farm_ar.errors import InputError, MissingPackageError, UnfinishedError

MISTAKE, UNFINISHED, INTERRUPTED = 2, 3, 130
"""Exit codes: the user's mistake, work of which some gave no result, and Ctrl-C."""


class OneLineMistakes(TyperGroup):
    """The program as a command that reports mistakes and interruptions in one line on the error stream."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was asked for."""
        try:
            result = super().invoke(ctx)
            sys.stdout.flush()  # a reader who went away is noticed here, where Typer ends the program quietly
            return result
        except (InputError, MissingPackageError) as problem:
            typer.echo(f"{type(problem).__name__}: {problem}", err=True)
            raise typer.Exit(MISTAKE) from None
        except UnfinishedError as problem:
            typer.echo(f"{type(problem).__name__}: {problem}", err=True)
            raise typer.Exit(UNFINISHED) from None
        except KeyboardInterrupt:
            typer.echo("Interrupted.", err=True)
            raise typer.Exit(INTERRUPTED) from None
