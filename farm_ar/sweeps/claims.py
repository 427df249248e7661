"""Which runs on a store are alive: a lock that the system takes away with the process that held it.

SQLite's own locks are used, on an empty file for each run beside the store, since they are the same on every
system. A killed run leaves its file behind, unlocked; whoever asks next for that run removes it.
"""

from __future__ import annotations

import sqlite3
from pathlib import Path
from uuid import uuid4


class Presence:
    """That this run is alive, until `end` or the end of the process.

    Args:
        store: the file of the store; None for one in memory, which no other run can see.

    Raises:
        sqlite3.OperationalError: the file beside the store cannot be made.
    """

    def __init__(self, store: Path | None) -> None:
        self.token = uuid4().hex[:12]
        self._file = None if store is None else _file(store, self.token)
        self._lock = None if self._file is None else _lock(self._file, "rwc")

    def end(self) -> None:
        """Give up the lock."""
        if self._lock is not None and self._file is not None:
            self._lock.close()
            self._file.unlink(missing_ok=True)


def is_alive(store: Path | None, token: str) -> bool:
    """Whether the run of a token still holds its lock."""
    if store is None:
        return False
    file = _file(store, token)
    try:
        _lock(file, "rw").close()
    except sqlite3.OperationalError as problem:
        return problem.sqlite_errorcode == sqlite3.SQLITE_BUSY
    file.unlink(missing_ok=True)
    return False


def _file(store: Path, token: str) -> Path:
    return store.with_name(f"{store.name}-run-{token}")


def _lock(file: Path, mode: str) -> sqlite3.Connection:
    connection = sqlite3.connect(
        f"{file.absolute().as_uri()}?mode={mode}",
        uri=True,
        timeout=0,
        isolation_level=None,
        check_same_thread=False,
    )
    try:
        connection.execute("BEGIN EXCLUSIVE")
    except BaseException:
        connection.close()
        raise
    return connection
