"""The search space pruning experiments of section 4.1.3: Table 3 with Fig. 8, and Fig. 9."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from farm_ar.arrays import FloatArray
from farm_ar.experiments.published import FIG_9, FIG_9_TIME, H1_CAMERA, TABLE_3, TABLE_3_SITES
from farm_ar.experiments.report import Comparison, Report, new_figure
from farm_ar.experiments.setting import Setting, accuracies, mean_per_layout, noisy_snapshots
from farm_ar.geometry import voronoi_cells
from farm_ar.reid import SpatialOptions, SpatialReid, site_probability, sites_by_probability
from farm_ar.scenes import LayoutNoise, Scene, SnapshotBatch

NOISE = LayoutNoise.of(0.1, 15.0)
THRESHOLDS = tuple(round(0.05 * i, 2) for i in range(21))
TIMED_SOLVERS = {"mip": 1, "lsap": 5}
"""The solvers whose time is taken, and how often each snapshot is solved."""


def table3(setting: Setting) -> Report:
    """Probabilities of H1's sites at the camera of Fig. 6, and what they prune. Paper, Table 3 and Fig. 8."""
    scene = setting.scenes["H1"]
    camera = np.array(H1_CAMERA[:2])
    probability = site_probability(camera, scene.site_positions)
    order, _ = sites_by_probability(camera, scene.site_positions, 1.0)
    others = order[1:]
    cumulative = np.cumsum(probability[others])
    rows = [
        {"site": scene.sites[s].name, "probability": float(probability[s]), "cumulative": float(total)}
        for s, total in zip(others, cumulative, strict=True)
    ]
    comparisons = [
        Comparison(f"rank {i + 1}", f"{site} {value:.3f}", f"{row['site']} {row['probability']:.3f}")
        for i, (site, value, row) in enumerate(zip(TABLE_3_SITES, TABLE_3, rows, strict=False))
    ]
    setting.advance(1.0)
    return Report(
        "table3",
        "Table 3: probabilities of the sites that the camera of Fig. 6 is not in (H1)",
        rows,
        comparisons,
        _cells_figure(scene, camera),
        note=f"Camera at x = {camera[0]}, z = {camera[1]} m, solved from the paper's table: the comparison "
        "holds for the authors' H1, not for another layout of it. The picture is in the form of Fig. 8.",
    )


def fig9(setting: Setting) -> Report:
    """Accuracy on H1 and time to solve, against the pruning threshold. Paper, Fig. 9."""
    scene, layouts = setting.scenes["H1"], setting.layouts
    batch = noisy_snapshots(scene, NOISE, layouts, setting.rng(9, 0))

    def run(threshold: float) -> FloatArray:
        return accuracies(SpatialReid(scene, SpatialOptions(threshold=threshold)), batch, layouts)

    found = dict(setting.each(THRESHOLDS, run))
    rows = [
        {
            "threshold": threshold,
            "accuracy": float(np.nanmean(accuracy)),
            "sd_of_layout_means": float(np.nanstd(mean_per_layout(accuracy))),
            "layouts": layouts,
        }
        for threshold, accuracy in found.items()
    ]
    thresholds = THRESHOLDS[::5] if setting.quick else THRESHOLDS
    measured = [_solve_times(scene, batch, layouts, threshold) for threshold in thresholds]
    whole = measured[-1]
    comparisons = []
    for threshold, paper in FIG_9.items():
        row = rows[THRESHOLDS.index(threshold)]
        comparisons.append(
            Comparison(
                f"accuracy at threshold {threshold:.2f}",
                f"{paper:.2f}",
                f"{row['accuracy']:.3f}",
                f"one layout's mean: SD {row['sd_of_layout_means']:.3f}",
            )
        )
    for threshold, share in FIG_9_TIME.items():
        times = next(row for row in measured if row["threshold"] == threshold)
        comparisons.append(
            Comparison(
                f"time at threshold {threshold:.2f}, of that without pruning",
                f"about {share:.1f}",
                ", ".join(f"{times[f'{s}_us'] / whole[f'{s}_us']:.2f} ({s})" for s in TIMED_SOLVERS),
            )
        )
    return Report(
        "fig9",
        f"Fig. 9: pruning on H1, T(0, 0.1), R(0, 15), {layouts} layouts",
        rows,
        comparisons,
        _threshold_figure(rows, measured),
        measured=measured,
        note="The paper solved with lp_solve; `mip` is the same binary programme by SCIP, `lsap` SciPy's "
        "assignment, which takes so little that pruning hardly matters. Times are of the solver alone.",
    )


