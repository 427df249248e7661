"""What can go wrong with a sweep as a whole."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from farm_ar.errors import InputError, UnfinishedError

if TYPE_CHECKING:
    from farm_ar.sweeps.results import Failure


MOST_NAMED = 20
"""Failed units that an error names; it names every quarantined one."""


class StoreError(InputError):
    """A store that cannot be read or written just now. What was in it is still in it."""


class UnfinishedSweepError(UnfinishedError):
    """Some units of a sweep gave nothing; all others are in the store.

    Args:
        sweep: its name.
        failures: the units, and why.
    """

    def __init__(self, sweep: str, failures: Sequence[Failure]) -> None:
        super().__init__(sweep, failures)
        self.sweep, self.failures = sweep, failures

    def __str__(self) -> str:
        quarantined = [failure for failure in self.failures if failure.quarantined]
        others = [failure for failure in self.failures if not failure.quarantined]
        lines = [f"{self.sweep}: {len(self.failures)} of its units gave no result; all others are kept"]
        lines += [f"  {failure.line()}" for failure in quarantined + others[:MOST_NAMED]]
        if len(others) > MOST_NAMED:
            lines.append(f"  and {len(others) - MOST_NAMED} more")
        if others:
            lines += ["The first of them in full:", str(others[0])]
        return "\n".join(lines)


EXPECTED = {
    sqlite3.SQLITE_FULL: "must be on a disk with room left",
    sqlite3.SQLITE_IOERR: "must be on a disk with room left that can be read and written",
    sqlite3.SQLITE_BUSY: "must not be locked by another program for so long",
    sqlite3.SQLITE_LOCKED: "must not be locked by another program for so long",
    sqlite3.SQLITE_READONLY: "must be a file that can be written",
    sqlite3.SQLITE_CANTOPEN: "must be in a folder that can be written",
    sqlite3.SQLITE_NOTADB: "must be a store that a sweep has made",
    sqlite3.SQLITE_CORRUPT: "must be whole",
}
"""What would be right, by SQLite's primary result code."""


@contextmanager
def of_the_store(path: Path | None) -> Iterator[None]:
    """Make an error of SQLite one that names the store.

    Raises:
        StoreError: SQLite reported a state of the file or its disk.
    """
    try:
        yield
    except sqlite3.DatabaseError as problem:
        # Of text that is not UTF-8 Python reports no code of SQLite's.
        code = getattr(problem, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT)
        expected = EXPECTED.get(code & 0xFF)
        if expected is None:
            raise
        raise StoreError("store", expected, str(problem), str(path or "in memory")) from None
