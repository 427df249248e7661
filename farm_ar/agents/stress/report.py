"""The report of a stress test: a page to look at, and the same as JSON and CSV for programs."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from farm_ar import __version__
from farm_ar.agents.certificates import NO_BOUND
from farm_ar.agents.stress.failures import Shown, gallery
from farm_ar.agents.stress.figures import (
    CERTIFIED,
    COLORS,
    Line,
    bar_chart,
    cameras_picture,
    cell_chart,
    failure_picture,
    key_picture,
    line_chart,
)
from farm_ar.agents.stress.statistics import ReidSummary, Share, broken_within, summarise_reid
from farm_ar.agents.stress.study import Study, known_case
from farm_ar.envs.generator import scene_of
from farm_ar.scenes import Scene
from farm_ar.scenes.files import csv_table, json_values, write_text

if TYPE_CHECKING:
    from jinja2 import Environment

COLUMNS = (
    "case", "reid", "attack", "asked", "least", "largest", "metres", "degrees", "moved", "wrong", "query",
    "bound", "bound_t1", "ratio", "most_wrong", "most_wrong_effort", "surprise", "endpoint_error_m",
    "miscounts", "by_hand",
)  # fmt: skip
"""Columns of the CSV table, a row per case, re-identifier and attack."""

POINTS = 201
"""Points of a curve."""

WEAKEST = 8
"""Cameras and labels that the tables name."""

KIND_TITLES = {
    "cheapest": "Cheapest",
    "worst": "Most labels wrong",
    "likeliest": "Likeliest under random noise",
}


@dataclass(frozen=True)
class Summary:
    """What a stress test says.

    Args:
        reids: each re-identifier.
        failures: those that the gallery shows.
    """

    reids: tuple[ReidSummary, ...]
    failures: tuple[Shown, ...]

    def notes(self) -> list[str]:
        """What must be known of the cases before the numbers are believed, one sentence each."""
        notes = []
        for one in self.reids:
            every = len(one.cases) + one.wrong_before
            if one.wrong_before:
                notes.append(
                    f"{one.reid}: {one.wrong_before} of {every} cases are left out, "
                    "where labels are wrong before anything moves."
                )
            if one.stuck:
                notes.append(
                    f"{one.reid}: in {one.stuck} of {len(one.cases)} cases an attack found next to nothing "
                    "to query: hardly any displacement is allowed there (objects that touch, that are "
                    "outside the room, or none in view)."
                )
        return notes


def summarise(study: Study, labels: Sequence[str]) -> Summary:
    """The numbers of a study; `labels` are those of the scene's objects, in order."""
    reids = tuple(summarise_reid(study, reid, labels) for reid in study.options.reids)
    return Summary(reids, tuple(gallery(study)))


def write_study(study: Study, summary: Summary, folder: str | os.PathLike[str]) -> list[Path]:
    """Write `stress.html`, `stress.json` and `stress.csv`, and `stress-times.csv` beside them.

    All but the times depend on the options alone.
    """
    out = Path(folder)
    files = {
        "stress.html": page_of(study, summary),
        "stress.json": json.dumps(json_values(as_json(study, summary)), indent=1, allow_nan=False) + "\n",
        "stress.csv": _table(study),
        "stress-times.csv": _times(study),
    }
    for name, text in files.items():
        write_text(out / name, text)
    return [out / name for name in files]


def as_json(study: Study, summary: Summary) -> dict[str, Any]:
    """All that a stress test found, as JSON values but for numbers that are not finite."""
    options = study.options
    given = {"scene": options.scene, "jitter": options.jitter, "seed": options.seed}
    failures = [
        {"id": i, "kind": kind, **given, **{key: row[key] for key in ("case", "reid", "attack")}, **found}
        for i, (kind, row, found) in enumerate(summary.failures)
    ]
    return {
        "version": __version__,
        "options": options.as_dict(),
        "rules": [_reid_as_json(one) for one in summary.reids],
        "failures": failures,
    }


