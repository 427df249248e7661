"""What commands print: tables and lines that stay readable anywhere, and how far long work is."""

from __future__ import annotations

import json
import os
import shutil
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console

NARROWEST, ELSEWHERE = 80, 160
"""Columns that a table is given at the least, and where there is no terminal whose width could be asked."""


def console() -> Console:
    """A console on the standard output that prints names as they are: no markup, no emoji codes."""
    from rich.console import Console

    width = shutil.get_terminal_size((ELSEWHERE, 24)).columns
    return Console(width=max(width, NARROWEST), markup=False, emoji=False, highlight=False)


def print_table(columns: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[str] = ()) -> None:
    """Print rows under the names of their columns; those named in `numbers` are aligned on the right.

    Text that is wider than there is room for goes on in the next line; nothing is cut off.
    """
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    for name in columns:
        if name in numbers:
            table.add_column(name, justify="right", no_wrap=True)
        else:
            table.add_column(name, overflow="fold")
    for row in rows:
        table.add_row(*map(printable, row))
    console().print(table)


def print_line(text: str) -> None:
    """Print one line, which the terminal may wrap."""
    console().print(printable(text), soft_wrap=True)


def printable(text: str) -> str:
    """The text with a replacement sign for whatever would steer the terminal: names come from any file."""
    return "".join(sign if sign.isprintable() else "\N{REPLACEMENT CHARACTER}" for sign in text)


def print_json(value: Any, line: bool = False) -> None:
    """Print a value as JSON and nothing else, on request in one line."""
    print(json.dumps(value, indent=None if line else 1, allow_nan=False))


PATIENCE_S = 1.5
"""What takes longer says what it does."""

EVERY_S = 10.0
"""How often that is said anew where there is no terminal."""

Report = Callable[[str, float], None]
"""Called with what is being done, and which share of it is done, 0 to 1."""


@contextmanager
def progress(beginning: str, at_once: bool = True) -> Iterator[Report]:
    """A bar that grows on a terminal and is gone at the end; elsewhere plain lines, one every `EVERY_S`.

    Args:
        beginning: what is being done at first.
        at_once: whether the first line comes at once; else it is left to the command's `saying`.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    screen = Console(stderr=True, markup=False, emoji=False, highlight=False)
    if at_once or screen.is_terminal:
        for timer in _waiting:
            timer.cancel()
    if not screen.is_terminal:
        if at_once:
            screen.print(f"{printable(beginning)} ...", soft_wrap=True)
        said = time.monotonic()

        def say(what: str, share: float) -> None:
            nonlocal said
            if time.monotonic() - said >= EVERY_S:
                said = time.monotonic()
                screen.print(f"{printable(what)} ({share:.0%})", soft_wrap=True)

        yield say
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
