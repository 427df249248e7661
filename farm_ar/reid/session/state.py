"""What a session knows, and the events that it follows from: the state is the fold of the events."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from farm_ar.arrays import FloatArray, Record
from farm_ar.errors import SessionError
from farm_ar.reid.adaptive import Disorder
from farm_ar.reid.alignment import moved
from farm_ar.reid.registration import RigidMotion
from farm_ar.reid.session.tracks import Track
from farm_ar.scenes import Detections, Layout, Scene, Snapshot, visible
from farm_ar.scenes.kinds import is_text
from farm_ar.scenes.layout import NO_CATEGORY


@dataclass(frozen=True)
class Aligned:
    """The frame of the snapshots from here on.

    Args:
        x: where its origin is in the map's frame, metres.
        z: likewise.
        turn: how far it is turned, radians, clockwise seen from above.
    """

    x: float
    z: float
    turn: float

    @property
    def motion(self) -> RigidMotion:
        """From that frame to the map's."""
        return RigidMotion(np.zeros(2), np.array([self.x, self.z]), np.array(self.turn))


@dataclass(frozen=True, eq=False)
class Looked(Record):
    """A snapshot was identified.

    Args:
        snapshot: as it came.
        labels: the answer.
        tracks: what is believed of each detection with a track.
        doubted: ids of the detections whose labels were more probably wrong than right.
    """

    snapshot: Snapshot
    labels: tuple[str | None, ...]
    tracks: tuple[Track | None, ...]
    doubted: tuple[str, ...] = ()


@dataclass(frozen=True)
class Corrected(Record):
    """Labels of detections of the last snapshot were set right, by their ids."""

    labels: Mapping[str, str | None]

    def __post_init__(self) -> None:
        object.__setattr__(self, "labels", MappingProxyType(dict(self.labels)))


@dataclass(frozen=True)
class Confirmed:
    """The labels of the last snapshot are known.

    Args:
        labels: of each detection; None for what is to have none.
        learnt: how far objects move, after this snapshot; None where nothing was learnt.
    """

    labels: tuple[str | None, ...]
    learnt: Disorder | None = None


@dataclass(frozen=True)
class Committed:
    """What was confirmed is the layout from here on."""


Event = Aligned | Looked | Corrected | Confirmed | Committed


@dataclass(frozen=True, eq=False)
class Look(Record):
    """The last snapshot.

    Args:
        snapshot: in the map's frame.
        labels: of each detection.
        tracks: what is believed of each detection with a track.
        confirmed: whether its labels are known.
        doubted: ids of the detections whose labels are more probably wrong than right.
    """

    snapshot: Snapshot
    labels: tuple[str | None, ...]
    tracks: tuple[Track | None, ...]
    confirmed: bool = False
    doubted: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class State(Record):
    """What a session knows.

    Args:
        scene: the place with the layout of reference, new objects among it.
        frame: of the snapshots; None if it is the map's.
        look: the last snapshot; None before the first.
        seen: where labels were confirmed to be since the last commit, as rows (x, z, yaw, y).
        viewed: labels whose places were in view in confirmed snapshots since then.
        confirmed: whether there was any such snapshot.
        lost: labels whose objects were not where they had been, and have not been found.
        learnt: how far objects move; None where nothing was learnt.
    """

    scene: Scene
    frame: Aligned | None = None
    look: Look | None = None
    seen: Mapping[str, tuple[float, float, float, float]] = field(default_factory=dict)
    viewed: frozenset[str] = frozenset()
    confirmed: bool = False
    lost: tuple[str, ...] = ()
    learnt: Disorder | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "seen", MappingProxyType(dict(self.seen)))


def fold(state: State, events: Iterable[Event]) -> State:
    """The state after events.

    Raises:
        SessionError: an event cannot follow those before it.
    """
    for event in events:
        state = after(state, event)
    return state


