"""The sweep over noise levels of section 4.1.1: Fig. 5, and the numbers for the offices in the text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from farm_ar.arrays import FloatArray
from farm_ar.experiments.intervals import difference_of, interval_of
from farm_ar.experiments.published import OFFICE_MEAN_AT_R50, OFFICE_MEAN_AT_T05, OFFICES
from farm_ar.experiments.report import (
    OTHER,
    OURS,
    TEXT_SIZE,
    Comparison,
    Report,
    new_figure,
    set_up_chart,
)
from farm_ar.experiments.setting import (
    SCENES,
    Setting,
    accuracies,
    mean_and_sd,
    mean_per_layout,
    named_scene,
    noisy_snapshots,
    piece_rng,
)
from farm_ar.reid import SpatialOptions, SpatialReid
from farm_ar.reid.base import Reidentifier
from farm_ar.reid.spatial_unity import SpatialUnityReid
from farm_ar.scenes import LayoutNoise, Scene
from farm_ar.sweeps import Row

LOW_TRANSLATIONS = tuple(round(0.1 * i, 1) for i in range(1, 11))
ROTATIONS = tuple(range(0, 121, 5))
QUICK_ROTATIONS = ROTATIONS[::2]
"""Evenly spaced like the whole list, so that means over it can be compared with the paper's."""


METHODS = {"local": "local boxes", "world": "world boxes"}
"""How the text's method is read in the means over the offices; the authors' program stands beside each."""


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
    cells = _cells(setting)
    offices = [cell for cell in cells if cell.scene in OFFICES]
    aggregates = (
        (
            "rotation SD 50°, low translation noise",
            OFFICE_MEAN_AT_R50,
            [cell for cell in offices if cell.rotation == 50 and cell.translation <= 1.0],
        ),
        (
            "translation SD 0.5 m, all rotation noise",
            OFFICE_MEAN_AT_T05,
            [cell for cell in offices if cell.translation == 0.5],
        ),
    )
    chosen_cells = dict.fromkeys(cell for _, _, chosen in aggregates for cell in chosen)
    both = [(c, which) for which in ("world", "program") for c in chosen_cells]
    everything = _sweep(setting, [*[(c, "local") for c in cells], *both])
    found = {cell: everything[cell, "local"] for cell in cells}
    rng = setting.rng(5, 90)
    return Report(
        "fig5",
        f"Fig. 5: accuracy against noise in six scenes, {setting.layouts} layouts per noise level",
        [_row(cell, means, rng) for cell, means in found.items()],
        [
            comparison
            for what, paper, chosen in aggregates
            for comparison in _office_means(what, paper, chosen, everything, rng)
        ],
        _figure({cell: mean_and_sd(means)[0] for cell, means in found.items()}),
        note="Means over the offices L2, M1 and H2. The paper used one layout per noise level. Local boxes: "
        "Eqs. 4 to 7 as written. World boxes: what the paper's program compares (boxes along the world's "
        "axes, no dimension cost in a scene of one category). Their program itself: `spatial-unity`.",
    )


def _cells(setting: Setting) -> list[Cell]:
    return [
        Cell(name, translation, rotation)
        for name in SCENES
        for translation in translations(setting.scenes[name])
        for rotation in (QUICK_ROTATIONS if setting.quick else ROTATIONS)
    ]


def _sweep(setting: Setting, pieces: Sequence[tuple[Cell, str]]) -> dict[tuple[Cell, str], FloatArray]:
    """(layouts,) mean accuracy over the path in each noisy layout, of each cell by each method."""
    scenes = {name: setting.scene_parameters(name) | {"layouts": setting.layouts} for name in SCENES}
    parameters = [scenes[cell.scene] | cell._asdict() | {"box": box} for cell, box in pieces]
    outcomes = setting.sweep("fig5", layout_means, parameters)
    found = (np.array(outcome.rows[0]["mean_per_layout"]) for outcome in outcomes)
    return dict(zip(pieces, found, strict=True))


