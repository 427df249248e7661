"""Recordings: what was asked of a session and answered, a JSON line each, which can be played again."""

from __future__ import annotations

import hashlib
import itertools
import json
import logging
import os
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from farm_ar.errors import OptionError, SessionError
from farm_ar.scenes.files import MOST_BYTES, json_in
from farm_ar.service.refusals import RefusedError

if TYPE_CHECKING:
    from farm_ar.service.images import Eye
    from farm_ar.service.served import Served
    from farm_ar.service.service import Answer

TIMED = "solve_ms"
"""The field of an answer that differs between two runs."""

SUFFIX = ".jsonl"

_KEPT = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?")
"""Names that Windows keeps for devices."""

_LOG = logging.getLogger(__name__)


class Asked(NamedTuple):
    """A request, and what was answered."""

    action: str
    body: bytes
    answer: Answer


class Recorder:
    """Keeps what was asked of each session, and answered, in a file of its own.

    Args:
        folder: where; it is made.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self._folder = Path(folder)
        self._begun: set[str] = set()
        self._full: set[str] = set()
        self._folder.mkdir(parents=True, exist_ok=True)

    def add(self, name: str, before: Served | None, ended: int, asked: Asked) -> None:
        """Add a request; before the first one of a session, the session as it was.

        Where there is no room for it nothing more is recorded of the session; the service goes on.

        Args:
            name: of the session.
            before: the session as it was; None where there was none.
            ended: the last revision of the one of this name before it, 0 for none.
            asked: the request.
        """
        if name in self._full:
            return
        lines = list[dict[str, Any]]()
        if name not in self._begun:
            self._begun.add(name)
            row = None if before is None else before.row()
            lines.append({"session": name, "began": row} | ({"ended": ended} if ended else {}))
        text = asked.body.decode("utf-8", "surrogateescape")
        said = asked.answer.body.decode("utf-8")
        lines.append({"action": asked.action, "body": text, "status": asked.answer.status, "answer": said})
        path = self._folder / f"{safe(name)}{SUFFIX}"
        data = "".join(json.dumps(line) + "\n" for line in lines).encode()
        size = path.stat().st_size if path.exists() else 0
        try:
            with path.open("ab", buffering=0) as file:
                if file.write(data) < len(data):
                    raise OSError("no room left")
        except OSError as problem:
            self._full.add(name)
            with suppress(OSError):
                os.truncate(path, size)
            _LOG.warning("nothing more is recorded of session %s: %s", name, problem)


class Played(NamedTuple):
    """A request that was played again: of which session, its number there, and what differs, if anything."""

    session: str
    number: int
    action: str
    difference: str | None


def replay(folder: str | os.PathLike[str], eye: Eye | None = None) -> Iterator[Played]:
    """Play the recordings in a folder again, and compare each answer with what was answered then.

    All but the times must be the same, byte for byte.

    Args:
        folder: of the recordings.
        eye: finds things in images, where there are any.

    Raises:
        OptionError: there are none.
        SessionError: a line is not one of a recording.
    """
    from farm_ar.service.service import Answer, Service
    from farm_ar.service.store import Store

    files = sorted(Path(folder).glob(f"*{SUFFIX}"))
    if not files:
        raise OptionError("folder", "must be one that serve --record has written", str(folder))
    for path in files:
        service, name, number = Service(Store(None), eye=eye), "", 0
        for where, entry in _entries(path):
            if "session" in entry:  # a recording that goes on where the service was started anew
                service, name, number = Service(Store(None), eye=eye), entry["session"], 0
                if entry["began"] is not None:
                    service.store.write(name, entry["began"])
                elif "ended" in entry:
                    service.store.delete(name, entry["ended"])
                service = Service(service.store, eye=eye)
                try:
                    if entry["began"] is not None:
                        service.session(name)
                except RefusedError as problem:
                    raise SessionError("began", problem.expected, "another", where) from None
                continue
            number += 1
            then = Answer(entry["status"], _bytes(entry["answer"]))
            now = service.call(name, entry["action"], _bytes(entry["body"]))
            yield Played(name, number, entry["action"], _difference(then, now))


def safe(name: str) -> str:
    """A session's name as a file's.

    What no session may be called is left out. Some systems take names for the same that differ in capitals,
    or keep some to themselves: those are told apart by a digest.
    """
    from farm_ar.service.wire import SESSION_NAME

    if not SESSION_NAME.fullmatch(name):
        return "refused"
    plain = name == name.lower() and not name.endswith(".") and not _KEPT.fullmatch(name)
    return name if plain and name != "refused" else f"{name}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def _entries(path: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """The lines of a recording, and where each stands.

    Raises:
        SessionError: it is no plain file, or a line is not one of a recording.
    """
    if not path.is_file():
        raise SessionError("file", "must be a plain file", path.name, str(path))
    with path.open("rb") as file:
        for number in itertools.count(1):
            line = file.readline(MOST_BYTES + 1)
            if not line:
                return
            where = f"{path.name}: line {number}"
            if len(line) > MOST_BYTES:
                raise SessionError("line", f"must be at most {MOST_BYTES >> 20} MiB", "more", where)
            yield where, _entry(line, where)


def _entry(line: bytes, where: str) -> dict[str, Any]:
    from farm_ar.service.service import ACTIONS

    try:
        entry = json_in(line.decode("utf-8"))
    except (ValueError, RecursionError):
        entry = None
    right = isinstance(entry, dict)
    if right and "session" in entry:
        right = {"session", "began"} == set(entry) - {"ended"} and isinstance(entry["session"], str)
        right = right and isinstance(entry["began"], dict | None) and type(entry.get("ended", 0)) is int
        right = right and type((entry["began"] or {"revision": 0}).get("revision")) is int
    elif right:
        right = set(entry) == {"action", "body", "status", "answer"} and type(entry["status"]) is int
        right = (
            right and entry["action"] in ACTIONS and _is_bytes(entry["body"]) and _is_bytes(entry["answer"])
        )
    if not right:
        got = line[:60].decode("utf-8", "replace")
        raise SessionError("line", "must be one of a recording", got, where)
    return dict(entry)


def _bytes(text: str) -> bytes:
    """Bytes as a recording has them."""
    return text.encode("utf-8", "surrogateescape")


def _is_bytes(text: object) -> bool:
    try:
        return isinstance(text, str) and _bytes(text) is not None
    except UnicodeEncodeError:
        return False


def _difference(then: Answer, now: Answer) -> str | None:
    if then.status != now.status:
        return f"status {then.status}, now {now.status}"
    if then.body == now.body:
        return None
    try:
        before, after = (json.loads(one.body) for one in (then, now))
        if not isinstance(before, dict):
            raise ValueError
    except (ValueError, RecursionError):
        return "the answer then is not JSON"
    for one in (before, after):
        one.pop(TIMED, None)
    texts = [json.dumps(one) for one in (before, after)]
    if texts[0] == texts[1]:
        return None
    at = next(i for i, (a, b) in enumerate(zip(*texts, strict=False)) if a != b)
    return f"...{texts[0][max(at - 40, 0) : at + 40]}..., now ...{texts[1][max(at - 40, 0) : at + 40]}..."
