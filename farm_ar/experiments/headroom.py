"""The head-room above the paper's method: every method on the same snapshots, and a bound."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.experiments.headroom_report import BOUND, JITTER, PAPER_METHOD, report_of
from farm_ar.experiments.intervals import Interval, difference_of, interval_of
from farm_ar.experiments.patterns import PATTERNS, Case, jitter
from farm_ar.experiments.report import Report
from farm_ar.experiments.setting import (
    SCENES,
    Setting,
    mean_and_sd,
    mean_per_layout,
    named_scene,
    piece_rng,
)
from farm_ar.reid import (
    REIDENTIFIERS,
    DistanceReid,
    IdentificationBatch,
    LastKnownReid,
    LikelihoodOptions,
    LikelihoodReid,
    NearestReid,
    ReidFactory,
    as_reidentifier,
    batch_accuracy,
    load_reid,
)
from farm_ar.scenes import LayoutNoise, Scene
from farm_ar.sweeps import Row

TRANSLATIONS = (0.1, 0.3, 0.5, 1.0)
ROTATIONS = (15, 30, 60, 120)
BINS = 50
"""Bins of confidence, 0 to 1."""

METHODS: dict[str, ReidFactory] = {
    **{name: REIDENTIFIERS[name] for name in (PAPER_METHOD, "spatial", "likelihood", "relational")},
    "nearest-ungated": partial(NearestReid, gate_categories=False),
    "distance-ungated": partial(DistanceReid, gate_categories=False),
    "last-known": LastKnownReid,
}
"""The methods compared; those called ungated ignore categories, as in the paper's experiments.

The bound comes with every unit whose noise a model describes.
"""


class Unit(NamedTuple):
    """One piece of the experiment: a scene and a pattern; for jitter its SDs in metres and degrees."""

    scene: str
    pattern: str
    translation: float = 0.0
    rotation: int = 0


def units(quick: bool = False) -> list[Unit]:
    """All pieces: the table's cells, then the patterns."""
    rotations = ROTATIONS[1::2] if quick else ROTATIONS
    cells = [Unit(s, JITTER, t, r) for s in SCENES for t in TRANSLATIONS for r in rotations]
    return cells + [Unit(s, pattern) for s in SCENES for pattern in PATTERNS]


def run_unit(
    unit: Unit,
    scene: Scene,
    layouts: int,
    rng: np.random.Generator,
    methods: Mapping[str, ReidFactory] = METHODS,
) -> list[Row]:
    """A row for each method: its accuracy, and how many answers of each confidence were right.

    Args:
        unit: what to run.
        scene: the unit's scene.
        layouts: how many noisy layouts, each seen along the whole path.
        rng: where the randomness comes from; all methods get the same snapshots.
        methods: makes each method, by name.
    """
    if unit.pattern == JITTER:
        case = jitter(scene, LayoutNoise.of(unit.translation, unit.rotation), layouts, rng)
    else:
        case = PATTERNS[unit.pattern](scene, layouts, rng)
    reids = {name: make(scene) for name, make in methods.items()}
    if case.noise is not None:
        reids[BOUND] = LikelihoodReid(scene, LikelihoodOptions(noise=case.noise, rates=(case.rates,)))
    found = {name: as_reidentifier(reid, scene).identify_many(case.snapshots) for name, reid in reids.items()}
    batch = case.snapshots
    assert batch.truth is not None
    each = {
        name: batch_accuracy(one.label, batch.truth, batch.count).reshape(layouts, -1)
        for name, one in found.items()
    }
    paper = each.get(PAPER_METHOD)
    return [_row(unit, name, found[name], case, (each[name], paper), rng.spawn(1)[0]) for name in reids]


def _row(
    unit: Unit,
    method: str,
    found: IdentificationBatch,
    case: Case,
    accuracies: tuple[FloatArray, FloatArray | None],
    rng: np.random.Generator,
) -> Row:
    """The row of a method: its (layouts, P) accuracies, and those of the paper's method where it is run."""
    batch, (accuracy, paper) = case.snapshots, accuracies
    assert batch.truth is not None
    between, gain = interval_of(accuracy, rng), Interval(np.nan, np.nan, np.nan)
    if paper is not None:
        gain = difference_of(accuracy, paper, rng)
    _, sd_of_layouts = mean_and_sd(mean_per_layout(accuracy))
    exists = np.arange(batch.yaw.shape[1]) < batch.count[:, None]
    right = (found.label == batch.truth)[exists]
    row: dict[str, str | int | float | None] = {
        "scene": unit.scene,
        "pattern": unit.pattern,
        "translation_sd_m": unit.translation,
        "rotation_sd_deg": unit.rotation,
        "rule": method,
        "accuracy": between.mean,
        "low": between.low,
        "high": between.high,
        "over_the_paper": gain.mean,
        "over_the_paper_low": gain.low,
        "over_the_paper_high": gain.high,
        "sd_of_layout_means": sd_of_layouts,
        "layouts": len(accuracy),
        "detections": int(exists.sum()),
    }
    return row | _by_confidence(found.confidence[exists], right)


def _by_confidence(confidence: FloatArray, right: FloatArray) -> dict[str, str | int | float | None]:
    """How many answers there are in each bin of confidence, their mean confidence, and how many are right.

    Three lists of numbers in text, so that a row stays a row; empty where the method does not say.
    """
    if not len(confidence) or np.isnan(confidence).all():
        return {"answers": "", "sure": "", "right": ""}
    which = np.minimum((confidence * BINS).astype(int), BINS - 1)
    count = np.bincount(which, minlength=BINS)
    sure = np.bincount(which, confidence, minlength=BINS)
    correct = np.bincount(which, right, minlength=BINS).astype(int)
    return {
        "answers": " ".join(map(str, count)),
        "sure": " ".join(f"{value:.4f}" for value in sure),
        "right": " ".join(map(str, correct)),
    }


def headroom(setting: Setting) -> Report:
    """Every method in every cell of the table and under every pattern."""
    parameters = [
        setting.scene_parameters(unit.scene)
        | unit._asdict()
        | {"layouts": setting.layouts}
        | setting.own_reids
        for unit in units(setting.quick)
    ]
    outcomes = setting.sweep("headroom", every_method, parameters)
    return report_of([row for outcome in outcomes for row in outcome.rows], setting.layouts, setting.reids)


def every_method(
    seed: int,
    scene: str,
    file: str | None,
    layouts: int,
    pattern: str,
    translation: float,
    rotation: int,
    own: Iterable[str] = (),
) -> list[Row]:
    """A unit of the sweep: a row for each method, the user's own included."""
    index = (SCENES.index(scene), [JITTER, *PATTERNS].index(pattern))
    rng = piece_rng(seed, 4, *index, round(translation * 10), rotation)
    methods = METHODS | {name: load_reid(name) for name in own}
    unit = Unit(scene, pattern, translation, rotation)
    return run_unit(unit, named_scene(scene, file), layouts, rng, methods)
