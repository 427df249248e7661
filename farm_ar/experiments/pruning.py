"""The search space pruning experiments of section 4.1.3: Table 3 with Fig. 8, and Fig. 9."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from farm_ar.arrays import FloatArray
from farm_ar.experiments.intervals import Interval, difference_of, interval_of
from farm_ar.experiments.published import FIG_9, FIG_9_TIME, H1_CAMERA, TABLE_3, TABLE_3_SITES
from farm_ar.experiments.report import (
    OTHER,
    OURS,
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
    piece_rng,
)
from farm_ar.geometry import voronoi_cells
from farm_ar.reid import SpatialOptions, SpatialReid, site_probability, sites_by_probability
from farm_ar.reid.spatial_unity import SpatialUnityReid
from farm_ar.scenes import LayoutNoise, Scene, SnapshotBatch
from farm_ar.sweeps import Outcome, Row, SerialExecutor

NOISE = LayoutNoise.of(0.1, 15.0)
THRESHOLDS = tuple(round(0.05 * i, 2) for i in range(21))
TIMED_SOLVERS = {"mip": 1, "lsap": 5}
"""The solvers that are timed, and how often each solves a snapshot."""

TIMED_SNAPSHOTS = 62
"""How many snapshots are timed: as many as the paper's path gave."""


def table3(setting: Setting) -> Report:
    """Probabilities of H1's sites at the camera of Fig. 6, and what they prune. Paper, Table 3 and Fig. 8."""
    scene = setting.scenes["H1"]
    camera = np.array(H1_CAMERA[:2])
    probability = site_probability(camera, scene.site_positions)
    order, _ = sites_by_probability(camera, scene.site_positions, 1.0)
    others = order[1:]
    cumulative = np.cumsum(probability[others])
    by_border = SpatialUnityReid(scene).site_probability(camera)
    by_program = np.argsort(-by_border, kind="stable")
    rows = [
        {
            "site": scene.sites[s].name,
            "probability": float(probability[s]),
            "cumulative": float(total),
            "program_site": scene.sites[p].name,
            "program_probability": float(by_border[p]),
        }
        for s, total, p in zip(others, cumulative, by_program[by_program != order[0]], strict=True)
    ]
    own = scene.sites[order[0]].name
    comparisons = [
        Comparison(
            f"rank {i + 1}",
            f"{site} {value:.3f}",
            f"{row['site']} {row['probability']:.3f}",
            program=f"{row['program_site']} {row['program_probability']:.3f}",
        )
        for i, (site, value, row) in enumerate(zip(TABLE_3_SITES, TABLE_3, rows, strict=False))
    ]
    return Report(
        "table3",
        "Table 3: probabilities of the sites that the camera of Fig. 6 is not in (H1)",
        rows,
        comparisons,
        _cells_figure(scene, camera),
        note=f"Camera at x = {camera[0]}, z = {camera[1]} m, solved from the paper's table: the comparison "
        "holds for the authors' H1, not for another layout of it. The picture is in the form of Fig. 8. The "
        f"camera's own site, {own}, has probability 1 in the text and {by_border[order[0]]:.3f} in the "
        "authors' program, where all sites share by a softmax of 1 / distance to their borders.",
    )


def fig9(setting: Setting) -> Report:
    """Accuracy on H1 and time to solve, against the pruning threshold. Paper, Fig. 9."""
    layouts = setting.layouts
    same = setting.scene_parameters("H1") | {"layouts": layouts}
    parameters = [same | {"threshold": t, "program": p} for p in (False, True) for t in THRESHOLDS]
    outcomes = setting.sweep("fig9", pruned, parameters)
    found = [np.array(outcome.rows[0]["accuracy"]) for outcome in outcomes]
    rng, count = setting.rng(9, 90), len(THRESHOLDS)
    rows = [
        _accuracy_row(threshold, text, program, rng)
        for threshold, text, program in zip(THRESHOLDS, found[:count], found[count:], strict=True)
    ]
    measured = _solve_times(setting, THRESHOLDS[::5] if setting.quick else THRESHOLDS)
    return Report(
        "fig9",
        f"Fig. 9: pruning on H1, T(0, 0.1), R(0, 15), {layouts} layouts",
        rows,
        _accuracy_comparisons(rows) + _time_comparisons(measured),
        _threshold_figure(rows, measured),
        measured=measured,
        note="The paper solved with lp_solve; `mip` is the same binary programme by SCIP, `lsap` SciPy's "
        "assignment, which takes so little that pruning hardly matters. Times are of the solver alone. The "
        "authors' program is `spatial-unity`, which names nothing where fewer labels are left than "
        "detections (the program then keeps the frame before's).",
    )


