"""`Session`: align, identify, confirm, correct, undo, commit; saved and loaded."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.arrays import SHARE, FloatArray
from farm_ar.errors import OptionError, SceneError, SessionError
from farm_ar.reid.adaptive import AdaptiveReid, Disorder
from farm_ar.reid.alignment import Alignment, Pose, align, spacing_of
from farm_ar.reid.alignment.method import CERTAIN
from farm_ar.reid.answers import Identification
from farm_ar.reid.base import Reidentifier
from farm_ar.reid.checked import identify, usable
from farm_ar.reid.registry import REIDENTIFIERS, ReidFactory, reid_factory
from farm_ar.reid.session.documents import Recorded, recorded_from_dict, recorded_to_dict
from farm_ar.reid.session.known import as_in_a_file, canonical
from farm_ar.reid.session.state import (
    Aligned,
    Committed,
    Confirmed,
    Corrected,
    Event,
    Looked,
    State,
    after,
    check_categories,
    check_labels,
    corrected,
    fold,
    in_map,
    open_look,
)
from farm_ar.reid.session.tracks import Track, going_on, hints, with_tracks
from farm_ar.scenes import Camera, Scene, Snapshot
from farm_ar.scenes.files import degrees, read_json, write_text
from farm_ar.scenes.kinds import radians


class Session:
    """Identities over many snapshots of one place.

    What it knows, `state`, is the fold of `events`: snapshots that were identified, and decisions about them.
    A decision can be undone, the last one first; a snapshot gives way to the next one.

    Args:
        scene: the place with its layout of reference.
        reid: the method: a name, or what makes it for a scene. What is learnt counts with `adaptive`.
        switch_rate: how probable it is that a track is on another thing at the next snapshot.

    Raises:
        OptionError: the method is not known, or the rate is not from 0 to 1.
    """

    def __init__(self, scene: Scene, reid: str | ReidFactory = "adaptive", switch_rate: float = 0.02) -> None:
        self._make = reid_factory(reid)
        if isinstance(switch_rate, bool) or not SHARE.allow(switch_rate):
            raise OptionError("switch_rate", SHARE.expected, switch_rate)
        self._name = reid if isinstance(reid, str) else None
        self._switch_rate = float(switch_rate)
        # As it comes back from a file, so that saving changes nothing.
        self._begin = as_in_a_file(State(scene))
        self._events: tuple[Event, ...] = ()
        self._state = self._begin

    def __copy__(self) -> Session:
        made = object.__new__(type(self))
        vars(made).update(vars(self))
        return made

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened and was not undone; of snapshots without a decision about them only the last."""
        return self._events

    @property
    def state(self) -> State:
        """What is known."""
        return self._state

    @property
    def scene(self) -> Scene:
        """The place with the layout of reference as it is now."""
        return self._state.scene

    @property
    def lost(self) -> tuple[str, ...]:
        """Labels whose objects were not where they had been, and have not been found."""
        return self._state.lost

    def align(
        self,
        snapshot: Snapshot,
        anchor: tuple[Pose, Pose] | None = None,
        at_least: float = CERTAIN,
    ) -> Alignment:
        """Find the frame of the snapshots; from here on they are taken to be in it, if it is the right one.

        Args:
            snapshot: in that frame.
            anchor: as of `align`.
            at_least: how probable it must be that the motion is the right one, however exact (`roughly`).

        Returns:
            The alignment, taken or not.
        """
        found = align(self.scene, snapshot, anchor)
        if found.roughly >= at_least:
            start = found.motion.about(np.zeros(2))
            x, z = start.shift.tolist()
            self._add(Aligned(x, z, radians(degrees(start.turn))))
        return found

    def identify(
        self, snapshot: Snapshot, cameras: Sequence[Camera] = (), checks: bool = True
    ) -> Identification:
        """The label of each detection of a snapshot, in the light of all that is known.

        Args:
            snapshot: in the frame of the session.
            cameras: all of them, where the detections are objects that several saw (`fusion.objects_of`).
            checks: whether scene and snapshot are checked, for warnings.

        Raises:
            SnapshotError: the method refuses the snapshot.
        """
        state, came = self._state, canonical(snapshot)
        snapshot = in_map(state, came)
        seen, layout = snapshot.detections, state.scene.layout
        given, going = None, dict[int, Track]()
        if state.look is not None and any(seen.track_id):
            spacing = spacing_of(layout.position, layout.size)
            going = going_on(state.look.snapshot.detections, state.look.tracks, seen, spacing)
        if len(layout):
            method = self._reid
            if cameras:
                method = _Fused(method, [in_map(state, replace(came, camera=one)).camera for one in cameras])
            answer = identify(self.scene, snapshot, method, checks=checks)
            if isinstance(self._reid, AdaptiveReid) and any(track.held for track in going.values()):
                hinted = _Hinted(self._reid, hints(layout.labels, seen, going))
                given = identify(self.scene, snapshot, hinted, checks=checks)
        else:
            answer = Identification((None,) * len(seen))
        answer, tracks = with_tracks(answer, given, layout.labels, seen, going, self._switch_rate)
        self._add(Looked(came, answer.labels, tracks, doubted_in(answer, came)))
        return answer

    def correct(self, labels: Mapping[str, str | None], force: bool = False) -> None:
        """Set labels of detections of the last snapshot right.

        Args:
            labels: by the ids of the detections; None for none. A label that another detection had leaves
                it. A new label enrols the object, once it is confirmed.
            force: whether a label may go to a detection of another category than its object's.

        Raises:
            SessionError: there is no snapshot, it is confirmed, a detection is not in it, or a label cannot
                be given.
        """
        if not isinstance(labels, Mapping):
            raise SessionError("labels", "must be labels by the ids of detections", labels)
        look = open_look(self._state)
        after_it = corrected(self._state, look, labels)
        if not force:
            check_categories(self._state, look.snapshot, after_it, look.labels)
        self._add(Corrected(labels))

    def confirm(
        self, labels: Identification | Sequence[str | None] | None = None, force: bool = False
    ) -> tuple[str, ...]:
        """Take the labels of the last snapshot as known, and learn from them how far objects move.

        Confirm one snapshot of each arrangement: each counts. Confirming the same again does nothing.

        Args:
            labels: an answer, or the label of each detection; as they were given and corrected by default.
            force: whether a label may go to a detection of another category than its object's.

        Returns:
            The ids of the detections whose labels were not corrected and had a probability below 0.5: `undo`,
            and correct them, unless they are known to be right.

        Raises:
            SessionError: there is no snapshot, other labels of it have been confirmed, or a label cannot be
                given.
        """
        state, look = self._state, self._state.look
        given = labels.labels if isinstance(labels, Identification) else labels
        if isinstance(given, str):
            raise SessionError("labels", "must be the label of each detection", given)
        if look is not None and look.confirmed and (given is None or tuple(given) == look.labels):
            return ()
        look = open_look(state)
        known = look.labels if given is None else tuple(given)
        check_labels(state, look.snapshot, known)
        if not force:
            check_categories(state, look.snapshot, known, look.labels)
        doubted = look.doubted if labels is None else ()
        if isinstance(labels, Identification):
            doubted = doubted_in(labels, look.snapshot)
        self._add(Confirmed(known, self._learnt(look.snapshot, known)))
        return doubted

    def commit(self) -> None:
        """Take what was confirmed since the last commit for the layout of reference.

        Labels that were seen are where they were seen; those whose places were in view, and empty, are lost.

        Raises:
            SessionError: nothing was confirmed.
        """
        self._add(Committed())

    def undo(self) -> Event:
        """Undo the last decision: an alignment, a correction, a confirmation or a commit.

        Returns:
            What was undone.

        Raises:
            SessionError: there is nothing to undo.
        """
        decisions = [i for i, event in enumerate(self._events) if not isinstance(event, Looked)]
        if not decisions:
            raise SessionError("session", "must have a decision to undo", "none")
        last = decisions[-1]
        later = self._events[last + 1 :]
        if isinstance(self._events[last], Aligned):  # what was believed in that frame says nothing
            later = tuple(
                [replace(one, tracks=(None,) * len(one.tracks)) for one in later if isinstance(one, Looked)]
            )
        events = _without_idle_looks((*self._events[:last], *later))
        undone, self._state = self._events[last], fold(self._begin, events)
        self._events = events
        self.__dict__.pop("_reid", None)
        return undone

    def settle(self, decisions: int) -> None:
        """Take the first decisions for final: they cannot be undone, and their snapshots are forgotten.

        Args:
            decisions: how many.

        Raises:
            SessionError: there are not so many.
        """
        ends = [i + 1 for i, event in enumerate(self._events) if not isinstance(event, Looked)]
        if not 0 <= decisions <= len(ends):
            raise SessionError("decisions", f"must be from 0 to {len(ends)}", decisions)
        if not decisions:
            return
        final, rest = self._events[: ends[decisions - 1]], self._events[ends[decisions - 1] :]
        self._begin = as_in_a_file(fold(self._begin, final))
        self._events, self._state = rest, fold(self._begin, rest)
        self.__dict__.pop("_reid", None)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the session to a file, whole or not at all.

        A method of one's own is not written: `load` is given it again.
        """
        write_text(path, json.dumps(self.to_dict(), allow_nan=False) + "\n")

    @classmethod
    def load(cls, path: str | os.PathLike[str], reid: str | ReidFactory | None = None) -> Session:
        """A session from its file.

        Args:
            path: the file.
            reid: another method than the one in the file.

        Raises:
            SessionError: the file cannot be used, or names no method and none is given.
        """
        return cls.from_dict(read_json(path, SessionError), reid, Path(path).name)

    def to_dict(self) -> dict[str, Any]:
        """The contents of the session's file."""
        return recorded_to_dict(Recorded(self._begin, self._name, self._switch_rate, self._events))

    @classmethod
    def from_dict(
        cls, data: object, reid: str | ReidFactory | None = None, source: str | None = None
    ) -> Session:
        """A session from the contents of its file.

        Args:
            data: the parsed JSON.
            reid: another method than the one in it.
            source: name of the file, for errors.

        Raises:
            SessionError: as `load`.
        """
        recorded = recorded_from_dict(data, source)
        if reid is None and recorded.reid not in REIDENTIFIERS:
            expected = f"must be one of {', '.join(sorted(REIDENTIFIERS))}, where no method is given"
            raise SessionError("reid", expected, recorded.reid, source)
        session = cls(recorded.begin.scene, reid or recorded.reid or "", recorded.switch_rate)
        session._begin = state = replace(recorded.begin, scene=session.scene)
        for i, event in enumerate(recorded.events):
            try:
                state = after(state, event)
            except SessionError as problem:
                raise SessionError(
                    f"events[{i}].{problem.field}", problem.expected, problem.got, source
                ) from None
        session._events, session._state = _without_idle_looks(recorded.events), state
        return session

    @cached_property
    def _reid(self) -> Reidentifier:
        """The method for the layout and the disorder as they are now."""
        made = self._make(self.scene)
        learnt = self._state.learnt
        if learnt is None or not isinstance(made, AdaptiveReid):
            return made
        try:
            return type(made)(self.scene, made.options, learnt)
        except SceneError:  # learnt under other options, or by another version
            return made

    def _learnt(self, snapshot: Snapshot, labels: Sequence[str | None]) -> Disorder | None:
        """How far objects move, after one more snapshot whose labels are known."""
        if not len(self.scene.layout) or not isinstance(self._reid, AdaptiveReid):
            return None
        snapshot, aside = usable(self.scene, snapshot)
        layout, seen = self.scene.layout, snapshot.detections
        usual = {None, *layout.categories}
        kept = [
            i
            for i, category in enumerate(seen.category)
            if category in usual and (aside[i] is None or labels[i] in layout.labels)
        ]
        known = [labels[i] if labels[i] in layout.labels else None for i in kept]
        return self._reid.learn(replace(snapshot, detections=seen.at(np.array(kept, dtype=np.int64))), known)

    def _add(self, event: Event) -> None:
        """Let something happen."""
        self._state = after(self._state, event)
        self._events = _without_idle_looks((*self._events, event))
        if not isinstance(event, Looked):
            self.__dict__.pop("_reid", None)


