"""Whether a snapshot in an unknown frame is in another unit of length than the map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from farm_ar.geometry import diameter
from farm_ar.reid.alignment.method import Alignment, align
from farm_ar.reid.plausibility.patterns import spacing_of
from farm_ar.reid.plausibility.sizes import UNITS
from farm_ar.scenes import Detections, Scene, Snapshot

SURE, FEWEST = 0.99, 4
"""How probable the frame must be in another unit that is named; how many objects must then stand in place."""

APART = 8.0
"""By how much the distances between neighbours differ that cannot be those of one place in one unit."""

TODO = "give both in one unit, metres in Python"

WIDEST = 1.5
"""How much farther apart than the labels detections may be in a unit that is tried."""


def other_unit(scene: Scene, snapshot: Snapshot, found: Alignment) -> str | None:
    """What says that a snapshot is in another unit of length than the map; None where nothing does.

    Units are tried in which the detections are no farther apart than the labels, and in which they do not
    all stand at one place. Where none fits, the distances between neighbours are compared. None where the
    frame was found as objects are.

    Args:
        scene: the map.
        snapshot: in a frame of its own.
        found: the frame that was found for it as it is.
    """
    seen = snapshot.detections
    place = seen.position[np.isfinite(seen.position).all(axis=1)]
    if found.certain or len(place) < FEWEST or len(scene.layout) < FEWEST:
        return None
    extent, most = diameter(place), WIDEST * diameter(scene.layout.position)
    best: tuple[float, str] | None = None
    for name, metres in UNITS.items():
        for factor, how in ((metres, f"it is in {name}"), (1 / metres, f"the map is in {name}")):
            if not most / (4 * WIDEST * len(scene.layout)) < factor * extent <= most:
                continue
            other = align(scene, _scaled(snapshot, factor))
            stood = sum(label is not None for label in other.matches)
            if stood >= FEWEST and other.confidence >= max(SURE, best[0] if best else 0.0):
                best = other.confidence, how
    if best is not None:
        return f"in a frame of its own the snapshot fits the map if {best[1]}: {TODO}"
    spacing = spacing_of(place), spacing_of(scene.layout.position)
    ratio = spacing[0] / spacing[1] if min(spacing) > 0 else 1.0
    if 1 / APART <= ratio <= APART:
        return None
    name, whose = _unit_near(ratio)
    times = f"{float(f'{max(ratio, 1 / ratio):.2g}'):g} times as {'far apart' if ratio > 1 else 'near'}"
    return f"things stand {times} in the snapshot as in the map, as if {whose} were in {name}: {TODO}"


def _unit_near(ratio: float) -> tuple[str, str]:
    """The unit in which lengths are about `ratio` times too large, and what would be in it."""
    whose = "the snapshot" if ratio > 1 else "the map"
    return min(UNITS, key=lambda name: abs(np.log(UNITS[name] * max(ratio, 1 / ratio)))), whose


def _scaled(snapshot: Snapshot, factor: float) -> Snapshot:
    """The snapshot with places in another unit, about the camera; of no known sizes."""
    seen, start = snapshot.detections, snapshot.camera.position
    values = vars(seen) | {
        "position": start + factor * (seen.position - start),
        "size": np.full_like(seen.size, np.nan),
        "uncertainty": None,
    }
    return replace(snapshot, detections=Detections.trusted(**values))