def _reid_as_json(one: ReidSummary) -> dict[str, Any]:
    return {
        "reid": one.reid,
        "theorem": one.theorem,
        "cases": list(one.cases),
        "cases_wrong_before": one.wrong_before,
        "cases_stuck": one.stuck,
        "bound_median": one.bound_median,
        "bound_t1_median": one.bound_t1,
        "median_least": one.best.median,
        "tightness_median": one.best.tightness,
        "noise_failures": list(one.noise),
        "calibration_error": one.calibration.error,
        "calibration_error_attacked": one.calibration_attacked.error,
        "mean_miscounts": one.miscounts,
        "mean_endpoint_error_m": one.endpoint_error_m,
        "by_hand": None if one.by_hand is None else list(one.by_hand),
        "by_hand_median": one.by_hand_median,
        "most_wrong": [None if worst is None else list(worst) for worst in one.most_wrong],
        "most_wrong_median": one.most_wrong_labels,
        "most_wrong_effort_median": one.most_wrong_distance,
        "transfer": {name: list(share) for name, share in one.transfer.items()},
        "attacks": [
            {
                "attack": attack.attack,
                "median_least": attack.median,
                "failed": list(attack.failed),
                "tightness_median": attack.tightness,
                "least": list(attack.least),
            }
            for attack in one.attacks
        ],
        "bounds": list(one.bounds) if one.certified else None,
        "labels": [
            dict(zip(("label", "misread", "cases_in_view", "bound_median"), row, strict=True))
            for row in one.labels
        ],
    }


def _table(study: Study) -> str:
    bounds = {(row["case"], row["reid"]): row for row in study.known}
    rows = []
    for row in study.attacked:
        known, cheapest, worst = bounds[row["case"], row["reid"]], row["cheapest"] or {}, row["worst"] or {}
        certified = known["theorem"] != NO_BOUND
        bound = known["bound"] if certified else None
        values = dict(row) | {
            "bound": bound,
            "bound_t1": known["bound_t1"] if certified else None,
            "ratio": row["least"] / bound if row["least"] is not None and bound else None,
            "moved": " ".join(cheapest.get("moved", [])),
            "most_wrong": worst.get("wrong"),
            "most_wrong_effort": worst.get("effort"),
        }
        values |= {name: cheapest.get(name) for name in COLUMNS if name in cheapest and name != "moved"}
        rows.append(values)
    return csv_table(COLUMNS, rows)


def _times(study: Study) -> str:
    return csv_table(("case", "reid", "attack", "asked", "seconds"), study.measured)


