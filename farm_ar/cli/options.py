"""What options take: numbers within limits, places for results, files that may run code."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farm_ar.arrays import number_in, whole_in
from farm_ar.errors import OptionError

if TYPE_CHECKING:
    from farm_ar.sweeps import ProcessExecutor, RayExecutor, SerialExecutor

DEFAULT_REID = "adaptive"
"""The method of `farm-ar identify`: the one that is right most often on the benchmark."""

REID_HELP = (
    "spatial (the paper's), spatial-unity (its authors' program), spatial-3d (in space), spatial-ungated, "
    "spatial-scale-free, likelihood, relational, adaptive, nearest, distance, squared-distance, last-known, "
    "or module:Class of your own, called with the scene."
)
"""What `--reid` takes."""

MOST_SEED = 2**63 - 1
"""The largest seed: what a store of results can hold."""


def whole(low: int, high: int = 10**9) -> Callable[[str | int], int]:
    """A parser of whole numbers for Typer: digits only, from `low` to `high`."""

    def whole_number(text: str | int) -> int:
        value = whole_in(text) if isinstance(text, str) else text
        if value is None or not low <= value <= high:
            raise typer.BadParameter(f"must be a whole number from {low} to {high}, got {text!r}")
        return value

    return whole_number


def number(low: float = -1e9, high: float = 1e9) -> Callable[[str | float], float]:
    """A parser of numbers for Typer: decimal digits and a point, from `low` to `high`."""

    def decimal_number(text: str | float) -> float:
        value = number_in(text) if isinstance(text, str) else float(text)
        if value is None or not low <= value <= high:
            raise typer.BadParameter(f"must be a number from {low:g} to {high:g}, got {text!r}")
        return value

    return decimal_number


Seed = Annotated[
    int,
    typer.Option(metavar="N", parser=whole(0, MOST_SEED), help="Seed of the random numbers."),
]


Trust = Annotated[
    bool, typer.Option("--trust", help="Allow the folder to run code: modules that it names, pickles.")
]

Which = Annotated[str, typer.Option(metavar="NAME", help="Which model: best (by the evaluations) or last.")]

EnvironmentArguments = Annotated[
    list[str] | None, typer.Option(metavar="NAME=VALUE", help="An argument of the environment.")
]


AsJson = Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")]

Plot = Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the answer, .svg or .png.")]

Results = Annotated[Path, typer.Option(metavar="DIR", help="Where the results go.")]

Fresh = Annotated[bool, typer.Option("--fresh", help="Start over; ignore finished work in DIR.")]

Workers = Annotated[
    int,
    typer.Option(
        metavar="N", parser=whole(1, 1000), help="Number of processes; the results do not depend on it."
    ),
]

Where = Annotated[
    str | None,
    typer.Option(
        "--executor",
        metavar="NAME",
        help="serial, process, or ray (a cluster); follows from --workers by default.",
    ),
]

Address = Annotated[
    str,
    typer.Option(
        metavar="HOST:PORT", help="Address of the Ray head, with --executor ray; by default on this machine."
    ),
]
OWN_CLUSTER = "auto"


def executor_of(
    name: str | None, workers: int | None, address: str, time_limit: float | None = None
) -> SerialExecutor | ProcessExecutor | RayExecutor:
    """The executor that a command was asked for.

    Args:
        name: of the executor; None for the one that suits the workers.
        workers: how many processes; None for one a core.
        address: of the cluster.
        time_limit: seconds for a unit.

    Raises:
        OptionError: the options do not go together, or no cluster answers.
        MissingPackageError: Ray is not installed.
    """
    from farm_ar.sweeps import make_executor

    if name is None:
        name = "serial" if workers == 1 and time_limit is None else "process"
    if name != "ray" and address != OWN_CLUSTER:
        raise OptionError("--address", "must be left out without --executor ray", address)
    if name != "process" and (workers or 1) > 1:
        expected = f"must be left out with --executor {name}"
        raise OptionError("--workers", expected, workers)
    return make_executor(name, workers or os.cpu_count() or 2, time_limit, address)


@contextmanager
def writing(option: str, path: Path) -> Iterator[None]:
    """Make a place that cannot be written a mistake in the option that named it.

    Raises:
        OptionError: the operating system refused what was done inside, or the path has a wrong ending.
    """
    try:
        yield
    except OptionError as problem:
        named = (problem.field, problem.got) == ("path", str(path))
        raise OptionError(option, problem.expected, problem.got) if named else problem from None
    except OSError as problem:
        reason = problem.strerror or str(problem)
        raise OptionError(option, f"must be a place that can be written ({reason})", str(path)) from None


def make_folder(option: str, path: Path) -> None:
    """Make a folder unless it exists, and see that files can be made in it, before the work begins.

    Raises:
        OptionError: they cannot.
    """
    with writing(option, path):
        path.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=path).close()


def check_file(option: str, path: Path) -> None:
    """See that a file can be written under a name, before the work begins.

    Raises:
        OptionError: it cannot.
    """
    if path.is_dir():
        raise OptionError(option, "must be a file, not a folder", str(path))
    make_folder(option, path.parent)


def require_trust(source: str, code: Sequence[str], trust: bool) -> None:
    """Say what a file or folder would run; go on only if it is trusted.

    Args:
        source: the file or folder.
        code: what it would run; nothing is said if that is nothing.
        trust: whether `--trust` was given.

    Raises:
        OptionError: there is code, and it is not trusted.
    """
    if not code:
        return
    runs = " and ".join(code)
    if not trust:
        expected = f"must be given to load {source}, which runs {runs}, code of whoever wrote it"
        raise OptionError("--trust", expected, "nothing")
    from farm_ar.cli.output import printable

    typer.echo(printable(f"Loading {source} runs {runs}, code of whoever wrote it."), err=True)


def code_of(run: str, which: str) -> list[str]:
    """What loading a run's folder runs beside farm-ar's own code; nothing for what is no run's folder.

    Args:
        run: the folder, or the name of a policy that comes with farm-ar.
        which: "best" or "last".

    Raises:
        RunError: its files are damaged.
    """
    from farm_ar.agents.training.checkpoints import pickles_in
    from farm_ar.agents.training.run_folder import BEST, CHECKPOINTS, RunFolder

    folder = RunFolder(Path(run))
    if not folder.exists:
        return []
    saved = folder.kept(BEST if which == "best" else CHECKPOINTS)[-1:]
    pickles = [f"the pickle {name}" for path in saved for name in pickles_in(path)]
    return [f"the module {name}" for name in folder.read().modules()] + pickles
