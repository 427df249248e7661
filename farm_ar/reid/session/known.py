"""What a session's file holds of snapshots, tracks, and what is known where the decisions are final."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import isfinite, pi
from typing import Any

import numpy as np

from farm_ar.arrays import POSITION, SHARE, Limits
from farm_ar.errors import InputError, SessionError
from farm_ar.reid.adaptive import Disorder
from farm_ar.reid.session.state import Aligned, Look, State, check_labels
from farm_ar.reid.session.tracks import Track
from farm_ar.scenes import (
    Camera,
    Detections,
    FieldOfView,
    Scene,
    Snapshot,
    scene_from_dict,
    scene_to_dict,
    snapshot_from_dict,
    snapshot_to_dict,
)
from farm_ar.scenes.documents import Listing, Named, Object
from farm_ar.scenes.files import degrees
from farm_ar.scenes.json_files import SNAPSHOT
from farm_ar.scenes.kinds import DEGREES, Flag, Kind, Number, Numbers, OrNull, Text, Whole, radians
from farm_ar.scenes.worlds import OURS


@dataclass(frozen=True)
class Unread(Kind):
    """A value of a kind that another reader reads; checked here, and left as it is."""

    kind: Kind

    def check(self, value: object) -> object:
        """See `Kind`."""
        self.kind.check(value)
        return value

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        return self.kind.rule()


LABEL = OrNull(Text(), "a label")
LEARNT = OrNull(
    Unread(
        Object({"snapshots": Whole(0, 10**9)}, open=True),
        about="How far objects of the place move, as the method has learnt it.",
    ),
    "what was learnt",
    default=None,
)
_SHIFT = Number(Limits(-1e8, 1e8, ""))
FRAME: dict[str, Kind] = {"x": _SHIFT, "z": _SHIFT, "yaw_deg": Number(DEGREES)}
"""Where the origin of the snapshots' frame is in the map's."""

LOOK: dict[str, Kind] = {
    "snapshot": Unread(SNAPSHOT.top, about="As it came; of what is final, in the map's frame."),
    "labels": Listing(LABEL),
    "tracks": Listing(
        OrNull(
            Object(
                {
                    "start": Numbers(2, POSITION, "[x, z] in metres"),
                    "held": Flag(default=False),
                    "belief": Named(Number(SHARE)),
                }
            ),
            "a track",
        )
    ),
    "broken": Named(Text(), default={}, about="Why a pose could not be used, by the detection's id."),
    "doubted": Listing(Text(), default=(), about="Ids of detections whose labels were improbable."),
}
"""An identified snapshot."""

KNOWN = Object(
    {
        "frame": OrNull(Object(FRAME), "a frame", default=None),
        "look": OrNull(Object({**LOOK, "confirmed": Flag()}), "a snapshot", default=None),
        "seen": Named(
            Object({**dict.fromkeys("xzy", _SHIFT), "yaw_deg": OrNull(Number(DEGREES), "an angle")}),
            about="Where labels were confirmed to be since the last commit.",
        ),
        "viewed": Listing(Text(), about="Labels whose places were in view since then."),
        "confirmed": Flag(about="Whether anything was confirmed since then."),
        "lost": Listing(Text(), about="Labels whose objects have not been found."),
        "learnt": LEARNT,
    }
)
"""What is known beside the place itself when the first of the events happens."""


def look_to_dict(
    snapshot: Snapshot,
    labels: tuple[str | None, ...],
    tracks: tuple[Track | None, ...],
    doubted: tuple[str, ...],
) -> dict[str, Any]:
    """An identified snapshot as a file holds it."""
    rows = [t and {"start": list(t.start), "held": t.held, "belief": dict(t.belief)} for t in tracks]
    values: dict[str, Any] = {"labels": list(labels), "tracks": rows}
    if broken := _broken(snapshot):
        values["broken"] = broken
    if doubted:
        values["doubted"] = list(doubted)
    return {"snapshot": snapshot_to_dict(_placed(snapshot)), **values}


def look_from_dict(
    one: Mapping[str, Any],
) -> tuple[Snapshot, tuple[str | None, ...], tuple[Track | None, ...], tuple[str, ...]]:
    """Snapshot, labels, tracks and doubted ids of which `look_to_dict` made these values.

    Raises:
        SessionError: the snapshot cannot be used.
    """
    try:
        snapshot = _snapshot_from(one["snapshot"], one["broken"])
    except InputError as problem:
        raise SessionError(f"snapshot.{problem.field}", problem.expected, problem.got) from None
    tracks = [None if t is None else Track(t["start"], t["held"], t["belief"]) for t in one["tracks"]]
    return snapshot, tuple(one["labels"]), tuple(tracks), tuple(one["doubted"])


def known_to_dict(state: State) -> dict[str, Any] | None:
    """What is known beside the place; None where that is nothing, as in the beginning."""
    if state.frame is None and state.look is None:
        return None
    look, frame = state.look, state.frame
    return {
        "frame": frame and {"x": frame.x, "z": frame.z, "yaw_deg": degrees(frame.turn)},
        "look": look
        and {
            **look_to_dict(look.snapshot, look.labels, look.tracks, look.doubted),
            "confirmed": look.confirmed,
        },
        "seen": {
            label: {"x": x, "z": z, "y": y, "yaw_deg": None if np.isnan(yaw) else degrees(yaw)}
            for label, (x, z, yaw, y) in state.seen.items()
        },
        "viewed": sorted(state.viewed),
        "confirmed": state.confirmed,
        "lost": list(state.lost),
        "learnt": state.learnt and state.learnt.to_json(),
    }


def known_from_dict(scene: Scene, values: Mapping[str, Any] | None) -> State:
    """The state of which `known_to_dict` made these values.

    Args:
        scene: the place as it is known then.
        values: checked by `KNOWN`.

    Raises:
        InputError: a value in it cannot be used.
    """
    state = State(scene)
    if values is None:
        return state
    look, frame, learnt = values["look"], values["frame"], values["learnt"]
    if look is not None:
        snapshot, labels, tracks, doubted = look_from_dict(look)
        check_labels(state, snapshot, labels)
        if len(tracks) != len(labels):
            raise SessionError("look.tracks", f"must be {len(labels)}, as the labels are", len(tracks))
        look = Look(snapshot, labels, tracks, look["confirmed"], doubted)
    return State(
        scene,
        None if frame is None else Aligned(frame["x"], frame["z"], radians(frame["yaw_deg"])),
        look,
        {label: _row(one) for label, one in values["seen"].items()},
        frozenset(values["viewed"]),
        values["confirmed"],
        tuple(values["lost"]),
        None if learnt is None else Disorder.from_json(learnt),
    )


def _row(one: Mapping[str, Any]) -> tuple[float, float, float, float]:
    """A place as a row (x, z, yaw, y)."""
    yaw = one["yaw_deg"]
    return one["x"], one["z"], np.nan if yaw is None else radians(yaw), one["y"]


def as_in_a_file(state: State) -> State:
    """A state as it comes back from a file."""
    scene = scene_from_dict(scene_to_dict(state.scene), default_name=state.scene.name)
    known = known_to_dict(state)
    return known_from_dict(scene, known and KNOWN.check(known))


def canonical(snapshot: Snapshot) -> Snapshot:
    """A snapshot as it comes back from a file."""
    seen = snapshot.detections
    plain = seen.tilt is None and seen.uncertainty is None and not any(seen.broken or ())
    if plain and isfinite(seen.position.sum()):
        return _rounded(snapshot)
    return from_file(snapshot)


def _rounded(snapshot: Snapshot) -> Snapshot:
    """`from_file` of a snapshot in which all stands upright, of known poses: only angles change."""
    seen, camera = snapshot.detections, snapshot.camera
    yaw = [_rounded_angle(angle) for angle in seen.yaw.tolist()]
    angles = {"yaw": np.array(yaw, dtype=np.float64), "broken": (None,) * len(seen)}
    return Snapshot.trusted(
        camera=Camera.trusted(
            position=camera.position,
            yaw=np.asarray(_rounded_angle(camera.yaw.item())),
            fov=_rounded_view(camera.fov),
            height=camera.height,
            pitch=np.asarray(_rounded_angle(camera.pitch.item())),
        ),
        detections=Detections.trusted(**vars(seen) | angles),
        timestamp=snapshot.timestamp,
        world=OURS,
        assumed=(),
    )


def _rounded_angle(angle: float) -> float:
    """An angle, radians, that was written in degrees and read again: `radians(degrees(angle))`, quicker."""
    return round(angle * (180 / pi), 12) * (pi / 180)


@lru_cache(maxsize=256)
def _rounded_view(fov: FieldOfView) -> FieldOfView:
    angles = (fov.left, fov.right, fov.up, fov.down)
    left, right, up, down = [angle if angle is None else _rounded_angle(angle) for angle in angles]
    return FieldOfView(left or 0.0, right or 0.0, fov.range_m, up, down)


def from_file(snapshot: Snapshot) -> Snapshot:
    """A snapshot that was written to a file and read again."""
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
