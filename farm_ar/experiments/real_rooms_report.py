"""Tables 4 and 5, and the distributions of Fig. 14: the real-world protocol of section 4.2, simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from farm_ar.arrays import FloatArray
from farm_ar.drawing import draw_scene, set_up_axes
from farm_ar.experiments.intervals import Interval, difference_of, interval_of, resampled
from farm_ar.experiments.published import TABLE_4, TABLE_5, TABLE_5_TIME
from farm_ar.experiments.real_rooms import (
    ALONE,
    FUSED,
    HEADINGS,
    METHODS,
    ROOMS,
    SIMULATED,
    TIMED_FRAMES,
    Case,
    Walks,
    cases,
    frame_rate,
    sds_of_layouts,
    shares_of,
    solve_times,
    walk_all,
    with_more_seen,
    with_one_shift,
)
from farm_ar.experiments.report import (
    OURS,
    TEXT_SIZE,
    TITLE_SIZE,
    Comparison,
    Report,
    new_figure,
    set_up_chart,
)
from farm_ar.experiments.setting import Setting, mean_and_sd
from farm_ar.scenes import builtin_scene
from farm_ar.sweeps import Row, SerialExecutor


def table4(setting: Setting) -> Report:
    """The counts of the three real rooms, and their Voronoi cells. Paper, Table 4, Figs. 10 to 12, 23."""
    rows: list[Row] = []
    comparisons = []
    figure = new_figure(12.0, 4.4)
    for axes, (name, paper) in zip(figure.subplots(1, 3), TABLE_4.items(), strict=True):
        scene = builtin_scene(name)
        ours = {"sites": len(scene.sites), "objects": len(scene.layout), "area_m2": round(scene.area, 6)}
        rows.append({"scene": name, **ours, **{f"paper_{key}": value for key, value in paper.items()}})
        comparisons.append(
            Comparison(
                f"{name}: sites, chairs, area in m²",
                ", ".join(map(str, paper.values())),
                ", ".join(f"{value:g}" for value in ours.values()),
            )
        )
        set_up_axes(axes, scene.size)
        draw_scene(axes, scene, legend=False)
        axes.set_title(f"{name}: {len(scene.layout)} chairs, {scene.area:g} m²", fontsize=TITLE_SIZE)
    note = "Rebuilt from the paper's counts; the rooms are not public. Drawn in the form of Figs. 11 and 23."
    return Report("table4", "Table 4: the three real-world scenes", rows, comparisons, figure, note=note)


def table5(setting: Setting) -> Report:
    """Accuracy over walks through the rearranged rooms, by method. Paper, Table 5."""
    found, rng = walk_all(setting, cases(setting.quick)), setting.rng(55, 90)
    rows = [row for case, walk in found.items() for row in _rows(case, walk, rng)]
    measured = _solve_times(setting, found)
    first = {room: found[Case(room, HEADINGS[0])] for room in ROOMS}
    return Report(
        "table5",
        f"Table 5: accuracy in the three real-world scenes, {setting.layouts} rearranged layouts",
        rows,
        [
            *(line for room in ROOMS for line in _room_lines(room, first[room], rng)),
            *_order_lines(setting, first),
            *_time_lines(measured),
        ],
        _accuracy_figure(rows),
        measured=measured,
        note=f"{SIMULATED} Chairs are turned by an SD of {HEADINGS[0]}°, and shifted by one SD a room, "
        "*fitted* so that the mean accuracy of the paper's method is the paper's; the rest is compared.",
        tables=f"{_tables(rows)}\n{_seen_table(setting)}",
    )


def fig14(setting: Setting) -> Report:
    """How often a frame has which accuracy, by the paper's method. Paper, Fig. 14."""
    found = walk_all(setting, cases(quick=True))
    figure = new_figure(10.0, 3.2)
    rows: list[Row] = []
    comparisons = []
    for axes, room in zip(figure.subplots(1, 3), ROOMS, strict=True):
        accuracy = found[Case(room, HEADINGS[0])].accuracy["spatial", ALONE]
        shares = shares_of(accuracy)
        rows += [{"scene": room, "accuracy": k / 10, "share": share} for k, share in enumerate(shares)]
        largest = int(np.argmax(shares))
        comparisons.append(
            Comparison(
                f"{room}: most frequent accuracy of a frame",
                "100%",
                f"{10 * largest}% ({shares[largest]:.0%} of the frames)",
            )
        )
        set_up_chart(axes, room, "accuracy of a frame (%)", "share of frames")
        axes.bar(10 * np.arange(11), shares, 8.0, color=OURS)
        axes.set_xticks(range(0, 101, 20))
    title = f"Fig. 14: distributions of accuracy in the three real-world scenes, {setting.layouts} layouts"
    note = (
        f"{SIMULATED} Shifts as fitted for Table 5. The paper names no share but that 100% has the largest."
    )
    return Report("fig14", title, rows, comparisons, figure, note=note)


