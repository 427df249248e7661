"""Frames of the headset in the three real rooms, with the labels given: Figs. 13, 24 and 25, simulated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from farm_ar.arrays import FloatArray
from farm_ar.experiments.real_rooms import (
    HEADINGS,
    ROOMS,
    SIMULATED,
    Case,
    cases,
    frame_rate,
    walk_all,
    walks_of,
)
from farm_ar.experiments.report import TEXT_SIZE, TITLE_SIZE, Comparison, Report, new_figure
from farm_ar.experiments.setting import Setting
from farm_ar.experiments.walks import Walked
from farm_ar.reid import SpatialReid
from farm_ar.rendering import Instance, Intrinsics, Renderer, View
from farm_ar.rendering.interior import chair, shell, table
from farm_ar.scenes import Layout, Scene, builtin_scene
from farm_ar.sweeps import Row

PIXELS = (640, 360)
TABLES = {"pantry": ((1.9, 0.7), (1.1, 0.7)), "cafeteria": ((0.6, 0.6),) * 5, "classroom": ((0.9, 0.7),) * 7}
"""Widths and depths of the tables that the frames show, metres; they hide nothing from the detector."""

LABEL_PIXELS = (66.0, 19.0)
"""Width and height of a label in a frame, pixels."""

RIGHT, WRONG = "#1f8a3b", "#c0392b"


class Frame(NamedTuple):
    """One frame of one walk: its number, and the true and the given label of each detection."""

    number: int
    true: tuple[str | None, ...]
    given: tuple[str | None, ...]


def fig13(setting: Setting) -> Report:
    """Frames with their labels, `a → b`: a is the true one, b the one given. Paper, Figs. 13, 24 and 25."""
    found = walk_all(setting, cases(quick=True))
    figure = new_figure(10.6, 9.2)
    rows: list[Row] = []
    comparisons = []
    for room, panels in zip(ROOMS, figure.subplots(3, 2), strict=True):
        case, scene = Case(room, HEADINGS[0]), builtin_scene(room)
        walked = walks_of(setting.seed, case, found[case].shift_m, setting.layouts, frame_rate(setting))
        frames = identified(scene, walked)
        for axes, frame in zip(panels, chosen(frames), strict=True):
            _draw(axes, scene, walked, frame)
            right = sum(a == b for a, b in zip(frame.true, frame.given, strict=True))
            axes.set_title(f"{room}: {right} of {len(frame.true)} right", fontsize=TITLE_SIZE)
            rows += [
                {"scene": room, "frame": frame.number, "true": a, "given": b, "right": int(a == b)}
                for a, b in zip(frame.true, frame.given, strict=True)
            ]
        both, seen = changing(frames)
        comparisons.append(
            Comparison(
                f"{room}: chairs right in one frame of a walk and wrong in another",
                "chair 1 of 10 (Fig. 13b, c)" if room == "pantry" else "",
                f"{both} of {seen}",
            )
        )
    legend = "a → b: the true label and the one given. Green: right. Red: wrong. Without: not wholly in view."
    figure.supxlabel(legend, fontsize=TEXT_SIZE)
    note = f"{SIMULATED} Drawn from where the person stood. The other two rooms are Figs. 24 and 25."
    title = "Fig. 13: frames of the headset with their labels"
    return Report("fig13", title, rows, comparisons, figure, note=note)


def identified(scene: Scene, walked: Walked) -> list[Frame]:
    """The frames of the first walk in which anything is detected, by the paper's method."""
    reid, batch, names = SpatialReid(scene), walked.snapshots, scene.layout.labels
    frames = range(walked.cameras.batch_shape[1])
    return [
        Frame(b, batch.true_labels(b, names), reid.identify(batch.snapshot(b)).labels)
        for b in frames
        if batch.count[b]
    ]


def chosen(frames: list[Frame]) -> tuple[Frame, Frame]:
    """The frame with most labels of those all right, and of those with a wrong one, where there are any."""
    by_count = sorted(frames, key=lambda frame: -len(frame.true))
    all_right = next((frame for frame in by_count if frame.true == frame.given), by_count[0])
    some_wrong = next((frame for frame in by_count if frame.true != frame.given), by_count[-1])
    return all_right, some_wrong


def changing(frames: list[Frame]) -> tuple[int, int]:
    """How many objects are right in one frame and wrong in another, and how many are seen at all."""
    outcomes: dict[str | None, set[bool]] = {}
    for frame in frames:
        for a, b in zip(frame.true, frame.given, strict=True):
            outcomes.setdefault(a, set()).add(a == b)
    return sum(len(found) == 2 for found in outcomes.values()), len(outcomes)


def _draw(axes: Axes, scene: Scene, walked: Walked, frame: Frame) -> None:
    camera, layout = walked.cameras.at((0, frame.number)), _first(walked.layouts)
    lens = Intrinsics.of_view(*PIXELS, camera.fov.left + camera.fov.right)
    view = View.of(camera, lens)
    axes.imshow(Renderer(_things(scene, layout)).draw(view).rgb)
    index = [layout.index(str(label)) for label in frame.true]
    tops = np.insert(layout.position[index], 1, layout.size[index, 1] + 0.06, axis=1)
    for a, b, (x, y) in zip(frame.true, frame.given, _apart(view.pixels(tops)), strict=True):
        face = RIGHT if a == b else WRONG
        box = {"facecolor": face, "edgecolor": "none", "pad": 1.2}
        text = axes.text(x, y, f"{a} → {b}", fontsize=TEXT_SIZE - 0.5, color="white", bbox=box)
        text.set(ha="center", va="bottom")
    axes.set(xlim=(0, PIXELS[0]), ylim=(PIXELS[1], 0))
    axes.set_axis_off()


def _apart(spots: FloatArray) -> FloatArray:
    """(N, 2) the same spots in pixels, those moved up on which another label stands already, lowest first."""
    placed: list[FloatArray] = []
    moved = spots.copy()
    for i in np.argsort(-spots[:, 1], kind="stable"):
        while any((np.abs(moved[i] - other) < LABEL_PIXELS).all() for other in placed):
            moved[i, 1] -= 2.0
        placed.append(moved[i])
    return moved


def _first(layouts: Layout) -> Layout:
    return layouts.placed(layouts.position[0].copy(), layouts.yaw[0].copy())


def _things(scene: Scene, layout: Layout) -> list[Instance]:
    """The room, its tables at the sites, and the chairs where they stand."""
    width, depth = scene.size
    things = [Instance(shell(width, depth), np.zeros(3), casts_shadow=False)]
    for site, (w, d) in zip(scene.sites, TABLES[scene.name], strict=True):
        things.append(Instance(table(w, 0.74, d), np.array([site.x, 0.0, site.z])))
    for (x, z), yaw in zip(layout.position, layout.yaw, strict=True):
        things.append(Instance(chair(), np.array([x, 0.0, z]), float(yaw)))
    return things
