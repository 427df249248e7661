"""How often the check before identifying warns wrongly, and how often it finds what is wrong.

    FARM_AR_PAPER_SCENES=... python benchmarks/plausibility.py [--layouts 40] [--seed 0]

False alarms: the built-in scenes and, where the variable names their folder, the authors', under the paper's
16 levels of noise, `--layouts` snapshots a level; the farm's metres scaled with its table. True alarms: the
same scenes and six rooms unlike them (a toy on a table, a warehouse, centimetres, far origins, no bounds),
things left where they were, or moved by T(0, 0.1 m), R(0, 15 degrees) in a room of 7 m, and each fault in
turn; in snapshots of at least 3 detections, for headings in radians with two that are not 0.
"""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.geometry.angles import wrap
from farm_ar.reid.plausibility import check, set_aside
from farm_ar.scenes import (
    BUILTIN,
    Bounds,
    Camera,
    Detections,
    FieldOfView,
    Layout,
    LayoutNoise,
    Scene,
    Snapshot,
    builtin_scene,
    load_scene,
    observe_many,
)

LEVELS = [(metres, degrees) for metres in (0.1, 0.3, 0.5, 1.0) for degrees in (15.0, 30.0, 60.0, 120.0)]
FEWEST = 3
USUAL_DIAGONAL = 7.0


def papers() -> list[Scene]:
    """The built-in scenes and the authors'."""
    folder = os.environ.get("FARM_AR_PAPER_SCENES")
    theirs = [load_scene(path) for path in sorted(Path(folder).glob("*.json"))] if folder else []
    return [builtin_scene(name) for name in BUILTIN] + theirs


def strangers() -> list[Scene]:
    """Rooms unlike the paper's."""
    made = []
    for seed, (scale, origin, number, bounds) in enumerate(
        [
            (0.02, (0.3, -0.1), 12, True),
            (20.0, (0.0, 0.0), 40, True),
            (100.0, (0.0, 0.0), 14, True),
            (1.0, (-420.0, 977.0), 14, True),
            (1.0, (-3.0, -2.5), 18, True),
            (3.0, (15.0, 40.0), 25, False),
        ]
    ):
        rng = np.random.default_rng(seed)
        position = np.zeros((0, 2))
        while len(position) < number:
            one = rng.uniform((0.3, 0.3), (5.7, 4.7))
            if not len(position) or np.linalg.norm(position - one, axis=1).min() > 2.5 / np.sqrt(number):
                position = np.vstack([position, one])
        category = tuple("rack" if k % 3 == 0 else "crate" for k in range(number))
        size = np.array([(0.6, 0.9, 0.3) if one == "rack" else (0.3, 0.3, 0.4) for one in category])
        layout = Layout(
            tuple(f"{name} {k}" for k, name in enumerate(category)),
            category,
            scale * position + origin,
            rng.uniform(-np.pi, np.pi, number),
            scale * size,
        )
        place = Bounds.rectangle(6 * scale, 5 * scale, origin) if bounds else None
        fov = FieldOfView(0.7, 0.7, 4.5 * scale)
        made.append(Scene(f"stranger {seed}", None, layout, fov=fov, bounds=place))
    return made


def cameras(scene: Scene, number: int, rng: np.random.Generator) -> Camera:
    """Cameras on the scene's path, or about it, looking at its middle."""
    if scene.camera_path is not None:
        path = scene.camera_path.cameras(200, scene.fov)
        index = rng.integers(200, size=number)
        return Camera(path.position[index], path.yaw[index], scene.fov)
    points = scene.layout.position
    middle, reach = points.mean(axis=0), np.ptp(points, axis=0)
    angle = rng.uniform(-np.pi, np.pi, number)
    away = middle - 0.65 * reach * np.stack([np.sin(angle), np.cos(angle)], axis=1)
    towards = middle + rng.normal(0, 0.1, (number, 2)) * reach - away
    return Camera(away, np.arctan2(towards[:, 0], towards[:, 1]), scene.fov)


def snapshots(
    scene: Scene, level: tuple[float, float], number: int, rng: np.random.Generator
) -> Iterator[Snapshot]:
    """Snapshots of a scene under a level of noise, which outside the usual rooms is relative to the size."""
    usual = scene.room is not None and scene.diagonal > 5
    scale = 1.0 if usual else scene.diagonal / USUAL_DIAGONAL
    noise = LayoutNoise.of(level[0] * scale, level[1])
    layout = scene.layout
    if scene.room is not None:
        moved = noise.disturb(layout, scene.room, rng, (number,))
    else:
        shape = (number, len(layout))
        shift, turn = rng.normal(0, level[0] * scale, (*shape, 2)), rng.normal(0, np.deg2rad(level[1]), shape)
        moved = layout.placed(layout.position + shift, layout.yaw + turn)
    batch = observe_many(moved, cameras(scene, number, rng))
    yield from (batch.snapshot(b) for b in range(len(batch)))


CAUSES, EFFECTS = {"mirrored", "units", "frame"}, {"view", "camera", "bounds"}
"""Faults that are found if they are named and nothing is that only follows from them."""

Change = Callable[[Snapshot, np.random.Generator], Snapshot]


def of_detections(change: Callable[[Detections, np.random.Generator], dict[str, Any]]) -> Change:
    """A fault of the detections only."""
    return lambda one, rng: replace(one, detections=replace(one.detections, **change(one.detections, rng)))


def mirrored(seen: Detections, rng: np.random.Generator) -> dict[str, Any]:
    """Detections in OpenXR's frame, or with x the other way."""
    sides = [1, -1] if rng.random() < 0.5 else [-1, 1]
    return {"position": seen.position * sides, "yaw": -seen.yaw}


