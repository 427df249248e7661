"""The service without a network: requests on sessions go in, answers come out and are recorded."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import orjson

from farm_ar.errors import InputError
from farm_ar.service.images import Eye
from farm_ar.service.limits import ServiceLimits
from farm_ar.service.recordings import Asked, Recorder
from farm_ar.service.refusals import (
    BUSY,
    STALE,
    TOO_LARGE,
    TOO_MANY,
    TOO_SLOW,
    UNKNOWN_SESSION,
    WRONG,
    RefusedError,
    values_of,
)
from farm_ar.service.served import Served
from farm_ar.service.store import Store
from farm_ar.service.usual_form import usual_snapshot
from farm_ar.service.wire import SESSION_NAME, SnapshotBody, parsed, read_layout, read_snapshots

Values = dict[str, Any]

ACTIONS = ("layout", "snapshots", "image", "align", "confirm", "undo", "delete")
"""What can be done to a session."""

SEPARATOR = b"\x00"
"""Between the camera and the image in the body of the action `image`; no JSON has it."""

MOST_IMAGES = 8
"""Sessions of which the last image is kept, to be looked at."""


BRIEF_S = 1.5e-3
"""What takes less processor time is done at once, not in a thread."""


class Answer(NamedTuple):
    """What a request is answered: an HTTP status, a body of some kind, and when it may be asked again."""

    status: int
    body: bytes
    kind: str = "application/json"
    again_s: int = 1

    @property
    def headers(self) -> dict[str, str]:
        """Headers that a refusal has beside its kind."""
        again = {"Retry-After": str(self.again_s)} if self.status in (TOO_MANY, BUSY) else {}
        again["X-Content-Type-Options"] = "nosniff"
        return again | ({"Connection": "close"} if self.status in (TOO_LARGE, TOO_SLOW) else {})


@dataclass
class Service:
    """Sessions by name. Requests on one session must come one after another; those on others need not.

    Args:
        store: where sessions are kept.
        limits: what is taken at most.
        recorder: keeps what was asked and answered; None for none.
        eye: finds things in images; None where images are not taken.
    """

    store: Store
    limits: ServiceLimits = field(default_factory=ServiceLimits)
    recorder: Recorder | None = None
    eye: Eye | None = None
    _images: dict[str, bytes] = field(default_factory=dict)
    _open: dict[str, Served] = field(default_factory=dict)
    _names: set[str] = field(default_factory=set)
    _brief: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._names |= set(self.store.names())

    @property
    def names(self) -> list[str]:
        """The sessions, in order."""
        return sorted(self._names)

    def session(self, name: str) -> Served:
        """A session as it is.

        Raises:
            RefusedError: there is none of this name.
        """
        if name not in self._open:
            row = self.store.read(name) if name in self._names else None
            if row is None:
                raise RefusedError(UNKNOWN_SESSION, "session", "must be one that was given a layout", name)
            try:
                self._open[name] = Served.from_row(name, row)
            except (InputError, KeyError, TypeError, ValueError, AttributeError) as problem:
                expected = f"must be one that this service has stored ({type(problem).__name__}): delete it"
                raise RefusedError(WRONG, "session", expected, name) from None
        return self._open[name]

    def call(self, name: str, action: str, body: bytes) -> Answer:
        """Do something to a session.

        Args:
            name: of the session.
            action: one of `ACTIONS`.
            body: of the request, JSON; with an image as `_seen_in` says.
        """
        before = self._as_it_was(name) if self.recorder else None
        ended = self.store.ended(name) if self.recorder and before is None else 0
        begun = time.thread_time()
        answer = answered(lambda: self._do(name, action, body))
        took = time.thread_time() - begun
        if action == "snapshots" and answer.status == 200 and took < BRIEF_S:
            self._brief[name] = len(body)
        else:
            self._brief.pop(name, None)
        if self.recorder:
            self.recorder.add(name, before, ended, Asked(action, body, answer))
        return answer

    def _as_it_was(self, name: str) -> Served | None:
        """A session before a request; None where there is none that can be read."""
        try:
            return self.session(name) if name in self._names else None
        except RefusedError:
            return None

    def is_brief(self, name: str, body: bytes) -> bool:
        """Whether a snapshot is answered so soon, as the last one was, that a thread would take longer."""
        return self.recorder is None and len(body) <= 2 * self._brief.get(name, 0)

    def state(self, name: str, frame: str) -> Answer:
        """All that is known of a session, in a frame."""
        return answered(lambda: (200, self.session(name).state(frame) | {"image": name in self._images}))

    def image(self, name: str) -> bytes:
        """The last image of a session.

        Raises:
            RefusedError: there is none.
        """
        if name not in self._images:
            raise RefusedError(UNKNOWN_SESSION, "image", "must have come with the last snapshot", name)
        return self._images[name]

    def _do(self, name: str, action: str, body: bytes) -> tuple[int, Values]:
        if not SESSION_NAME.fullmatch(name):
            expected = "must be at most 64 letters, digits, dots, dashes and underscores"
            raise RefusedError(WRONG, "session", expected, name)
        if action == "layout":
            return self._begin(name, body)
        if action == "delete":
            if name not in self._names:
                self.session(name)
            self.store.delete(name, self.store.revision(name))
            self._names.discard(name)
            self._open.pop(name, None)
            self._images.pop(name, None)
            return 200, {"session": name, "deleted": True}
        served = self.session(name)
        if action == "image":
            after, reply = served.look(self._seen_in(served, body), body)
            self._images[name] = body.partition(SEPARATOR)[2]
            for old in list(self._images)[:-MOST_IMAGES]:
                self._images.pop(old, None)
        else:
            after, reply = self._asked(served, action, body)
        if after.revision != served.revision:
            self.store.write(name, after.row())
        self._open[name] = after
        return 200, reply

    def _asked(self, served: Served, action: str, body: bytes) -> tuple[Served, Values]:
        if action == "snapshots":
            asked = usual_snapshot(body, self.limits)
            if asked is None:
                asked = read_snapshots(parsed(body, self.limits.most_text), self.limits)
            seen = served.look(asked, body)
            self._images.pop(served.name, None)
            return seen
        data = parsed(body, self.limits.most_text)
        if action == "align":
            return served.align(data, self.limits)
        return served.confirm(data, self.limits) if action == "confirm" else served.undo(data)

    def _seen_in(self, served: Served, body: bytes) -> SnapshotBody:
        """What an image shows: the body is its camera as JSON, `SEPARATOR`, and the image."""
        if self.eye is None:
            expected = "must not be given: the service was started without --meshes"
            raise RefusedError(WRONG, "image", expected, "an image")
        camera, _, image = body.partition(SEPARATOR)
        return self.eye.look(parsed(camera, self.limits.most_text), image, served.session.scene, self.limits)

    def _begin(self, name: str, body: bytes) -> tuple[int, Values]:
        given = read_layout(parsed(body, self.limits.most_text), self.limits)
        there = name in self._names
        revision = self.session(name).revision if there else self.store.ended(name)
        if there:
            if given.revision != revision:
                expected = f"must be {revision}, the session's, to replace it"
                raise RefusedError(STALE, "revision", expected, given.revision)
        elif given.revision is not None:
            raise RefusedError(
                STALE, "revision", "must be left out where there is no session yet", given.revision
            )
        elif len(self._names) >= self.limits.most_sessions:
            raise RefusedError(
                TOO_MANY, "session", f"must be one of {self.limits.most_sessions} at most", name
            )
        served = Served.begin(name, given, revision + 1)
        self.store.write(name, served.row())
        self._open[name] = served
        self._names.add(name)
        return 200 if there else 201, {
            "session": name,
            "revision": served.revision,
            "method": served.method,
            "options": dict(served.options),
            "objects": len(given.scene.layout),
        }


def answered(do: Callable[[], tuple[int, Mapping[str, Any]]]) -> Answer:
    """The answer to a request: what is done gives, or why it is refused."""
    try:
        status, values = do()
        return Answer(status, encoded(values))
    except InputError as problem:
        return refused(problem)


def refused(problem: InputError) -> Answer:
    """The answer that says what is wrong."""
    status, again_s = getattr(problem, "status", WRONG), getattr(problem, "again_s", 1)
    return Answer(status, encoded(values_of(problem)), again_s=again_s)


def encoded(values: Mapping[str, Any]) -> bytes:
    """JSON in UTF-8, in which there is no number that is not finite."""
    try:
        return orjson.dumps(values)
    except TypeError:  # half of a surrogate pair, or a whole number beyond 64 bits
        text = json.dumps(values, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
        return text.encode("utf-8", "replace")
