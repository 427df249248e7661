"""Where units are run: the contract of executors, the simplest of them, and the result of a unit."""

from __future__ import annotations

import time
import traceback
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

from farm_ar.sweeps.unit import BY_HAND, Unit, as_outcome, code_version, load_function, to_text


@dataclass(frozen=True)
class Attempt:
    """How one attempt at a unit ended.

    Args:
        unit: what was tried.
        rows: JSON text of the list of rows; None where there are none.
        measured: JSON text of the list of measured rows.
        seconds: how long it took.
        problem: what went wrong; "" where nothing did.
        killed: whether it took its worker along, so that another attempt may do better.
    """

    unit: Unit
    rows: str | None = None
    measured: str = "[]"
    seconds: float = 0.0
    problem: str = ""
    killed: bool = False


def attempt(unit: Unit) -> Attempt:
    """Run a unit here and now. An exception is an outcome too; only an interruption comes out."""
    begin = time.perf_counter()
    try:
        function = load_function(unit.function)
        outcome = as_outcome(function(seed=unit.seed, **unit.parameters))
        rows = to_text(outcome.rows, "rows")
        measured = to_text(outcome.measured, "measured") if outcome.measured else "[]"
    except Exception:
        return Attempt(unit, seconds=time.perf_counter() - begin, problem=traceback.format_exc())
    return Attempt(unit, rows, measured, time.perf_counter() - begin)


def check_version(unit: Unit) -> None:
    """See that the code here is that which the unit was planned with.

    Raises:
        RuntimeError: it is not.
    """
    if not unit.version.startswith(BY_HAND) and code_version(unit.function) != unit.version:
        raise RuntimeError(
            f"the code of {unit.function} is not that which the sweep began with ({unit.version}): "
            "it was changed meanwhile, or this worker has another installation"
        )


class Executor(Protocol):
    """Runs units somewhere and brings back what came of them, in any order.

    It knows nothing of stores, retries and quarantine. A unit that kills its worker comes back as an attempt
    with `killed` set, and the executor goes on.
    """

    @property
    def capacity(self) -> int:
        """How many units it can hold now, those that run among them; never below 1."""

    def submit(self, unit: Unit) -> None:
        """Take a unit, to run it as soon as may be. Does not wait."""

    def collect(self, seconds: float) -> Sequence[Attempt]:
        """The attempts that ended since the last call; waits so long at the most for the first."""

    def stop(self) -> None:
        """Drop what was submitted and end the workers; the next `submit` starts anew."""


def mean_seconds(before: float | None, ended: Iterable[Attempt]) -> float | None:
    """What a unit takes, with those that ended well counted in; None where none has yet."""
    for one in ended:
        if not one.problem:
            before = one.seconds if before is None else 0.9 * before + 0.1 * one.seconds
    return before


class Stoppable(ABC):
    """Base of executors: a `with` block stops them."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    @abstractmethod
    def stop(self) -> None:
        """Drop what was submitted."""


class SerialExecutor(Stoppable):
    """Runs one unit at a time in this process. What kills a unit kills the run."""

    capacity = 1

    def __init__(self) -> None:
        self._waiting: deque[Unit] = deque()

    def submit(self, unit: Unit) -> None:
        """Take a unit."""
        self._waiting.append(unit)

    def collect(self, seconds: float) -> Sequence[Attempt]:
        """Run the next unit, however long it takes."""
        return [attempt(self._waiting.popleft())] if self._waiting else []

    def stop(self) -> None:
        """Drop what was submitted."""
        self._waiting.clear()