def _full(accuracy: FloatArray) -> FloatArray:
    """Whether all is right in each frame, NaN where nothing was seen."""
    return np.where(np.isnan(accuracy), np.nan, accuracy == 1.0)


def _rows(case: Case, walks: Walks, rng: np.random.Generator) -> list[Row]:
    paper = walks.accuracy["spatial", ALONE]
    rows: list[Row] = []
    for (method, mode), accuracy in walks.accuracy.items():
        mean, difference = interval_of(accuracy, rng), difference_of(accuracy, paper, rng)
        rows.append(
            {
                **case._asdict(),
                "shift_sd_m": walks.shift_m,
                "detections": walks.detections,
                "frames_with_detections": walks.seen,
                "method": method,
                "mode": mode,
                "mean": mean.mean,
                "low": mean.low,
                "high": mean.high,
                "sd": float(np.mean(sds_of_layouts(accuracy))),
                "all_right": mean_and_sd(_full(accuracy))[0],
                "difference": difference.mean,
                "difference_low": difference.low,
                "difference_high": difference.high,
            }
        )
    return rows


def _room_lines(room: str, walks: Walks, rng: np.random.Generator) -> list[Comparison]:
    accuracy, (mean, sd) = walks.accuracy["spatial", ALONE], TABLE_5[room]
    ours = interval_of(accuracy, rng)
    spread = resampled(accuracy, lambda values: 100 * float(np.mean(sds_of_layouts(values))), rng)
    sds = 100 * sds_of_layouts(accuracy)
    shares = shares_of(accuracy)
    full = interval_of(_full(accuracy), rng)
    return [
        Comparison(
            f"{room}: mean accuracy, %",
            f"{mean:.2f}",
            f"{100 * ours.mean:.2f}",
            f"*fitted*: shifts of SD {walks.shift_m:.2f} m; {walks.detections:.1f} chairs a frame",
            _percent(ours),
        ),
        Comparison(
            f"{room}: SD over the frames of a layout, %",
            f"{sd:.2f}",
            f"{spread.mean:.2f}",
            f"one layout: {sds.min():.1f} to {sds.max():.1f}; all frames together "
            f"{100 * mean_and_sd(accuracy)[1]:.1f}",
            interval="" if np.isnan(spread.low) else f"{spread.low:.1f} to {spread.high:.1f}",
        ),
        Comparison(
            f"{room}: share of frames all right",
            "the largest",
            f"{full.mean:.0%}, {'the largest' if shares.argmax() == 10 else 'not the largest'}",
            interval=_percent(full),
        ),
    ]


