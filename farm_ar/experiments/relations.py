"""Objects that moved together, and frames that drifted: every method on the same snapshots."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.experiments.headroom import METHODS as EVERY_RULE
from farm_ar.experiments.headroom_report import PAPER_METHOD
from farm_ar.experiments.intervals import Interval, Sums, interval_of_mean
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
from farm_ar.experiments.setting import SCENES, Setting, named_scene, piece_rng
from farm_ar.experiments.shared_motions import PATTERNS
from farm_ar.reid import ReidFactory, as_reidentifier, load_reid
from farm_ar.scenes import Scene
from farm_ar.sweeps import Row

FARM = "farm"
"""The game's table: ten buildings that move and a shed that does not."""

POSES, QUICK_POSES = 10, 4
"""Snapshots of each layout, drawn from those along the path that see two objects or more."""

RIGHT, SEEN = "right_by_layout", "detections_by_layout"
"""What rows of the sweep hold beside those of the report."""

METHODS: dict[str, ReidFactory] = {name: make for name, make in EVERY_RULE.items() if name != "spatial"}


class Unit(NamedTuple):
    """One piece of the experiment: a scene and a pattern."""

    scene: str
    pattern: str


def units() -> list[Unit]:
    """All pieces."""
    return [Unit(scene, pattern) for scene in (*SCENES, FARM) for pattern in PATTERNS]


def run_unit(
    unit: Unit,
    scene: Scene,
    layouts: int,
    poses: int,
    rng: np.random.Generator,
    methods: Mapping[str, ReidFactory] = METHODS,
) -> list[Row]:
    """A row for each method, of the same snapshots; detections and right labels are counted by layout."""
    batch, layout = PATTERNS[unit.pattern](scene, layouts, poses, rng)
    assert batch.truth is not None
    exists = np.arange(batch.yaw.shape[1]) < batch.count[:, None]
    seen = np.bincount(layout, batch.count, layouts)
    rows: list[Row] = []
    for name, make in methods.items():
        found = as_reidentifier(make(scene), scene).identify_many(batch)
        correct = (found.label == batch.truth) & exists
        right = correct[exists]
        confidence = found.confidence[exists]
        rows.append(
            {
                "scene": unit.scene,
                "pattern": unit.pattern,
                "rule": name,
                "accuracy": float(right.mean()) if len(right) else float("nan"),
                "calibration_error": calibration_error(confidence, right),
                "snapshots": len(batch),
                "detections": int(exists.sum()),
                RIGHT: np.bincount(layout, correct.sum(axis=1), layouts).tolist(),
                SEEN: seen.tolist(),
            }
        )
    return rows


def calibration_error(confidence: FloatArray, right: BoolArray, bins: int = 10) -> float:
    """Expected calibration error over bins of confidence; NaN without confidences."""
    if not len(confidence) or np.isnan(confidence).any():
        return float("nan")
    which = np.minimum((confidence * bins).astype(int), bins - 1)
    return float(np.abs(np.bincount(which, confidence - right)).sum() / len(right))


def relations(setting: Setting) -> Report:
    """Every method where objects moved together or the frame drifted, and where neither happened."""
    poses = QUICK_POSES if setting.quick else POSES
    places = {name: setting.scene_parameters(name) for name in SCENES} | {FARM: {"scene": FARM, "file": None}}
    parameters = [
        places[unit.scene]
        | {"pattern": unit.pattern, "layouts": setting.layouts, "poses": poses}
        | setting.own_reids
        for unit in units()
    ]
    outcomes = setting.sweep("relations", every_method, parameters)
    cells = [row for outcome in outcomes for row in outcome.rows]
    rng = setting.rng(12, 90)
    rows = [_with_intervals(row, cells, rng) for row in cells]
    return Report(
        "relations",
        f"Things that moved together, and frames that drifted: {setting.layouts} layouts",
        rows,
        [
            Comparison(
                f"accuracy, {pattern}",
                f"{_mean(cells, PAPER_METHOD, pattern):.3f}",
                f"{_mean(cells, 'relational', pattern):.3f}",
                f"likelihood: {_mean(cells, 'likelihood', pattern):.3f}",
                _interval(cells, "relational", pattern, rng).ends,
            )
            for pattern in PATTERNS
        ],
        _figure(cells),
        note="Means over the six scenes and the farm, of snapshots that see two objects or more. In the "
        "column of the paper stands the paper's method, run here; ours is the relational method. Intervals: "
        "95%, by resampling layouts; differences are of the same snapshots.",
        tables=_tables(cells, rng),
    )


