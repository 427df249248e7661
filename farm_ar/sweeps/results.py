"""What a sweep has given so far, in the order of its units: outcomes, a CSV table, how far it is."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from farm_ar.scenes.files import csv_table
from farm_ar.sweeps.errors import UnfinishedSweepError
from farm_ar.sweeps.unit import Outcome, Unit

KILLS = 3
"""So many killed workers quarantine a unit."""


@dataclass(frozen=True)
class Failure:
    """A unit that gave nothing.

    Args:
        unit: which.
        problem: what its last attempt ended with.
        kills: how many workers it took along; three quarantine it.
    """

    unit: Unit
    problem: str
    kills: int = 0

    @property
    def quarantined(self) -> bool:
        """Whether it is not tried again unless that is asked for."""
        return self.kills >= KILLS

    def __str__(self) -> str:
        what = "quarantined" if self.quarantined else "to be tried again" if self.kills else "failed"
        workers = f", killed {self.kills} workers" if self.kills else ""
        return f"{what}{workers}: {self.unit}: {self.problem.strip()}"

    def line(self) -> str:
        """The same in one line: of a traceback, what it ends with."""
        return str(Failure(self.unit, self.problem.strip().rpartition("\n")[2], self.kills))


@dataclass(frozen=True, eq=False)
class Results:
    """What a sweep has given.

    Args:
        sweep: its name.
        units: all of them.
        texts: JSON text of rows and of measured rows, by the key of each unit that is finished.
        seconds: that each finished unit took, by its key.
        failures: the units that gave nothing, in order.
    """

    sweep: str
    units: Sequence[Unit]
    texts: Mapping[str, tuple[str, str]]
    seconds: Mapping[str, float]
    failures: Sequence[Failure]

    def __len__(self) -> int:
        return len(self.texts)

    def finished(self) -> Iterator[tuple[Unit, Outcome]]:
        """Each finished unit with what it gave."""
        for unit in self.units:
            if unit.key in self.texts:
                yield unit, Outcome(*map(json.loads, self.texts[unit.key]))

    def outcomes(self) -> list[Outcome]:
        """What each unit gave, in order.

        Raises:
            UnfinishedSweepError: some gave nothing.
        """
        self.check()
        return [outcome for _, outcome in self.finished()]

    def rows(self) -> list[dict[str, Any]]:
        """The rows of all units, one after the other.

        Raises:
            UnfinishedSweepError: some units gave nothing.
        """
        return [dict(row) for outcome in self.outcomes() for row in outcome.rows]

    def check(self) -> None:
        """See that every unit is finished.

        Raises:
            UnfinishedSweepError: some are not.
        """
        failed = {failure.unit.key: failure for failure in self.failures}
        unfinished = [unit for unit in self.units if unit.key not in self.texts]
        if unfinished:
            nothing = "not run yet, or its result was removed"
            problems = [failed.get(unit.key, Failure(unit, nothing)) for unit in unfinished]
            raise UnfinishedSweepError(self.sweep, problems)


def as_csv(results: Results, measured: bool = False) -> str:
    """The rows of all finished units as CSV, each behind the parameters and the seed of its unit.

    A column of the rows that is called like a parameter gets `result.` before its name. Numbers keep every
    digit; lists are JSON; null and not-a-number are empty.

    Args:
        results: of the sweep.
        measured: the measured rows in place of the results; then with `unit_seconds`, how long the unit took.
    """
    rows = []
    for unit, outcome in results.finished():
        given = {**unit.parameters, "seed": unit.seed}
        extra: Iterable[Mapping[str, Any]] = outcome.rows
        if measured:
            seconds = {"unit_seconds": results.seconds[unit.key]}
            extra = [seconds | dict(row) for row in outcome.measured] or [seconds]
        rows += [
            given | {f"result.{name}" if name in given else name: value for name, value in row.items()}
            for row in extra
        ]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return csv_table(columns, [{name: _cell(value) for name, value in row.items()} for row in rows])


def _cell(value: Any) -> Any:
    """A value as CSV has it: no not-a-number, and JSON for what is neither a number nor text."""
    if isinstance(value, float) and math.isnan(value):
        return None
    if isinstance(value, bool | list | dict) or (isinstance(value, float) and math.isinf(value)):
        return json.dumps(value, ensure_ascii=False)
    return value


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
