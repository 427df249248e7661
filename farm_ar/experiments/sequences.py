"""Several snapshots along a path: how accuracy grows with their number."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypedDict, Unpack

import numpy as np
from matplotlib.figure import Figure

from farm_ar.experiments.headroom_report import PAPER_METHOD
from farm_ar.experiments.intervals import Interval, interval_of_mean, sums_of
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
from farm_ar.experiments.setting import SCENES, Setting, named_scene, path_cameras, piece_rng
from farm_ar.reid import REIDENTIFIERS, Reidentifier, ReidFactory, load_reid
from farm_ar.reid.fusion.tracking import track
from farm_ar.scenes import Detector, LayoutNoise, Scene, Snapshot, observe
from farm_ar.sweeps import Row

LENGTHS = (1, 2, 3, 4, 6, 8, 12, 16)
"""Snapshots in a sequence."""

NOISE = ((0.1, 30), (0.3, 30), (0.5, 60), (1.0, 60))
"""SDs of how each label moved, metres and degrees: some of the paper's levels."""

DETECTORS = {
    "exact": Detector(),
    "noisy": Detector(position_sd=0.03, yaw_sd=float(np.deg2rad(5.0)), miss_rate=0.05),
}

STARTS, QUICK_STARTS = 4, 1
"""Sequences begun in each layout."""

METHODS: dict[str, ReidFactory] = {name: REIDENTIFIERS[name] for name in (PAPER_METHOD, "likelihood")}

BY_LAYOUT = "by layout: "
"""Begins the names of what rows of the sweep hold beside those of the report."""

Truth = tuple[str | None, ...]


class Unit(NamedTuple):
    """One piece of the experiment: a scene, SDs of how labels moved in metres and degrees, and a detector."""

    scene: str
    translation: float
    rotation: int
    detector: str


def units(quick: bool = False) -> list[Unit]:
    """All pieces; the noisy detector at one level of noise only."""
    levels = NOISE[1:2] if quick else NOISE
    exact = [Unit(scene, t, r, "exact") for scene in SCENES for t, r in levels]
    return exact + [Unit(scene, *NOISE[1], "noisy") for scene in SCENES]


def run_unit(
    unit: Unit,
    scene: Scene,
    layouts: int,
    starts: int,
    rng: np.random.Generator,
    methods: Mapping[str, ReidFactory] = METHODS,
    lengths: tuple[int, ...] = LENGTHS,
) -> list[Row]:
    """A row for each method and length: the accuracy of the answers to all snapshots, and to the first.

    Accuracies are kept by layout, too, (layouts, starts), NaN where nothing was detected.

    A sequence begins where something is detected and goes on along the path, past its end from its start.

    Args:
        unit: what to run.
        scene: the unit's scene.
        layouts: how many noisy layouts.
        starts: how many sequences in each.
        rng: where the randomness comes from; all methods get the same snapshots.
        methods: makes each method, by name.
        lengths: of the sequences, rising.
    """
    noise = LayoutNoise.of(unit.translation, unit.rotation)
    sequences: list[list[tuple[Snapshot, Truth]]] = []
    cameras = path_cameras(scene)
    poses = len(cameras.yaw)
    for _ in range(layouts):
        noisy = noise.disturb(scene.layout, scene.size, rng)
        for _ in range(starts):
            begin = int(rng.integers(poses))
            seen = [
                observe(noisy, cameras.at((begin + step) % poses), DETECTORS[unit.detector], rng)
                for step in range(poses)
            ]
            first = next((t for t, (_, truth) in enumerate(seen) if truth), 0)
            sequences.append([seen[(first + step) % poses] for step in range(min(lengths[-1], poses))])
    rows: list[Row] = []
    for name, make in methods.items():
        reid = make(scene)
        for length in lengths:
            scores = [_score(reid, sequence[:length]) for sequence in sequences]
            every, early, objects, real = np.array(scores).T
            rows.append(
                {
                    "scene": unit.scene,
                    "translation_sd_m": unit.translation,
                    "rotation_sd_deg": unit.rotation,
                    "detector": unit.detector,
                    "rule": name,
                    "snapshots": length,
                    "accuracy": float(np.nanmean(every)),
                    "accuracy_of_first": float(np.nanmean(early)),
                    "objects": float(objects.mean()),
                    "real_objects": float(real.mean()),
                    "sequences": len(sequences),
                    **{
                        BY_LAYOUT + what: np.reshape(values, (layouts, starts))
                        for what, values in (("accuracy", every), ("accuracy_of_first", early))
                    },
                }
            )
    return rows


