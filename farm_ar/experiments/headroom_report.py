"""Tables, calibration and the figure of the head-room experiment, from its rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from farm_ar.arrays import FloatArray
from farm_ar.experiments.report import (
    OTHER,
    OURS,
    PAPER,
    TEXT_SIZE,
    Comparison,
    Report,
    new_figure,
    set_up_chart,
)
from farm_ar.sweeps import Row

JITTER, PAPER_METHOD, MAIN_METHOD, BOUND = "jitter", "spatial-ungated", "likelihood", "bound: noise known"
RELIABILITY_BINS = 10
MOST_CONFIDENT = 0.8
"""Share of the answers, those with the highest confidence, whose accuracy is reported separately."""

_COLOURS = (PAPER, "#777777", OURS, "#5a9a68", "#8b5fa8", "#b3554f", "#4fa3a5")


def report_of(rows: Sequence[Row], layouts: int, own: Sequence[str] = ()) -> Report:
    """The report of all rows of `run_unit`; `own` names the user's re-identifiers."""
    sure = [method for method in methods_of(rows) if answers_by_confidence(rows, method, None)[0].any()]
    worst, where = worst_cell(rows, MAIN_METHOD)
    table = (JITTER,)
    comparisons = [
        Comparison(
            "mean accuracy over the table, noise unknown",
            f"{mean_accuracy(rows, PAPER_METHOD):.4f}",
            f"{mean_accuracy(rows, MAIN_METHOD):.4f}",
            f"noise known: {mean_accuracy(rows, BOUND):.4f}; goal 0.83",
        ),
        Comparison("the cell with the least gain", "", f"{worst:+.3f}", f"{where}; goal not below -0.02"),
        Comparison(
            "expected calibration error over the table",
            "",
            f"{calibration_error(rows, MAIN_METHOD, table):.3f}",
            "goal at most 0.05",
        ),
        Comparison(
            f"accuracy of the {MOST_CONFIDENT:.0%} of the answers with the highest confidence",
            "",
            f"{accuracy_of_most_confident(rows, MAIN_METHOD, table):.3f}",
            "over the table",
        ),
        *(_compared(rows, name) for name in own),
    ]
    return Report(
        "headroom",
        f"Head-room: every method on the same snapshots, {layouts} layouts",
        rows,
        comparisons,
        _figure(rows, sure),
        note="The column of the paper is the paper's method, run here. The table is T 0.1 0.3 0.5 1 by "
        "R 15 30 60 120 by six scenes.",
        tables=tables(rows),
    )


def _compared(rows: Sequence[Row], own: str) -> Comparison:
    """A re-identifier of the user's beside the paper's method."""
    worst, where = worst_cell(rows, own)
    return Comparison(
        f"mean accuracy over the table, {own}",
        f"{mean_accuracy(rows, PAPER_METHOD):.4f}",
        f"{mean_accuracy(rows, own):.4f}",
        f"least gain {worst:+.3f} at {where}",
    )


def methods_of(rows: Sequence[Row]) -> list[str]:
    """The methods in the order of the rows, the bound last."""
    names = list(dict.fromkeys(str(row["rule"]) for row in rows))
    return [name for name in names if name != BOUND] + [name for name in names if name == BOUND]


def mean_accuracy(rows: Sequence[Row], method: str, **only: Any) -> float:
    """Mean over the scenes and noise levels of a method's rows, of the table unless `pattern` is given."""
    only = {"pattern": JITTER, **only}
    wanted = [r for r in rows if r["rule"] == method and all(r[key] == value for key, value in only.items())]
    return float(np.mean([float(r["accuracy"] or 0.0) for r in wanted])) if wanted else float("nan")


def worst_cell(rows: Sequence[Row], method: str) -> tuple[float, str]:
    """The smallest gain over the paper's method of all pairs T, R (means over the scenes), and its pair."""
    gains = {cell: _cell(rows, method, cell) - _cell(rows, PAPER_METHOD, cell) for cell in _cells(rows)}
    worst = min(gains, key=lambda cell: gains[cell])
    return gains[worst], f"T {worst[0]:g}, R {worst[1]}"


