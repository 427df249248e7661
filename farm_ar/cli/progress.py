"""Telling how far a long piece of work is, on the error output, so that what is printed stays clean."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import typer

PATIENCE_S = 1.5
"""What takes longer says what it does."""

Report = Callable[[str, float], None]
"""Is told what is being done, and which share of it is done, 0 to 1."""


@contextmanager
def progress(beginning: str) -> Iterator[Report]:
    """A bar that grows on a terminal and is gone at the end; elsewhere one plain line at the beginning.

    Args:
        beginning: what is being done at first.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    from farm_ar.cli.output import printable

    for timer in _waiting:
        timer.cancel()
    screen = Console(stderr=True, markup=False, emoji=False, highlight=False)
    if not screen.is_terminal:
        screen.print(f"{printable(beginning)} ...", soft_wrap=True)
        yield lambda what, share: None
        return
    words = TextColumn("{task.description}", markup=False)
    columns = (words, BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=screen, transient=True) as bars:
        task = bars.add_task(printable(beginning), total=1.0)
        yield lambda what, share: bars.update(task, description=printable(what), completed=share)


_waiting: list[threading.Timer] = []


@contextmanager
def saying(what: str) -> Iterator[None]:
    """Says in a line what is being done if it takes longer than `PATIENCE_S` and shows no bar before.

    Not where the environment variable `FARM_AR_QUIET` is set. Serves as a decorator, too.
    """
    timer = threading.Timer(PATIENCE_S, lambda: typer.echo(f"{what} ...", err=True))
    timer.daemon = True
    if not os.environ.get("FARM_AR_QUIET"):
        timer.start()
        _waiting.append(timer)
    try:
        yield
    finally:
        timer.cancel()
        _waiting.clear()
