"""What the commands print: tables that stay readable in a terminal, in a file and in a pipe."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable, Sequence
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

NARROWEST, ELSEWHERE = 80, 160
"""Columns that a table is given at the least, and where there is no terminal whose width could be asked."""


def console() -> Console:
    """A console on the standard output that prints names as they are: no markup, no emoji codes."""
    width = shutil.get_terminal_size((ELSEWHERE, 24)).columns
    return Console(width=max(width, NARROWEST), markup=False, emoji=False, highlight=False)


def print_table(columns: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[str] = ()) -> None:
    """Print rows under the names of their columns; those named in `numbers` are aligned on the right.

    Text that is wider than there is room for goes on in the next line; nothing is cut off.
    """
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


def print_json(value: Any) -> None:
    """Print a value as JSON and nothing else."""
    print(json.dumps(value, indent=1, allow_nan=False))
