"""The ablation study of section 4.1.2: Table 2, and the worked example of Fig. 7."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from farm_ar.drawing import draw_identification, draw_scene, set_up_axes
from farm_ar.experiments.published import FIG_7, H1_CAMERA, TABLE_2
from farm_ar.experiments.report import Comparison, Report, Row, new_figure
from farm_ar.experiments.setting import (
    Setting,
    accuracies,
    mean_per_layout,
    noisy_snapshots,
    path_cameras,
)
from farm_ar.reid import Identification, SpatialOptions, SpatialReid, accuracy
from farm_ar.reid.spatial import TERMS, Term
from farm_ar.scenes import Camera, Layout, LayoutNoise, Scene, Snapshot, observe, visible

NOISE = LayoutNoise.of(0.3, 30.0)
CONDITIONS: dict[str, tuple[Term, ...]] = {
    "all costs": TERMS,
    **{f"without {left_out}": tuple(term for term in TERMS if term != left_out) for left_out in TERMS},
}
DETECTIONS_IN_FIG_7 = 7


def table2(setting: Setting) -> Report:
    """Accuracy on H1 with each cost term left out, over the whole path. Paper, Table 2."""
    scene = setting.scenes["H1"]
    layouts = setting.layouts
    batch = noisy_snapshots(scene, NOISE, layouts, setting.rng(2, 0))

    def run(condition: tuple[int, str]) -> np.ndarray:
        index, name = condition
        reid = SpatialReid(scene, SpatialOptions(terms=CONDITIONS[name]), setting.rng(2, 1 + index))
        return accuracies(reid, batch, layouts)

    rows: list[Row] = []
    comparisons = []
    for (_, name), found in setting.each(enumerate(CONDITIONS), run):
        mean, sd = float(np.nanmean(found)), float(np.nanstd(found))
        per_layout = mean_per_layout(found)
        rows.append(
            {
                "condition": name,
                "mean": mean,
                "sd_over_snapshots": sd,
                "sd_of_layout_means": float(np.nanstd(per_layout)),
                "snapshots_per_layout": float(np.isfinite(found).sum(axis=1).mean()),
                "layouts": layouts,
                "paper_mean": TABLE_2[name][0],
                "paper_sd": TABLE_2[name][1],
            }
        )
        comparisons.append(
            Comparison(
                f"accuracy, {name}: mean / SD over snapshots",
                f"{TABLE_2[name][0]:.2f} / {TABLE_2[name][1]:.2f}",
                f"{mean:.3f} / {sd:.3f}",
                f"one layout's mean: SD {np.nanstd(per_layout):.3f}",
            )
        )
    return Report(
        "table2",
        f"Table 2: ablation on H1, T(0, 0.3), R(0, 30), {layouts} layouts",
        rows,
        comparisons,
        _ablation_figure(rows),
        note="The paper wandered once through one noisy layout (62 snapshots).",
    )


def fig7(setting: Setting) -> Report:
    """One snapshot of a noisy H1 under the four conditions. Paper, Fig. 7."""
    scene = setting.scenes["H1"]
    noisy, camera = worked_example(scene, setting.rng(7, 0))
    snapshot, truth = observe(noisy, camera)
    found = {
        name: SpatialReid(scene, SpatialOptions(terms=terms), setting.rng(7, 1 + i)).identify(snapshot)
        for i, (name, terms) in enumerate(CONDITIONS.items())
    }
    setting.advance(1.0)
    scores = {name: accuracy(answer, truth) for name, answer in found.items()}
    rows = [
        {"detection": snapshot.detections.ids[i], "truth": truth[i]}
        | {name: answer.labels[i] for name, answer in found.items()}
        for i in range(len(truth))
    ]
    return Report(
        "fig7",
        "Fig. 7: a worked example of the ablation on H1",
        rows,
        [Comparison(f"accuracy, {name}", f"{FIG_7[name]:.2f}", f"{scores[name]:.2f}") for name in CONDITIONS],
        _worked_example_figure(scene, noisy, snapshot, truth, found, scores),
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


def _ablation_figure(rows: list[Row]) -> Figure:
    figure = new_figure(6.4, 3.2)
    axes = figure.subplots()
    place = np.arange(len(rows))
    for offset, mean, sd, name, colour in (
        (-0.2, "paper_mean", "paper_sd", "paper", "#b0b0b0"),
        (0.2, "mean", "sd_over_snapshots", "ours", "#3b6ea5"),
    ):
        heights = [float(row[mean]) for row in rows]  # type: ignore[arg-type]
        errors = [float(row[sd]) for row in rows]  # type: ignore[arg-type]
        axes.bar(place + offset, heights, 0.38, yerr=errors, label=name, color=colour, capsize=3)
    axes.set_xticks(place, [str(row["condition"]) for row in rows], fontsize=8)
    axes.set(ylabel="accuracy", ylim=(0, 1.25), title="Ablation on H1 (bars: SD over snapshots)")
    axes.title.set_fontsize(9)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8, ncols=2, loc="upper right")
    return figure


def _worked_example_figure(
    scene: Scene,
    noisy: Layout,
    snapshot: Snapshot,
    truth: tuple[str | None, ...],
    found: dict[str, Identification],
    scores: dict[str, float],
) -> Figure:
    figure = new_figure(11.0, 7.4)
    panels = figure.subplots(2, 3).flat
    first = next(panels)
    set_up_axes(first, scene.size)
    draw_scene(first, scene, layout=noisy, camera=snapshot.camera, labels=False, path=False, legend=False)
    first.set_title("(a) noisy layout", fontsize=9)
    answers: dict[str, tuple[Identification, tuple[str | None, ...] | None]]
    answers = {"true labels": (Identification(truth), None)}
    answers |= {f"{name} ({scores[name]:.2f})": (answer, truth) for name, answer in found.items()}
    for letter, (title, (answer, compared)) in zip("bcdef", answers.items(), strict=True):
        axes = next(panels)
        set_up_axes(axes, scene.size)
        _zoom(axes, snapshot)
        draw_identification(axes, scene, snapshot, answer, compared, reference_labels=False, legend=False)
        _zoom(axes, snapshot)
        axes.set_title(f"({letter}) {title}", fontsize=9)
    return figure


def _zoom(axes: Axes, snapshot: Snapshot) -> None:
    """Show the surroundings of what was detected, and nothing beyond."""
    points = np.vstack([snapshot.detections.position, snapshot.camera.position])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    half = float((points.max(axis=0) - points.min(axis=0)).max()) / 2 + 0.6
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    for artist in axes.get_children():
        if artist is not axes.title:
            artist.set_clip_box(axes.bbox)
