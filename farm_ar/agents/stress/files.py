"""The files of a stress test: a page to look at, tables for programs, failures that can be played again."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar import __version__
from farm_ar.agents.certificates import NO_BOUND
from farm_ar.agents.stress.study import Study
from farm_ar.agents.stress.summary import Summary
from farm_ar.errors import InputError
from farm_ar.scenes.files import read_json, write_text

COLUMNS = (
    "case", "reid", "attack", "asked", "least", "largest", "metres", "degrees", "moved", "wrong", "query",
    "bound", "bound_t1", "ratio", "most_wrong", "most_wrong_effort", "surprise", "endpoint_error_m",
    "miscounts", "by_hand",
)  # fmt: skip
"""Columns of the CSV table, a row per case, re-identifier and attack."""


class ReportError(InputError):
    """A stress test's file that cannot be used."""


def write_study(study: Study, summary: Summary, folder: str | os.PathLike[str]) -> list[Path]:
    """Write `stress.html`, `stress.json` and `stress.csv`, and `stress-times.csv` beside them.

    All but the times depend on the options alone.
    """
    from farm_ar.agents.stress.page import page_of

    out = Path(folder)
    files = {
        "stress.html": page_of(study, summary),
        "stress.json": json.dumps(_plain(as_json(study, summary)), indent=1, allow_nan=False) + "\n",
        "stress.csv": _table(study),
        "stress-times.csv": _times(study),
    }
    for name, text in files.items():
        write_text(out / name, text)
    return [out / name for name in files]


def as_json(study: Study, summary: Summary) -> dict[str, Any]:
    """All that a stress test found, as JSON values but for numbers that are not finite."""
    rules = []
    for rule in summary.rules:
        rules.append(
            {
                "reid": rule.reid,
                "theorem": rule.theorem,
                "bound_median": rule.bound_median,
                "bound_t1_median": rule.bound_t1,
                "median_least": rule.best.median,
                "tightness_median": rule.best.tightness,
                "noise_failures": list(rule.noise),
                "calibration_error": rule.calibration.error,
                "calibration_error_attacked": rule.calibration_attacked.error,
                "mean_miscounts": rule.miscounts,
                "mean_endpoint_error_m": rule.endpoint_error_m,
                "by_hand": None if rule.by_hand is None else list(rule.by_hand),
                "by_hand_median": rule.by_hand_median,
                "most_wrong": [None if worst is None else list(worst) for worst in rule.most_wrong],
                "most_wrong_median": rule.most_wrong_labels,
                "most_wrong_effort_median": rule.most_wrong_effort,
                "transfer": {name: list(share) for name, share in rule.transfer.items()},
                "attacks": [
                    {
                        "attack": one.attack,
                        "median_least": one.median,
                        "failed": list(one.failed),
                        "tightness_median": one.tightness,
                        "least": list(one.least),
                    }
                    for one in rule.attacks
                ],
                "bounds": None if rule.theorem == NO_BOUND else list(rule.bounds),
                "labels": [
                    dict(zip(("label", "misread", "cases_in_view", "bound_median"), row, strict=True))
                    for row in rule.labels
                ],
            }
        )
    options = study.options
    given = {"scene": options.scene, "jitter": options.jitter, "seed": options.seed}
    failures = [
        {
            "id": i,
            "kind": kind,
            **given,
            "case": row["case"],
            "reid": row["reid"],
            "attack": row["attack"],
            **found,
        }
        for i, (kind, row, found) in enumerate(summary.failures)
    ]
    return {"version": __version__, "options": options.as_dict(), "rules": rules, "failures": failures}


def read_failure(path: str | os.PathLike[str], number: int) -> Mapping[str, Any]:
    """One failure of a stress test's JSON file.

    Raises:
        ReportError: the file cannot be used, or has no failure of that number.
    """
    content = read_json(path, ReportError)
    failures = content.get("failures") if isinstance(content, dict) else None
    name = Path(path).name
    if not isinstance(failures, list):
        raise ReportError(
            "failures", "must be a list, as farm-ar stress writes it", type(failures).__name__, name
        )
    if not 0 <= number < len(failures):
        expected = f"must hold number {number}, counted from 0"
        raise ReportError("failures", expected, f"{len(failures)} failures", name)
    failure = failures[number]
    needed = {"scene", "jitter", "seed", "case", "reid", "position", "yaw", "effort", "wrong"}
    if not isinstance(failure, dict) or not needed <= set(failure):
        raise ReportError(f"failures[{number}]", f"must have {', '.join(sorted(needed))}", failure, name)
    return failure


def _table(study: Study) -> str:
    bounds = {(row["case"], row["reid"]): row for row in study.known}
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
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
        writer.writerow(["" if values.get(name) is None else values[name] for name in COLUMNS])
    return text.getvalue()


def _times(study: Study) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, ("case", "reid", "attack", "asked", "seconds"), lineterminator="\n")
    writer.writeheader()
    writer.writerows(dict(row) for row in study.measured)
    return text.getvalue()


def _plain(value: Any) -> Any:
    """The value with None for numbers that are not finite, which JSON does not have."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
