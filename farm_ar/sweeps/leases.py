"""Which runs on a store are alive: a lock that the system takes away with the process that held it.

SQLite's own locks are used, on an empty file for each run beside the store, since they are the same on every
system. A killed run leaves its file behind, unlocked; whoever looks next removes it.
"""

from __future__ import annotations

import sqlite3
from contextlib import suppress
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
        self._lock: sqlite3.Connection | None = None
        self.token = uuid4().hex[:12]
        if store is not None:
            _remove_those_of_the_dead(store)
            while not self._take(_file(store, self.token)):
                self.token = uuid4().hex[:12]

    def end(self) -> None:
        """Give up the lock."""
        if self._lock is not None:
            _remove(self._path, self._lock)
            self._lock = None

    def _take(self, file: Path) -> bool:
        """Make a file and lock it; False where another run took it for a dead one's in between."""
        try:
            lock = _lock(file, "rwc")
        except sqlite3.OperationalError as problem:
            if problem.sqlite_errorcode == sqlite3.SQLITE_BUSY:
                return False
            raise
        if not file.exists():
            lock.close()
            return False
        self._path, self._lock = file, lock
        return True


def is_alive(store: Path | None, token: str) -> bool:
    """Whether the run of a token still holds its lock."""
    return store is not None and _is_locked(_file(store, token))


def _remove_those_of_the_dead(store: Path) -> None:
    beginning = f"{store.name}-run-"
    for file in store.parent.iterdir():
        if file.name.startswith(beginning):
            _is_locked(file)


def _is_locked(file: Path) -> bool:
    """Whether a run is alive that has locked the file; where none is, the file goes."""
    try:
        lock = _lock(file, "rw")
    except sqlite3.OperationalError as problem:
        return problem.sqlite_errorcode == sqlite3.SQLITE_BUSY
    _remove(file, lock)
    return False


def _remove(file: Path, lock: sqlite3.Connection) -> None:
    """Remove a file while its lock is held; on systems that refuse that, right after."""
    with suppress(OSError):
        file.unlink()
    lock.close()
    with suppress(OSError):
        file.unlink()


def _file(store: Path, token: str) -> Path:
    return store.with_name(f"{store.name}-run-{token}")


def _lock(file: Path, mode: str) -> sqlite3.Connection:
    place = f"{file.absolute().as_uri()}?mode={mode}"
    connection = sqlite3.connect(place, uri=True, timeout=0, isolation_level=None)
    try:
        connection.execute("PRAGMA journal_mode = MEMORY")  # no second file
        connection.execute("BEGIN EXCLUSIVE")
    except BaseException:
        connection.close()
        raise
    return connection
