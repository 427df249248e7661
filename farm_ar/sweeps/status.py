"""How far the sweeps of a store are, in numbers."""

from __future__ import annotations

from dataclasses import dataclass

from farm_ar.sweeps.results import Results

COLUMNS = ("sweep", "units", "finished", "running", "failed", "quarantined", "time in units")


@dataclass(frozen=True)
class Status:
    """How far one sweep is.

    Args:
        sweep: its name.
        units: how many it has.
        finished: with a result.
        running: claimed by a run that is alive.
        failed: whose function raised an exception; the next run tries them again.
        quarantined: given up, having killed their workers again and again.
        seconds: that the finished units took, one after the other.
    """

    sweep: str
    units: int
    finished: int
    running: int
    failed: int
    quarantined: int
    seconds: float

    def cells(self) -> tuple[str, ...]:
        """A row of `COLUMNS`."""
        counts = (self.units, self.finished, self.running, self.failed, self.quarantined)
        return (self.sweep, *map(str, counts), f"{self.seconds:.1f} s")


def summarise(results: Results, running: int) -> Status:
    """How far a sweep is of which so many units are running."""
    quarantined = sum(failure.quarantined for failure in results.failures)
    return Status(
        results.sweep,
        len(results.units),
        len(results),
        running,
        len(results.failures) - quarantined,
        quarantined,
        sum(results.seconds.values()),
    )
