"""Detections that cannot be identified, each with the reason."""

from __future__ import annotations

import numpy as np

from farm_ar.reid.plausibility.duplicates import duplicates
from farm_ar.reid.plausibility.finding import named, some
from farm_ar.reid.plausibility.look_alikes import look_alike
from farm_ar.reid.plausibility.patterns import places_of
from farm_ar.reid.plausibility.view import is_lost
from farm_ar.scenes import Scene, Snapshot


def set_aside(scene: Scene, snapshot: Snapshot, again: bool = True) -> tuple[str | None, ...]:
    """N short reasons why a detection cannot be identified; None where it can be.

    Args:
        scene: the reference layout.
        snapshot: what was seen.
        again: whether one of two detections of the same thing is set aside.
    """
    seen, categories = snapshot.detections, scene.layout.categories
    reasons: list[str | None] = [None] * len(seen)
    for i, name in enumerate(seen.category):
        if not np.isfinite(seen.position[i]).all():
            fault = seen.broken[i] if seen.broken else None
            reasons[i] = f"its pose is broken: {fault or 'its position is not a number'}"
        elif name is not None and name not in categories:
            like = look_alike(name, categories)
            hint = "" if like is None else f" (is it {like!r}?)"
            reasons[i] = f"the scene has no {name!r}, only {named(list(categories))}{hint}"
    kept = np.flatnonzero([reason is None for reason in reasons])
    for i in kept[is_lost(scene, some(snapshot, kept))]:
        reasons[i] = "its pose is no measurement: others have it to the last digit, or it is the camera's own"
    if again and len(scene.layout):
        kept = np.flatnonzero([reason is None for reason in reasons])
        same = duplicates(some(snapshot, kept).detections, scene.layout, places_of(scene).spacing)
        for other, surer in same.items():
            reasons[kept[other]] = f"the same thing as detection {seen.ids[kept[surer]]}"
    return tuple(reasons)
