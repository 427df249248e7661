"""The real-world protocol of section 4.2, simulated: walks through rearranged rooms, and their accuracy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.experiments.published import TABLE_4, TABLE_5
from farm_ar.experiments.setting import Setting, mean_and_sd, piece_rng
from farm_ar.experiments.walks import DETECTOR, VIEWS, Walk, Walked
from farm_ar.reid import REIDENTIFIERS, Reidentifier, SpatialOptions, SpatialReid, batch_accuracy
from farm_ar.reid.fusion import track_all
from farm_ar.scenes import LayoutNoise, Scene, SnapshotBatch, builtin_scene
from farm_ar.sweeps import Outcome, Row

ROOMS = tuple(TABLE_4)
HEADINGS = (30, 15, 60)
"""SDs by which chairs are turned, degrees: the first is what the paper is compared at."""

METHODS = ("spatial", "likelihood", "adaptive")
"""The paper's method, and ours. All chairs look alike, so that categories give no information."""

ALONE, FUSED = "single frame", "fused over the walk"
SHIFTS_M, HALVINGS = (0.02, 3.0), 9
"""Between which SDs that of the shifts is sought, and by how many halvings."""

TIMED_FRAMES = 40

SEEING: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "as in the table": {},
        "chairs hide nothing": {"detector": replace(DETECTOR, occlusion=False)},
        "looking past tables nearer than 3 m": {"nearest_m": 3.0},
        "both": {"detector": replace(DETECTOR, occlusion=False), "nearest_m": 3.0},
        "looking at the middle of the room": {"look": "middle"},
        "the same, chairs hide nothing": {
            "look": "middle",
            "detector": replace(DETECTOR, occlusion=False),
        },
    }
)
"""Ways of seeing more: the paper counts chairs whose boxes are wholly in view, and names no occlusion, nor
where the person looked; its Figs. 10 and 12 show a whole room in one view, or in two."""


SIMULATED = (
    "Simulated: the paper's scans, motions and recordings are not public. The rooms are rebuilt from Table "
    "4, with chairs alone as objects; a walk passes all tables once, looking at the nearest one ahead."
)


class Case(NamedTuple):
    """One room, with the SD by which chairs are turned in degrees, and what the headset sees."""

    scene: str
    heading: int
    view: str = "camera"


def cases(quick: bool) -> list[Case]:
    """What is walked: all rooms at each heading, and with the display's view at the first."""
    headings = HEADINGS[:1] if quick else HEADINGS
    every = [Case(room, heading) for heading in headings for room in ROOMS]
    return every if quick else every + [Case(room, HEADINGS[0], "display") for room in ROOMS]


class Walks(NamedTuple):
    """What the walks of one case gave.

    Args:
        shift_m: SD of the chairs' shifts, fitted.
        detections: mean number of a frame in which there are any.
        seen: share of the frames in which there are any.
        accuracy: (walks, P) of each frame by method and by `ALONE` or `FUSED`; NaN where nothing was seen.
    """

    shift_m: float
    detections: float
    seen: float
    accuracy: Mapping[tuple[str, str], FloatArray]


def walk_all(setting: Setting, every: Sequence[Case]) -> dict[Case, Walks]:
    """Cases with what their walks gave; those of a run before are taken from the setting's store."""
    same = {"walks": setting.layouts, "rate": frame_rate(setting)}
    outcomes = setting.sweep("real rooms", walked, [case._asdict() | same for case in every])
    found = {}
    for case, outcome in zip(every, outcomes, strict=True):
        first: Mapping[str, Any] = outcome.rows[0]
        accuracy = {
            (str(row["method"]), str(row["mode"])): np.array(row["accuracy"], dtype=np.float64)
            for row in outcome.rows
        }
        found[case] = Walks(first["shift_m"], first["detections"], first["seen"], accuracy)
    return found


def walked(seed: int, scene: str, heading: int, view: str, walks: int, rate: float) -> list[Row]:
    """A unit of Table 5: fits the shifts of a room, and identifies every frame by each method."""
    room, case = builtin_scene(scene), Case(scene, heading, view)

    def with_shift(shift_m: float) -> Walked:
        return walks_of(seed, case, shift_m, walks, rate)

    shift = fitted_shift(room, lambda shift_m: with_shift(shift_m).snapshots, TABLE_5[scene][0] / 100)
    batch = with_shift(shift).snapshots
    some = batch.count > 0
    about: dict[str, Any] = {
        "shift_m": shift,
        "detections": float(batch.count[some].mean()) if some.any() else 0.0,
        "seen": float(some.mean()),
    }
    rows: list[Row] = []
    reids = [REIDENTIFIERS[name](room) for name in METHODS]
    for name, reid, together in zip(METHODS, reids, fused(reids, batch, walks), strict=True):
        for mode, accuracy in ((ALONE, alone(reid, batch)), (FUSED, together)):
            rows.append(
                {**about, "method": name, "mode": mode, "accuracy": accuracy.reshape(walks, -1).round(6)}
            )
    return rows


def frame_rate(setting: Setting) -> float:
    """Frames a second that are identified."""
    return 0.5 if setting.quick else 2.0


def walks_of(seed: int, case: Case, shift_m: float, walks: int, rate: float) -> Walked:
    """The walks of one case; with the same random numbers whatever the SD of the shifts, metres."""
    walk = replace(Walk(), frames_per_second=rate, fov=VIEWS[case.view])
    rng = piece_rng(seed, 55, ROOMS.index(case.scene), case.heading, list(VIEWS).index(case.view))
    return walk.through(builtin_scene(case.scene), LayoutNoise.of(shift_m, case.heading), walks, rng)


