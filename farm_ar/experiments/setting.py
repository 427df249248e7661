"""What an experiment is given: scenes, how many noisy layouts, where the randomness comes from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from numbers import Integral
from pathlib import Path
from typing import TypeVar

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError, SceneError
from farm_ar.experiments.published import TABLE_1
from farm_ar.reid import SpatialReid, batch_accuracy
from farm_ar.scenes import (
    Camera,
    LayoutNoise,
    Scene,
    SnapshotBatch,
    builtin_scene,
    load_scene,
    observe_many,
    visible,
)
from farm_ar.scenes.fields import NOTHING

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
        OptionError: layouts or workers is not a whole number from 1 on, or the seed not one from 0 on.
    """

    scenes: Mapping[str, Scene]
    layouts: int = 20
    seed: int = 0
    workers: int = 2
    quick: bool = False
    advance: Callable[[float], None] = field(default=lambda share: None)

    def __post_init__(self) -> None:
        for name, least in (("layouts", 1), ("workers", 1), ("seed", 0)):
            value = getattr(self, name)
            if not isinstance(value, Integral) or value < least:
                raise OptionError(name, f"must be a whole number not below {least}", value)

    def rng(self, *key: int) -> np.random.Generator:
        """The generator of one piece of work, which `key` tells apart from all others."""
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=key))

    def part(self, begin: float, end: float) -> Setting:
        """The same for one part of the experiment, which takes it from one share of its work to another."""
        return replace(self, advance=lambda share: self.advance(begin + share * (end - begin)))

    def each(self, items: Iterable[Item], work: Callable[[Item], Outcome]) -> list[tuple[Item, Outcome]]:
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
        return [(item, future.result()) for item, future in zip(todo, running, strict=True)]


def load_scenes(folder: Path | None) -> dict[str, Scene]:
    """The six synthetic scenes: the built-in ones, or `L1.json` to `H2.json` of a folder.

    Raises:
        SceneError: a file is missing or cannot be used.
    """
    if folder is None:
        return {name: builtin_scene(name) for name in SCENES}
    if not folder.is_dir():
        raise SceneError("scenes", "must be a folder with L1.json to H2.json", str(folder))
    scenes = {name: load_scene(folder / f"{name}.json") for name in SCENES}
    for name, scene in scenes.items():
        _check(scene, source=f"{name}.json")
    return scenes


def _check(scene: Scene, source: str) -> None:
    """Refuse a scene that a file may hold, but that the experiments can do nothing with."""
    for field_name, value in (("objects", scene.layout.labels), ("sites", scene.sites)):
        if not value:
            raise SceneError(field_name, "must be at least one for the experiments", [], source)
    if scene.camera_path is None:
        raise SceneError("camera_path", "must be there for the experiments", NOTHING, source)
    if not visible(scene.layout, path_cameras(scene)).any():
        length = f"{scene.camera_path.length:.1f} m of path"
        raise SceneError("camera_path", "must pass where the camera sees an object", length, source)


def path_cameras(scene: Scene) -> Camera:
    """The poses on a scene's camera path, which it must have, from which snapshots are taken."""
    assert scene.camera_path is not None
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


def mean_and_sd(accuracy: FloatArray) -> tuple[float, float]:
    """Mean and SD of all accuracies, NaNs aside; NaN if there are no others."""
    known = accuracy[np.isfinite(accuracy)]
    return (float(known.mean()), float(known.std())) if len(known) else (np.nan, np.nan)