def _order_lines(setting: Setting, first: Mapping[str, Walks]) -> list[Comparison]:
    """The rooms from the highest accuracy to the lowest, all moved alike: by metres, or by their sides."""
    sides = {room: float(np.sqrt(builtin_scene(room).area)) for room in ROOMS}
    shift = float(np.mean([walks.shift_m for walks in first.values()]))
    share = float(np.mean([walks.shift_m / sides[room] for room, walks in first.items()]))
    return [
        _order_line(setting, f"of SD {shift:.2f} m", dict.fromkeys(ROOMS, shift)),
        _order_line(
            setting,
            f"of SD {100 * share:.1f}% of the root of its area",
            {room: share * side for room, side in sides.items()},
        ),
    ]


def _order_line(setting: Setting, how: str, shifts: Mapping[str, float]) -> Comparison:
    parameters = [
        {"scene": room, "shift_m": round(shift, 4), "walks": setting.layouts}
        for room, shift in shifts.items()
    ]
    outcomes = setting.sweep("real rooms with one shift", with_one_shift, parameters)
    rows: dict[str, Mapping[str, Any]] = {
        room: outcome.rows[0] for room, outcome in zip(ROOMS, outcomes, strict=True)
    }
    mean = {room: float(row["mean"]) for room, row in rows.items()}
    order = sorted(ROOMS, key=lambda room: -TABLE_5[room][0])
    high, middle, low = np.ix_(*(np.array(rows[room]["means"], dtype=np.float64) for room in order))
    as_paper = float(np.mean((high > middle) & (middle > low)))
    return Comparison(
        f"the rooms by mean accuracy, all with shifts {how}",
        " > ".join(order),
        " > ".join(f"{room} {mean[room]:.3f}" for room in sorted(ROOMS, key=lambda room: -mean[room])),
        f"one layout a room, as in the paper: {as_paper:.0%} in its order",
    )


def _solve_times(setting: Setting, found: Mapping[Case, Walks]) -> list[Row]:
    """Mean time to solve a frame in each room, microseconds: the binary programme, and the assignment."""
    shifts = {room: round(found[Case(room, HEADINGS[0])].shift_m, 4) for room in ROOMS}
    parameters = [{"scene": room, "shift_m": shift, "frames": TIMED_FRAMES} for room, shift in shifts.items()]
    outcomes = setting.sweep("table5 times", solve_times, parameters, executor=SerialExecutor())
    return [{"scene": room, **o.measured[0]} for room, o in zip(ROOMS, outcomes, strict=True)]


def _time_lines(measured: Sequence[Mapping[str, Any]]) -> list[Comparison]:
    """Times only as ratios: those of the rooms to the first, and of the assignment to the programme."""
    first = measured[0]
    lines = [
        Comparison(
            f"time to solve a frame: {row['scene']} over {ROOMS[0]}",
            f"{TABLE_5_TIME[row['scene']] / TABLE_5_TIME[ROOMS[0]]:.2f} (lp_solve)",
            ", ".join(f"{row[f'{s}_us'] / first[f'{s}_us']:.2f} ({s})" for s in ("mip", "lsap")),
        )
        for row in measured[1:]
    ]
    share = np.mean([row["lsap_us"] / row["mip_us"] for row in measured])
    what = "time of the assignment by that of the same binary programme"
    return [*lines, Comparison(what, "", f"{share:.4f}", "the programme by SCIP in place of lp_solve")]


def _percent(one: Interval) -> str:
    return "" if np.isnan(one.low) else f"{100 * one.low:.1f} to {100 * one.high:.1f}"