def _score(reid: Reidentifier, sequence: list[tuple[Snapshot, Truth]]) -> tuple[float, float, float, float]:
    """Share of correct answers to all snapshots and to the first; objects found, and objects that exist."""
    found = track(reid, [snapshot for snapshot, _ in sequence])
    right = [
        [given == true for given, true in zip(answer.labels, truth, strict=True)]
        for answer, (_, truth) in zip(found.identifications, sequence, strict=True)
    ]
    every = [one for some in right for one in some]
    real = {true for _, truth in sequence for true in truth}
    mean = [float(np.mean(some)) if some else float("nan") for some in (every, right[0])]
    return mean[0], mean[1], float(len(found.objects)), float(len(real))


def sequences(setting: Setting) -> Report:
    """Accuracy against the number of snapshots along each path."""
    starts = QUICK_STARTS if setting.quick else STARTS
    parameters = [
        setting.scene_parameters(unit.scene)
        | unit._asdict()
        | {"layouts": setting.layouts, "starts": starts}
        | setting.own_reids
        for unit in units(setting.quick)
    ]
    outcomes = setting.sweep("sequences", every_method, parameters)
    cells = [row for outcome in outcomes for row in outcome.rows]
    rng = setting.rng(13, 90)
    rows = [_with_intervals(row, rng) for row in cells]
    return Report(
        "sequences",
        f"Several snapshots along a path, {setting.layouts} layouts",
        rows,
        [
            Comparison(
                f"accuracy of the first snapshot's answer in the light of {length}",
                f"{_mean(rows, PAPER_METHOD, length, 'accuracy_of_first'):.3f}",
                f"{_mean(rows, 'likelihood', length, 'accuracy_of_first'):.3f}",
                f"all snapshots: {_mean(rows, 'likelihood', length, 'accuracy'):.3f}",
                _interval(cells, "likelihood", length, "accuracy_of_first", rng).ends,
            )
            for length in LENGTHS
        ],
        _figure(rows),
        note="Means over the six scenes and all levels of noise, exact detector. In the column of the paper "
        "stands the paper's method, run here on the objects found; ours is the likelihood method. Intervals: "
        "95%, by resampling layouts.",
        tables=_means(cells, rng) + _tables(rows),
    )


class Conditions(TypedDict):
    """The noise of a unit: SDs of translation (m) and rotation (degrees), and the detector's name."""

    translation: float
    rotation: int
    detector: str


def every_method(
    seed: int,
    scene: str,
    file: str | None,
    layouts: int,
    starts: int,
    own: Iterable[str] = (),
    **conditions: Unpack[Conditions],
) -> list[Row]:
    """A unit of the sweep: a row for each method and length, the user's own included."""
    unit = Unit(scene, **conditions)
    detector = list(DETECTORS).index(unit.detector)
    key = (SCENES.index(scene), round(unit.translation * 10), unit.rotation, detector)
    methods = METHODS | {name: load_reid(name) for name in own}
    return run_unit(unit, named_scene(scene, file), layouts, starts, piece_rng(seed, 13, *key), methods)


def _mean(
    rows: Sequence[Row], method: str, length: int, what: str, detector: str = "exact", **only: object
) -> float:
    found = [
        float(row[what] or 0.0)
        for row in rows
        if row["rule"] == method
        and row["snapshots"] == length
        and row["detector"] == detector
        and all(row[key] == value for key, value in only.items())
    ]
    return float(np.mean(found))


def _interval(
    rows: Sequence[Row], method: str, length: int, what: str, rng: np.random.Generator, gain: bool = False
) -> Interval:
    """The mean over scenes and levels, exact detector, or its gain over a single snapshot."""
    exact = [row for row in rows if row["rule"] == method and row["detector"] == "exact"]
    found, alone = (
        [np.array(row[BY_LAYOUT + what]) for row in exact if row["snapshots"] == number]
        for number in (length, LENGTHS[0])
    )
    values = [ours - one for ours, one in zip(found, alone, strict=True)] if gain else found
    return interval_of_mean([sums_of(each) for each in values], rng)


