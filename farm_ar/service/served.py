"""One session of the service: what each request does to it, and what it is answered."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np

from farm_ar.errors import SessionError
from farm_ar.reid.session import Session
from farm_ar.reid.session.state import Look
from farm_ar.scenes.files import degrees
from farm_ar.service.limits import ServiceLimits
from farm_ar.service.methods import IN_SPACE, check_size, method_of
from farm_ar.service.refusals import STALE, RefusedError
from farm_ar.service.replies import answers, missing, new_things, present, size_of, together
from farm_ar.service.wire import (
    CONFIRM,
    UNDO,
    LayoutBody,
    SnapshotBody,
    pose_in,
    read_align,
)

Values = dict[str, Any]


@dataclass(frozen=True)
class Served:
    """A session as the service keeps it. What a request changes is changed in a copy.

    Args:
        name: of the session.
        session: of `farm_ar.reid`.
        method: its name.
        options: of the method.
        checks: whether layout and snapshots are checked, for warnings.
        revision: how often anything was decided; never less than before.
        history: what was decided and can be undone: `did`, `revision`, `events`, and what it was about.
        final: how many decisions before those cannot be undone any more.
        looked: name of the last snapshot; of the revision, before the first one.
        seen: the answer to the last snapshot; None before the first.
        identified: that snapshot, with its labels as they were answered.
    """

    name: str
    session: Session
    method: str
    options: Mapping[str, Any]
    checks: bool = True
    revision: int = 1
    history: tuple[Values, ...] = ()
    final: int = 0
    looked: str = ""
    seen: Values | None = None
    identified: Look | None = None

    @classmethod
    def begin(cls, name: str, body: LayoutBody, revision: int) -> Served:
        """A session that begins with a layout."""
        make, options = method_of(body.method, body.options)
        check_size(body.method, len(body.scene.layout), 1)
        if len(body.scene.layout):
            make(body.scene)  # what it refuses, it refuses now
        session = Session(body.scene, make, body.switch_rate)
        return cls(name, session, body.method, options, body.checks, revision)

    @classmethod
    def from_row(cls, name: str, row: Values) -> Served:
        """A session as it was stored.

        Raises:
            InputError: the row is not one of this service; a ValueError, KeyError, TypeError too.
        """
        counted = [row["revision"], row.get("final", 0), *(one["events"] for one in row["history"])]
        if not all(type(one) is int and one >= 0 for one in counted):
            raise ValueError("counts must be whole numbers")
        make, options = method_of(row["method"], row["options"])
        session = Session.from_dict(row["session"], make)
        made = (row["method"], options, row["checks"], row["revision"], tuple(row["history"]))
        return cls(name, session, *made, final=row.get("final", 0))

    def row(self) -> Values:
        """What is stored of it."""
        return {
            "revision": self.revision,
            "method": self.method,
            "options": dict(self.options),
            "checks": self.checks,
            "history": list(self.history),
            "final": self.final,
            "session": self.session.to_dict(),
        }

    def look(self, asked: SnapshotBody, body: bytes) -> tuple[Served, Values]:
        """Identify one snapshot, or several together; the answer, and the session after it.

        Args:
            asked: what was seen.
            body: in which it came, for the snapshot's name.
        """
        begun = perf_counter()
        snapshot, parts, broken = together(asked)
        check_size(self.method, len(self.session.scene.layout), len(snapshot.detections))
        session = copy(self.session)
        cameras = [one.camera for one in asked.snapshots] if len(asked.snapshots) > 1 else []
        found = session.identify(snapshot, cameras, self.checks)
        looked = hashlib.sha256((self.looked or str(self.revision)).encode() + body).hexdigest()[:16]
        reply = self._head(asked.frame, snapshot.timestamp) | {
            "snapshot": looked,
            "detections": answers(snapshot.detections, found),
            "missing": missing(session, asked.snapshots, found),
            "new": new_things(snapshot.detections, found),
            "warnings": [*(() if self.method in IN_SPACE else asked.tilts), *found.warnings],
        }
        for one, seen in zip(reply["detections"], parts, strict=False):
            one["seen"] = seen
        for place, answer in broken:
            reply["detections"].insert(place, answer)
        reply["solve_ms"] = round((perf_counter() - begun) * 1000, 3)
        return replace(self, session=session, looked=looked, seen=reply, identified=session.state.look), reply

    def confirm(self, data: Values, limits: ServiceLimits) -> tuple[Served, Values]:
        """Take the labels of the last snapshot for known, with corrections, and commit them."""
        given = CONFIRM.read(data)
        self._check(given["revision"])
        look = self.session.state.look
        if look is None or given["snapshot"] != self.looked:
            expected = f"must be the last one, {self.looked or 'none'}"
            raise RefusedError(STALE, "snapshot", expected, given["snapshot"])
        if look.confirmed:
            expected = "must not be confirmed yet: undo that, or send the next"
            raise RefusedError(STALE, "snapshot", expected, self.looked)
        session = copy(self.session)
        before = len(session.events)
        if given["labels"]:
            session.correct(given["labels"], given["force"])
        doubted = session.confirm(force=given["force"])
        if given["commit"]:
            session.commit()
        events = len(session.events) - before
        about = {"labels": given["labels"], "commit": given["commit"]}
        after = self._decided(session, "confirm", events, about, limits)
        return after, after._said({"doubted": list(doubted), "lost": list(session.lost)})

    def undo(self, data: Values) -> tuple[Served, Values]:
        """Take back the last thing that was decided."""
        self._check(UNDO.read(data)["revision"])
        if not self.history:
            expected = "must have a decision to undo"
            old = f"{self.final} that are final: only the last ones are kept to be undone"
            raise SessionError("session", expected, old if self.final else "none")
        session, last = copy(self.session), self.history[-1]
        for _ in range(last["events"]):
            session.undo()
        after = replace(
            self, session=session, revision=self.revision + 1, history=self.history[:-1], looked="", seen=None
        )
        return after, after._said({"undone": last, "lost": list(session.lost)})

    def align(self, data: Values, limits: ServiceLimits) -> tuple[Served, Values]:
        """Find the frame of the snapshots from here on."""
        asked = read_align(data, limits)
        self._check(asked.revision)
        session = copy(self.session)
        found = session.align(asked.snapshot, asked.anchor)
        taken = session.state is not self.session.state
        sure = {
            "aligned": taken,
            "confidence": found.confidence,
            "ambiguous": found.ambiguous,
            "reason": found.reason or None,
        }
        if not taken:
            return self, self._said(sure | {"origin": None}, asked.frame)
        after = self._decided(session, "align", 1, {"anchor": asked.anchor is not None}, limits)
        return after, after._said(sure | {"origin": after._origin(asked.frame)}, asked.frame)

    def state(self, frame: str) -> Values:
        """All that is known, in a frame."""
        scene = self.session.scene
        layout = scene.layout
        objects = [
            {
                "id": label,
                "category": layout.category[j] if layout.names_categories else None,
                **self._pose(frame, layout.position[j], layout.yaw[j], layout.elevation[j]),
                "size": size_of(layout.size[j]),
                "fixed": bool(layout.fixed[j]),
                "lost": label in self.session.lost,
            }
            for j, label in enumerate(layout.labels)
        ]
        corners = None if scene.bounds is None else scene.bounds.corners
        outline = (
            corners
            if corners is None
            else [pose_in(frame, corner, 0.0, 0.0)["position"] for corner in corners]
        )
        return self._head(frame, None) | {
            "method": self.method,
            "options": dict(self.options),
            "objects": objects,
            "bounds": outline,
            "origin": self._origin(frame),
            "lost": list(self.session.lost),
            "snapshot": self.looked or None,
            "last": self.seen,
            "view": self._view(frame),
            "history": list(self.history),
            "final": self.final,
        }

    @cached_property
    def present(self) -> Mapping[str, Values]:
        """What was identified in the last snapshot, by label, for listeners."""
        return present(self.identified)

    def tracked(self, frame: str) -> Values:
        """What was identified in the last snapshot, by label, in a frame; for listeners."""
        return {label: {**one, **self._pose(frame, *one["pose"])} for label, one in self.present.items()}

    def _check(self, revision: int) -> None:
        if revision != self.revision:
            raise RefusedError(STALE, "revision", f"must be the session's, {self.revision}", revision)

    def _decided(
        self, session: Session, did: str, events: int, about: Values, limits: ServiceLimits
    ) -> Served:
        """The session after one more decision; the oldest beyond `most_history` are final then."""
        revision = self.revision + 1
        entry = {"did": did, "revision": revision, "events": events, "snapshot": self.looked or None, **about}
        history = (*self.history, entry)
        old = history[: -limits.most_history]
        session.settle(sum(one["events"] for one in old))
        final = self.final + len(old)
        return replace(self, session=session, revision=revision, history=history[len(old) :], final=final)

    def _head(self, frame: str, stamp: float | None) -> Values:
        return {
            "header": {"stamp": stamp, "frame_id": frame},
            "session": self.name,
            "revision": self.revision,
        }

    def _said(self, values: Values, frame: str = "unity") -> Values:
        return self._head(frame, None) | values

    def _pose(self, frame: str, position: Any, yaw: float, elevation: float) -> Values:
        return {"pose": pose_in(frame, np.asarray(position), yaw, elevation)}

    def _origin(self, frame: str) -> Values | None:
        """Where the origin of the snapshots' frame is in the map's; null if it is the same."""
        found = self.session.state.frame
        return None if found is None else pose_in(frame, np.array([found.x, found.z]), found.turn, 0.0)

    def _view(self, frame: str) -> Values | None:
        """The camera of the last snapshot, in the map."""
        look = self.session.state.look
        if look is None:
            return None
        eye = look.snapshot.camera
        height = 0.0 if eye.height is None else float(eye.height)
        return pose_in(frame, eye.position, float(eye.yaw), height) | {
            "fov_left_deg": degrees(eye.fov.left),
            "fov_right_deg": degrees(eye.fov.right),
            "range_m": eye.fov.range_m,
            "detections": [
                {"detection": name, "id": label, **pose_in(frame, place, yaw, height), "size": size_of(size)}
                for name, label, place, yaw, height, size in zip(
                    look.snapshot.detections.ids,
                    look.labels,
                    look.snapshot.detections.position,
                    look.snapshot.detections.yaw,
                    look.snapshot.detections.elevation,
                    look.snapshot.detections.size,
                    strict=True,
                )
                if np.isfinite(place).all()
            ],
        }
