"""The file of a session: one JSON document of the place, the options and the events that were not undone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from farm_ar.arrays import POSITION, SHARE, Limits
from farm_ar.errors import InputError, SessionError
from farm_ar.reid.adaptive import Disorder
from farm_ar.reid.session.state import Aligned, Committed, Confirmed, Corrected, Event, Looked
from farm_ar.reid.session.tracks import Track
from farm_ar.scenes import (
    Detections,
    Scene,
    Snapshot,
    scene_from_dict,
    scene_to_dict,
    snapshot_from_dict,
    snapshot_to_dict,
)
from farm_ar.scenes.documents import (
    DEGREES,
    Document,
    Flag,
    Kind,
    Listing,
    MismatchError,
    Named,
    Number,
    Numbers,
    Object,
    OrNull,
    Text,
    Whole,
    radians,
)
from farm_ar.scenes.files import degrees
from farm_ar.scenes.json_files import SCENE, SNAPSHOT

VERSION = 1
"""Of the form of the file."""


@dataclass(frozen=True)
class _Unread(Kind):
    """A value of a kind that another reader reads; checked here, and left as it is."""

    kind: Kind

    def check(self, value: object) -> object:
        """See `Kind`."""
        self.kind.check(value)
        return value

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        return self.kind.rule()


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


_LABEL = OrNull(Text(), "a label")
_TRACK = Object(
    {
        "start": Numbers(2, POSITION, "[x, z] in metres"),
        "held": Flag(default=False),
        "belief": Named(Number(SHARE)),
    }
)
_LEARNT = _Unread(
    Object({"snapshots": Whole(0, 10**9)}, open=True),
    about="How untidy the place is, as the method has learnt it.",
)
_SHIFT = Number(Limits(-1e8, 1e8, ""))

SESSION = Document(
    "session",
    Object(
        {
            "version": Whole(VERSION, VERSION, about="Of the form of the file."),
            "scene": _Unread(SCENE.top, about="The place as it was when the session began."),
            "reid": OrNull(Text(), "a method's name", about="null: a method of one's own."),
            "switch_rate": Number(SHARE, about="How probable it is that a track is then on another thing."),
            "events": Listing(
                _OneEvent(
                    {
                        "aligned": _event("aligned", x=_SHIFT, z=_SHIFT, yaw_deg=Number(DEGREES)),
                        "looked": _event(
                            "looked",
                            snapshot=_Unread(SNAPSHOT.top, about="As it came."),
                            labels=Listing(_LABEL),
                            tracks=Listing(OrNull(_TRACK, "a track")),
                            broken=Named(
                                Text(),
                                default={},
                                about="Why a pose could not be used, by the detection's id.",
                            ),
                            doubted=Listing(
                                Text(), default=(), about="Ids of detections whose labels were improbable."
                            ),
                        ),
                        "corrected": _event("corrected", labels=Named(_LABEL)),
                        "confirmed": _event(
                            "confirmed",
                            labels=Listing(_LABEL),
                            learnt=OrNull(_LEARNT, "what was learnt", default=None),
                        ),
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
        scene: as it was in the beginning.
        reid: name of the method; None for one of the user's own.
        switch_rate: of tracks.
        events: those that were not undone.
    """

    scene: Scene
    reid: str | None
    switch_rate: float
    events: tuple[Event, ...]


def recorded_to_dict(recorded: Recorded) -> dict[str, Any]:
    """The contents of a session's file."""
    return {
        "version": VERSION,
        "scene": scene_to_dict(recorded.scene),
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
    events = tuple(_read_events(values["events"], source))
    return Recorded(scene, values["reid"], values["switch_rate"], events)


def canonical(snapshot: Snapshot) -> Snapshot:
    """A snapshot as it comes back from a file."""
    return _snapshot_from(snapshot_to_dict(_placed(snapshot)), _broken(snapshot))


def _broken(snapshot: Snapshot) -> dict[str, str]:
    """Why poses cannot be used, by the ids of their detections."""
    seen = snapshot.detections
    reasons = seen.broken or (None,) * len(seen)
    lost = np.flatnonzero(~np.isfinite(seen.position).all(axis=-1)).tolist()
    return {seen.ids[i]: reasons[i] or "its position is not a number" for i in lost}


def _placed(snapshot: Snapshot) -> Snapshot:
    """The snapshot with what stands nowhere at the origin, so that a file can hold it."""
    seen = snapshot.detections
    changes: dict[str, Any] = {name: np.nan_to_num(getattr(seen, name)) for name in ("position", "elevation")}
    return replace(snapshot, detections=Detections.trusted(**vars(seen) | changes))


def _snapshot_from(data: object, broken: Mapping[str, str]) -> Snapshot:
    """A snapshot of which some poses are not known."""
    snapshot = snapshot_from_dict(data)
    if not broken:
        return snapshot
    seen = snapshot.detections
    position, elevation = seen.position.copy(), seen.elevation.copy()
    reasons = tuple([broken.get(name) for name in seen.ids])
    lost = [reason is not None for reason in reasons]
    position[lost], elevation[lost] = np.nan, np.nan
    return replace(snapshot, detections=replace(seen, position=position, elevation=elevation, broken=reasons))


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
        try:
            snapshot = _snapshot_from(one["snapshot"], one["broken"])
        except InputError as problem:
            raise SessionError(f"snapshot.{problem.field}", problem.expected, problem.got) from None
        tracks = [None if t is None else Track(t["start"], t["held"], t["belief"]) for t in one["tracks"]]
        return Looked(snapshot, tuple(one["labels"]), tuple(tracks), tuple(one["doubted"]))
    if one["event"] == "corrected":
        return Corrected(one["labels"])
    if one["event"] == "confirmed":
        learnt = None if one["learnt"] is None else Disorder.from_json(one["learnt"])
        return Confirmed(tuple(one["labels"]), learnt)
    return Committed()


def _event_to_dict(event: Event) -> dict[str, Any]:
    values: dict[str, Any]
    if isinstance(event, Aligned):
        return {"event": "aligned", "x": event.x, "z": event.z, "yaw_deg": degrees(event.turn)}
    if isinstance(event, Looked):
        tracks = [
            t and {"start": list(t.start), "held": t.held, "belief": dict(t.belief)} for t in event.tracks
        ]
        values = {"labels": list(event.labels), "tracks": tracks}
        if broken := _broken(event.snapshot):
            values["broken"] = broken
        if event.doubted:
            values["doubted"] = list(event.doubted)
        return {"event": "looked", "snapshot": snapshot_to_dict(_placed(event.snapshot)), **values}
    if isinstance(event, Corrected):
        return {"event": "corrected", "labels": dict(event.labels)}
    if isinstance(event, Confirmed):
        learnt = None if event.learnt is None else event.learnt.to_json()
        return {"event": "confirmed", "labels": list(event.labels), "learnt": learnt}
    return {"event": "committed"}
