"""The file of a session: one JSON document of the place, the options and the events that were not undone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from farm_ar.arrays import SHARE
from farm_ar.errors import InputError, SessionError
from farm_ar.reid.adaptive import Disorder
from farm_ar.reid.session.known import (
    FRAME,
    KNOWN,
    LABEL,
    LEARNT,
    LOOK,
    Unread,
    known_from_dict,
    known_to_dict,
    look_from_dict,
    look_to_dict,
)
from farm_ar.reid.session.state import Aligned, Committed, Confirmed, Corrected, Event, Looked, State
from farm_ar.scenes import scene_from_dict, scene_to_dict
from farm_ar.scenes.documents import Document, Listing, Named, Object
from farm_ar.scenes.files import degrees
from farm_ar.scenes.json_files import SCENE
from farm_ar.scenes.kinds import Kind, MismatchError, Number, OrNull, Text, Whole, radians

VERSION = 1
"""Of the form of the file."""


@dataclass(frozen=True)
class _OneEvent(Kind):
    """An event: an object whose field `event` names which, and says what others it has."""

    kinds: Mapping[str, Object]

    def check(self, value: object) -> Any:
        """See `Kind`."""
        if not isinstance(value, dict):
            raise MismatchError("must be a JSON object", value)
        name = value.get("event")
        if not isinstance(name, str) or name not in self.kinds:
            raise MismatchError(f"must be one of {', '.join(self.kinds)}", name, ("event",))
        return self.kinds[name].check(value)

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        return {"anyOf": [kind.schema() for kind in self.kinds.values()]}


def _event(name: str, **fields: Kind) -> Object:
    return Object({"event": Text((name,)), **fields})


SESSION = Document(
    "session",
    Object(
        {
            "version": Whole(VERSION, VERSION, about="Of the form of the file."),
            "scene": Unread(SCENE.top, about="The place as it was before the first event."),
            "known": OrNull(
                KNOWN, "what is known", default=None, about="Beside the place; null: nothing yet."
            ),
            "reid": OrNull(Text(), "a method's name", about="null: a method of one's own."),
            "switch_rate": Number(SHARE, about="How probable it is that a track is then on another thing."),
            "events": Listing(
                _OneEvent(
                    {
                        "aligned": _event("aligned", **FRAME),
                        "looked": _event("looked", **LOOK),
                        "corrected": _event("corrected", labels=Named(LABEL)),
                        "confirmed": _event("confirmed", labels=Listing(LABEL), learnt=LEARNT),
                        "committed": _event("committed"),
                    }
                ),
                about="What happened and was not undone, in order.",
            ),
        },
        notes=True,
        about="A session: the place, and what was seen, confirmed and corrected in it since.",
    ),
    SessionError,
)
"""What a session's file holds."""


@dataclass(frozen=True)
class Recorded:
    """The contents of a session's file.

    Args:
        begin: what was known before the first event.
        reid: name of the method; None for one of the user's own.
        switch_rate: of tracks.
        events: those that were not undone.
    """

    begin: State
    reid: str | None
    switch_rate: float
    events: tuple[Event, ...]


def recorded_to_dict(recorded: Recorded) -> dict[str, Any]:
    """The contents of a session's file."""
    known = known_to_dict(recorded.begin)
    return {
        "version": VERSION,
        "scene": scene_to_dict(recorded.begin.scene),
        **({} if known is None else {"known": known}),
        "reid": recorded.reid,
        "switch_rate": recorded.switch_rate,
        "events": [_event_to_dict(event) for event in recorded.events],
    }


def recorded_from_dict(data: object, source: str | None = None) -> Recorded:
    """Read the contents of a session's file.

    Raises:
        SessionError: a value in it cannot be used; names the file and the field.
    """
    values = SESSION.read(data, source)
    try:
        scene = scene_from_dict(values["scene"], default_name="scene")
    except InputError as problem:
        raise _inside("scene", problem, source) from None
    try:
        begin = known_from_dict(scene, values["known"])
    except InputError as problem:
        raise _inside("known", problem, source) from None
    events = tuple(_read_events(values["events"], source))
    return Recorded(begin, values["reid"], values["switch_rate"], events)


def _inside(place: str, problem: InputError, source: str | None) -> SessionError:
    """An error of a part of the file as one of the file."""
    return SessionError(f"{place}.{problem.field}", problem.expected, problem.got, source)


def _read_events(values: Iterable[Mapping[str, Any]], source: str | None) -> Iterable[Event]:
    for i, one in enumerate(values):
        try:
            yield _event_from_dict(one)
        except InputError as problem:
            raise _inside(f"events[{i}]", problem, source) from None


def _event_from_dict(one: Mapping[str, Any]) -> Event:
    if one["event"] == "aligned":
        return Aligned(one["x"], one["z"], radians(one["yaw_deg"]))
    if one["event"] == "looked":
        return Looked(*look_from_dict(one))
    if one["event"] == "corrected":
        return Corrected(one["labels"])
    if one["event"] == "confirmed":
        learnt = None if one["learnt"] is None else Disorder.from_json(one["learnt"])
        return Confirmed(tuple(one["labels"]), learnt)
    return Committed()


def _event_to_dict(event: Event) -> dict[str, Any]:
    if isinstance(event, Aligned):
        return {"event": "aligned", "x": event.x, "z": event.z, "yaw_deg": degrees(event.turn)}
    if isinstance(event, Looked):
        return {"event": "looked", **look_to_dict(event.snapshot, event.labels, event.tracks, event.doubted)}
    if isinstance(event, Corrected):
        return {"event": "corrected", "labels": dict(event.labels)}
    if isinstance(event, Confirmed):
        learnt = None if event.learnt is None else event.learnt.to_json()
        return {"event": "confirmed", "labels": list(event.labels), "learnt": learnt}
    return {"event": "committed"}