def answers_by_confidence(
    rows: Sequence[Row], method: str, patterns: Sequence[str] | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Answers in each bin of confidence, the sum of their confidences, and how many were right."""
    total: FloatArray = np.zeros((3, 1))
    for row in rows:
        if row["rule"] == method and (patterns is None or row["pattern"] in patterns) and row["answers"]:
            lists = [
                np.array(str(row[key]).split(), dtype=np.float64) for key in ("answers", "sure", "right")
            ]
            total = total + np.array(lists)
    return total[0], total[1], total[2]


def calibration_error(rows: Sequence[Row], method: str, patterns: Sequence[str] | None) -> float:
    """Expected calibration error over ten bins of confidence; NaN without confidences."""
    count, sure, right = (_coarser(x) for x in answers_by_confidence(rows, method, patterns))
    return float(np.abs(sure - right).sum() / count.sum()) if count.sum() else float("nan")


def risk_coverage(
    rows: Sequence[Row], method: str, patterns: Sequence[str] | None
) -> tuple[FloatArray, FloatArray]:
    """Share of the answers, by falling confidence, and their accuracy."""
    count, _, right = (x[::-1].cumsum() for x in answers_by_confidence(rows, method, patterns))
    some = count > 0
    return count[some] / count[-1], right[some] / count[some]


def accuracy_of_most_confident(rows: Sequence[Row], method: str, patterns: Sequence[str] | None) -> float:
    """Accuracy of the `MOST_CONFIDENT` share of the answers; NaN without confidences."""
    covered, accuracy = risk_coverage(rows, method, patterns)
    return float(np.interp(MOST_CONFIDENT, covered, accuracy)) if len(covered) else float("nan")


def tables(rows: Sequence[Row]) -> str:
    """The tables in Markdown: all methods by scene and pattern, the cells, and their confidence."""
    patterns = [p for p in dict.fromkeys(str(row["pattern"]) for row in rows) if p != JITTER]
    scenes, every = list(dict.fromkeys(str(row["scene"]) for row in rows)), methods_of(rows)
    overview = [
        [method, *(_number(mean_accuracy(rows, method, pattern=p)) for p in (JITTER, *patterns))]
        for method in every
    ]
    by_scene = [
        [method, *(_number(mean_accuracy(rows, method, scene=s)) for s in scenes)] for method in every
    ]
    cells = _cells(rows)
    by_cell = [[method, *(_number(_cell(rows, method, cell)) for cell in cells)] for method in every]
    sure = [
        [
            method,
            _number(calibration_error(rows, method, (JITTER,))),
            _number(calibration_error(rows, method, None)),
            _number(accuracy_of_most_confident(rows, method, (JITTER,))),
            _number(accuracy_of_most_confident(rows, method, None)),
        ]
        for method in every
        if answers_by_confidence(rows, method, None)[0].any()
    ]
    heads = ["calibration error, table", "with patterns", "80% most confident, table", "with patterns"]
    parts = [
        "Mean accuracy over the six scenes:\n",
        _markdown(["method", "table", *patterns], overview),
        "\nThe table by scene:\n",
        _markdown(["method", *scenes], by_scene),
        "\nThe table by noise, T in metres and R in degrees:\n",
        _markdown(["method", *(f"{t:g}, {r}" for t, r in cells)], by_cell),
        "\nConfidence of the methods, and its calibration:\n",
        _markdown(["method", *heads], sure),
    ]
    return "\n".join(parts)


def _cells(rows: Sequence[Row]) -> list[tuple[float, int]]:
    return sorted(
        {
            (float(row["translation_sd_m"] or 0), int(row["rotation_sd_deg"] or 0))
            for row in rows
            if row["pattern"] == JITTER
        }
    )


def _cell(rows: Sequence[Row], method: str, cell: tuple[float, int]) -> float:
    return mean_accuracy(rows, method, translation_sd_m=cell[0], rotation_sd_deg=cell[1])


def _coarser(values: FloatArray) -> FloatArray:
    coarse: FloatArray = values.reshape(min(RELIABILITY_BINS, len(values)), -1).sum(axis=1)
    return coarse


def _number(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.3f}"


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _figure(rows: Sequence[Row], sure: Sequence[str]) -> Figure:
    figure = new_figure(9.5, 7.0)
    (noise, patterns), (reliability, coverage) = figure.subplots(2, 2)
    colours = dict(zip(methods_of(rows), _COLOURS * 3, strict=False)) | {MAIN_METHOD: OURS, BOUND: OTHER}
    _plot_cells(noise, rows, colours)
    _plot_patterns(patterns, rows, colours)
    set_up_chart(reliability, "(c) reliability, all snapshots", "confidence", "accuracy")
    set_up_chart(
        coverage, "(d) the most confident answers, all snapshots", "share of the answers", "accuracy"
    )
    reliability.plot([0, 1], [0, 1], color="#bbbbbb", linewidth=0.8, linestyle=":")
    for method in sure:
        count, confidence, right = (_coarser(x) for x in answers_by_confidence(rows, method, None))
        some = count > 0
        reliability.plot(
            confidence[some] / count[some], right[some] / count[some], ".-", color=colours[method]
        )
        coverage.plot(*risk_coverage(rows, method, None), color=colours[method])
    figure.legend(
        handles=noise.get_lines(), loc="outside lower center", ncols=4, frameon=False, fontsize=TEXT_SIZE
    )
    return figure


def _plot_cells(axes: Axes, rows: Sequence[Row], colours: dict[str, str]) -> None:
    set_up_chart(axes, "(a) the table, mean of six scenes", "T (m), R (°)", "accuracy")
    cells = _cells(rows)
    for method in methods_of(rows):
        line = "--" if method == BOUND else "-"
        axes.plot([_cell(rows, method, cell) for cell in cells], line, color=colours[method], label=method)
    axes.set_xticks(range(len(cells)), [f"{t:g}, {r}" for t, r in cells], rotation=90, fontsize=6)


def _plot_patterns(axes: Axes, rows: Sequence[Row], colours: dict[str, str]) -> None:
    set_up_chart(axes, "(b) other patterns, mean of six scenes", "", "accuracy")
    names = [p for p in dict.fromkeys(str(row["pattern"]) for row in rows) if p != JITTER]
    every = methods_of(rows)
    width = 0.8 / len(every)
    for k, method in enumerate(every):
        place = np.arange(len(names)) + (k - (len(every) - 1) / 2) * width
        axes.bar(place, [mean_accuracy(rows, method, pattern=p) for p in names], width, color=colours[method])
    axes.set_xticks(range(len(names)), [name.replace(" ", "\n", 1) for name in names], fontsize=6)
    axes.grid(visible=False, axis="x")
