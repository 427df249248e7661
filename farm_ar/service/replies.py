"""What a snapshot is answered: labels with what is known of each; what is missing, and what is new."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite
from typing import Any

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.reid import Identification
from farm_ar.reid.fusion import objects_of
from farm_ar.reid.plausibility import some
from farm_ar.reid.session import Session
from farm_ar.reid.session.state import Look
from farm_ar.scenes import Detections, Snapshot, visible
from farm_ar.service.wire import SnapshotBody

ALTERNATIVES, LEAST_ALTERNATIVE = 3, 1e-3
"""How many other labels of a detection are named, and how probable each must be."""

BROKEN = "its pose is broken: it is not a number within limits"

Values = dict[str, Any]


def together(asked: SnapshotBody) -> tuple[Snapshot, list[list[Values]], list[tuple[int, Values]]]:
    """What is identified of one snapshot, or of several.

    Returns:
        The snapshot, or the objects of several, without broken poses; the detections that each object is of,
        of several; and the answers to those with a broken pose, with their places.
    """
    if len(asked.snapshots) == 1 and isfinite(asked.snapshots[0].detections.position.sum()):
        return asked.snapshots[0], [], []
    sound = [np.isfinite(one.detections.position).all(axis=1) for one in asked.snapshots]
    kept = [some(one, np.flatnonzero(good)) for one, good in zip(asked.snapshots, sound, strict=True)]
    broken = [
        (i, _broken(one.detections, i) | ({"seen": [_seen(k, one, i)]} if len(kept) > 1 else {}))
        for k, (one, good) in enumerate(zip(asked.snapshots, sound, strict=True))
        for i in np.flatnonzero(~good).tolist()
    ]
    if len(kept) == 1:
        return kept[0], [], broken
    objects, of = objects_of(kept)
    parts: list[list[Values]] = [[] for _ in range(len(objects))]
    for k, (one, index) in enumerate(zip(kept, of, strict=True)):
        for i, j in enumerate(index.tolist()):
            parts[j].append(_seen(k, one, i))
    last = asked.snapshots[-1]
    at_the_end = [(len(objects) + i, answer) for i, (_, answer) in enumerate(broken)]
    return Snapshot(last.camera, objects, last.timestamp), parts, at_the_end


def _seen(k: int, snapshot: Snapshot, i: int) -> Values:
    """Which detection of which snapshot."""
    return {"snapshot": k, "detection": snapshot.detections.ids[i]}


def _broken(seen: Detections, i: int) -> Values:
    """The answer to a detection with a broken pose."""
    unknown = dict.fromkeys(("confidence", "margin", "cost"))
    name = {"detection": seen.ids[i], "track_id": seen.track_id[i], "id": None, "reason": BROKEN}
    return {**name, **unknown, "alternatives": []}


def answers(seen: Detections, found: Identification) -> list[Values]:
    """The answer to each detection; null for a number that is not known."""
    confidence, margin, cost = map(_known, (found.confidence, found.margin, found.cost))
    rows: Any = [None] * len(seen) if found.probability is None else found.probability
    return [
        {
            "detection": seen.ids[i],
            "track_id": seen.track_id[i],
            "id": label,
            "reason": found.reason[i],
            "confidence": confidence[i],
            "margin": margin[i],
            "cost": cost[i],
            "alternatives": _alternatives(found, i, rows[i]),
        }
        for i, label in enumerate(found.labels)
    ]


def _known(values: FloatArray) -> list[float | None]:
    """Numbers; None where one is not known."""
    return [value if isfinite(value) else None for value in values.tolist()]


def _alternatives(found: Identification, i: int, row: Any) -> list[Values]:
    """Other labels that a detection may be, the most probable first; null for none of them."""
    if row is None or not np.isfinite(row).all():
        second = found.runner_up[i]
        return [] if second is None else [{"id": second, "confidence": None}]
    names = (*found.candidates, None)
    order = np.argsort(-row, kind="stable")[: ALTERNATIVES + 1].tolist()
    given = found.labels[i]
    others = [j for j in order if names[j] != given and row[j] >= LEAST_ALTERNATIVE][:ALTERNATIVES]
    return [{"id": names[j], "confidence": float(row[j])} for j in others]


def missing(session: Session, snapshots: tuple[Snapshot, ...], found: Identification) -> list[str]:
    """Labels whose places were in view, and not hidden, that no detection is."""
    layout, motion = session.scene.layout, session.state.frame
    if not len(layout):
        return []
    seen = np.zeros(len(layout), dtype=bool)
    for one in snapshots:
        camera = one.camera
        if motion is not None:
            place = motion.motion.position(camera.position[None])[0]
            camera = replace(camera, position=place, yaw=camera.yaw + motion.turn)
        seen |= visible(layout, camera, occlusion=True)
    given = set(found.labels)
    return [label for label, here in zip(layout.labels, seen, strict=True) if here and label not in given]


def new_things(seen: Detections, found: Identification) -> list[str]:
    """Detections that are no known object, as it seems: without a label, though there is nothing wrong."""
    wrong = ("its pose is", "the same thing")
    return [
        name
        for name, label, reason in zip(seen.ids, found.labels, found.reason, strict=True)
        if label is None and not (reason or "").startswith(wrong)
    ]


def present(look: Look | None) -> dict[str, Values]:
    """What was identified in a snapshot, in the map, by label."""
    if look is None:
        return {}
    seen = look.snapshot.detections
    return {
        label: {
            "id": label,
            "detection": seen.ids[i],
            "category": seen.category[i],
            "pose": (seen.position[i], float(seen.yaw[i]), float(seen.elevation[i])),
            "size": size_of(seen.size[i]),
        }
        for i, label in enumerate(look.labels)
        if label is not None
    }


def size_of(size: Any) -> Values | None:
    """Width, height and depth; null where not known."""
    return None if np.isnan(size).any() else dict(zip("xyz", size.tolist(), strict=True))
