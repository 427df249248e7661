"""Lifted and tilted objects (section 5.1): a shelf of two levels, where the plane alone says little."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from farm_ar.arrays import FloatArray
from farm_ar.experiments.intervals import Interval, difference_of, interval_of
from farm_ar.experiments.report import TEXT_SIZE, TITLE_SIZE, Comparison, Report, new_figure
from farm_ar.experiments.setting import Setting, piece_rng
from farm_ar.geometry import rotation_matrix
from farm_ar.reid import Identification, Reidentifier, SpatialReid, accuracy
from farm_ar.reid.spatial_space import SpatialSpaceReid
from farm_ar.scenes import Bounds, Camera, Detections, FieldOfView, Layout, Scene, Site, Snapshot, observe
from farm_ar.sweeps import Row

LEVELS_M = (0.40, 1.00)
"""Heights of the two boards, metres."""

BOX = (0.22, 0.34, 0.26)
COLUMNS, SPACING_M = 8, 0.42
SHIFT_M, TURN_DEG, TILT_DEG = (0.15, 0.03), 20.0, 5.0
"""SDs by which boxes are moved along the board and towards its edge, turned, and measured as tilted."""

LIFTED = (0.0, 0.15, 0.3)
"""Shares of the boxes that are put on the other level, near where they stood."""

CAMERA = Camera(np.array([1.68, -3.0]), np.array(0.0), FieldOfView(1.2, 1.2, 10.0))

METHODS = {
    "plane": "the paper's plane (no heights, no tilts)",
    "heights": "`spatial` (heights, where look-alikes are stacked)",
    "space": "`spatial-3d` (heights and tilts)",
}


def shelf() -> Scene:
    """Sixteen equal boxes on two boards, one above the other; of each two, one lies on its side."""
    level, column = np.divmod(np.arange(2 * COLUMNS), COLUMNS)
    lies = (column + level) % 2 == 1
    layout = Layout(
        labels=tuple(f"{'AB'[k]}{c + 1}" for k, c in zip(level, column, strict=True)),
        category=("box",) * (2 * COLUMNS),
        position=np.stack([0.2 + SPACING_M * column, np.full(2 * COLUMNS, 0.3)], axis=1),
        yaw=np.zeros(2 * COLUMNS),
        size=np.tile(BOX, (2 * COLUMNS, 1)),
        elevation=np.array(LEVELS_M)[level],
        tilt=np.stack([np.zeros(2 * COLUMNS), np.where(lies, np.pi / 2, 0.0)], axis=1),
    )
    bounds = Bounds.rectangle(2 * 0.2 + SPACING_M * (COLUMNS - 1), 0.6)
    return Scene("shelf", None, layout, (Site("S1", 1.68, 0.3),), bounds=bounds)


def rearranged(scene: Scene, lifted: float, rng: np.random.Generator) -> Layout:
    """The boxes shifted and turned, some of them put on the other level."""
    layout, n = scene.layout, len(scene.layout)
    assert layout.tilt is not None
    other = np.where(layout.elevation == LEVELS_M[0], LEVELS_M[1], LEVELS_M[0])
    return replace(
        layout,
        position=layout.position + rng.normal(0, SHIFT_M, (n, 2)),
        yaw=rng.normal(0, np.deg2rad(TURN_DEG), n),
        elevation=np.where(rng.random(n) < lifted, other, layout.elevation),
        tilt=layout.tilt + rng.normal(0, np.deg2rad(TILT_DEG), (n, 2)),
    )


def answers(scene: Scene, snapshot: Snapshot) -> dict[str, Identification]:
    """The answer of each of `METHODS`."""
    seen = snapshot.detections
    flat = Detections(seen.category, seen.position, seen.yaw, seen.size)
    on_the_floor = replace(scene.layout, elevation=np.zeros(len(scene.layout)), tilt=None)
    plane: Reidentifier = SpatialReid(scene.knowing(on_the_floor))
    return {
        "plane": plane.identify(replace(snapshot, detections=flat)),
        "heights": SpatialReid(scene).identify(snapshot),
        "space": SpatialSpaceReid(scene).identify(snapshot),
    }


def shelf_experiment(setting: Setting) -> Report:
    """Accuracy on the shelf by what is known of heights and tilts. Paper, section 5.1."""
    outcomes = setting.sweep(
        "shelf", on_shelves, [{"lifted": share, "layouts": 10 * setting.layouts} for share in LIFTED]
    )
    rng = setting.rng(71, 90)
    rows: list[Row] = []
    comparisons = []
    for share, outcome in zip(LIFTED, outcomes, strict=True):
        found = {name: np.array(outcome.rows[0][name]) for name in METHODS}
        for name, what in METHODS.items():
            mean, gain = interval_of(found[name], rng), difference_of(found[name], found["plane"], rng)
            rows.append({"lifted": share, "method": name, **_ends("accuracy", mean), **_ends("gain", gain)})
            comparisons.append(
                Comparison(
                    f"accuracy, {share:.0%} lifted or lowered: {what}",
                    "",
                    f"{mean.mean:.3f}",
                    "" if name == "plane" else f"over the plane, paired: {gain.signed}",
                    mean.ends,
                )
            )
    return Report(
        "shelf",
        f"A shelf of two levels, {10 * setting.layouts} rearrangements",
        rows,
        comparisons,
        _figure(setting),
        note=f"{2 * COLUMNS} equal boxes, one above the other, every second one on its side; shifted along "
        f"the board by an SD of {SHIFT_M[0]:.2f} m and turned by {TURN_DEG:.0f}°. The paper assumes upright "
        "objects that are not lifted, and gives no number.",
    )


def on_shelves(seed: int, lifted: float, layouts: int) -> Row:
    """A unit of the shelf: (layouts,) accuracies of each method."""
    scene, rng = shelf(), piece_rng(seed, 71, round(100 * lifted))
    found: dict[str, list[float]] = {name: [] for name in METHODS}
    for _ in range(layouts):
        snapshot, truth = observe(rearranged(scene, lifted, rng), CAMERA)
        for name, answer in answers(scene, snapshot).items():
            found[name].append(accuracy(answer, truth))
    return {name: np.array(values) for name, values in found.items()}


def _ends(name: str, one: Interval) -> dict[str, float]:
    return {name: one.mean, f"{name}_low": one.low, f"{name}_high": one.high}


def _figure(setting: Setting) -> Figure:
    """The shelf from in front: as known, and as the plane and space answer to one rearrangement."""
    scene = shelf()
    now = rearranged(scene, LIFTED[2], setting.rng(71, 91))
    snapshot, truth = observe(now, CAMERA)
    found = answers(scene, snapshot)
    figure = new_figure(9.0, 7.2)
    known, plane, space = figure.subplots(3, 1)
    _draw(known, scene.layout, scene.layout.labels, scene.layout.labels)
    known.set_title("as the headset knows it", fontsize=TITLE_SIZE)
    order = [scene.layout.labels.index(str(label)) for label in truth]
    for axes, name, what in (
        (plane, "plane", "by the plane alone"),
        (space, "space", "by heights and tilts"),
    ):
        right = accuracy(found[name], truth)
        _draw(axes, now.subset(order), found[name].labels, truth)
        axes.set_title(f"rearranged, identified {what}: {right:.0%} right", fontsize=TITLE_SIZE)
    legend = "Green: the right label. Red: a wrong one, with the true one in brackets."
    figure.supxlabel(legend, fontsize=TEXT_SIZE)
    return figure


def _draw(axes: Axes, layout: Layout, given: Sequence[str | None], truth: Sequence[str | None]) -> None:
    tilt = np.zeros((len(layout), 2)) if layout.tilt is None else layout.tilt
    for i, (label, true) in enumerate(zip(given, truth, strict=True)):
        corners = _outline(layout.size[i], rotation_matrix(layout.yaw[i], tilt[i]))
        middle = np.array([layout.position[i, 0], layout.elevation[i]])
        colour = "#4f9a5f" if label == true else "#c0392b"
        axes.add_patch(
            Polygon(corners + middle, facecolor=colour, edgecolor="#333333", alpha=0.75, linewidth=0.8)
        )
        text = str(label) if label == true else f"{label}\n[{true}]"
        axes.text(middle[0], middle[1] + 0.12, text, ha="center", va="center", fontsize=TEXT_SIZE - 1)
    for height in LEVELS_M:
        axes.axhline(height, color="#8a6d4b", linewidth=2.0, zorder=0)
    axes.set(xlim=(-0.2, 3.55), ylim=(0.3, 1.45), aspect="equal")
    axes.set_axis_off()


def _outline(size: FloatArray, turn: FloatArray) -> FloatArray:
    """(4, 2) x and y of a box's face, standing on 0 however it is turned."""
    half = np.array([[-1, 0], [1, 0], [1, 2], [-1, 2]]) * size[:2] / 2
    seen = np.column_stack([half, np.zeros(4)]) @ turn.T
    flat: FloatArray = seen[:, :2] - [seen[:, 0].mean(), seen[:, 1].min()]
    return flat
