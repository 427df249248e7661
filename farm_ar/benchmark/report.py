"""The report of a benchmark: tables for the terminal, and a page with charts."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from farm_ar import __version__
from farm_ar.agents.stress.figures import COLORS, SETTINGS, Line, bar_chart, line_chart, svg_of
from farm_ar.agents.stress.report import templates_of
from farm_ar.benchmark.evaluation import SIMPLE
from farm_ar.benchmark.results import BREAKING_CASES, Results
from farm_ar.benchmark.scores import BINS, Interval, Score
from farm_ar.drawing.palette import FAINT, INK
from farm_ar.scenes.files import write_text

HEAD = (
    "method", "accuracy", "gain over simple", "none", "named", "calibration", "Brier", "at 0.9",
    "right there", "ms", "to break",
)  # fmt: skip
"""Columns of the summary."""

ROW_HEAD = (
    "row", "accuracy", "best simple", "gain over it", "none", "named", "calibration", "Brier", "at 0.9",
    "right there", "ms",
)  # fmt: skip
"""Columns of one method's rows."""

SHORT = 7
"""How many of these a terminal shows."""

LEGEND = (
    "accuracy: right answers, mean over rows; gain: less the best simple assignment of each row, with 95%.",
    "none: wrongly answered none; named: wrongly given a label, to a false detection or a new object.",
    "calibration: expected calibration error, less that of a calibrated method; Brier: 0 (best) to 2.",
    "at 0.9: share of answers with at least 0.9 confidence; right there: share of these that is right.",
    "ms: median time of a snapshot; to break: median minimum perturbation on the game's table, D.",
)
"""What the columns of the summary say."""

POINTS = 200
"""Points of a curve."""


def summary_rows(results: Results) -> list[tuple[str, ...]]:
    """A row of text for each method, under `HEAD`."""
    rows = []
    for method in results.methods:
        one = results.scores[method, "all"]
        breaking = results.breaking.get(method)
        rows.append(
            (
                method,
                number(one.accuracy),
                "–" if method in SIMPLE else gain(one.difference),
                *_details(one),
                "–" if breaking is None else effort(breaking),
            )
        )
    return rows


def accuracy_rows(results: Results) -> list[tuple[str, ...]]:
    """A row of text for each row of the suite: its name and every method's accuracy."""
    return [
        (row, *(number(results.scores[method, row].accuracy) for method in results.methods))
        for row in results.rows
    ]


def paired_rows(results: Results) -> list[tuple[str, ...]]:
    """A row of text for each row of the suite: by how much the first method is oftener right than others."""
    others = list(dict.fromkeys(other for other, _ in results.paired))
    return [(row, *(gain(results.paired[other, row]) for other in others)) for row in (*results.rows, "all")]


def paired_head(results: Results) -> tuple[str, ...]:
    """The columns of `paired_rows`."""
    others = dict.fromkeys(other for other, _ in results.paired)
    return ("row", *(f"{results.methods[0]} less {other}" for other in others))


def method_rows(results: Results, method: str) -> list[tuple[str, ...]]:
    """A row of text for each row of the suite, about one method, under `ROW_HEAD`."""
    rows = []
    for row in results.rows:
        one = results.scores[method, row]
        best = f"{one.simple} {number(results.scores[one.simple, row].accuracy)}"
        rows.append((row, number(one.accuracy), best, gain(one.difference), *_details(one)))
    return rows


def _details(one: Score) -> tuple[str, ...]:
    values = (
        one.wrongly_none,
        one.wrongly_named,
        one.calibration_error,
        one.brier,
        one.coverage,
        one.coverage_right,
    )
    return (*map(number, values), "–" if np.isnan(one.milliseconds) else f"{one.milliseconds:.3g}")


def number(value: float) -> str:
    """A number with three decimals; NaN as a dash."""
    return "–" if np.isnan(value) else f"{value:.3f}"


def gain(value: Interval) -> str:
    """A difference with its interval."""
    if np.isnan(value.value):
        return "–"
    return f"{value.value:+.3f} ({value.low:+.3f} to {value.high:+.3f})"


