"""What a sweep has given so far, in the order of its units."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from farm_ar.sweeps.errors import UnfinishedSweepError
from farm_ar.sweeps.rows import Outcome
from farm_ar.sweeps.units import Unit


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

    def __str__(self) -> str:
        what = f"quarantined, killed {self.kills} workers" if self.kills else "failed"
        return f"{what}: {self.unit}: {self.problem.strip()}"


@dataclass(frozen=True, eq=False)
class Results:
    """What a sweep has given.

    Args:
        sweep: its name.
        units: all of them.
        texts: JSON text of rows and of measured rows, by the key of each unit that is finished.
        failures: the units that gave nothing, in order.
    """

    sweep: str
    units: Sequence[Unit]
    texts: Mapping[str, tuple[str, str]]
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
        if self.failures:
            raise UnfinishedSweepError(self.sweep, self.failures)
