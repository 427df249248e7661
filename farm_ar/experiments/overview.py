"""The six synthetic scenes: Table 1 and Fig. 4."""

from __future__ import annotations

from matplotlib.figure import Figure

from farm_ar.drawing import draw_scene, set_up_axes
from farm_ar.experiments.published import TABLE_1
from farm_ar.experiments.report import TITLE_SIZE, Comparison, Report, Row, new_figure
from farm_ar.experiments.setting import Setting
from farm_ar.scenes import Scene


def table1(setting: Setting) -> Report:
    """The counts of the six synthetic scenes, and their pictures. Paper, Table 1 and Fig. 4."""
    rows: list[Row] = []
    comparisons = []
    for name, paper in TABLE_1.items():
        ours = _counts(setting.scenes[name])
        rows.append({"scene": name, **ours, **{f"paper_{key}": paper[key] for key in ours}})
        comparisons.append(
            Comparison(
                f"{name}: {', '.join(key.replace('_m2', ' in m²') for key in paper)}",
                ", ".join(f"{value}" for value in paper.values()),
                ", ".join(f"{ours[key]}" for key in paper),
            )
        )
    return Report("table1", "Table 1: the six synthetic scenes", rows, comparisons, _figure(setting))


def _counts(scene: Scene) -> dict[str, int | float]:
    area = round(scene.area, 6)
    return {
        "sites": len(scene.sites),
        "types": len(scene.layout.categories),
        "objects": len(scene.layout),
        "area_m2": int(area) if area.is_integer() else area,
    }


def _figure(setting: Setting) -> Figure:
    figure = new_figure(11.0, 7.6)
    for axes, (name, scene) in zip(figure.subplots(2, 3).flat, setting.scenes.items(), strict=True):
        set_up_axes(axes, scene.size)
        draw_scene(axes, scene, labels=False, legend=False)
        axes.set_title(f"{name}: {len(scene.layout)} objects, {scene.area:g} m²", fontsize=TITLE_SIZE)
    return figure
