"""Measured things: sizes with errors at both looks, and rooms scanned again in a frame that has drifted."""

from __future__ import annotations

from functools import partial

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.benchmark.worlds.base import Area, Example, Objects, Row, boxes, seen_as, spaced_points
from farm_ar.geometry import wrap
from farm_ar.scenes import Snapshot

CHAIRS, CHAIR = 8, (0.45, 0.9, 0.5)
ROOM = Area((-2.1, -1.4), (1.9, 2.0))
MOVE_M = 0.1

SCANNED = Area((-3.0, -2.0), (3.5, 3.5))
DRIFT_M, DRIFT_TURN = 0.35, float(np.deg2rad(4))
"""SD of how far a second scan's frame is off, on each axis, and how far it is turned."""

KINDS = (("chair", 9, (0.5, 0.9, 0.5)), ("table", 3, (1.1, 0.75, 0.7)), ("cushion", 6, (0.45, 0.2, 0.45)),
         ("cabinet", 3, (0.9, 1.2, 0.45)), ("lamp", 2, (0.3, 1.4, 0.3)))  # fmt: skip


def measured_sizes(rng: np.random.Generator, count: int, error: float) -> list[Example]:
    """Eight identical chairs, each moved by 10 cm, whose sides are measured with an error at both looks.

    Args:
        rng: where the randomness comes from.
        count: how many pairs.
        error: SD of the logarithm of each measured side.
    """
    examples = []
    names = [f"chair {i + 1}" for i in range(CHAIRS)]
    for _ in range(count):
        place = spaced_points(ROOM, CHAIRS, 0.8, rng)
        yaw = rng.uniform(-np.pi, np.pi, CHAIRS)
        true = boxes(CHAIRS, CHAIR)
        known = Objects(names, ["chair"] * CHAIRS, place, yaw, _measured(true, error, rng))
        way = rng.uniform(-np.pi, np.pi, CHAIRS)
        later = place + MOVE_M * np.stack([np.sin(way), np.cos(way)], axis=-1)
        now = known.at(later, yaw + rng.normal(0, np.deg2rad(10), CHAIRS))
        wide = Area((ROOM.low[0] - 0.2, ROOM.low[1] - 0.2), (ROOM.high[0] + 0.2, ROOM.high[1] + 0.2))
        now = now._replace(size=_measured(true, error, rng), yaw=wrap(now.yaw))
        examples.append(seen_as(wide, "chairs", known, now, rng))
    return examples


def rescans(rng: np.random.Generator, count: int, moved: float = 0.12) -> list[Example]:
    """A room scanned twice: all poses and sizes measured again, in a frame that is shifted and turned.

    Positions are measured to 3 cm, headings to 4 degrees, sides to 4%. The second camera's pose is in the
    second frame.

    Args:
        rng: where the randomness comes from.
        count: how many pairs.
        moved: share of the objects that really move, by .3 to 2.5 m.
    """
    category = [name for name, number, _ in KINDS for _ in range(number)]
    names = [f"{name} {category[: i + 1].count(name)}" for i, name in enumerate(category)]
    true = np.array([size for _, number, size in KINDS for _ in range(number)])
    number = len(names)
    examples = []
    for _ in range(count):
        place = spaced_points(SCANNED, number, 0.45, rng)
        yaw = rng.integers(4, size=number) * np.pi / 2 + rng.normal(0, 0.15, number)
        known = Objects(names, category, place, wrap(yaw), _measured(true, 0.04, rng))
        goes = rng.random(number) < moved
        way, far = rng.uniform(-np.pi, np.pi, number), rng.uniform(0.3, 2.5, number)
        shift = (far * goes)[:, None] * np.stack([np.sin(way), np.cos(way)], axis=-1)
        later = np.clip(place + shift, SCANNED.low, SCANNED.high) + rng.normal(0, 0.03, (number, 2))
        turned = yaw + goes * rng.uniform(-np.pi, np.pi, number) + rng.normal(0, np.deg2rad(4), number)
        drift, turn = rng.normal(0, DRIFT_M, 2), rng.normal(0, DRIFT_TURN)
        now = Objects(
            names,
            category,
            SCANNED.middle + drift + _turned(later - SCANNED.middle, turn),
            wrap(turned + turn),
            _measured(true, 0.04, rng),
        )
        wide = Area(
            (SCANNED.low[0] - 1.5, SCANNED.low[1] - 1.5), (SCANNED.high[0] + 1.5, SCANNED.high[1] + 1.5)
        )
        example = seen_as(wide, "scan", known, now, rng)
        view = example.snapshot.camera
        drifted = type(view)(view.position + drift, view.yaw + turn, view.fov)
        examples.append(example._replace(snapshot=Snapshot(drifted, example.snapshot.detections)))
    return examples


def _measured(true: FloatArray, error: float, rng: np.random.Generator) -> FloatArray:
    measured: FloatArray = true * np.exp(rng.normal(0, error, true.shape))
    return measured


def _turned(offset: FloatArray, turn: float) -> FloatArray:
    """(..., 2) offsets turned clockwise, as yaw goes."""
    sine, cosine = np.sin(turn), np.cos(turn)
    x, z = offset[..., 0], offset[..., 1]
    return np.stack([x * cosine + z * sine, z * cosine - x * sine], axis=-1)


ROWS = (
    *(
        Row(
            f"sizes-{round(100 * error)}",
            f"8 identical chairs moved by 10 cm, sides measured to {round(100 * error)}% at both looks",
            partial(measured_sizes, error=error),
        )
        for error in (0.05, 0.1, 0.2, 0.3)
    ),
    Row("rescan", "a room scanned again in a frame off by 35 cm and 4 degrees, an eighth moved", rescans),
)
"""The measured rows."""