def templates_of(*packages: str) -> Environment:
    """The templates of pages in packages, those of the first one first: escaped, and strict about names."""
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=ChoiceLoader([PackageLoader(package) for package in packages]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def page_of(study: Study, summary: Summary) -> str:
    """The whole page: it loads nothing, and runs nothing."""
    from markupsafe import Markup

    scene = scene_of(study.options.scene, game=False)
    environment = templates_of("farm_ar.agents.stress")
    environment.filters |= {"number": number, "ratio": ratio, "share": share}
    environment.filters["as_way"] = lambda distance: in_metres(distance, scene)
    page = environment.get_template("report.html.j2")
    reach = _reach_of(study, summary.reids)
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for i, (kind, row, failure) in enumerate(summary.failures):
        case = known_case(study.options.scene, row["case"], study.options.jitter, study.options.seed)
        card = {"picture": Markup(failure_picture(case, failure)), "row": row, "id": i, **failure}
        groups.setdefault((row["reid"], KIND_TITLES[kind]), []).append(card)
    return page.render(
        study=study,
        options=study.options,
        summary=summary,
        many=len(summary.reids) > 1,
        command=command_of(study),
        version=__version__,
        comparison=Markup(_comparison(summary.reids, reach)),
        parts=[
            {name: Markup(drawn) for name, drawn in _charts_of(study, one, scene).items()}
            for one in summary.reids
        ],
        groups=groups,
        key=Markup(key_picture()),
        weakest=WEAKEST,
        likelihood=lambda surprise: f"{np.exp(-surprise):.2g}",
        heading=lambda yaw: f"{np.rad2deg(yaw) + 0.0:.0f}°",
    )


def command_of(study: Study) -> str:
    """The command that makes this report again."""
    o = study.options
    which = f"--reid {o.reids[0]}" if len(o.reids) == 1 else f"--compare {','.join(o.reids)}"
    return (
        f"farm-ar stress --scene {o.scene} {which} --attack {','.join(o.attacks)} --queries {o.queries} "
        f"--cases {o.cases} --budget {o.budget:g} --jitter {o.jitter} --seed {o.seed}"
    )


def _charts_of(study: Study, one: ReidSummary, scene: Scene) -> dict[str, str]:
    """The charts of one re-identifier by their names in the template."""
    reach = _reach_of(study, [one])
    colors = [*COLORS[: len(one.attacks) - 1], COLORS[-1]]
    shown = one.attacks if len(one.attacks) > 2 else one.attacks[:1]
    lines = [_curve(reach, attack.attack, attack.least, c) for attack, c in zip(shown, colors, strict=False)]
    if one.certified:
        lines.append(_curve(reach, "certified", one.bounds, CERTIFIED, bound=True))
    cells = np.zeros((1, 1))
    for row in study.attacked:
        if row["reid"] == one.reid and row["case"] in one.cases:
            cells = cells + np.array(row["cells"])
    distances = [study.options.budget if weak.least is None else weak.least for weak in one.weakest]
    low, high = min(distances, default=0.0), max(distances, default=0.0)
    strength = [(distance - low) / max(high - low, 1e-9) for distance in distances]
    charts = {
        "success": line_chart(lines, "D", "share of cases broken", reach),
        "cells": cell_chart(cells.tolist(), "D", "wrong labels", study.options.budget),
        "cameras": cameras_picture(scene, [weak.camera for weak in one.weakest], strength),
    }
    for name, calibration in (("noise", one.calibration), ("attacked", one.calibration_attacked)):
        values = calibration.right.tolist(), calibration.answers.tolist()
        charts[name] = bar_chart(*values, "confidence", "share right") if calibration.answers.sum() else ""
    return charts


def _comparison(reids: Sequence[ReidSummary], reach: float) -> str:
    lines = []
    for one, color in zip(reids, COLORS, strict=False):
        lines.append(_curve(reach, one.reid, one.best.least, color))
        if one.certified:
            lines.append(_curve(reach, f"{one.reid}, certified", one.bounds, color, bound=True))
    return line_chart(lines, "D", "share of cases broken", reach)


def _curve(reach: float, name: str, least: Sequence[float | None], color: str, bound: bool = False) -> Line:
    """The share of the cases that fail within each distance, up to `reach`."""
    distances = np.linspace(0, reach, POINTS)
    return Line(name, distances.tolist(), broken_within(least, distances).tolist(), color, bound)


def _reach_of(study: Study, reids: Sequence[ReidSummary]) -> float:
    """How far a curve of distances need go: to where little happens any more, a round number."""
    values = [v for one in reids for v in (*one.best.least, *one.bounds) if v is not None]
    top = max(values, default=study.options.budget) * 1.1
    step = 10.0 ** np.floor(np.log10(max(top, 1e-6))) / 2
    return float(min(study.options.budget, np.ceil(top / step) * step))


def number(value: float | None) -> str:
    """A number with three digits; an infinite one, or None, as "> budget"; NaN as a dash."""
    if value is None or value == np.inf:
        return "> budget"
    return "–" if not np.isfinite(value) else f"{value:.3g}"


def ratio(value: float) -> str:
    """A factor with two decimals; an infinite one as "> budget"; NaN as a dash."""
    return f"{value:.2f}" if np.isfinite(value) else number(value)


def share(value: Share) -> str:
    """A share with its interval, in per cent."""
    if not np.isfinite(value.value):
        return "–"
    digits = 1 if 0 < min(value.value, 1 - value.value) < 0.05 else 0
    return f"{100 * value.value:.{digits}f}% ({100 * value.low:.{digits}f}–{100 * value.high:.{digits}f})"


def in_metres(distance: float, scene: Scene) -> str:
    """D as the metres that an object goes for it without turning."""
    if not np.isfinite(distance):
        return "–"
    metres = distance * scene.diagonal
    return f"{100 * metres:.1f} cm" if metres < 1 else f"{metres:.2f} m"