def fitted_shift(room: Scene, seen: Any, mean: float) -> float:
    """The SD of shifts, metres, at which the paper's method has a mean accuracy, by bisection.

    Args:
        room: the scene.
        seen: gives the snapshots for an SD; the same random numbers each time, so that they change steadily.
        mean: what is wanted. Where no SD in `SHIFTS_M` gives it, the nearer end is the answer.
    """
    reid = SpatialReid(room)
    low, high = np.log(SHIFTS_M)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        above = mean_and_sd(alone(reid, seen(float(np.exp(middle)))))[0] > mean
        low, high = (middle, high) if above else (low, middle)
    return float(np.exp((low + high) / 2))


def alone(reid: Reidentifier, batch: SnapshotBatch) -> FloatArray:
    """(B,) accuracy of each frame identified by itself; NaN where nothing is seen."""
    assert batch.truth is not None
    return batch_accuracy(reid.identify_many(batch).label, batch.truth, batch.count)


def fused(reids: Sequence[Reidentifier], batch: SnapshotBatch, walks: int) -> FloatArray:
    """(R, B) accuracy of each frame by R methods, in the light of its whole walk."""
    names = reids[0].scene.layout.labels
    accuracy = np.full((len(reids), len(batch)), np.nan)
    for frames in np.split(np.arange(len(batch)), walks):
        some = frames[batch.count[frames] > 0]
        if not len(some):
            continue
        truths = [batch.true_labels(int(b), names) for b in some]
        for r, found in enumerate(track_all(reids, [batch.snapshot(int(b)) for b in some])):
            for b, answer, truth in zip(some, found.identifications, truths, strict=True):
                accuracy[r, b] = np.mean([g == t for g, t in zip(answer.labels, truth, strict=True)])
    return accuracy


def with_more_seen(seed: int, scene: str, walks: int, rate: float) -> list[Row]:
    """A unit of Table 5's SDs: what the paper's method does with more chairs a frame, shifts fitted anew.

    Returns:
        For each way of seeing in `SEEING`: chairs a frame; (walks,) SDs over the frames of each layout; the
        share of all frames that are all right; (walks,) whether 100% is the most frequent of a layout.
    """
    room, reid = builtin_scene(scene), SpatialReid(builtin_scene(scene))
    rows: list[Row] = []
    for name, changed in SEEING.items():
        walk = replace(Walk(), frames_per_second=rate, **changed)

        def seen(shift_m: float, walk: Walk = walk) -> SnapshotBatch:
            rng = piece_rng(seed, 55, ROOMS.index(scene), HEADINGS[0], 0)
            return walk.through(room, LayoutNoise.of(shift_m, HEADINGS[0]), walks, rng).snapshots

        batch = seen(fitted_shift(room, seen, TABLE_5[scene][0] / 100))
        accuracy = alone(reid, batch).reshape(walks, -1)
        rows.append(
            {
                "seeing": name,
                "detections": float(batch.count[batch.count > 0].mean()),
                "sd": sds_of_layouts(accuracy),
                "all_right": float(shares_of(accuracy)[-1]),
                "most_right": np.array([int(shares_of(one).argmax() == 10) for one in accuracy]),
            }
        )
    return rows


def sds_of_layouts(accuracy: FloatArray) -> FloatArray:
    """(W,) SDs over the frames of each of W walks (W, P); the paper's is of one walk through one layout."""
    return np.asarray(np.nanstd(accuracy, axis=1))


def shares_of(accuracy: FloatArray) -> FloatArray:
    """(11,) shares of the frames whose accuracy is nearest to 0%, 10%, ... 100%."""
    known = accuracy[np.isfinite(accuracy)]
    return np.bincount(np.rint(10 * known).astype(int), minlength=11) / max(1, len(known))


def with_one_shift(seed: int, scene: str, shift_m: float, walks: int) -> Row:
    """A unit of Table 5's order of the rooms: (walks,) mean accuracies of the paper's method by layout."""
    room = builtin_scene(scene)
    rng = piece_rng(seed, 56, ROOMS.index(scene))
    batch = Walk().through(room, LayoutNoise.of(shift_m, HEADINGS[0]), walks, rng).snapshots
    accuracy = alone(SpatialReid(room), batch)
    return {"mean": mean_and_sd(accuracy)[0], "means": np.nanmean(accuracy.reshape(walks, -1), axis=1)}


def solve_times(seed: int, scene: str, shift_m: float, frames: int) -> Outcome:
    """A unit of Table 5's times: mean microseconds of a frame by each solver."""
    room = builtin_scene(scene)
    walk = replace(Walk(), frames_per_second=1.0)
    rng = piece_rng(seed, 57, ROOMS.index(scene))
    batch = walk.through(room, LayoutNoise.of(shift_m, HEADINGS[0]), 1, rng).snapshots
    seen = [batch.snapshot(int(b)) for b in np.flatnonzero(batch.count)[:frames]]
    measured = {}
    for solver, times in (("mip", 1), ("lsap", 5)):
        reid = SpatialReid(room, SpatialOptions(solver=solver))
        best = [min(reid.identify(one).solve_time for _ in range(times)) for one in seen]
        measured[f"{solver}_us"] = float(np.mean(best)) * 1e6
    return Outcome([{"frames": len(seen)}], [measured])
