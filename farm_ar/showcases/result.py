"""What a showcase gives: rows of a table with intervals, and files; and the intervals."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray
from farm_ar.scenes.files import csv_table, write_text

RESAMPLINGS = 2000

Row = dict[str, Any]
Image = npt.NDArray[np.uint8]
Report = Callable[[str, float], None]


@dataclass
class Shown:
    """What a showcase shows.

    Args:
        title: of the table.
        rows: of the table, with the same columns.
        notes: lines below it.
        paths: files written so far.
    """

    title: str
    rows: list[Row] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    paths: list[Path] = field(default_factory=list)

    def write(self, out: Path, name: str, trials: Sequence[Row]) -> None:
        """Write the table as NAME.json and what it sums up as NAME.csv."""
        about = {"title": self.title, "rows": self.rows, "notes": self.notes}
        for path, text in (
            (out / f"{name}.json", json.dumps(about, indent=1, allow_nan=False) + "\n"),
            (out / f"{name}.csv", csv_table(list(trials[0]), trials)),
        ):
            write_text(path, text)
            self.paths.append(path)


def interval(
    values: npt.ArrayLike, statistic: Callable[[FloatArray], FloatArray] | None = None
) -> FloatArray:
    """(3,) a statistic of N layouts and its 95% interval, by resampling them.

    Args:
        values: (N,) or, for a statistic of several numbers a layout, (N, K).
        statistic: of (..., N) or (..., N, K), over the layouts; the mean by default.
    """
    given = np.asarray(values, dtype=np.float64)
    of = statistic or (lambda drawn: drawn.mean(axis=-1))
    rng = np.random.default_rng(np.random.SeedSequence(0, spawn_key=(len(given),)))
    drawn = of(given[rng.integers(len(given), size=(RESAMPLINGS, len(given)))])
    return np.array([float(of(given)), *np.nanquantile(drawn, [0.025, 0.975])])


def percent(values: npt.ArrayLike) -> str:
    """The mean of N shares as a percentage, with its interval."""
    middle, low, high = 100 * interval(values)
    return f"{middle:.1f}% [{low:.1f}, {high:.1f}]"


def number(values: npt.ArrayLike, digits: int = 2) -> str:
    """The mean of N numbers, with its interval."""
    middle, low, high = interval(values)
    return f"{middle:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def points(values: npt.ArrayLike, others: npt.ArrayLike) -> str:
    """The mean difference of N pairs of shares in percentage points, with its interval."""
    middle, low, high = 100 * interval(np.asarray(values, dtype=np.float64) - np.asarray(others))
    return f"{middle:+.1f} [{low:+.1f}, {high:+.1f}]"


def column(trials: Sequence[Mapping[str, Any]], name: str) -> FloatArray:
    """One column of the rows of trials."""
    return np.array([float(trial[name]) for trial in trials])
