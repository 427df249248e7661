"""Where sessions are kept: an SQLite file in WAL mode, written when something is decided."""

from __future__ import annotations

import json
import os
import sqlite3
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from farm_ar.errors import OptionError
from farm_ar.service.refusals import DISK_FULL, RefusedError

SCHEMA = (
    "create table if not exists sessions (name text primary key, revision integer, row text)",
    "create table if not exists ended (name text primary key, revision integer)",
)

LOG_PAGES = 8
"""So long may the log of changes become, in pages, before they are put into their places."""

REMEMBERED = 10_000
"""Names of sessions that were deleted; of those before them the greatest revision is known, under no name."""


class Store:
    """The stored sessions by name. A row is written whole or not at all, and is there after a kill.

    Args:
        path: the file; None keeps all in memory only.

    Raises:
        OptionError: the file cannot be used.
    """

    def __init__(self, path: str | os.PathLike[str] | None) -> None:
        self._lock = threading.Lock()
        try:
            if path is not None:
                Path(path).parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            self._base = sqlite3.connect(
                ":memory:" if path is None else path,
                timeout=1.0,
                check_same_thread=False,
                isolation_level=None,
            )
            self._base.execute("pragma locking_mode = exclusive")  # one service at a time
            self._base.execute("pragma journal_mode = wal")
            self._base.execute("pragma synchronous = full")
            self._base.execute(f"pragma wal_autocheckpoint = {LOG_PAGES}")
            self._base.execute("pragma trusted_schema = off")  # the file may be another's
            self._base.execute("begin exclusive")
            for table in SCHEMA:
                self._base.execute(table)
            self._base.execute("commit")
            self._check()
        except (OSError, sqlite3.Error) as problem:
            if hasattr(self, "_base"):
                self._base.close()
            taken = "locked" in str(problem)
            expected = "must be used by one service only" if taken else f"must be writable ({problem})"
            raise OptionError("state", expected, str(path)) from None

    def _check(self) -> None:
        """See that the file holds these tables and nothing else.

        Raises:
            sqlite3.DatabaseError: it is another's, or damaged.
        """
        found = self._base.execute(
            "select type, name, sql from sqlite_master where type <> 'index'"
        ).fetchall()
        tables = {sql.replace(" if not exists", "") for sql in SCHEMA}
        if {sql.lower() if isinstance(sql, str) else "" for _, _, sql in found} != tables:
            raise sqlite3.DatabaseError("it holds other tables than the service's")
        if self._base.execute("pragma quick_check(1)").fetchone() != ("ok",):
            raise sqlite3.DatabaseError("it is damaged")

    def names(self) -> list[str]:
        """The sessions, in order of their names."""
        with self._lock:
            found = self._base.execute("select name from sessions order by name").fetchall()
        return [name for (name,) in found if isinstance(name, str)]

    def read(self, name: str) -> Any:
        """A session's row, or None; whatever stands there."""
        with self._lock:
            found = self._base.execute("select row from sessions where name = ?", (name,)).fetchone()
        try:
            return None if found is None else json.loads(found[0])
        except (ValueError, TypeError, RecursionError):
            return {}

    def revision(self, name: str) -> int:
        """A session's revision; 0 where none can be read."""
        with self._lock:
            found = self._base.execute("select revision from sessions where name = ?", (name,)).fetchone()
        return found[0] if found is not None and isinstance(found[0], int) else 0

    def write(self, name: str, row: dict[str, Any]) -> None:
        """Keep a session's row.

        Raises:
            RefusedError: there is no room for it; what was there stays.
        """
        text = json.dumps(row, allow_nan=False, separators=(",", ":"))
        values = name, row["revision"], text
        self._change(lambda base: base.execute("insert or replace into sessions values (?, ?, ?)", values))

    def delete(self, name: str, revision: int) -> None:
        """Forget a session but for its revision, on which the next one of its name goes on.

        Raises:
            RefusedError: there is no room for that; the session stays.
        """

        def do(base: sqlite3.Connection) -> None:
            base.execute("delete from sessions where name = ?", (name,))
            base.execute("delete from ended where name = ?", (name,))  # so that it is the youngest
            base.execute("insert into ended values (?, ?)", (name, revision))
            named = "from ended where name <> '' order by rowid desc limit 1 offset ?"
            old = base.execute(f"select rowid {named}", (REMEMBERED,)).fetchone()
            if old is not None:
                few = "from ended where name = '' or rowid <= ?"
                (most,) = base.execute(f"select max(revision) {few}", old).fetchone()
                base.execute(f"delete {few}", old)
                base.execute("insert into ended values ('', ?)", (most,))

        self._change(do)

    def ended(self, name: str) -> int:
        """The revision from which a session that is not there goes on, were it begun; 0 for a new one."""
        with self._lock:
            found = self._base.execute(
                "select max(revision) from ended where name = ? or name = ''", (name,)
            ).fetchone()
        return int(found[0] or 0)

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._base.close()

    def _change(self, do: Callable[[sqlite3.Connection], object]) -> None:
        """One transaction, which takes place whole or not at all.

        Raises:
            RefusedError: there is no room for it.
        """
        with self._lock:
            try:
                try:
                    self._try(do)
                except sqlite3.OperationalError:  # what is outdated in the log may be all that fills the disk
                    self._base.execute("pragma wal_checkpoint(truncate)").fetchall()
                    self._try(do)
            except sqlite3.OperationalError as problem:
                expected = "must have room to be written"
                raise RefusedError(DISK_FULL, "state", expected, str(problem)) from None

    def _try(self, do: Callable[[sqlite3.Connection], object]) -> None:
        try:
            self._base.execute("begin immediate")
            do(self._base)
            self._base.execute("commit")
        except BaseException:
            if self._base.in_transaction:
                self._base.execute("rollback")
            raise
