"""What an experiment leaves: rows, a picture, and the paper's numbers beside ours."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from farm_ar.drawing import save_picture
from farm_ar.scenes.fields import write_text

Value = str | int | float | None
Row = Mapping[str, Value]


@dataclass(frozen=True)
class Comparison:
    """One number of the paper beside ours; `spread` says how far ours varies, and over what."""

    what: str
    paper: str
    ours: str
    spread: str = ""


@dataclass(frozen=True, eq=False)
class Report:
    """The outcome of one experiment.

    Args:
        name: of its files.
        title: what it is.
        rows: the results, one mapping from column to value each.
        comparisons: with the paper.
        figure: in the paper's form.
        measured: rows of measured times, which no seed repeats; kept in a file of their own.
        note: what a reader must know to judge the comparison.
    """

    name: str
    title: str
    rows: Sequence[Row]
    comparisons: Sequence[Comparison]
    figure: Figure
    measured: Sequence[Row] = ()
    note: str = ""
    more_figures: Mapping[str, Figure] = field(default_factory=dict)

    def write(self, folder: Path) -> list[Path]:
        """Write the CSV, JSON and SVG files into a folder; returns their paths."""
        written = []
        for suffix, rows in (("", self.rows), ("_times", self.measured)):
            if rows:
                written.append(folder / f"{self.name}{suffix}.csv")
                write_text(written[-1], _as_csv(rows))
                written.append(folder / f"{self.name}{suffix}.json")
                write_text(written[-1], json.dumps(list(rows), indent=1) + "\n")
        for name, figure in {self.name: self.figure, **self.more_figures}.items():
            written.append(folder / f"{name}.svg")
            save_picture(figure, written[-1])
        return written

    def markdown(self) -> str:
        """The section of the summary about this experiment."""
        lines = [f"## {self.title}", ""]
        if self.note:
            lines += [self.note, ""]
        lines += ["| | paper | ours | spread |", "|---|---|---|---|"]
        lines += [f"| {c.what} | {c.paper} | {c.ours} | {c.spread} |" for c in self.comparisons]
        figures = [self.name, *self.more_figures]
        lines += ["", "Pictures: " + ", ".join(f"[{name}.svg]({name}.svg)" for name in figures), ""]
        return "\n".join(lines)


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of a size in inches that spaces its panels by itself."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _as_csv(rows: Sequence[Row]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
