"""The setting of an experiment: scenes, number of noisy layouts, source of randomness."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from hashlib import sha256
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError, SceneError
from farm_ar.experiments.published import TABLE_1
from farm_ar.reid import Reidentifier, batch_accuracy
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
from farm_ar.scenes.kinds import NEEDED
from farm_ar.sweeps import Executor, Outcome, Row, SerialExecutor, Store, Sweep, Watcher, run_sweep
from farm_ar.sweeps.unit import code_version

POSE_SPACING_M = 0.617
"""Way between two snapshots. It gives 80 poses on the path of the authors' H1; some 62 detect anything:
as many as the paper's data points (section 4.1.2)."""

SCENES = tuple(TABLE_1)


@dataclass(frozen=True)
class Setting:
    """The setting of an experiment.

    Args:
        folder: of the six synthetic scenes, `L1.json` to `H2.json`; None for the built-in ones.
        layouts: noisy layouts for each noise level.
        seed: where all randomness comes from.
        quick: a coarser run of the same experiments.
        store: where the results of finished units are kept; None keeps them in memory.
        executor: where units are run; the results do not depend on it.
        fresh: whether to forget what is in the store.
        watch: called with the progress of each sweep.
        reids: `module:Class` of re-identifiers that are compared beside our own.

    Raises:
        OptionError: layouts is not a whole number from 1 on, or the seed not one from 0 on.
    """

    folder: Path | None = None
    layouts: int = 20
    seed: int = 0
    quick: bool = False
    store: Store | None = None
    executor: Executor = field(default_factory=SerialExecutor)
    fresh: bool = False
    watch: Watcher = field(default=lambda standing: None)
    reids: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, least in (("layouts", 1), ("seed", 0)):
            value = getattr(self, name)
            if not isinstance(value, Integral) or value < least:
                raise OptionError(name, f"must be a whole number not below {least}", value)

    @cached_property
    def scenes(self) -> Mapping[str, Scene]:
        """The six synthetic scenes by name.

        Raises:
            SceneError: a file is missing or cannot be used.
        """
        return load_scenes(self.folder)

    @property
    def own_reids(self) -> dict[str, Any]:
        """The user's own re-identifiers as a parameter of a unit: each with the version of its code."""
        return {"own": {name: code_version(name) for name in self.reids}} if self.reids else {}

    def rng(self, *key: int) -> np.random.Generator:
        """The generator of one piece of work, identified by `key`."""
        return piece_rng(self.seed, *key)

    def scene_parameters(self, name: str) -> dict[str, str | None]:
        """A scene as parameters of a unit, from which `named_scene` makes it again."""
        if self.folder is None:
            return {"scene": name, "file": None}
        file = (self.folder / f"{name}.json").resolve()
        return {"scene": name, "file": f"{file}#{_fingerprint(file)}"}

    def sweep(
        self,
        name: str,
        function: Callable[..., Outcome | Row | Sequence[Row]],
        parameters: Sequence[Mapping[str, Any]],
        executor: Executor | None = None,
    ) -> list[Outcome]:
        """The results of a function for this seed and each of the parameters, in order; see `farm_ar.sweeps`.

        Raises:
            UnfinishedSweepError: some gave nothing. The others are in the store.
        """
        sweep = Sweep(name, function, parameters, seeds=[self.seed])
        where = executor or self.executor
        return run_sweep(sweep, self.store, where, fresh=self.fresh, watch=self.watch).outcomes()


def piece_rng(seed: int, *key: int) -> np.random.Generator:
    """The generator of one piece of work, identified by `key` among all of the same seed."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


@lru_cache(maxsize=16)
def named_scene(scene: str, file: str | None) -> Scene:
    """The scene of `Setting.scene_parameters`.

    Raises:
        SceneError: its file is no longer what it was.
    """
    if file is None:
        return builtin_scene(scene)
    path, _, fingerprint = file.rpartition("#")
    if _fingerprint(Path(path)) != fingerprint:
        raise SceneError("file", "must stay as it is while the experiments run", "another content", path)
    return load_scene(path)


def _fingerprint(file: Path) -> str:
    return sha256(file.read_bytes()).hexdigest()[:16]


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
        raise SceneError("camera_path", "must be there for the experiments", NEEDED, source)
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


def accuracies(reid: Reidentifier, batch: SnapshotBatch, layouts: int) -> FloatArray:
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