def _tables(rows: Sequence[Mapping[str, Any]]) -> str:
    """Every method at every heading, with paired differences to the paper's method on single frames."""
    head = (
        "All methods, %, with 95% intervals by resampling layouts; the difference is paired with the paper's "
        "method (`spatial`) on single frames. SD: over a layout's frames. Shifts are fitted anew for each "
        "heading and view."
    )
    columns = ("room", "turned by SD", "view", "shifts, SD", "method", "frames", "mean", "95%", "SD",
               "all right", "difference (95%)")  # fmt: skip
    lines = [head, "", f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for row in rows:
        mean = Interval(row["mean"], row["low"], row["high"])
        apart = Interval(*(100 * row[f"difference{end}"] for end in ("", "_low", "_high")))
        signed = f"{apart.mean:+.1f}"
        if not np.isnan(apart.low):
            signed += f" ({apart.low:+.1f} to {apart.high:+.1f})"
        if (row["method"], row["mode"]) == ("spatial", ALONE):
            signed = ""
        lines.append(
            f"| {row['scene']} | {row['heading']}° | {row['view']} | {row['shift_sd_m']:.2f} m "
            f"| {row['method']} | {row['mode']} | {100 * mean.mean:.1f} | {_percent(mean)} "
            f"| {100 * row['sd']:.1f} | {row['all_right']:.0%} | {signed} |"
        )
    return "\n".join(lines) + "\n"


def _seen_table(setting: Setting) -> str:
    """The SD over frames by how many chairs a frame shows."""
    same = {"walks": setting.layouts, "rate": frame_rate(setting)}
    outcomes = setting.sweep("real rooms seen", with_more_seen, [{"scene": room} | same for room in ROOMS])
    head = (
        "Why the SDs differ: the paper's method with shifts fitted anew, where a frame shows more chairs. "
        "The paper's SDs are of one layout a room, and 100% is the most frequent accuracy in all three."
    )
    columns = ("room", "what is seen", "chairs a frame", "SD over frames, % (paper)", "layouts with no more",
               "frames all right", "layouts in which 100% is the most frequent")  # fmt: skip
    lines = [head, "", f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for room, outcome in zip(ROOMS, outcomes, strict=True):
        for row in outcome.rows:
            sd, paper = 100 * np.array(row["sd"], dtype=np.float64), TABLE_5[room][1]
            lines.append(
                f"| {room} | {row['seeing']} | {row['detections']:.1f} | {sd.mean():.1f} ({paper:.1f}) "
                f"| {np.mean(sd <= paper):.0%} | {row['all_right']:.0%} "
                f"| {np.mean(np.array(row['most_right'], dtype=np.float64)):.0%} |"
            )
    return "\n".join(lines) + "\n"


def _accuracy_figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Means and their intervals by room and method, at the first heading."""
    figure = new_figure(9.0, 3.4)
    axes = figure.subplots()
    set_up_chart(axes, "Accuracy in the real-world scenes (95% intervals of the mean)", "", "accuracy")
    here = [row for row in rows if row["heading"] == HEADINGS[0] and row["view"] == "camera"]
    kinds = [(method, mode) for method in METHODS for mode in (ALONE, FUSED)]
    colours = ("#b0b0b0", "#7a7a7a", "#9dbce0", "#3b6ea5", "#f0c393", "#c77d2e")
    place = np.arange(len(ROOMS))
    for k, (method, mode) in enumerate(kinds):
        chosen = [row for row in here if (row["method"], row["mode"]) == (method, mode)]
        mean = np.array([row["mean"] for row in chosen])
        ends = np.array([[row["low"], row["high"]] for row in chosen]).T
        error = np.nan_to_num(np.abs(ends - mean))
        bars = axes.bar(place + 0.13 * (k - 2.5), mean, 0.12, color=colours[k], label=f"{method}, {mode}")
        middles = [bar.get_x() + bar.get_width() / 2 for bar in bars]
        axes.errorbar(middles, mean, error, fmt="none", ecolor="#444444", elinewidth=0.8, capsize=2)
    for x, room in enumerate(ROOMS):
        level, label = [TABLE_5[room][0] / 100] * 2, None if x else "paper"
        axes.plot([x - 0.42, x + 0.42], level, "k:", linewidth=1.0, label=label)
    axes.set_xticks(place, list(ROOMS))
    axes.legend(
        frameon=False, fontsize=TEXT_SIZE - 1, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.08)
    )
    return figure
