"""What an experiment is given: scenes, how many noisy layouts, where the randomness comes from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError, SceneError
from farm_ar.experiments.published import TABLE_1
from farm_ar.reid import SpatialReid, batch_accuracy
from farm_ar.scenes import Camera, LayoutNoise, Scene, SnapshotBatch, builtin_scene, load_scene, observe_many

POSE_SPACING_M = 0.617
"""Way between two snapshots. It gives 80 poses on the path of the authors' H1; some 62 detect anything:
as many as the paper's data points (section 4.1.2)."""

SCENES = tuple(TABLE_1)

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")


@dataclass(frozen=True)
class Setting:
    """What an experiment is given.

    Args:
        scenes: the six synthetic scenes by name.
        layouts: noisy layouts for each noise level.
        seed: where all randomness comes from.
        workers: threads that share the work; the results do not depend on it.
        quick: a coarser run of the same experiments.
        advance: called with the share of the experiment that is done, 0 to 1.

    Raises:
        OptionError: layouts or workers is below 1, or the seed below 0.
    """

    scenes: Mapping[str, Scene]
    layouts: int = 20
    seed: int = 0
    workers: int = 2
    quick: bool = False
    advance: Callable[[float], None] = field(default=lambda share: None)

    def __post_init__(self) -> None:
        for name, least in (("layouts", 1), ("workers", 1), ("seed", 0)):
            if getattr(self, name) < least:
                raise OptionError(name, f"must be a whole number not below {least}", getattr(self, name))

    def rng(self, *key: int) -> np.random.Generator:
        """The generator of one piece of work, which `key` tells apart from all others."""
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=key))

    def each(self, items: Iterable[Item], work: Callable[[Item], Outcome]) -> Iterator[tuple[Item, Outcome]]:
        """The outcome of `work` for each item, in the items' order, shared among the workers.

        The first error stops what has not begun and is raised.
        """
        todo = list(items)
        with ThreadPoolExecutor(self.workers) as pool:
            running = [pool.submit(work, item) for item in todo]
            try:
                for done, finished in enumerate(as_completed(running), start=1):
                    finished.result()
                    self.advance(done / len(running))
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
        yield from zip(todo, (future.result() for future in running), strict=True)


def load_scenes(folder: Path | None) -> dict[str, Scene]:
    """The six synthetic scenes: the built-in ones, or `L1.json` to `H2.json` of a folder.

    Raises:
        SceneError: a file is missing or cannot be used.
    """
    if folder is None:
        return {name: builtin_scene(name) for name in SCENES}
    if not folder.is_dir():
        raise SceneError("scenes", "must be a folder with L1.json to H2.json", str(folder))
    return {name: load_scene(folder / f"{name}.json") for name in SCENES}


def path_cameras(scene: Scene) -> Camera:
    """The poses on a scene's camera path from which snapshots are taken.

    Raises:
        SceneError: the scene has no camera path.
    """
    if scene.camera_path is None:
        raise SceneError("camera_path", "must be there for this experiment", None)
    return scene.camera_path.cameras(max(2, round(scene.camera_path.length / POSE_SPACING_M)), scene.fov)


def noisy_snapshots(
    scene: Scene, noise: LayoutNoise, layouts: int, rng: np.random.Generator
) -> SnapshotBatch:
    """The snapshots of `layouts` noisy layouts, each seen from P poses on the path: layouts x P of them."""
    noisy = noise.disturb(scene.layout, scene.size, rng, (layouts,))
    each_pose = noisy.with_poses(noisy.position[:, None], noisy.yaw[:, None])
    return observe_many(each_pose, path_cameras(scene))


def accuracies(reid: SpatialReid, batch: SnapshotBatch, layouts: int) -> FloatArray:
    """(layouts, P) accuracy of each snapshot of `noisy_snapshots`; NaN where nothing was detected."""
    assert batch.truth is not None
    found = reid.identify_many(batch)
    return batch_accuracy(found.label, batch.truth, batch.count).reshape(layouts, -1)


def mean_per_layout(accuracy: FloatArray) -> FloatArray:
    """(L,) mean over the snapshots of each layout, of (L, P) accuracies; NaN where nothing was seen."""
    seen = np.isfinite(accuracy)
    total = np.where(seen, accuracy, 0.0).sum(axis=-1)
    return np.where(seen.any(axis=-1), total / np.maximum(seen.sum(axis=-1), 1), np.nan)
