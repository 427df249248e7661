"""The result of an experiment: rows, a picture, and the paper's numbers beside ours."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from farm_ar.drawing import save_picture
from farm_ar.scenes.files import csv_table, write_text

Value = str | int | float | None
Row = Mapping[str, Value]

OURS, OTHER, PAPER = "#3b6ea5", "#c77d2e", "#b0b0b0"
"""Colours of the charts."""

TITLE_SIZE, TEXT_SIZE = 9, 8
"""Sizes of their letters, points."""


@dataclass(frozen=True)
class Comparison:
    """One number of the paper beside ours.

    Args:
        what: it is of.
        paper: the paper's.
        ours: the text's method, run here.
        spread: the variation of ours, and over what.
        interval: 95% interval of ours, by resampling layouts.
        program: what the authors' public program gives here (`spatial-unity`).
        difference: ours less the program's on the same snapshots, with its 95% interval.
    """

    what: str
    paper: str
    ours: str
    spread: str = ""
    interval: str = ""
    program: str = ""
    difference: str = ""


COLUMNS = {
    "paper": "paper",
    "ours": "ours",
    "interval": "95% interval",
    "program": "authors' program",
    "difference": "ours less program (95%)",
    "spread": "spread",
}
"""Headings of a comparison's columns; those from the interval to the difference stand only where needed."""


def comparison_table(comparisons: Sequence[Comparison]) -> tuple[list[str], list[list[str]]]:
    """Headings and cells of a table of comparisons, without columns that none of them fills."""
    always = ("paper", "ours", "spread")
    names = [name for name in COLUMNS if name in always or any(getattr(c, name) for c in comparisons)]
    cells = [[c.what, *(getattr(c, name) for name in names)] for c in comparisons]
    return ["", *(COLUMNS[name] for name in names)], cells


@dataclass(frozen=True, eq=False)
class Report:
    """The outcome of one experiment.

    Args:
        name: of its files.
        title: what it is.
        rows: the results, one mapping from column to value each; NaN is written as an empty value.
        comparisons: with the paper.
        figure: in the paper's form.
        measured: rows of measured times, which no seed repeats; kept in a file of their own.
        note: what a reader must know to judge the comparison.
        tables: further tables in Markdown.
    """

    name: str
    title: str
    rows: Sequence[Row]
    comparisons: Sequence[Comparison]
    figure: Figure
    measured: Sequence[Row] = ()
    note: str = ""
    tables: str = ""

    def write(self, folder: Path) -> list[Path]:
        """Write the CSV, JSON and SVG files into a folder, each whole or not at all; returns their paths."""
        written = []
        for suffix, rows in (("", self.rows), ("_times", self.measured)):
            if rows:
                plain = [{column: _plain(value) for column, value in row.items()} for row in rows]
                written.append(folder / f"{self.name}{suffix}.csv")
                write_text(written[-1], csv_table(plain[0], plain))
                written.append(folder / f"{self.name}{suffix}.json")
                write_text(written[-1], json.dumps(plain, indent=1, allow_nan=False) + "\n")
        written.append(folder / f"{self.name}.svg")
        save_picture(self.figure, written[-1])
        return written

    def markdown(self) -> str:
        """The section of the summary about this experiment."""
        lines = [f"## {self.title}", ""]
        if self.note:
            lines += [self.note, ""]
        headings, cells = comparison_table(self.comparisons)
        lines += [f"| {' | '.join(headings)} |".replace("|  |", "| |"), "|---" * len(headings) + "|"]
        lines += [f"| {' | '.join(row)} |" for row in cells]
        if self.tables:
            lines += ["", self.tables]
        lines += ["", f"Picture: [{self.name}.svg]({self.name}.svg)", ""]
        return "\n".join(lines)


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of a size in inches that spaces its panels by itself."""
    figure = Figure(figsize=(width, height), layout=ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.08))
    FigureCanvasAgg(figure)
    return figure


def set_up_chart(axes: Axes, title: str, xlabel: str, ylabel: str) -> None:
    """Make axes those of a chart of shares, 0 to 1, over a light grid."""
    axes.set_title(title, fontsize=TITLE_SIZE)
    axes.set_xlabel(xlabel, fontsize=TEXT_SIZE)
    axes.set_ylabel(ylabel, fontsize=TEXT_SIZE)
    axes.set_ylim(0, 1.04)
    axes.set_yticks([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
    axes.tick_params(labelsize=TEXT_SIZE)
    axes.grid(color="#eeeeee")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _plain(value: Value) -> Value:
    return None if isinstance(value, float) and math.isnan(value) else value