def every_method(
    seed: int,
    scene: str,
    file: str | None,
    layouts: int,
    poses: int,
    pattern: str,
    own: Iterable[str] = (),
) -> list[Row]:
    """A unit of the sweep: a row for each method, the user's own included."""
    rng = piece_rng(seed, 12, [*SCENES, FARM].index(scene), list(PATTERNS).index(pattern))
    methods = METHODS | {name: load_reid(name) for name in own}
    return run_unit(Unit(scene, pattern), named_scene(scene, file), layouts, poses, rng, methods)


def _mean(rows: Sequence[Row], method: str, pattern: str, scene: str | None = None) -> float:
    found = [
        float(row["accuracy"] or 0.0)
        for row in rows
        if row["rule"] == method and row["pattern"] == pattern and scene in (None, row["scene"])
    ]
    return float(np.mean(found))


def _sums(rows: Sequence[Row], method: str, pattern: str, less: str | None = None) -> list[Sums]:
    """Right labels of a method in each scene, or how many more they are than those of another."""
    by_scene = {(row["scene"], row["rule"]): row for row in rows if row["pattern"] == pattern}
    return [
        Sums(
            np.array(row[RIGHT]) - (0.0 if less is None else np.array(by_scene[scene, less][RIGHT])),
            np.array(row[SEEN]),
        )
        for (scene, rule), row in by_scene.items()
        if rule == method
    ]


def _interval(
    rows: Sequence[Row], method: str, pattern: str, rng: np.random.Generator, less: str | None = None
) -> Interval:
    """The mean over the scenes of a method's accuracy, or of its gain over another, with its interval."""
    return interval_of_mean(_sums(rows, method, pattern, less), rng)


def _with_intervals(row: Row, rows: Sequence[Row], rng: np.random.Generator) -> dict[str, Any]:
    """A row of the report: with intervals in place of the counts of each layout."""
    scene, pattern, rule = (str(row[key]) for key in ("scene", "pattern", "rule"))
    same = [one for one in rows if one["scene"] == scene]
    own, gain = (_interval(same, rule, pattern, rng, less) for less in (None, PAPER_METHOD))
    plain = {key: value for key, value in row.items() if key not in (RIGHT, SEEN)}
    return plain | {
        "low": own.low,
        "high": own.high,
        "over_the_paper": gain.mean,
        "over_the_paper_low": gain.low,
        "over_the_paper_high": gain.high,
    }


def _tables(rows: Sequence[Row], rng: np.random.Generator) -> str:
    scenes = list(dict.fromkeys(str(row["scene"]) for row in rows))
    methods = list(dict.fromkeys(str(row["rule"]) for row in rows))
    last = f"mean (95%) | less {PAPER_METHOD} (95%)"
    lines = [f"| pattern | method | {' | '.join(scenes)} | {last} |", "|---" * (len(scenes) + 4) + "|"]
    for pattern in PATTERNS:
        for method in methods:
            values = [f"{_mean(rows, method, pattern, scene):.3f}" for scene in scenes]
            values += [
                _interval(rows, method, pattern, rng).text,
                "" if method == PAPER_METHOD else _interval(rows, method, pattern, rng, PAPER_METHOD).signed,
            ]
            lines.append(f"| {pattern} | {method} | {' | '.join(values)} |")
    return "\n".join(lines) + "\n"


def _figure(rows: Sequence[Row]) -> Figure:
    figure = new_figure(7.2, 3.2)
    axes = figure.subplots()
    set_up_chart(axes, "Accuracy, mean of the six scenes and the farm", "", "accuracy")
    place = np.arange(len(PATTERNS))
    for offset, method, colour in (
        (-0.27, PAPER_METHOD, PAPER),
        (0.0, "likelihood", OTHER),
        (0.27, "relational", OURS),
    ):
        axes.bar(place + offset, [_mean(rows, method, p) for p in PATTERNS], 0.25, color=colour, label=method)
    axes.set_xticks(place, list(PATTERNS))
    axes.grid(visible=False, axis="x")
    figure.legend(frameon=False, fontsize=TEXT_SIZE, ncols=3, loc="outside lower center")
    return figure
