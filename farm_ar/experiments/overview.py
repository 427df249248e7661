"""The scenes of the experiments: Table 1, and beside it Table 4."""

from __future__ import annotations

from farm_ar.drawing import draw_scene, set_up_axes
from farm_ar.experiments.published import TABLE_1, TABLE_4
from farm_ar.experiments.report import Comparison, Report, Row, new_figure
from farm_ar.experiments.setting import Setting
from farm_ar.scenes import Scene, builtin_scene


def table1(setting: Setting) -> Report:
    """The counts of the six synthetic scenes and of the three real-world ones. Paper, Tables 1 and 4."""
    rows: list[Row] = []
    comparisons = []
    real = {name: builtin_scene(name) for name in TABLE_4}
    for scenes, published in ((setting.scenes, TABLE_1), (real, TABLE_4)):
        for name, paper in published.items():
            ours = _counts(scenes[name])
            rows.append({"scene": name, **ours, **{f"paper_{key}": paper.get(key) for key in ours}})
            comparisons.append(
                Comparison(
                    f"{name}: {', '.join(key.replace('_m2', ' in m²') for key in paper)}",
                    ", ".join(f"{value}" for value in paper.values()),
                    ", ".join(f"{ours[key]}" for key in paper),
                )
            )
    setting.advance(1.0)
    figure = new_figure(11.0, 7.6)
    for axes, (name, scene) in zip(figure.subplots(2, 3).flat, setting.scenes.items(), strict=True):
        set_up_axes(axes, scene.size)
        draw_scene(axes, scene, labels=False, legend=False)
        axes.set_title(f"{name}: {len(scene.layout)} objects, {scene.area:g} m²", fontsize=9)
    return Report("table1", "Tables 1 and 4: the scenes", rows, comparisons, figure)


def _counts(scene: Scene) -> dict[str, int | float]:
    return {
        "sites": len(scene.sites),
        "types": len(scene.layout.categories),
        "objects": len(scene.layout),
        "area_m2": round(scene.area, 6) if scene.area % 1 else int(scene.area),
    }
