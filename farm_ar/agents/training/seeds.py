"""Several seeds of one training, as units of a sweep: in processes or on a cluster's machines."""

from __future__ import annotations

import base64
import io
import json
import shutil
import tarfile
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, replace
from hashlib import sha256
from pathlib import Path
from typing import Any
from uuid import uuid4

from farm_ar.agents.training.recipes import recipe_from, settings_of
from farm_ar.agents.training.run_folder import BEST, CHECKPOINTS, Run, RunFolder, read_table
from farm_ar.errors import OptionError
from farm_ar.sweeps import Executor, Outcome, Store, Sweep, Watcher, run_sweep

STORE = "seeds.sqlite"
"""The file in which finished seeds are kept, beside their folders."""


def train_seeds(
    run: Run, seeds: Sequence[int], home: Path, executor: Executor, watch: Watcher = lambda standing: None
) -> list[Path]:
    """Train a run for several seeds; each leaves a folder `seed-N` as `train` does, from any machine.

    A seed that is finished is not trained again; one that was interrupted begins anew.

    Args:
        run: its description; its own seed does not count.
        seeds: of the runs.
        home: the folder in which theirs are.
        executor: where they are trained.
        watch: is called with the number of those done.

    Returns:
        The folders.

    Raises:
        UnfinishedSweepError: a seed gave no result; the folders of the others are there.
        StoreError: the store cannot be used.
        RunError: a seed's folder is there and is no run's.
        OptionError: a seed's folder is of another run.
    """
    values = _values(run)
    for path in (home / f"seed-{seed}" for seed in seeds):
        if path.exists() and _plain(RunFolder(path).read()) != _plain(run):
            expected = "must be another folder, as this seed is there from a training with other arguments"
            raise OptionError("run", expected, str(path))
    sweep = Sweep("seeds", train_one, [{"run": values}], seeds)
    with Store(home / STORE) as store:
        results = run_sweep(sweep, store, executor, watch=watch)
    folders = []
    for unit, outcome in results.finished():
        folders.append(home / f"seed-{unit.seed}")
        if not folders[-1].exists():
            _unpack(outcome.measured[0]["folder"], folders[-1])
    results.check()
    return folders


def train_one(seed: int, run: dict[str, Any]) -> Outcome:
    """One seed: its evaluations and a hash of what it learnt; beside them its folder, packed.

    Args:
        seed: of everything.
        run: what is asked for, as JSON values.
    """
    from farm_ar.agents.training.training import train

    recipe = recipe_from(run["recipe"], settings_of(run["algo"]), "run")
    with tempfile.TemporaryDirectory() as home:
        folder = RunFolder(Path(home) / "run")
        model = train(Run(**run | {"seed": seed, "recipe": recipe}), folder.path)
        learnt = sha256()
        for name, values in sorted(model.policy.state_dict().items()):
            learnt.update(name.encode() + values.cpu().numpy().tobytes())
        rows = read_table(folder.path / "evaluations.csv")
        packed = _pack(folder)
    return Outcome([*rows, {"learnt": learnt.hexdigest()}], [{"folder": packed}])


def _values(run: Run) -> dict[str, Any]:
    """A run as JSON values, whatever its seed."""
    return asdict(replace(run, seed=0)) | {"recipe": run.recipe.as_dict()}


def _plain(run: Run) -> str:
    """The same, whatever the order of what it holds."""
    return json.dumps(_values(run), sort_keys=True)


def _pack(folder: RunFolder) -> str:
    """A run's folder with its newest models alone, as text."""
    kept = {folder.kept(kind)[-1] for kind in (BEST, CHECKPOINTS) if folder.kept(kind)}
    old = {one for kind in (BEST, CHECKPOINTS) for one in folder.kept(kind)} - kept
    data = io.BytesIO()
    with tarfile.open(fileobj=data, mode="w:xz") as archive:
        for file in sorted(folder.path.rglob("*")):
            if file.is_file() and not old.intersection(file.parents) and file.name != ".lock":
                archive.add(file, file.relative_to(folder.path).as_posix())
    return base64.b64encode(data.getvalue()).decode()


def _unpack(packed: str, path: Path) -> None:
    """Make the folder again, whole or not at all."""
    temporary = path.with_name(f".{path.name}-{uuid4().hex}")
    try:
        with tarfile.open(fileobj=io.BytesIO(base64.b64decode(packed)), mode="r:xz") as archive:
            archive.extractall(temporary, filter="data")
        temporary.rename(path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