def after(state: State, event: Event) -> State:
    """The state after one more event.

    Raises:
        SessionError: it cannot follow.
    """
    if isinstance(event, Aligned):
        look = state.look
        if look is not None and not look.confirmed:  # what was believed in another frame says nothing
            look = replace(look, tracks=(None,) * len(look.tracks))
        return replace(state, frame=event, look=look)
    if isinstance(event, Looked):
        return _looked(state, event)
    if isinstance(event, Committed):
        return _committed(state)
    look = open_look(state)
    if isinstance(event, Corrected):
        labels = corrected(state, look, event.labels)
        doubted = tuple([name for name in look.doubted if name not in event.labels])
        return replace(state, look=replace(look, labels=labels, doubted=doubted))
    return _confirmed(state, look, event)


def in_map(state: State, snapshot: Snapshot) -> Snapshot:
    """A snapshot in the map's frame."""
    return snapshot if state.frame is None else moved(snapshot, state.frame.motion)


def open_look(state: State) -> Look:
    """The last snapshot, whose labels may still be set.

    Raises:
        SessionError: there is none, or its labels have been confirmed.
    """
    if state.look is None:
        raise SessionError("session", "must have identified a snapshot before", "none")
    if state.look.confirmed:
        expected = "must be of a snapshot that is not confirmed: undo that, or identify the next one"
        raise SessionError("labels", expected, "a confirmed snapshot")
    return state.look


def corrected(state: State, look: Look, changes: Mapping[str, str | None]) -> tuple[str | None, ...]:
    """The labels of the last snapshot with changes; a label that is given anew is taken from its detection.

    Raises:
        SessionError: a detection is not there, or a label cannot be given.
    """
    ids, labels = look.snapshot.detections.ids, list(look.labels)
    for name in changes:
        if name not in ids:
            raise SessionError("detection", f"must be one of {', '.join(ids) or 'none'}", name)
    for label in changes.values():
        if label is not None and not is_text(label):
            raise SessionError("label", "must be a non-empty string of Unicode, or None", label)
    given = {label for label in changes.values() if label is not None}
    labels = [None if label in given else label for label in labels]
    for name, label in changes.items():
        labels[ids.index(name)] = label
    check_labels(state, look.snapshot, labels)
    return tuple(labels)


def check_labels(state: State, snapshot: Snapshot, labels: Iterable[str | None]) -> None:
    """See that labels can be given to the detections of a snapshot.

    Raises:
        SessionError: there is not one for each, one is no name or given twice, or a new one is given to a
            detection whose category is not known.
    """
    given, seen = list(labels), snapshot.detections
    if len(given) != len(seen):
        raise SessionError("labels", f"must be one, or None, for each of {len(seen)} detections", len(given))
    names = [label for label in given if label is not None]
    for i, label in enumerate(given):
        if label is None:
            continue
        if not is_text(label):
            raise SessionError(f"labels[{i}]", "must be a non-empty string of Unicode, or None", label)
        if names.count(label) > 1:
            raise SessionError(f"labels[{i}]", "must not be given to two detections", label)
        if not np.isfinite(seen.position[i]).all():
            expected = f"must be None: the pose of detection {seen.ids[i]} cannot be used"
            raise SessionError(f"labels[{i}]", expected, label)
        layout = state.scene.layout
        if label not in layout.labels and seen.category[i] is None and layout.names_categories:
            expected = f"must be a label of the scene: detection {seen.ids[i]} has no category for a new one"
            raise SessionError(f"labels[{i}]", expected, label)


def check_categories(
    state: State, snapshot: Snapshot, labels: Iterable[str | None], before: Iterable[str | None]
) -> None:
    """See that labels that are new to their detections are of the same categories.

    Raises:
        SessionError: one is of another category.
    """
    layout, seen = state.scene.layout, snapshot.detections
    category = dict(zip(layout.labels, layout.category, strict=True)) if layout.names_categories else {}
    for i, (label, old) in enumerate(zip(labels, before, strict=True)):
        own, mine = category.get(label or ""), seen.category[i]
        if label != old and None not in (own, mine) and own != mine:
            expected = (
                f"must be of category {mine}, as detection {seen.ids[i]} is; force=True gives it anyhow"
            )
            raise SessionError(f"labels[{i}]", expected, f"{label}, a {own}")


