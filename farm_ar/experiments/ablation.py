"""The ablation study of section 4.1.2: Table 2, and the worked example of Fig. 7."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path

from farm_ar.arrays import FloatArray
from farm_ar.drawing import draw_identification, draw_scene, set_up_axes
from farm_ar.experiments.intervals import difference_of, interval_of
from farm_ar.experiments.published import FIG_7, H1_CAMERA, TABLE_2
from farm_ar.experiments.report import (
    OURS,
    PAPER,
    TEXT_SIZE,
    TITLE_SIZE,
    Comparison,
    Report,
    new_figure,
    set_up_chart,
)
from farm_ar.experiments.setting import (
    Setting,
    accuracies,
    mean_and_sd,
    mean_per_layout,
    named_scene,
    noisy_snapshots,
    path_cameras,
    piece_rng,
)
from farm_ar.geometry import footprint_corners
from farm_ar.reid import Identification, SpatialOptions, SpatialReid, accuracy
from farm_ar.reid.spatial_costs import TERMS, Term
from farm_ar.reid.spatial_unity import SpatialUnityReid
from farm_ar.scenes import Camera, Layout, LayoutNoise, Scene, Snapshot, observe, visible
from farm_ar.sweeps import Row

NOISE = LayoutNoise.of(0.3, 30.0)
CONDITIONS: dict[str, tuple[Term, ...]] = {
    "all costs": TERMS,
    **{f"without {left_out}": tuple(term for term in TERMS if term != left_out) for left_out in TERMS},
}
DETECTIONS_IN_FIG_7 = 7

Answer = tuple[Identification, tuple[str | None, ...] | None]
"""An identification, and the true labels to score it by, if it is to be scored."""


def table2(setting: Setting) -> Report:
    """Accuracy on H1 with each cost term left out, over the whole path. Paper, Table 2."""
    rows: list[Row] = []
    comparisons = []
    scores = {}
    rng = setting.rng(2, 90)
    program = ablate(setting, "program")
    for name, found in ablate(setting).items():
        (mean, sd), (paper_mean, paper_sd) = mean_and_sd(found), TABLE_2[name]
        _, sd_of_means = mean_and_sd(mean_per_layout(found))
        between, difference = interval_of(found, rng), difference_of(found, program[name], rng)
        program_mean, program_sd = mean_and_sd(program[name])
        scores[name] = mean, sd
        rows.append(
            {
                "condition": name,
                "mean": mean,
                "low": between.low,
                "high": between.high,
                "sd_over_snapshots": sd,
                "sd_of_layout_means": sd_of_means,
                "snapshots_per_layout": float(np.isfinite(found).sum(axis=1).mean()),
                "layouts": setting.layouts,
                "paper_mean": paper_mean,
                "paper_sd": paper_sd,
                "program_mean": program_mean,
                "program_sd": program_sd,
                "difference": difference.mean,
                "difference_low": difference.low,
                "difference_high": difference.high,
            }
        )
        comparisons.append(
            Comparison(
                f"accuracy, {name}: mean / SD over snapshots",
                f"{paper_mean:.2f} / {paper_sd:.2f}",
                f"{mean:.3f} / {sd:.3f}",
                f"one layout's mean: SD {sd_of_means:.3f}",
                between.ends,
                f"{program_mean:.3f} / {program_sd:.3f}",
                difference.signed,
            )
        )
    return Report(
        "table2",
        f"Table 2: ablation on H1, T(0, 0.3), R(0, 30), {setting.layouts} layouts",
        rows,
        comparisons,
        _ablation_figure(scores),
        note="The paper's camera walked once through one noisy layout (62 snapshots). The authors' program "
        "is `spatial-unity`, with the same terms left out.",
    )


Reading = Literal["local", "world", "program"]
"""How the method is read: by the text, with boxes along the world's axes, or as in the authors' program."""


def ablate(setting: Setting, reading: Reading = "local") -> dict[str, FloatArray]:
    """(layouts, P) accuracies under each condition, of the same snapshots; NaN where nothing was seen."""
    same = setting.scene_parameters("H1") | {"layouts": setting.layouts, "reading": reading}
    name = "table2" if reading == "local" else f"table2 {reading}"
    outcomes = setting.sweep(name, ablated, [same | {"condition": name} for name in CONDITIONS])
    return {
        name: np.array(outcome.rows[0]["accuracy"])
        for name, outcome in zip(CONDITIONS, outcomes, strict=True)
    }


def ablated(seed: int, scene: str, file: str | None, layouts: int, reading: Reading, condition: str) -> Row:
    """A unit of Table 2: (layouts, P) accuracies under one condition."""
    room, terms = named_scene(scene, file), CONDITIONS[condition]
    batch = noisy_snapshots(room, NOISE, layouts, piece_rng(seed, 2, 0))
    rng = piece_rng(seed, 2, 1 + list(CONDITIONS).index(condition))
    if reading == "program":
        return {"accuracy": accuracies(SpatialUnityReid(room, terms=terms, rng=rng), batch, layouts)}
    reid = SpatialReid(room, SpatialOptions(terms=terms, gate_categories=False, box=reading), rng)
    return {"accuracy": accuracies(reid, batch, layouts)}


def fig7(setting: Setting) -> Report:
    """One snapshot of a noisy H1 under the four conditions. Paper, Fig. 7."""
    scene = setting.scenes["H1"]
    noisy, camera = worked_example(scene, setting.rng(7, 0))
    snapshot, truth = observe(noisy, camera)
    found = {
        name: SpatialReid(
            scene, SpatialOptions(terms=terms, gate_categories=False), setting.rng(7, 1 + i)
        ).identify(snapshot)
        for i, (name, terms) in enumerate(CONDITIONS.items())
    }
    scores = {name: accuracy(answer, truth) for name, answer in found.items()}
    rows = [
        {"detection": snapshot.detections.ids[i], "truth": truth[i]}
        | {name: answer.labels[i] for name, answer in found.items()}
        for i in range(len(truth))
    ]
    answers: dict[str, Answer] = {"true labels": (Identification(truth), None)}
    answers |= {f"{name} ({scores[name]:.2f})": (answer, truth) for name, answer in found.items()}
    return Report(
        "fig7",
        "Fig. 7: a worked example of the ablation on H1",
        rows,
        [Comparison(f"accuracy, {name}", f"{FIG_7[name]:.2f}", f"{scores[name]:.2f}") for name in CONDITIONS],
        _worked_example_figure(scene, noisy, snapshot, answers),
        note=f"One snapshot of {len(truth)} detections (the paper's shows {DETECTIONS_IN_FIG_7}), from the "
        "pose nearest to the paper's camera that sees that many; another layout gives other numbers.",
    )


def worked_example(scene: Scene, rng: np.random.Generator) -> tuple[Layout, Camera]:
    """A noisy layout, and the pose on the path that sees seven of its objects.

    It is the one nearest to the paper's camera among those with seven, or with the number nearest to it.
    """
    noisy = NOISE.disturb(scene.layout, scene.size, rng)
    cameras = path_cameras(scene)
    away = np.abs(visible(noisy, cameras).sum(axis=-1) - DETECTIONS_IN_FIG_7)
    distance = np.linalg.norm(cameras.position - np.array(H1_CAMERA[:2]), axis=-1)
    return noisy, cameras.at(int(np.lexsort((distance, away))[0]))


def _ablation_figure(scores: Mapping[str, tuple[float, float]]) -> Figure:
    figure = new_figure(6.4, 3.2)
    axes = figure.subplots()
    set_up_chart(axes, "Ablation on H1 (mean, and SD over snapshots)", "", "accuracy")
    axes.set_ylim(0, 1.2)
    place = np.arange(len(scores))
    for offset, values, name, color in ((-0.2, TABLE_2, "paper", PAPER), (0.2, scores, "ours", OURS)):
        means, sds = zip(*(values[condition] for condition in scores), strict=True)
        error = {"elinewidth": 0.9, "ecolor": "#444444"}
        axes.bar(place + offset, means, 0.38, yerr=sds, label=name, color=color, capsize=3, error_kw=error)
    axes.set_xticks(place, list(scores))
    axes.grid(visible=False, axis="x")
    axes.legend(frameon=False, fontsize=TEXT_SIZE, ncols=2, loc="upper right", borderaxespad=0.0)
    return figure


def _worked_example_figure(
    scene: Scene, noisy: Layout, snapshot: Snapshot, answers: Mapping[str, Answer]
) -> Figure:
    """The noisy layout, and a panel for each of five answers under its title."""
    figure = new_figure(11.0, 7.6)
    first, *panels = figure.subplots(2, 3).flat
    set_up_axes(first, scene.size)
    draw_scene(first, scene, layout=noisy, camera=snapshot.camera, labels=False, path=False, legend=False)
    first.set_title("(a) noisy layout", fontsize=TITLE_SIZE)
    for axes, letter, (title, (answer, truth)) in zip(panels, "bcdef", answers.items(), strict=True):
        set_up_axes(axes, scene.size)
        _zoom(axes, snapshot)
        draw_identification(axes, scene, snapshot, answer, truth, reference_labels=False, legend=False)
        for artist in (*axes.patches, *axes.lines):  # some are cut off at the walls only
            artist.set_clip_path(Path.unit_rectangle(), axes.transAxes)
        axes.set_title(f"({letter}) {title}", fontsize=TITLE_SIZE)
    figure.supxlabel(
        "Grey: reference layout. Arrows: from the reference position of the label given. "
        "Green: correct. Red: wrong, with the true label in brackets.",
        fontsize=TEXT_SIZE,
    )
    return figure


def _zoom(axes: Axes, snapshot: Snapshot) -> None:
    """Zoom to the camera and its detections."""
    seen = snapshot.detections
    corners = footprint_corners(seen.position, seen.yaw, seen.size).reshape(-1, 2)
    points = np.vstack([corners, snapshot.camera.position])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    half = float(np.ptp(points, axis=0).max()) / 2 + 0.4
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