def _accuracy_row(
    threshold: float, accuracy: FloatArray, program: FloatArray, rng: np.random.Generator
) -> dict[str, float]:
    between, difference = interval_of(accuracy, rng), difference_of(accuracy, program, rng)
    return {
        "threshold": threshold,
        "accuracy": between.mean,
        "low": between.low,
        "high": between.high,
        "sd_of_layout_means": mean_and_sd(mean_per_layout(accuracy))[1],
        "program": mean_and_sd(program)[0],
        "difference": difference.mean,
        "difference_low": difference.low,
        "difference_high": difference.high,
        "layouts": len(accuracy),
    }


def pruned(
    seed: int, scene: str, file: str | None, layouts: int, threshold: float, program: bool = False
) -> Row:
    """A unit of Fig. 9: (layouts, P) accuracies at one threshold, of the text's method or the program's."""
    batch, room = _snapshots(seed, scene, file, layouts), named_scene(scene, file)
    if program:
        return {"accuracy": accuracies(SpatialUnityReid(room, threshold), batch, layouts)}
    reid = SpatialReid(room, SpatialOptions(threshold=threshold, gate_categories=False))
    return {"accuracy": accuracies(reid, batch, layouts)}


@lru_cache(maxsize=1)
def _snapshots(seed: int, scene: str, file: str | None, layouts: int) -> SnapshotBatch:
    """The snapshots that all units of Fig. 9 share."""
    return noisy_snapshots(named_scene(scene, file), NOISE, layouts, piece_rng(seed, 9, 0))


def _solve_times(setting: Setting, thresholds: Sequence[float]) -> list[dict[str, float]]:
    """Mean time to solve a snapshot at each threshold, microseconds, by each solver; one at a time."""
    scene = setting.scene_parameters("H1")
    same = scene | {"layouts": setting.layouts, "thresholds": thresholds}
    seen = np.flatnonzero(_snapshots(setting.seed, **scene, layouts=setting.layouts).count)
    parameters = [same | {"snapshot": b} for b in seen[:TIMED_SNAPSHOTS]]
    outcomes = setting.sweep("fig9 times", solve_times, parameters, executor=SerialExecutor())
    each = [[row[f"{solver}_s"] for row in o.measured for solver in TIMED_SOLVERS] for o in outcomes]
    mean = np.mean(each, axis=0).reshape(len(thresholds), len(TIMED_SOLVERS)) * 1e6
    columns = [f"{solver}_us" for solver in TIMED_SOLVERS]
    return [
        {"threshold": threshold, **dict(zip(columns, times, strict=True))}
        for threshold, times in zip(thresholds, mean.tolist(), strict=True)
    ]


def solve_times(
    seed: int, scene: str, file: str | None, layouts: int, thresholds: Sequence[float], snapshot: int
) -> Outcome:
    """A unit of Fig. 9's times: seconds to solve one snapshot at each threshold, by each solver.

    The snapshot is solved at all thresholds before the next one is, so that what else the machine does falls
    on all of them alike.
    """
    room = named_scene(scene, file)
    seen = _snapshots(seed, scene, file, layouts).snapshot(snapshot)
    measured = []
    for threshold in thresholds:
        row = {"threshold": threshold}
        for solver, times in TIMED_SOLVERS.items():
            reid = SpatialReid(
                room, SpatialOptions(threshold=threshold, gate_categories=False, solver=solver)
            )
            row[f"{solver}_s"] = min(reid.identify(seen).solve_time for _ in range(times))
        measured.append(row)
    return Outcome([{"detections": len(seen.detections)}], measured)


