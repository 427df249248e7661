"""Where results are kept: one SQLite file, in which a finished unit stays finished whatever happens.

Results are rows of the table `results`, functions of parameters and seed; what a clock measured stands in
`times`. A unit that is lost between two commits is merely computed again.
"""

from __future__ import annotations

import json
import os
import sqlite3
import stat
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from farm_ar.sweeps.errors import EXPECTED, StoreError, of_the_store
from farm_ar.sweeps.executors.base import Attempt
from farm_ar.sweeps.leases import is_alive
from farm_ar.sweeps.results import KILLS, Failure, Results
from farm_ar.sweeps.unit import Unit

FORM = 1
SCHEMA = """
CREATE TABLE units (
    key TEXT PRIMARY KEY, function TEXT, parameters TEXT, seed INTEGER, version TEXT
);
CREATE TABLE plans (sweep TEXT, position INTEGER, key TEXT, PRIMARY KEY (sweep, position)) WITHOUT ROWID;
CREATE TABLE results (key TEXT PRIMARY KEY, rows TEXT NOT NULL);
CREATE TABLE times (key TEXT PRIMARY KEY, seconds REAL, measured TEXT NOT NULL, ended_at REAL) WITHOUT ROWID;
CREATE TABLE failures (key TEXT PRIMARY KEY, problem TEXT, kills INTEGER, ended_at REAL) WITHOUT ROWID;
CREATE TABLE claims (key TEXT PRIMARY KEY, owner TEXT NOT NULL) WITHOUT ROWID;
"""
AT_ONCE = 500
"""Keys in one statement."""


@dataclass(frozen=True)
class Claimed:
    """What became of the units that a run wished to claim; those in none of the sets are free still.

    Args:
        mine: keys of those that it may run now.
        others: of those that another run, which is alive, has claimed.
        finished: of those that have a result.
        given_up: of those that are quarantined, or failed in another run meanwhile.
    """

    mine: set[str]
    others: set[str]
    finished: set[str]
    given_up: set[str]


