"""A run's folder: all that is needed to repeat a training, to go on with it, and to use what it made."""

from __future__ import annotations

import csv
import io
import json
import platform
import shutil
import sqlite3
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from uuid import uuid4

import yaml

from farm_ar import __version__
from farm_ar.agents.training.recipes import Recipe, recipe_from, settings_of, yaml_from
from farm_ar.errors import InputError, OptionError
from farm_ar.scenes.documents import Document, Object
from farm_ar.scenes.files import read_json, read_text, write_text
from farm_ar.scenes.kinds import Flag, Text, Whole

DESCRIPTION, HYPERPARAMETERS, LOCK = "run.json", "hyperparameters.yml", ".lock"
CHECKPOINTS, BEST = "checkpoints", "best"
KEPT = 2
"""How many of either stay: the one before is there if the newest is damaged, or lies after a checkpoint."""

PACKAGES = ("numpy", "torch", "stable-baselines3", "sb3-contrib", "gymnasium", "pymunk", "numba")


class RunError(InputError):
    """A run's folder that cannot be used."""


@dataclass(frozen=True)
class Run:
    """What was asked for.

    Args:
        algo: the learner, by name.
        env: the environment's id.
        seed: of everything.
        recipe: the hyperparameters and the environment's arguments.
        threads: of torch.
        processes: whether each environment has a process of its own.
        eval_every: steps between evaluations.
        eval_episodes: of each evaluation.
    """

    algo: str
    env: str
    seed: int
    recipe: Recipe
    threads: int = 1
    processes: bool = False
    eval_every: int = 10_000
    eval_episodes: int = 50

    def modules(self) -> list[str]:
        """Other modules than this package's that are imported to make the run's environment."""
        names = [self.env, self.recipe.env_kwargs.get("reid")]
        found = [name.partition(":")[0] for name in names if isinstance(name, str) and ":" in name]
        return [module for module in found if module.partition(".")[0] != "farm_ar"]


DOCUMENT = Document(
    "run",
    Object(
        {
            "algo": Text(),
            "env": Text(),
            "seed": Whole(0, 2**63 - 1),
            "threads": Whole(1, 10_000),
            "processes": Flag(),
            "eval_every": Whole(1, 10**12),
            "eval_episodes": Whole(1, 10**9),
        },
        notes=True,
        open=True,
    ),
    RunError,
)
"""What is read of `run.json`; the rest is for people."""


