"""Where results are kept: one SQLite file, in which a finished unit stays finished whatever happens.

Results are rows of the table `results`, functions of parameters and seed; what a clock measured stands in
`times`. A unit that is lost between two commits is merely computed again.
"""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from farm_ar.sweeps.attempts import Attempt
from farm_ar.sweeps.claims import is_alive
from farm_ar.sweeps.errors import StoreError, of_the_store
from farm_ar.sweeps.results import Failure, Results
from farm_ar.sweeps.units import Unit

KILLS = 3
"""So many killed workers quarantine a unit."""

FORM = 1
SCHEMA = """
CREATE TABLE units (
    key TEXT PRIMARY KEY, function TEXT, parameters TEXT, seed INTEGER, version TEXT
);
CREATE TABLE plans (sweep TEXT, position INTEGER, key TEXT, PRIMARY KEY (sweep, position));
CREATE TABLE results (key TEXT PRIMARY KEY, rows TEXT NOT NULL);
CREATE TABLE times (key TEXT PRIMARY KEY, seconds REAL, measured TEXT NOT NULL, ended_at REAL);
CREATE TABLE failures (key TEXT PRIMARY KEY, problem TEXT, kills INTEGER, ended_at REAL);
CREATE TABLE claims (key TEXT PRIMARY KEY, owner TEXT NOT NULL);
"""
AT_ONCE = 500
"""Keys in one statement."""