class Store:
    """An open store.

    Args:
        path: its file, made with its folder if need be; None for one in memory, which ends with this object.
        timeout: seconds to wait for another program that holds a lock.
        create: whether to make it where there is none.

    Raises:
        StoreError: it cannot be opened, or is none.
    """

    def __init__(
        self, path: str | os.PathLike[str] | None = None, timeout: float = 30.0, create: bool = True
    ) -> None:
        self.path = None if path is None else Path(path)
        if self.path is not None:
            self._check_place(self.path, create)
        with of_the_store(self.path):
            place = ":memory:" if self.path is None else str(self.path)
            self._connection = sqlite3.connect(place, timeout=timeout, isolation_level=None)
        try:
            self._set_up(timeout, create)
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

    def claim(self, owner: str, keys: Sequence[str], most: int, since: float) -> Claimed:
        """Claim units for a run, so that no other run on this store computes them.

        Args:
            owner: the token of the run's `Presence`.
            keys: of the units to choose from.
            most: how many to claim, the first ones first.
            since: time after which a failure counts as one of this run's.
        """
        with self._change():
            finished = self.finished(keys)
            over = finished | self.given_up(keys, since)
            held = dict(self._among("SELECT key, owner FROM claims WHERE key IN ({})", keys))
            alive = {other for other in {*held.values()} - {owner} if is_alive(self.path, other)}
            others = {key for key, other in held.items() if other in alive} - over
            mine = [key for key in keys if key not in over and key not in others][:most]
            self._many("INSERT OR REPLACE INTO claims VALUES (?, ?)", [(key, owner) for key in mine])
        return Claimed(set(mine), others, finished, over - finished)

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
        for unit in units:
            if not _is_unit(unit):
                raise self._damaged(f"the unit {unit!r}")
        keys = [unit.key for unit in units]
        columns = "key, rows, measured, seconds"
        statement = f"SELECT {columns} FROM results JOIN times USING (key) WHERE key IN ({{}})"
        texts, seconds = {}, {}
        for key, rows, measured, took in self._among(statement, keys):
            if not (_are_rows(rows) and _are_rows(measured) and isinstance(took, int | float)):
                raise self._damaged(f"the result {(rows, measured, took)!r}")
            texts[key], seconds[key] = (rows, measured), took
        statement = "SELECT key, problem, kills FROM failures WHERE key IN ({})"
        problems = {key: (problem, kills) for key, problem, kills in self._among(statement, keys)}
        for problem, kills in problems.values():
            if not (isinstance(problem, str) and isinstance(kills, int)):
                raise self._damaged(f"the failure {(problem, kills)!r}")
        failures = [Failure(unit, *problems[unit.key]) for unit in units if unit.key in problems]
        return Results(sweep, units, texts, seconds, failures)

    def claimed(self, results: Results) -> int:
        """How many units of a sweep are claimed by a run that is alive."""
        keys = [unit.key for unit in results.units if unit.key not in results.texts]
        owners = [owner for (owner,) in self._among("SELECT owner FROM claims WHERE key IN ({})", keys)]
        alive = {owner for owner in {*owners} if is_alive(self.path, owner)}
        return sum(owner in alive for owner in owners)

    def sweeps(self) -> list[str]:
        """The names of the sweeps, in order."""
        return self._column("SELECT DISTINCT sweep FROM plans ORDER BY sweep", [])

    def _check_place(self, path: Path, create: bool) -> None:
        """See that there is a plain file, or nothing where one may be made."""
        try:
            if path.is_file():
                return
            if path.exists():
                raise StoreError("store", "must be a plain file", _kind(path), str(path))
            if not create:
                raise StoreError("store", "must be a file that a sweep has made", "no such file", str(path))
            path.parent.mkdir(parents=True, exist_ok=True)
        except (OSError, ValueError) as problem:
            if isinstance(problem, StoreError):
                raise
            expected, got = (
                EXPECTED[sqlite3.SQLITE_CANTOPEN],
                getattr(problem, "strerror", None) or str(problem),
            )
            raise StoreError("store", expected, got, str(path)) from None

    def _set_up(self, timeout: float, create: bool) -> None:
        """See that the file is a store or empty, and make it a store if it is empty and may become one."""
        with of_the_store(self.path):
            form = self._form()
            if form == 0 and not create:
                raise StoreError(
                    "store", "must be a file that a sweep has made", "an empty file", str(self.path)
                )
            self._use_wal(time.monotonic() + timeout)
            self._connection.execute("PRAGMA synchronous = NORMAL")
        if form == 0:
            with self._change():
                if self._form() == 0:  # no other process made it meanwhile
                    for statement in SCHEMA.strip().split(";\n"):
                        self._connection.execute(statement)
                    self._connection.execute(f"PRAGMA user_version = {FORM}")
        with of_the_store(self.path):
            found = _columns(self._connection)
        missing = [name for name in _columns_of_a_store() if name not in found]
        if missing:
            raise self._damaged(f"without {missing[0]}")

    def _damaged(self, how: str) -> StoreError:
        return StoreError("store", EXPECTED[sqlite3.SQLITE_CORRUPT], how, str(self.path))

    def _form(self) -> int:
        """The form of the store; 0 where the file is empty."""
        statement = "SELECT user_version, (SELECT count(*) FROM sqlite_master) FROM pragma_user_version"
        form, tables = self._connection.execute(statement).fetchone()
        if form not in (0, FORM) or (form == 0 and tables):
            raise StoreError("store", f"must be a store of form {FORM}", f"form {form}", str(self.path))
        return int(form)

    def _use_wal(self, until: float) -> None:
        """Let readers and a writer work at once. SQLite does not wait by itself to change to it."""
        while True:
            try:
                self._connection.execute("PRAGMA journal_mode = WAL")
                return
            except sqlite3.OperationalError as problem:
                if problem.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > until:
                    raise
                time.sleep(0.01)

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
    return failure.kills == 0 or failure.quarantined


def _columns(connection: sqlite3.Connection) -> set[str]:
    """The columns of all tables, each as "column COLUMN of TABLE"."""
    statement = "SELECT t.name, c.name FROM sqlite_master AS t JOIN pragma_table_info(t.name) AS c"
    return {f"column {column} of {table}" for table, column in connection.execute(statement)}


@cache
def _columns_of_a_store() -> tuple[str, ...]:
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(SCHEMA)
        return tuple(sorted(_columns(connection)))


def _kind(path: Path) -> str:
    mode = path.stat().st_mode
    return "a folder" if stat.S_ISDIR(mode) else "a pipe" if stat.S_ISFIFO(mode) else "no plain file"


def _is_unit(unit: Unit) -> bool:
    texts = (unit.function, unit.text, unit.version)
    if not (all(isinstance(text, str) for text in texts) and isinstance(unit.seed, int)):
        return False
    try:
        return isinstance(json.loads(unit.text), dict)
    except ValueError:
        return False


def _are_rows(text: object) -> bool:
    """Whether this is the JSON text of a list of rows."""
    try:
        rows = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        return False
    return isinstance(rows, list) and all(isinstance(row, dict) for row in rows)
