"""The frozen suite `benchmark-1`: how it was made, where it is kept, and the hash that it has."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from importlib import resources
from pathlib import Path

import numpy as np

from farm_ar.benchmark.suite import Suite, SuiteRow, made_examples, row_of, unpack
from farm_ar.benchmark.worlds import ROWS
from farm_ar.benchmark.worlds.base import Example
from farm_ar.errors import SnapshotError
from farm_ar.experiments.setting import SCENES, load_scenes, path_cameras
from farm_ar.scenes import LayoutNoise, Scene, Snapshot, observe_many

NAME = "benchmark-1"
DIGEST = "3090bfd1005d2475a6399972deaa0e36"
"""The hash of the frozen suite."""

SEED, WORLD_SNAPSHOTS, PAPER_SNAPSHOTS = 1, 40, 80
QUICK = 6
"""Snapshots of each row in a quick run."""

TRANSLATIONS, ROTATIONS = (0.1, 0.3, 0.5, 1.0), (15, 30, 60, 120)
"""The paper's noise: SD in metres and in degrees, in all combinations."""


@lru_cache(maxsize=1)
def frozen_suite() -> Suite:
    """The frozen suite, read from the package.

    It is kept, not made anew: simulations of many steps are chaotic, so that the last bit of another
    machine's sine or exponential would give other snapshots, and NumPy may change what a seed gives.

    Raises:
        SnapshotError: the package's file is not the one that was frozen.
    """
    file = resources.files("farm_ar.benchmark") / f"{NAME}.jsonl.xz"
    suite = unpack(NAME, file.read_bytes())
    if suite.digest != DIGEST:
        raise SnapshotError("digest", f"must be {DIGEST}, that of {NAME}", suite.digest, file.name)
    return suite


def made_suite(world_snapshots: int = WORLD_SNAPSHOTS, paper_snapshots: int = PAPER_SNAPSHOTS) -> Suite:
    """The suite made anew: the paper's built-in scenes, then the worlds."""
    paper = paper_rows("paper", load_scenes(None), paper_snapshots)
    worlds = (
        row_of(row.name, row.about, row.all_in_view, made_examples(row, SEED, world_snapshots))
        for row in ROWS.values()
    )
    return Suite(NAME, (*paper, *worlds))


def authors_rows(folder: Path) -> tuple[SuiteRow, ...]:
    """Rows of the paper's authors' own layouts, which do not come with the package.

    They are made anew from the files of a folder, and are no part of the frozen suite.

    Args:
        folder: with `L1.json` to `H2.json`.

    Raises:
        SceneError: a file is missing or cannot be used.
    """
    return paper_rows("authors", load_scenes(folder), PAPER_SNAPSHOTS)


def paper_rows(prefix: str, scenes: Mapping[str, Scene], count: int) -> tuple[SuiteRow, ...]:
    """A row for each scene under the paper's noise, its cells in turn, seen from its camera path.

    A snapshot is drawn again until it has at least two detections.
    """
    rows = []
    cells = [(t, r) for t in TRANSLATIONS for r in ROTATIONS]
    for number, name in enumerate(SCENES):
        scene = scenes[name]
        examples: list[Example] = []
        rng = np.random.default_rng(np.random.SeedSequence(SEED, spawn_key=(number, 1000)))
        while len(examples) < count:
            noise = LayoutNoise.of(*cells[len(examples) % len(cells)])
            examples.append(_seen(scene, noise, rng))
        about = f"scene {name} under the paper's noise, seen from its camera path"
        rows.append(row_of(f"{prefix}-{name}", about, False, examples))
    return tuple(rows)


def _seen(scene: Scene, noise: LayoutNoise, rng: np.random.Generator) -> Example:
    """A snapshot of a noisy layout from somewhere on the path, with at least two detections."""
    cameras = path_cameras(scene)
    while True:
        noisy = noise.disturb(scene.layout, scene.size, rng)
        batch = observe_many(noisy, cameras)
        enough = np.flatnonzero(batch.count >= 2)
        if len(enough):
            index = int(rng.choice(enough))
            snapshot: Snapshot = batch.snapshot(index)
            return Example(scene, snapshot, batch.true_labels(index, scene.layout.labels))
