"""Where units are run: the protocol, and the executor that runs them in this process."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Sequence
from types import TracebackType
from typing import Protocol, Self

from farm_ar.sweeps.attempts import Attempt, attempt
from farm_ar.sweeps.units import Unit


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