def _solve_times(scene: Scene, batch: SnapshotBatch, layouts: int, threshold: float) -> dict[str, float]:
    """Mean time to solve one snapshot of the first layout, microseconds, by each solver."""
    first = range(len(batch) // layouts)
    snapshots = [batch.snapshot(b) for b in first if batch.count[b]]
    row = {"threshold": threshold}
    for solver, repeats in TIMED_SOLVERS.items():
        reid = SpatialReid(scene, SpatialOptions(threshold=threshold, solver=solver))
        times = [min(reid.identify(s).solve_time for _ in range(repeats)) for s in snapshots]
        row[f"{solver}_us"] = float(np.mean(times)) * 1e6
    return row


def _cells_figure(scene: Scene, camera: FloatArray) -> Figure:
    """The cells kept at rising thresholds, as in Fig. 8."""
    figure = new_figure(9.0, 6.4)
    for axes, threshold in zip(figure.subplots(2, 3).flat, (0.0, 0.25, 0.5, 0.75, 0.9, 1.0), strict=True):
        order, kept = sites_by_probability(camera, scene.site_positions, threshold)
        _draw_cells(axes, scene, set(order[:kept].tolist()))
        axes.plot(*camera, marker="*", markersize=11, color="#c0392b", linestyle="none")
        axes.set_title(f"threshold {threshold:.2f}: {kept} of {len(scene.sites)} sites", fontsize=9)
    return figure


def _draw_cells(axes: Axes, scene: Scene, kept: set[int]) -> None:
    for s, cell in enumerate(voronoi_cells(scene.site_positions, scene.size)):
        if len(cell):
            colour = "#a9c9e8" if s in kept else "white"
            axes.add_patch(Polygon(cell, facecolor=colour, edgecolor="#444444", linewidth=0.7))
    for site in scene.sites:
        axes.plot(site.x, site.z, ".", color="#444444", markersize=3)
        axes.annotate(site.name, (site.x, site.z), xytext=(2, 2), textcoords="offset points", fontsize=7)
    width, depth = scene.size
    axes.add_patch(Rectangle((0, 0), width, depth, fill=False, linewidth=1.2))
    axes.set(xlim=(-0.02 * width, 1.02 * width), ylim=(-0.02 * depth, 1.02 * depth), aspect="equal")
    axes.set_axis_off()


def _threshold_figure(rows: list[dict[str, float]], measured: list[dict[str, float]]) -> Figure:
    figure = new_figure(6.4, 3.6)
    axes = figure.subplots()
    blue, orange = "#3b6ea5", "#c77d2e"
    thresholds = [row["threshold"] for row in rows]
    found = [row["accuracy"] for row in rows]
    axes.plot(thresholds, found, "o-", markersize=3, color=blue, label="accuracy")
    axes.plot(list(FIG_9), list(FIG_9.values()), "x", color=blue, label="accuracy, paper")
    axes.set(xlabel="threshold", ylabel="accuracy", ylim=(0, 1.05))
    times = axes.twinx()
    share = np.array([row["mip_us"] for row in measured]) / measured[-1]["mip_us"]
    timed = [row["threshold"] for row in measured]
    times.plot(timed, share, "s--", markersize=3, color=orange, label="time (mip)")
    times.plot(list(FIG_9_TIME), list(FIG_9_TIME.values()), "+", color=orange, label="time, paper")
    times.set(ylabel="time, of that without pruning", ylim=(0, 1.4))
    handles = [*axes.get_lines(), *times.get_lines()]
    axes.legend(handles, [str(h.get_label()) for h in handles], frameon=False, fontsize=8, loc="lower right")
    axes.set_title("Accuracy and time against the pruning threshold (H1)", fontsize=9)
    return figure