def _accuracy_comparisons(rows: Sequence[Mapping[str, float]]) -> list[Comparison]:
    return [
        Comparison(
            f"accuracy at threshold {row['threshold']:.2f}",
            f"{FIG_9[row['threshold']]:.2f}",
            f"{row['accuracy']:.3f}",
            f"one layout's mean: SD {row['sd_of_layout_means']:.3f}",
            Interval(row["accuracy"], row["low"], row["high"]).ends,
            f"{row['program']:.3f}",
            Interval(row["difference"], row["difference_low"], row["difference_high"]).signed,
        )
        for row in rows
        if row["threshold"] in FIG_9
    ]


def _time_comparisons(measured: Sequence[Mapping[str, float]]) -> list[Comparison]:
    """Of times as shares of those at the last threshold, which prunes nothing."""
    return [
        Comparison(
            f"time at threshold {row['threshold']:.2f}, of that without pruning",
            f"about {FIG_9_TIME[row['threshold']]:.1f}",
            ", ".join(f"{row[f'{s}_us'] / measured[-1][f'{s}_us']:.2f} ({s})" for s in TIMED_SOLVERS),
        )
        for row in measured
        if row["threshold"] in FIG_9_TIME
    ]


def _cells_figure(scene: Scene, camera: FloatArray) -> Figure:
    """The cells kept at rising thresholds, as in Fig. 8."""
    figure = new_figure(9.0, 6.4)
    for axes, threshold in zip(figure.subplots(2, 3).flat, (0.0, 0.25, 0.5, 0.75, 0.9, 1.0), strict=True):
        order, kept = sites_by_probability(camera, scene.site_positions, threshold)
        _draw_cells(axes, scene, set(order[:kept].tolist()))
        axes.plot(*camera, marker="*", markersize=11, color="#c0392b", linestyle="none")
        axes.set_title(f"threshold {threshold:.2f}: {kept} of {len(scene.sites)} sites", fontsize=TITLE_SIZE)
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


def _threshold_figure(rows: Sequence[Mapping[str, float]], measured: Sequence[Mapping[str, float]]) -> Figure:
    figure = new_figure(6.4, 3.6)
    axes = figure.subplots()
    set_up_chart(
        axes,
        "Accuracy and time to solve against the pruning threshold (H1)",
        "threshold",
        "accuracy, share of time",
    )
    found = [(row["threshold"], row["accuracy"]) for row in rows]
    whole = measured[-1]["mip_us"]
    share = [(row["threshold"], row["mip_us"] / whole) for row in measured]
    axes.set_ylim(0, 1.04 * max(1.0, *(value for _, value in share)))
    axes.plot(*np.transpose(found), "o-", markersize=3, color=OURS, label="accuracy")
    if not np.isnan(rows[0]["low"]):
        low, high = ([row[end] for row in rows] for end in ("low", "high"))
        axes.fill_between(np.transpose(found)[0], low, high, color=OURS, alpha=0.2, linewidth=0)
    by_program = [(row["threshold"], row["program"]) for row in rows]
    axes.plot(*np.transpose(by_program), ":", color=OURS, label="accuracy, authors' program")
    axes.plot(list(FIG_9), list(FIG_9.values()), "x", markersize=7, color=OURS, label="accuracy, paper")
    axes.plot(
        *np.transpose(share), "s--", markersize=3, color=OTHER, label="time (mip), of that without pruning"
    )
    axes.plot(list(FIG_9_TIME), list(FIG_9_TIME.values()), "P", color=OTHER, label="time, paper")
    axes.legend(frameon=False, fontsize=TEXT_SIZE, loc="lower right")
    return figure