class RunFolder:
    """The files of a run.

    `run.json` holds the arguments, versions and seeds; `hyperparameters.yml` the recipe, in the form in which
    it can be used again; `training.csv` and `evaluations.csv` the learning curve; `tensorboard/` the same and
    more; `checkpoints/STEPS/` and `best/STEPS/` the model and what belongs to it.

    Args:
        path: the folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def exists(self) -> bool:
        """Whether there is a run in it."""
        return (self.path / DESCRIPTION).exists()

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keeps other processes from training in the folder; a kill frees it.

        Raises:
            OptionError: another process trains in it, or its lock cannot be used.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        lock = None
        try:
            lock = sqlite3.connect(self.path / LOCK, timeout=0, isolation_level=None)
            lock.execute("BEGIN EXCLUSIVE")
        except sqlite3.Error as problem:
            if lock is not None:
                lock.close()
            if problem.sqlite_errorcode == sqlite3.SQLITE_BUSY:
                expected = "must not be trained by another process at the same time, as it is now"
                raise OptionError("run", expected, str(self.path)) from None
            expected = f"must be a lock that SQLite can hold ({problem}); remove it where nothing trains"
            raise OptionError(LOCK, expected, str(self.path / LOCK)) from None
        try:
            yield
        finally:
            lock.close()

    def describe(self, run: Run) -> None:
        """Write down what was asked for, and with what."""
        values = asdict(run)
        del values["recipe"]
        earlier = read_json(self.path / DESCRIPTION, RunError).get("commands", []) if self.exists else []
        versions = {name: version(name) for name in PACKAGES}
        whole = {
            "farm-ar": __version__,
            **values,
            "commands": [*earlier, sys.argv],
            "python": platform.python_version(),
            "machine": platform.machine(),
            "versions": versions,
        }
        section = yaml.safe_dump({run.env: run.recipe.as_dict()}, sort_keys=False)
        write_text(self.path / HYPERPARAMETERS, section)
        write_text(self.path / DESCRIPTION, json.dumps(whole, indent=1) + "\n")

    def read(self) -> Run:
        """What was asked for.

        Raises:
            RunError: it is not the folder of a run, or its files are not as they were written.
        """
        found = DOCUMENT.read(read_json(self.path / DESCRIPTION, RunError), str(self.path / DESCRIPTION))
        source = str(self.path / HYPERPARAMETERS)
        sections = yaml_from(read_text(self.path / HYPERPARAMETERS, RunError, "YAML"), source, RunError)
        if not isinstance(sections, dict) or found["env"] not in sections:
            expected = f"must have the section {found['env']}, as farm-ar train wrote it"
            raise RunError("run", expected, type(sections).__name__, source)
        recipe = recipe_from(sections[found["env"]], settings_of(found["algo"]), source)
        return Run(**{name: found[name] for name in DOCUMENT.top.fields}, recipe=recipe)  # type: ignore[attr-defined]

    def read_to_make(self, trust: bool) -> Run:
        """The same, of a run whose environment is about to be made, which imports its module.

        Raises:
            RunError: as `read`; or there is such a module, and it is not trusted.
        """
        run = self.read()
        if run.modules() and not trust:
            expected = "must be trusted (--trust), as importing a module runs code of whoever wrote it"
            raise RunError("env", expected, " and ".join(run.modules()), str(self.path))
        return run

    def keep(self, kind: str, steps: int, write: Callable[[Path], None]) -> None:
        """Keep files whole or not at all, in `kind/STEPS/`, beside the ones before them.

        Args:
            kind: "checkpoints" or "best".
            steps: how many steps had been taken.
            write: writes the files into the folder that it is given.
        """
        home = self.path / kind
        target, temporary = home / f"{steps:09d}", home / f".{steps}-{uuid4().hex}"
        if target.exists():
            return
        temporary.mkdir(parents=True)
        try:
            write(temporary)
            temporary.rename(target)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
        for old in self.kept(kind)[:-KEPT]:
            shutil.rmtree(old, ignore_errors=True)

    def go_back(self, steps: int) -> None:
        """Forget models later than a checkpoint, and what a kill left unfinished.

        Args:
            steps: of the checkpoint.
        """
        for kind in (CHECKPOINTS, BEST):
            for late in (path for path in self.kept(kind) if int(path.name) > steps):
                late.rename(late.with_name(f".{late.name}"))
            for unfinished in (self.path / kind).glob(".[0-9]*"):
                shutil.rmtree(unfinished, ignore_errors=True)

    def kept(self, kind: str) -> list[Path]:
        """The folders of a kind, the newest last."""
        home = self.path / kind
        found = home.glob("[0-9]*") if home.is_dir() else ()
        return sorted(path for path in found if path.name.isdecimal() and path.is_dir())

    def newest(self, kind: str) -> Path:
        """The newest folder of a kind.

        Raises:
            RunError: there is none.
        """
        found = self.kept(kind)
        if not found:
            raise RunError(kind, "must hold a model; the run has not come so far", "nothing", str(self.path))
        return found[-1]


class Table:
    """A CSV file that is written anew, whole, with every row.

    Args:
        path: the file.
        columns: their names; the first counts steps.
        until: rows that are there already are taken over up to so many steps.
    """

    def __init__(self, path: Path, columns: Sequence[str], until: int) -> None:
        self._path, self._columns = path, list(columns)
        steps = columns[0]
        try:
            self.rows = [{**row, steps: int(row[steps])} for row in read_table(path) if row[steps] <= until]
        except (ValueError, TypeError, KeyError, csv.Error) as problem:
            expected = "must be as farm-ar train wrote it; without the file the run goes on"
            raise RunError("table", expected, " ".join(repr(problem).split()), str(path)) from None

    def add(self, **row: float) -> None:
        """One more row, with a value for each column."""
        self.rows.append({name: row[name] for name in self._columns})
        text = io.StringIO()
        writer = csv.DictWriter(text, self._columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(self.rows)
        write_text(self._path, text.getvalue())


def read_table(path: Path) -> list[dict[str, float]]:
    """The rows of a CSV file of numbers; none where there is no file."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
