"""What the check before identifying found."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from farm_ar.arrays import IntArray
from farm_ar.scenes import Snapshot


class Finding(NamedTuple):
    """One thing that cannot be right, or hardly, in a scene and a snapshot of it.

    Args:
        kind: one of those in docs/reidentification.md: "view", "mirrored", "units", ...
        said: what is noticed, and what to do about it, in a line.
        detections: which it is about; none where it is about all of them, or about the scene.
        doubt: probability that the snapshot does not mean what it says, as far as that spoils the answer.
    """

    kind: str
    said: str
    detections: tuple[int, ...] = ()
    doubt: float = 0.0


def named(names: list[str], most: int = 5) -> str:
    """Names with commas between them, the first of many."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def number(count: int, noun: str = "detection") -> str:
    """A number with its noun."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def some(snapshot: Snapshot, index: IntArray) -> Snapshot:
    """The snapshot with the detections at `index` only."""
    return replace(snapshot, detections=snapshot.detections.at(index))