def _with_intervals(row: Row, rng: np.random.Generator) -> dict[str, Any]:
    """A row of the report: with intervals in place of the accuracies of each layout."""
    plain = {key: value for key, value in row.items() if not key.startswith(BY_LAYOUT)}
    for what in ("accuracy", "accuracy_of_first"):
        found = interval_of_mean([sums_of(np.array(row[BY_LAYOUT + what]))], rng)
        plain |= {f"{what}_low": found.low, f"{what}_high": found.high}
    return plain


def _means(rows: Sequence[Row], rng: np.random.Generator) -> str:
    """Means over scenes and levels, and what a sequence gains over its first snapshot."""
    lines = ["Means over the scenes and all levels of noise, exact detector, with 95%:", ""]
    lines += ["| method | answers | snapshots | accuracy | gain over one |", "|---|---|---|---|---|"]
    for method in METHODS:
        for what, of in (("accuracy_of_first", "the first's"), ("accuracy", "all")):
            for length in LENGTHS:
                mean = _interval(rows, method, length, what, rng).text
                gain = "" if length == 1 else _interval(rows, method, length, what, rng, gain=True).signed
                lines.append(f"| {method} | {of} | {length} | {mean} | {gain} |")
    return "\n".join(lines) + "\n\n"


def _tables(rows: Sequence[Row]) -> str:
    """The first snapshot's answer by scene, and all answers with a noisy detector beside an exact one."""
    head = " | ".join(str(length) for length in LENGTHS)
    lines = ["The first snapshot's answer, by scene, exact detector:", ""]
    lines += [f"| scene | method | {head} |", "|---" * (len(LENGTHS) + 2) + "|"]
    for scene in SCENES:
        for method in METHODS:
            values = [_mean(rows, method, length, "accuracy_of_first", scene=scene) for length in LENGTHS]
            lines.append(f"| {scene} | {method} | {' | '.join(f'{value:.3f}' for value in values)} |")
    t, r = NOISE[1]
    lines += ["", f"All answers at T {t}, R {r}, and objects found for each that exists:", ""]
    lines += [f"| detector | method | {head} |", "|---" * (len(LENGTHS) + 2) + "|"]
    level = {"translation_sd_m": t, "rotation_sd_deg": r}
    for detector in DETECTORS:
        for method in METHODS:
            values = [_mean(rows, method, n, "accuracy", detector, **level) for n in LENGTHS]
            lines.append(f"| {detector} | {method} | {' | '.join(f'{value:.3f}' for value in values)} |")
        told = [
            _mean(rows, PAPER_METHOD, n, "objects", detector, **level)
            / _mean(rows, PAPER_METHOD, n, "real_objects", detector, **level)
            for n in LENGTHS
        ]
        lines.append(f"| {detector} | objects | {' | '.join(f'{value:.3f}' for value in told)} |")
    return "\n".join(lines) + "\n"


def _figure(rows: Sequence[Row]) -> Figure:
    figure = new_figure(7.6, 3.4)
    left, right = figure.subplots(1, 2)
    set_up_chart(left, "(a) mean of the six scenes", "snapshots", "accuracy")
    for method, colour in ((PAPER_METHOD, PAPER), ("likelihood", OURS)):
        for what, line, of in (("accuracy", "-", "all answers"), ("accuracy_of_first", "--", "the first's")):
            values = [_mean(rows, method, length, what) for length in LENGTHS]
            left.plot(LENGTHS, values, line, marker=".", color=colour, label=f"{method}, {of}")
    set_up_chart(right, "(b) the first snapshot's answer, likelihood", "snapshots", "accuracy")
    colours = (OURS, OTHER, "#5a9a68", "#8b5fa8", "#b3554f", "#4fa3a5")
    for scene, colour in zip(SCENES, colours, strict=True):
        values = [_mean(rows, "likelihood", n, "accuracy_of_first", scene=scene) for n in LENGTHS]
        right.plot(LENGTHS, values, ".-", color=colour, label=scene)
    for axes in (left, right):
        axes.legend(frameon=False, fontsize=TEXT_SIZE - 1, ncols=2, loc="lower right")
    return figure