def layout_means(
    seed: int, scene: str, file: str | None, layouts: int, translation: float, rotation: int, box: str
) -> Row:
    """A unit of Fig. 5: (layouts,) mean accuracy over the path in each noisy layout of a cell."""
    room = named_scene(scene, file)
    rng = piece_rng(seed, 5, SCENES.index(scene), round(translation * 10), rotation)
    batch = noisy_snapshots(room, LayoutNoise.of(translation, rotation), layouts, rng)
    reid: Reidentifier = SpatialUnityReid(room)
    if box != "program":
        reid = SpatialReid(
            room, SpatialOptions(gate_categories=False, box="world" if box == "world" else "local")
        )
    return {"mean_per_layout": mean_per_layout(accuracies(reid, batch, layouts))}


def _row(cell: Cell, layout_means: FloatArray, rng: np.random.Generator) -> Row:
    between = interval_of(layout_means, rng)
    return {
        "scene": cell.scene,
        "translation_sd_m": cell.translation,
        "rotation_sd_deg": cell.rotation,
        "accuracy": between.mean,
        "low": between.low,
        "high": between.high,
        "sd_of_layout_means": mean_and_sd(layout_means)[1],
        "layouts": len(layout_means),
    }


def _office_means(
    what: str,
    paper: float,
    cells: Sequence[Cell],
    found: Mapping[tuple[Cell, str], FloatArray],
    rng: np.random.Generator,
) -> list[Comparison]:
    """Means over the offices and noise levels, as many in each, by each reading, and their spread."""
    means = {
        reading: mean_per_layout(np.transpose([found[cell, reading] for cell in cells]))
        for reading in (*METHODS, "program")
    }
    program = means.pop("program")
    return [
        Comparison(
            f"offices, {what}, {METHODS[reading]}",
            f"{paper:.4f}",
            f"{mean_and_sd(ours)[0]:.4f}",
            f"one layout per level: SD {mean_and_sd(ours)[1]:.4f}",
            interval_of(ours, rng).ends,
            f"{mean_and_sd(program)[0]:.4f}",
            difference_of(ours, program, rng).signed,
        )
        for reading, ours in means.items()
    ]


def _figure(means: Mapping[Cell, float]) -> Figure:
    figure = new_figure(9.5, 14.0)
    for letter, name, (left, right) in zip("abcdef", SCENES, figure.subplots(6, 2), strict=True):
        here = {cell: mean for cell, mean in means.items() if cell.scene == name}
        # 1.0 m belongs to both the low and the high translation noises, as in the paper.
        low = {cell: mean for cell, mean in here.items() if cell.translation <= 1.0}
        high = {cell: mean for cell, mean in here.items() if cell.translation >= 1.0}
        set_up_chart(left, f"({letter}1) {name}", "SD of rotation noise (°)", "accuracy")
        _plot_means(left, low, "rotation", OURS, "low translation noise (0.1 to 1 m)")
        _plot_means(left, high, "rotation", OTHER, "high translation noise (1 m and more)")
        set_up_chart(right, f"({letter}2) {name}", "SD of translation noise (m)", "accuracy")
        _plot_means(right, here, "translation", OURS, "all rotation noise")
        right.axvline(1.0, color="#bbbbbb", linewidth=0.8, linestyle=":")
    figure.legend(
        handles=left.get_lines(), loc="outside lower center", ncols=2, frameon=False, fontsize=TEXT_SIZE
    )
    return figure


def _plot_means(
    axes: Axes,
    means: Mapping[Cell, float],
    against: Literal["translation", "rotation"],
    color: str,
    label: str,
) -> None:
    """Plot the mean over all cells of each level of one noise."""
    levels = sorted({getattr(cell, against) for cell in means})
    line = [np.mean([mean for cell, mean in means.items() if getattr(cell, against) == x]) for x in levels]
    axes.plot(levels, line, ".-", color=color, label=label)
