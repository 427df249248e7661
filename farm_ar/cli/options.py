"""Options that several commands share; numbers are read strictly, within limits, and refused in one line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from farm_ar.arrays import number_in, whole_in

REID_HELP = (
    "spatial (the paper's), spatial-ungated, likelihood, relational, nearest, distance, last-known, "
    "or module:Class of your own, called with the scene."
)
"""What `--reid` takes."""

MOST_SEED = 2**63 - 1
"""The largest seed: what a store of results can hold."""


def whole(low: int, high: int = 10**9) -> Callable[[str | int], int]:
    """A parser of whole numbers for Typer: digits only, from `low` to `high`."""

    def whole_number(text: str | int) -> int:
        value = whole_in(text) if isinstance(text, str) else text
        if value is None or not low <= value <= high:
            raise typer.BadParameter(f"must be a whole number from {low} to {high}, got {text!r}")
        return value

    return whole_number


def number(low: float = -1e9, high: float = 1e9) -> Callable[[str | float], float]:
    """A parser of numbers for Typer: decimal digits and a point, from `low` to `high`."""

    def decimal_number(text: str | float) -> float:
        value = number_in(text) if isinstance(text, str) else float(text)
        if value is None or not low <= value <= high:
            raise typer.BadParameter(f"must be a number from {low:g} to {high:g}, got {text!r}")
        return value

    return decimal_number


Seed = Annotated[
    int,
    typer.Option(metavar="N", parser=whole(0, MOST_SEED), help="Seed of the random numbers."),
]
