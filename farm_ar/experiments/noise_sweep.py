"""The sweep over noise levels of section 4.1.1: Fig. 5, and what the text says of the offices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from farm_ar.arrays import FloatArray
from farm_ar.experiments.published import OFFICE_MEAN_AT_R50, OFFICE_MEAN_AT_T05, OFFICES
from farm_ar.experiments.report import Comparison, Report, Row, new_figure
from farm_ar.experiments.setting import SCENES, Setting, accuracies, mean_per_layout, noisy_snapshots
from farm_ar.reid import SpatialOptions, SpatialReid
from farm_ar.reid.spatial import Box
from farm_ar.scenes import LayoutNoise, Scene

LOW_TRANSLATIONS = tuple(round(0.1 * i, 1) for i in range(1, 11))
ROTATIONS = tuple(range(0, 121, 5))
QUICK_ROTATIONS = (0, 10, 30, 50, 80, 120)


class Cell(NamedTuple):
    """One noise level in one scene: SDs in metres and degrees."""

    scene: str
    translation: float
    rotation: int


def translations(scene: Scene) -> tuple[float, ...]:
    """The paper's TList: 0.1 to 1.0 m by 0.1, then by 1 to the side of the room."""
    return LOW_TRANSLATIONS + tuple(float(sd) for sd in range(2, int(np.sqrt(scene.area) + 1e-9) + 1))


def fig5(setting: Setting) -> Report:
    """Accuracy of all six scenes under all noise levels. Paper, Fig. 5."""
    rotations = QUICK_ROTATIONS if setting.quick else ROTATIONS
    cells = [
        Cell(name, translation, rotation)
        for name in SCENES
        for translation in translations(setting.scenes[name])
        for rotation in rotations
    ]

    at_r50 = [c for c in cells if c.scene in OFFICES and c.rotation == 50 and c.translation <= 1.0]
    at_t05 = [c for c in cells if c.scene in OFFICES and c.translation == 0.5]

    def run(task: tuple[Cell, Box]) -> FloatArray:
        cell, box = task
        scene = setting.scenes[cell.scene]
        key = (5, SCENES.index(cell.scene), round(cell.translation * 10), cell.rotation)
        noise = LayoutNoise.of(cell.translation, cell.rotation)
        batch = noisy_snapshots(scene, noise, setting.layouts, setting.rng(*key))
        reid = SpatialReid(scene, SpatialOptions(box=box))
        return mean_per_layout(accuracies(reid, batch, setting.layouts))

    local: list[tuple[Cell, Box]] = [(cell, "local") for cell in cells]
    world: list[tuple[Cell, Box]] = [(cell, "world") for cell in dict.fromkeys(at_r50 + at_t05)]
    everything = dict(setting.each(local + world, run))
    found = {cell: accuracy for (cell, box), accuracy in everything.items() if box == "local"}
    rows: list[Row] = [
        {
            "scene": cell.scene,
            "translation_sd_m": cell.translation,
            "rotation_sd_deg": cell.rotation,
            "accuracy": float(np.nanmean(accuracy)),
            "sd_of_layout_means": float(np.nanstd(accuracy)),
            "layouts": setting.layouts,
        }
        for cell, accuracy in found.items()
    ]
    comparisons = [
        _office_mean(f"offices, {what}, {box} boxes", paper, {c: everything[c, box] for c in chosen})
        for what, paper, chosen in (
            ("rotation SD 50°, low translation noise", OFFICE_MEAN_AT_R50, at_r50),
            ("translation SD 0.5 m, all rotation noise", OFFICE_MEAN_AT_T05, at_t05),
        )
        for box in ("local", "world")
    ]
    return Report(
        "fig5",
        f"Fig. 5: accuracy against noise in six scenes, {setting.layouts} layouts per noise level",
        rows,
        comparisons,
        _figure(setting, found),
        note="Means over the offices L2, M1 and H2. The paper used one layout per noise level. Local boxes: "
        "Eqs. 4 to 7 as written. World boxes: what the paper's program compares (boxes along the world's "
        "axes, no dimension cost in a scene of one category).",
    )


def _office_mean(what: str, paper: float, found: dict[Cell, FloatArray]) -> Comparison:
    """The mean over the noise levels of each office, then over the offices; its spread over the layouts."""
    scenes = sorted({cell.scene for cell in found})
    each = [np.nanmean([a for c, a in found.items() if c.scene == name], axis=0) for name in scenes]
    runs = np.mean(each, axis=0)
    spread = f"one layout per level: SD {np.nanstd(runs):.4f}"
    return Comparison(what, f"{paper:.4f}", f"{np.nanmean(runs):.4f}", spread)


def _figure(setting: Setting, found: dict[Cell, FloatArray]) -> Figure:
    figure = new_figure(9.5, 14.0)
    panels = figure.subplots(6, 2)
    for letter, name, (left, right) in zip("abcdef", SCENES, panels, strict=True):
        scene = setting.scenes[name]
        means = {cell: float(np.nanmean(value)) for cell, value in found.items() if cell.scene == name}
        _rotation_panel(left, means)
        left.set_title(f"({letter}1) {name}: against rotation noise", fontsize=9)
        _translation_panel(right, means, translations(scene))
        right.set_title(f"({letter}2) {name}: against translation noise", fontsize=9)
    return figure


def _rotation_panel(axes: Axes, means: dict[Cell, float]) -> None:
    """Mean over the low and over the high translation noises; 1.0 m belongs to both, as in the paper."""
    rotations = sorted({cell.rotation for cell in means})
    low = {cell: mean for cell, mean in means.items() if cell.translation <= 1.0}
    high = {cell: mean for cell, mean in means.items() if cell.translation >= 1.0}
    for name, chosen, colour in (("low", low, "#3b6ea5"), ("high", high, "#c77d2e")):
        line = [np.mean([v for c, v in chosen.items() if c.rotation == r]) for r in rotations]
        axes.plot(rotations, line, ".-", color=colour, label=f"{name} translation noise")
    _finish(axes, "SD of rotation noise (°)")
    axes.legend(frameon=False, fontsize=7)


def _translation_panel(axes: Axes, means: dict[Cell, float], levels: tuple[float, ...]) -> None:
    line = [np.mean([v for c, v in means.items() if c.translation == level]) for level in levels]
    axes.plot(levels, line, ".-", color="#3b6ea5")
    axes.axvline(1.0, color="#bbbbbb", linewidth=0.8, linestyle=":")
    _finish(axes, "SD of translation noise (m)")


def _finish(axes: Axes, xlabel: str) -> None:
    axes.set(ylim=(0, 1.03), ylabel="accuracy")
    axes.set_xlabel(xlabel, fontsize=8)
    axes.tick_params(labelsize=8)
    axes.grid(color="#eeeeee")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