def effort(value: float) -> str:
    """A breaking effort; infinite where nothing broke, NaN as a dash."""
    return "not broken" if np.isinf(value) else "–" if np.isnan(value) else f"{value:.3g}"


def write_results(results: Results, folder: str | os.PathLike[str]) -> list[Path]:
    """Write `benchmark.html` and `benchmark.json`."""
    out = Path(folder)
    files = {
        "benchmark.html": page_of(results),
        "benchmark.json": json.dumps(results.values(), indent=1, allow_nan=False) + "\n",
    }
    for name, text in files.items():
        write_text(out / name, text)
    return [out / name for name in files]


def page_of(results: Results) -> str:
    """The whole page: it loads nothing, and runs nothing."""
    from markupsafe import Markup

    environment = templates_of("farm_ar.benchmark", "farm_ar.agents.stress")
    environment.filters |= {"number": number, "gain": gain, "percent": lambda share: f"{100 * share:.1f}%"}
    asked = asked_for(results)
    stating = [method for method in asked if results.calibrations[method].answers.any()]
    return environment.get_template("benchmark.html.j2").render(
        results=results,
        asked=asked,
        version=__version__,
        bins=BINS,
        cases=BREAKING_CASES,
        detections=results.scores[asked[0], "all"].detections,
        head=HEAD,
        rows=summary_rows(results),
        row_head=ROW_HEAD,
        by_row=[(row, results.rows[row], *cells) for row, *cells in accuracy_rows(results)],
        paired_head=paired_head(results),
        paired=paired_rows(results) if results.paired else [],
        parts={method: method_rows(results, method) for method in asked},
        gains=Markup(gain_chart(results, asked)),
        calibrations=[(method, Markup(_calibration_chart(results, method))) for method in stating],
        curves=Markup(_selection_chart(results, stating)) if stating else "",
    )


def asked_for(results: Results) -> list[str]:
    """The methods that were asked for; the simple ones if there are no others."""
    return [method for method in results.methods if method not in SIMPLE] or list(results.methods)


def gain_chart(results: Results, methods: Sequence[str]) -> str:
    """Each method's gain in each row, a dot with its interval."""
    names = list(results.rows)
    place = np.arange(len(names))[::-1]
    with mpl.rc_context(SETTINGS):
        figure = Figure(figsize=(7.4, 0.9 + 0.19 * len(names)))
        axes = figure.add_axes((0.2, 0.06, 0.78, 0.9))
        axes.set_xlabel("gain in accuracy")
    for k, (method, color) in enumerate(zip(methods, COLORS, strict=False)):
        found = [results.scores[method, row].difference for row in names]
        off = 0.22 * (k - (len(methods) - 1) / 2)
        axes.hlines(place - off, [one.low for one in found], [one.high for one in found], color=color, lw=1.2)
        axes.plot([one.value for one in found], place - off, "o", color=color, markersize=3.2, label=method)
    axes.axvline(0.0, color=INK, linewidth=0.8)
    axes.set_yticks(place, names)
    axes.set_ylim(-0.8, len(names) - 0.2)
    axes.grid(color="#e5e7eb", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(length=2, color=FAINT, labelcolor=INK)
    if len(methods) > 1:
        axes.legend(loc="lower left", frameon=False)
    return svg_of(figure)


def _calibration_chart(results: Results, method: str) -> str:
    found = results.calibrations[method]
    return bar_chart(found.right.tolist(), found.answers.tolist(), "confidence", "share right")


def _selection_chart(results: Results, methods: Sequence[str]) -> str:
    lines = []
    for method, color in zip(methods, COLORS, strict=False):
        coverage, right = results.curves[method]
        shown = np.unique(np.linspace(0, len(coverage) - 1, POINTS).astype(int))
        lines.append(Line(method, coverage[shown].tolist(), right[shown].tolist(), color))
    return line_chart(lines, "share of the answers", "accuracy", 1.0)