class _Fused(Reidentifier):
    """A method for objects seen from several cameras."""

    def __init__(self, reid: Reidentifier, cameras: Sequence[Camera]) -> None:
        self.scene, self._reid, self._cameras = reid.scene, reid, cameras

    def identify(self, snapshot: Snapshot) -> Identification:
        return self._reid.identify_objects(snapshot.detections, self._cameras)


def doubted_in(answer: Identification, snapshot: Snapshot) -> tuple[str, ...]:
    """The ids of the detections whose labels are more probably wrong than right."""
    named = zip(snapshot.detections.ids, answer.labels, answer.confidence.tolist(), strict=True)
    return tuple([name for name, label, sure in named if label is not None and sure < 0.5])


class _Hinted(Reidentifier):
    """The adaptive method with what is known from elsewhere of some detections, by their ids."""

    def __init__(self, reid: AdaptiveReid, hint: Mapping[str, FloatArray]) -> None:
        self.scene, self._reid, self._hint = reid.scene, reid, hint

    def identify(self, snapshot: Snapshot) -> Identification:
        nothing = np.zeros(len(self.scene.layout))
        rows = [self._hint.get(name, nothing) for name in snapshot.detections.ids]
        return self._reid.identify(snapshot, np.reshape(rows, (-1, len(nothing))))


def _without_idle_looks(events: tuple[Event, ...]) -> tuple[Event, ...]:
    """Events without snapshots that gave way to the next one before anything was decided about them."""
    kept = [
        event
        for event, following in zip(events, (*events, None)[1:], strict=True)
        if not (isinstance(event, Looked) and isinstance(following, Looked))
    ]
    return tuple(kept)