class Store:
    """An open store.

    Args:
        path: its file, made if need be; None for one in memory, which ends with this object.
        timeout: seconds to wait for another program that holds a lock.
        create: whether to make it where there is none.

    Raises:
        StoreError: it cannot be opened, or is none.
    """

    def __init__(
        self, path: str | os.PathLike[str] | None = None, timeout: float = 30.0, create: bool = True
    ) -> None:
        self.path = None if path is None else Path(path)
        if self.path is not None and not create and not self.path.is_file():
            raise StoreError("store", "must be a file that a sweep has made", "no such file", str(path))
        with of_the_store(self.path):
            place = ":memory:" if self.path is None else str(self.path)
            self._connection = sqlite3.connect(place, timeout=timeout, isolation_level=None)
        try:
            self._set_up()
        except BaseException:
            self._connection.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def plan(self, sweep: str, units: Sequence[Unit], fresh: bool = False) -> None:
        """Make these units those of a sweep; fresh forgets all that its former and these units gave."""
        keys = [unit.key for unit in units]
        with self._change():
            former = self._column("SELECT key FROM plans WHERE sweep = ? ORDER BY position", [sweep])
            if fresh:
                self._forget({*former, *keys})
            if former != keys:
                self._run("DELETE FROM plans WHERE sweep = ?", [sweep])
                self._many(
                    "INSERT INTO plans VALUES (?, ?, ?)", [(sweep, i, key) for i, key in enumerate(keys)]
                )
            self._many(
                "INSERT OR IGNORE INTO units VALUES (?, ?, ?, ?, ?)",
                [(unit.key, unit.function, unit.text, unit.seed, unit.version) for unit in units],
            )

    def retry(self, keys: Iterable[str]) -> None:
        """Forget the failures of units, quarantined ones among them."""
        with self._change():
            self._many("DELETE FROM failures WHERE key = ?", [(key,) for key in keys])

    def save(self, finished: Sequence[Attempt], failures: Sequence[Failure] = ()) -> None:
        """Keep what units gave, whole or not at all, and give up the claims on them."""
        now = time.time()
        with self._change():
            self._many(
                "INSERT OR IGNORE INTO results VALUES (?, ?)", [(d.unit.key, d.rows) for d in finished]
            )
            self._many(
                "INSERT OR IGNORE INTO times VALUES (?, ?, ?, ?)",
                [(done.unit.key, done.seconds, done.measured, now) for done in finished],
            )
            self._many("DELETE FROM failures WHERE key = ?", [(done.unit.key,) for done in finished])
            self._many(
                "INSERT OR REPLACE INTO failures VALUES (?, ?, ?, ?)",
                [(failure.unit.key, failure.problem, failure.kills, now) for failure in failures],
            )
            ended = [*(done.unit.key for done in finished), *(f.unit.key for f in failures if _is_over(f))]
            self._many("DELETE FROM claims WHERE key = ?", [(key,) for key in ended])

    def claim(self, owner: str, keys: Sequence[str], since: float) -> tuple[set[str], set[str]]:
        """Claim units for a run, so that no other run on this store computes them.

        Args:
            owner: the token of the run's `Presence`.
            keys: of the units.
            since: time after which a failure counts as one of this run's.

        Returns:
            the keys of those that are now the run's, and of those that are another's; the rest are over.
        """
        with self._change():
            over = self.finished(keys) | self.given_up(keys, since)
            held = dict(self._among("SELECT key, owner FROM claims WHERE key IN ({})", keys))
            alive = {other for other in {*held.values()} - {owner} if is_alive(self.path, other)}
            others = {key for key, other in held.items() if other in alive} - over
            mine = {*keys} - over - others
            self._many("INSERT OR REPLACE INTO claims VALUES (?, ?)", [(key, owner) for key in mine])
        return mine, others

    def finished(self, keys: Sequence[str]) -> set[str]:
        """Those of the keys whose units are finished."""
        return {key for (key,) in self._among("SELECT key FROM results WHERE key IN ({})", keys)}

    def given_up(self, keys: Sequence[str], since: float) -> set[str]:
        """Those of the keys whose units are quarantined, or failed after a time."""
        found = self._among("SELECT key, kills, ended_at FROM failures WHERE key IN ({})", keys)
        return {key for key, kills, ended_at in found if kills >= KILLS or (kills == 0 and ended_at >= since)}

    def kills(self, keys: Sequence[str]) -> dict[str, int]:
        """How many workers units have killed that are not finished, where any."""
        return dict(self._among("SELECT key, kills FROM failures WHERE kills > 0 AND key IN ({})", keys))

    def results(self, sweep: str) -> Results:
        """What a sweep has given.

        Raises:
            StoreError: no sweep has this name.
        """
        units = [Unit(*values) for values in self._run(
            "SELECT function, parameters, seed, version FROM plans JOIN units USING (key) "
            "WHERE sweep = ? ORDER BY position", [sweep],
        )]  # fmt: skip
        if not units:
            known = ", ".join(self.sweeps()) or "none"
            raise StoreError("sweep", f"must be one of the store's: {known}", sweep, str(self.path))
        keys = [unit.key for unit in units]
        statement = "SELECT key, rows, measured FROM results JOIN times USING (key) WHERE key IN ({})"
        texts = {key: (rows, measured) for key, rows, measured in self._among(statement, keys)}
        statement = "SELECT key, problem, kills FROM failures WHERE key IN ({})"
        problems = {key: (problem, kills) for key, problem, kills in self._among(statement, keys)}
        failures = [Failure(unit, *problems[unit.key]) for unit in units if unit.key in problems]
        return Results(sweep, units, texts, failures)

    def sweeps(self) -> list[str]:
        """The names of the sweeps, in order."""
        return self._column("SELECT DISTINCT sweep FROM plans ORDER BY sweep", [])

    def _set_up(self) -> None:
        with of_the_store(self.path):
            form = self._connection.execute("PRAGMA user_version").fetchone()[0]
            tables = self._connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
            if form not in (0, FORM) or (form == 0 and tables):
                expected = f"must be a store of form {FORM}"
                raise StoreError("store", expected, f"form {form}", str(self.path))
            self._connection.execute("PRAGMA journal_mode = WAL")
            self._connection.execute("PRAGMA synchronous = NORMAL")
        if form == 0:
            with self._change():
                for statement in SCHEMA.strip().split(";\n"):
                    self._connection.execute(statement)
                self._connection.execute(f"PRAGMA user_version = {FORM}")

    def _forget(self, keys: Iterable[str]) -> None:
        for table in ("results", "times", "failures"):
            self._many(f"DELETE FROM {table} WHERE key = ?", [(key,) for key in keys])

    @contextmanager
    def _change(self) -> Iterator[None]:
        """One transaction, which takes place whole or not at all."""
        with of_the_store(self.path):
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._connection.execute("COMMIT")
            except BaseException:
                if self._connection.in_transaction:
                    self._connection.execute("ROLLBACK")
                raise

    def _run(self, statement: str, values: Sequence[object]) -> list[tuple[Any, ...]]:
        with of_the_store(self.path):
            return self._connection.execute(statement, values).fetchall()

    def _column(self, statement: str, values: Sequence[object]) -> list[str]:
        return [str(value) for (value,) in self._run(statement, values)]

    def _many(self, statement: str, values: Sequence[Sequence[object]]) -> None:
        if values:
            self._connection.executemany(statement, values)

    def _among(self, statement: str, keys: Sequence[str]) -> Iterator[tuple[Any, ...]]:
        for begin in range(0, len(keys), AT_ONCE):
            some = keys[begin : begin + AT_ONCE]
            yield from self._run(statement.format(", ".join("?" * len(some))), some)


def _is_over(failure: Failure) -> bool:
    return failure.kills == 0 or failure.kills >= KILLS