def moved_frame(seen: Detections, rng: np.random.Generator) -> dict[str, Any]:
    """Detections in a frame of their own."""
    turn = rng.uniform(0.3, 2 * np.pi - 0.3)
    sine, cosine, reach = np.sin(turn), np.cos(turn), 2 * np.ptp(seen.position)
    position = seen.position @ np.array([[cosine, -sine], [sine, cosine]]) + rng.normal(0, reach, 2)
    return {"position": position, "yaw": seen.yaw + turn}


def lost(seen: Detections, rng: np.random.Generator) -> dict[str, Any]:
    """Two or more detections at one pose."""
    which = rng.permutation(len(seen))[: max(2, len(seen) // 2)]
    position, yaw = seen.position.copy(), seen.yaw.copy()
    position[which], yaw[which] = (0.0, 0.0) if rng.random() < 0.5 else position[which[0]], yaw[which[0]]
    return {"position": position, "yaw": yaw}


def one_strays(seen: Detections, rng: np.random.Generator) -> dict[str, Any]:
    """One detection far away."""
    position = seen.position.copy()
    position[0] += 10 * np.ptp(seen.position, axis=0).max() * np.array([1.0, 1.0])
    return {"position": position}


def turned_camera(one: Snapshot, rng: np.random.Generator) -> Snapshot:
    """The camera turned around."""
    return replace(one, camera=replace(one.camera, yaw=one.camera.yaw + np.pi))


UNITS = (1e-3, 1e-2, 0.1, 0.3048, 1 / 0.3048, 10.0, 100.0, 1000.0)
FAULTS: dict[str, tuple[str, Change]] = {
    "mirrored": ("mirrored", of_detections(mirrored)),
    "positions 10 to 1000 times off": (
        "units",
        of_detections(lambda seen, rng: {"position": seen.position * rng.choice((*UNITS[:3], *UNITS[5:]))}),
    ),
    "positions in feet": ("units", of_detections(lambda seen, rng: {"position": seen.position / 0.3048})),
    "sizes in another unit": (
        "sizes",
        of_detections(lambda seen, rng: {"size": seen.size * rng.choice(UNITS)}),
    ),
    "radians for degrees": (
        "radians",
        of_detections(lambda seen, rng: {"yaw": np.deg2rad(wrap(seen.yaw))}),
    ),
    "headings counter-clockwise": (
        "headings",
        of_detections(lambda seen, rng: {"yaw": -seen.yaw}),
    ),
    "frame moved as a whole": ("frame", of_detections(moved_frame)),
    "one pose repeated": ("repeated", of_detections(lost)),
    "camera turned around": ("camera", turned_camera),
    "one outside the view": ("view", of_detections(one_strays)),
    "one outside the bounds": ("bounds", of_detections(one_strays)),
}


def false_alarms(layouts: int, rng: np.random.Generator) -> None:
    """Print how many snapshots there were, and how many were warned of or lost a detection."""
    kinds: Counter[str] = Counter()
    number, seconds = 0, 0.0
    for scene in papers():
        for level in LEVELS:
            for one in snapshots(scene, level, layouts, rng):
                begin = time.perf_counter()
                found, aside = check(scene, one), set_aside(scene, one)
                seconds += time.perf_counter() - begin
                number += 1
                kinds["any warning"] += bool(found)
                kinds["a detection set aside"] += any(aside)
                kinds.update(one.kind for one in found)
    print(f"{number} snapshots as they should be, {1e3 * seconds / number:.1f} ms each:")
    for kind in sorted(kinds, key=lambda kind: (" " not in kind, kind)):
        print(f"  {kind:40} {kinds[kind]:6d}  {kinds[kind] / number:.5f}")


def true_alarms(layouts: int, rng: np.random.Generator) -> None:
    """Print how often each fault is found."""
    groups = {"the paper's": papers(), "strangers": strangers()}
    columns = [(group, level) for group in groups for level in ((0.0, 0.0), (0.1, 15.0))]
    head = "".join(f"{f'{group}, T {level[0]:g} R {level[1]:g}':>26}" for group, level in columns)
    print(f"\nShare of faults found, and of how many snapshots\n{'':34}{head}")
    found: dict[tuple[str, int], list[bool]] = {}
    for column, (group, level) in enumerate(columns):
        for scene in groups[group]:
            for one in snapshots(scene, level, layouts, rng):
                if len(one.detections) < FEWEST:
                    continue
                for fault, (kind, change) in FAULTS.items():
                    headings = np.count_nonzero(np.abs(wrap(one.detections.yaw)) > 0.01)
                    if (kind == "bounds" and scene.bounds is None) or (kind == "radians" and headings < 2):
                        continue
                    kinds = {finding.kind for finding in check(scene, change(one, rng))}
                    named = kind in kinds and not (kind in CAUSES and kinds & EFFECTS)
                    found.setdefault((fault, column), []).append(named)
    for fault in FAULTS:
        cells = [found[fault, column] for column in range(len(columns))]
        print(f"{fault:34}" + "".join(f"{f'{np.mean(cell):.3f} of {len(cell)}':>26}" for cell in cells))


def main() -> None:
    """Measure and print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--layouts", type=int, default=40)
    options.add_argument("--seed", type=int, default=0)
    chosen = options.parse_args()
    false_alarms(chosen.layouts, np.random.default_rng(chosen.seed))
    true_alarms(chosen.layouts, np.random.default_rng(chosen.seed + 1))


if __name__ == "__main__":
    main()
