"""The executor that runs units in this process, one at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from farm_ar.sweeps.executors.base import Attempt, Stoppable, attempt
from farm_ar.sweeps.unit import Unit


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
