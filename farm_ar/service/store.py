"""Where sessions are kept: an SQLite file in WAL mode, written when something is decided."""

from __future__ import annotations

import json
import os
import sqlite3
import threading
from pathlib import Path
from typing import Any

from farm_ar.errors import OptionError
from farm_ar.service.refusals import DISK_FULL, RefusedError

SCHEMA = "create table if not exists sessions (name text primary key, revision integer, row text)"


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
            self._base.execute("begin exclusive")
            self._base.execute(SCHEMA)
            self._base.execute("commit")
        except (OSError, sqlite3.Error) as problem:
            taken = "locked" in str(problem)
            expected = "must be used by one service only" if taken else f"must be writable ({problem})"
            raise OptionError("state", expected, str(path)) from None

    def names(self) -> list[str]:
        """The sessions, in order of their names."""
        with self._lock:
            return [name for (name,) in self._base.execute("select name from sessions order by name")]

    def read(self, name: str) -> dict[str, Any] | None:
        """A session's row, or None."""
        with self._lock:
            found = self._base.execute("select row from sessions where name = ?", (name,)).fetchone()
        return None if found is None else json.loads(found[0])

    def write(self, name: str, row: dict[str, Any]) -> None:
        """Keep a session's row.

        Raises:
            RefusedError: there is no room for it; what was there stays.
        """
        text = json.dumps(row, allow_nan=False, separators=(",", ":"))
        change = "insert or replace into sessions values (?, ?, ?)"
        self._do(change, (name, row["revision"], text))

    def delete(self, name: str) -> None:
        """Forget a session."""
        self._do("delete from sessions where name = ?", (name,))

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._base.close()

    def _do(self, change: str, values: tuple[Any, ...]) -> None:
        try:
            with self._lock:
                self._base.execute(change, values)
        except sqlite3.OperationalError as problem:
            raise RefusedError(DISK_FULL, "state", "must have room to be written", str(problem)) from None