def _looked(state: State, event: Looked) -> State:
    n = len(event.snapshot.detections)
    if len(event.labels) != n or len(event.tracks) != n:
        expected = f"must have an entry for each of {n} detections"
        raise SessionError("labels, tracks", expected, (len(event.labels), len(event.tracks)))
    known = set(state.scene.layout.labels)
    # A label may have been new when the snapshot was identified, and its confirmation undone since.
    labels = tuple(label if label in known else None for label in event.labels)
    look = Look(in_map(state, event.snapshot), labels, event.tracks, doubted=event.doubted)
    return State.trusted(**vars(state) | {"look": look})


def _confirmed(state: State, look: Look, event: Confirmed) -> State:
    check_labels(state, look.snapshot, event.labels)
    found, known = look.snapshot.detections, set(state.scene.layout.labels)
    new = [i for i, label in enumerate(event.labels) if label is not None and label not in known]
    in_view = visible(state.scene.layout, look.snapshot.camera, occlusion=True) & state.scene.layout.movable
    viewed = {label for label, here in zip(state.scene.layout.labels, in_view, strict=True) if here}
    seen = dict(state.seen)
    for i, label in enumerate(event.labels):
        if label is not None:
            x, z = found.position[i].tolist()
            seen[label] = (x, z, float(found.yaw[i]), float(found.elevation[i]))
    tracks = tuple(
        None if track is None else track.confirmed(label)
        for track, label in zip(look.tracks, event.labels, strict=True)
    )
    return replace(
        state,
        scene=state.scene.knowing(_enrolled(state.scene.layout, look.snapshot, event.labels, new)),
        look=Look(look.snapshot, event.labels, tracks, confirmed=True),
        seen=seen,
        viewed=state.viewed | viewed,
        confirmed=True,
        lost=tuple(label for label in state.lost if label not in seen),
        learnt=event.learnt or state.learnt,
    )


def _enrolled(layout: Layout, snapshot: Snapshot, labels: tuple[str | None, ...], new: list[int]) -> Layout:
    """The layout with new objects, where they were detected."""
    if not new:
        return layout
    seen = snapshot.detections
    # A single category would rule out all that has none.
    category = [str(seen.category[i]) if layout.names_categories else NO_CATEGORY for i in new]
    return Layout(
        labels=(*layout.labels, *[str(labels[i]) for i in new]),
        category=(*layout.category, *category),
        position=np.vstack([layout.position, seen.position[new]]),
        yaw=np.concatenate([layout.yaw, seen.yaw[new]]),
        size=np.vstack([layout.size, seen.size[new]]),
        elevation=np.concatenate([layout.elevation, seen.elevation[new]]),
        fixed=np.concatenate([layout.fixed, np.zeros(len(new), dtype=bool)]),
        tilt=_enrolled_tilt(layout, seen, new),
    )


def _enrolled_tilt(layout: Layout, seen: Detections, new: list[int]) -> FloatArray | None:
    if layout.tilt is None and seen.tilt is None:
        return None
    before = np.zeros((len(layout), 2)) if layout.tilt is None else layout.tilt
    return np.vstack([before, np.zeros((len(new), 2)) if seen.tilt is None else seen.tilt[new]])


def _committed(state: State) -> State:
    if not state.confirmed:
        raise SessionError("session", "must have confirmed a snapshot since the last commit", "none")
    layout = state.scene.layout
    position, yaw, elevation = layout.position.copy(), layout.yaw.copy(), layout.elevation.copy()
    for j, label in enumerate(layout.labels):
        if label in state.seen and not layout.fixed[j]:
            x, z, heading, y = state.seen[label]
            position[j], elevation[j] = (x, z), y
            yaw[j] = yaw[j] if np.isnan(heading) else heading
    missing = state.viewed - set(state.seen)
    lost = tuple(label for label in layout.labels if label in missing or label in state.lost)
    layout = replace(layout, position=position, yaw=yaw, elevation=elevation)
    scene = state.scene.knowing(layout)
    return replace(state, scene=scene, seen={}, viewed=frozenset(), confirmed=False, lost=lost)
