"""The check before identifying."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from farm_ar.arrays import IntArray
from farm_ar.reid.plausibility.finding import Finding, named, some
from farm_ar.reid.plausibility.frames import check_frames
from farm_ar.reid.plausibility.look_alikes import check_names
from farm_ar.reid.plausibility.sizes import check_sizes
from farm_ar.reid.plausibility.view import check_bounds, check_poses, check_view, is_lost
from farm_ar.scenes import UNKNOWN, Scene, Snapshot

CAUSES, EFFECTS = ("mirrored", "units", "frame"), ("camera", "view", "bounds")
"""Ways of writing a snapshot down wrongly, and what is then noticed as well, though it only follows."""


def check(scene: Scene, snapshot: Snapshot) -> tuple[Finding, ...]:
    """What cannot be right in a scene and a snapshot of it, or hardly: each with what to do about it.

    It asks whether things are where the camera and the bounds allow, and whether the snapshot would fit the
    map far better if it had been written down in another frame, unit or convention. It costs a few
    milliseconds at 8 detections and 29 labels.

    Args:
        scene: the reference layout and its place.
        snapshot: what was seen.
    """
    found = list(check_names(scene.layout))
    layout, seen = scene.layout, snapshot.detections
    sound = np.isfinite(seen.position).all(axis=1)
    if not sound.any() or not len(layout):
        return tuple(found)
    whole = np.flatnonzero(sound)
    found += _of(whole, check_poses(scene, some(snapshot, whole)))
    lost = np.zeros(len(seen), dtype=bool)
    lost[whole] = is_lost(scene, some(snapshot, whole))
    sound &= ~lost
    kept = np.flatnonzero(sound)
    rest = some(snapshot, kept)
    found += _of(kept, check_sizes(scene, rest.detections))
    codes = {name: i for i, name in enumerate(layout.categories)} | {None: UNKNOWN}
    known = np.flatnonzero([name in codes for name in rest.detections.category])
    category = np.array([codes[rest.detections.category[i]] for i in known], dtype=np.int64)
    frames = list(check_frames(scene, some(rest, known), category))
    places = [*_of(kept, check_view(scene, rest)), *_of(kept, check_bounds(scene, rest))]
    found += _causes(places, frames, bool(snapshot.assumed))
    names = {name for name in seen.category if name is not None}
    if names and names.isdisjoint(layout.categories):
        theirs = named(sorted(names))
        said = f"the scene has no {theirs}, only {named(list(layout.categories))}"
        found.append(Finding("categories", said + ": give both the same names"))
    return tuple(found)


def _causes(places: list[Finding], frames: list[Finding], assumed: bool) -> list[Finding]:
    """Findings about where things stand and about how they are written down, without what only follows.

    Args:
        places: about where things stand.
        frames: about how the snapshot is written down.
        assumed: whether a part of the view is, which is worth a word in any case.
    """
    if any(one.kind in CAUSES for one in frames):
        return [one for one in places if assumed and one.kind == "view"] + frames
    if any(one.kind == "mirrored" for one in places):  # the camera, too
        places = [one for one in places if one.kind != "camera"]
    return places + frames


def _of(index: IntArray, found: Iterable[Finding]) -> Iterator[Finding]:
    """Findings about some of the detections, with their places among all."""
    for one in found:
        yield one._replace(detections=tuple(int(index[i]) for i in one.detections))
