"""Learning curves of runs: over seeds, with what known policies have as lines."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from farm_ar.agents.training.run_folder import Run, RunError, RunFolder, read_table
from farm_ar.arrays import FloatArray
from farm_ar.drawing.palette import FAINT, INK
from farm_ar.envs.references import reference_returns
from farm_ar.errors import OptionError

COLORS = ("#2563eb", "#d97706", "#059669", "#db2777", "#7c3aed", "#0891b2", "#65a30d", "#475569")
"""Of the curves, in turn."""

TABLES = {"evaluations": "evaluations.csv", "training": "training.csv"}
"""The files of a run that hold curves, by name."""

NO_MATTER = {"play_seconds", "animals_a_second"}
"""Arguments that change no return, but with the reward `miscount`."""

LINE_SHARE = 0.05
"""How far apart two names beside a picture are at least, as a share of its height."""

SETTINGS: dict[Any, Any] = {"svg.hashsalt": "farm-ar", "font.family": "sans-serif", "font.size": 9.0}


@dataclass(frozen=True, eq=False)
class Curve:
    """Mean returns of R runs that differ in the seed.

    Args:
        name: of what they have in common.
        steps: (S,) of training.
        returns: (R, S) of each run, between its own points on straight lines.
    """

    name: str
    steps: FloatArray
    returns: FloatArray


def curves_of(runs: Sequence[str], which: str = "evaluations") -> tuple[list[Curve], dict[str, float]]:
    """The curves of runs, and what known policies have on their environment.

    Runs of the same environment, learner and hyperparameters are one curve, as long as the shortest of them.

    Args:
        runs: their folders.
        which: one of `TABLES`.

    Returns:
        The curves, and mean returns by policy; none where the runs' arguments make returns of another kind.

    Raises:
        RunError: a folder is no run's, or has no curve yet.
        OptionError: there are none, one is there twice, or they are of environments with other returns.
    """
    if not runs:
        raise OptionError("run", "must be at least one folder", None)
    read = [(Path(run), RunFolder(Path(run)).read()) for run in runs]
    places = [path.resolve() for path, _ in read]
    for path, _ in read:
        if places.count(path.resolve()) > 1:
            raise OptionError("run", "must be given once, or it would count as several seeds", str(path))
    for path, run in read:
        if (run.env, _scored(run)) != (read[0][1].env, _scored(read[0][1])):
            expected = f"must be of the same environment, with the same arguments, as {read[0][0]}"
            raise OptionError("run", expected, str(path))
    groups: dict[str, list[tuple[FloatArray, FloatArray]]] = {}
    names: list[tuple[tuple[str, dict[str, Any]], str]] = []
    for path, run in read:
        kind = run.algo, run.recipe.as_dict()
        known = next((name for other, name in names if other == kind), None)
        if known is None:
            known = run.algo if run.algo not in groups else f"{run.algo} ({path.name})"
            names.append((kind, known))
        groups.setdefault(known, []).append(_points(path, which))
    return [_curve(name, points) for name, points in groups.items()], _references(read[0][1])


def draw(curves: Sequence[Curve], references: Mapping[str, float], title: str) -> Figure:
    """A picture of the curves: means, all runs faintly, from least to most; references as dashed lines."""
    with rc_context(SETTINGS):
        figure = Figure(figsize=(7.0, 4.0), layout="constrained")
        axes = figure.add_subplot()
        for k, curve in enumerate(curves):
            color, count = COLORS[k % len(COLORS)], len(curve.returns)
            axes.fill_between(
                curve.steps, curve.returns.min(0), curve.returns.max(0), color=color, alpha=0.15, linewidth=0
            )
            axes.plot(curve.steps, curve.returns.T, color=color, alpha=0.35, linewidth=0.8)
            seeds = f"{count} seed{'s' if count > 1 else ''}"
            axes.plot(
                curve.steps, curve.returns.mean(0), color=color, linewidth=2, label=f"{curve.name}, {seeds}"
            )
        for value in references.values():
            axes.axhline(value, color=FAINT, linestyle="--", linewidth=1)
        low, high = axes.get_ylim()
        for name, height in _apart(references, LINE_SHARE * (high - low)).items():
            text, place = f"{name} {references[name]:.2f}", (1.01, height)
            where: Any = ("axes fraction", "data")
            axes.annotate(text, place, xycoords=where, color=INK, verticalalignment="center")
        axes.set_xlabel("steps")
        axes.set_ylabel("mean return")
        axes.set_title(title)
        axes.legend(frameon=False)
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _apart(values: Mapping[str, float], gap: float) -> dict[str, float]:
    """Where names are written: each at its value, or so much above the one below it."""
    heights: dict[str, float] = {}
    for name in sorted(values, key=lambda one: values[one]):
        heights[name] = max([values[name], *(height + gap for height in heights.values())])
    return heights


def save(figure: Figure, path: Path) -> None:
    """Write a picture; an SVG repeats byte for byte."""
    with rc_context(SETTINGS):
        metadata = {"Date": None} if path.suffix == ".svg" else None
        figure.savefig(path, dpi=150, metadata=metadata)


def _points(path: Path, which: str) -> tuple[FloatArray, FloatArray]:
    """(S,) steps and (S,) mean returns of a run."""
    try:
        rows = read_table(path / TABLES[which])
        points = np.array([(row["steps"], row["mean_return"]) for row in rows], dtype=np.float64)
    except KeyError as missing:
        raise RunError(TABLES[which], f"must have the column {missing}", "none", str(path)) from None
    except (OSError, ValueError, TypeError, csv.Error) as problem:
        expected = "must be a table of numbers, as farm-ar train wrote it"
        raise RunError(TABLES[which], expected, " ".join(str(problem).split()), str(path)) from None
    if len(points) == 0 or not np.isfinite(points).all():
        raise RunError(
            TABLES[which], "must hold finite numbers; the run has not come so far", "none", str(path)
        )
    steps = points[:, 0]
    if not (np.diff(steps) > 0).all():
        raise RunError(TABLES[which], "must have steps that rise from row to row", steps.tolist(), str(path))
    return steps, points[:, 1]


def _curve(name: str, points: Sequence[tuple[FloatArray, FloatArray]]) -> Curve:
    first, last = max(steps[0] for steps, _ in points), min(steps[-1] for steps, _ in points)
    every = np.unique(np.concatenate([steps for steps, _ in points]))
    shared = every[(every >= first) & (every <= last)]
    if not shared.size:
        raise OptionError("run", "must have trained for steps in common, to be one curve", name)
    return Curve(name, shared, np.array([np.interp(shared, steps, returns) for steps, returns in points]))


def _scored(run: Run) -> dict[str, Any]:
    """The arguments on which a return depends."""
    given = run.recipe.env_kwargs
    miscount = given.get("reward") == "miscount"
    return {name: value for name, value in given.items() if miscount or name not in NO_MATTER}


def _references(run: Run) -> dict[str, float]:
    if _scored(run) or "Shaped" in run.env:
        return {}
    try:
        return {name: one.mean for name, one in reference_returns(run.env).items()}
    except OptionError:
        return {}
