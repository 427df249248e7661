"""Flats with furniture: most objects stay exactly where they were, some are moved, some change places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.benchmark.worlds.base import Area, Example, Objects, Row, seen_as, spaced_points, towards
from farm_ar.geometry import wrap
from farm_ar.scenes import Camera, Detector, FieldOfView


@dataclass(frozen=True)
class Thing:
    """Objects of one category in a room: how many at least and at most, their sides, how easily they move."""

    category: str
    least: int
    most: int
    sides: tuple[float, float, float]
    mobile: float = 1.0


ROOMS: dict[str, tuple[Thing, ...]] = {
    "kitchen": (
        Thing("chair", 3, 6, (0.45, 0.9, 0.5), 1.6),
        Thing("table", 1, 1, (1.2, 0.75, 0.8), 0.3),
        Thing("fridge", 1, 1, (0.6, 1.8, 0.65), 0.05),
        Thing("stool", 0, 3, (0.35, 0.65, 0.35), 1.6),
        Thing("bin", 1, 2, (0.3, 0.5, 0.3)),
    ),
    "living": (
        Thing("armchair", 1, 3, (0.85, 0.9, 0.85), 0.6),
        Thing("sofa", 1, 1, (2.0, 0.8, 0.9), 0.1),
        Thing("lamp", 1, 3, (0.3, 1.5, 0.3)),
        Thing("plant", 2, 5, (0.35, 0.8, 0.35)),
        Thing("pouffe", 0, 3, (0.45, 0.4, 0.45), 1.5),
        Thing("side table", 1, 2, (0.5, 0.5, 0.5), 0.7),
    ),
    "bedroom": (
        Thing("bed", 1, 1, (1.6, 0.5, 2.0), 0.05),
        Thing("bedside table", 1, 2, (0.4, 0.5, 0.4), 0.3),
        Thing("lamp", 1, 2, (0.3, 1.5, 0.3)),
        Thing("box", 2, 6, (0.4, 0.3, 0.3), 1.4),
        Thing("chair", 1, 2, (0.45, 0.9, 0.5), 1.6),
    ),
    "study": (
        Thing("desk", 1, 2, (1.4, 0.74, 0.7), 0.1),
        Thing("office chair", 1, 3, (0.6, 1.0, 0.6), 2.0),
        Thing("box", 2, 6, (0.4, 0.3, 0.3), 1.4),
        Thing("plant", 1, 2, (0.35, 0.8, 0.35)),
        Thing("shelf", 1, 3, (0.8, 2.0, 0.3), 0.05),
    ),
}
"""What stands in each kind of room."""

GAP_M = 0.35
"""Between the middles of objects that are put somewhere, where there is room."""


@dataclass(frozen=True)
class Tidying:
    """What happens to a thing between two looks; the rest stays exactly.

    Args:
        nudged: share pushed by about `nudge_m` and turned by some degrees.
        moved: share put anywhere in the flat, turned anyhow.
        swapped: share that changes places with another of its category, headings included.
        nudge_m: median length of a push, metres; log-normal by a factor of 2.
    """

    nudged: float = 0.25
    moved: float = 0.08
    swapped: float = 0.0
    nudge_m: float = 0.08


def furnished(rng: np.random.Generator, rooms: Sequence[str]) -> tuple[Area, list[Area], Objects, FloatArray]:
    """A flat of rooms in a row: its bounds, the rooms, its objects, and (N,) how easily each moves.

    The flat's origin is the doormat, a metre in front of a corner that is drawn.
    """
    depth = rng.uniform(3.2, 4.6)
    widths = rng.uniform(2.8, 5.2, len(rooms))
    x0, z0 = rng.uniform(-sum(widths), 0.0), 1.0
    areas, position, yaw, size, mobile = [], [], [], [], []
    labels: list[str] = []
    category: list[str] = []
    for i, (room, width) in enumerate(zip(rooms, widths, strict=True)):
        low = (float(x0 + widths[:i].sum()), z0)
        area = Area(low, (low[0] + float(width), z0 + float(depth)))
        inner = Area((area.low[0] + 0.25, area.low[1] + 0.25), (area.high[0] - 0.25, area.high[1] - 0.25))
        areas.append(area)
        things = [t for t in ROOMS[room] for _ in range(rng.integers(t.least, t.most + 1))]
        position.append(spaced_points(inner, len(things), 0.6, rng))
        yaw.append(rng.integers(4, size=len(things)) * np.pi / 2 + rng.normal(0, 0.1, len(things)))
        for thing in things:
            labels.append(f"{thing.category} {category.count(thing.category) + 1}")
            category.append(thing.category)
            size.append(thing.sides)
            mobile.append(thing.mobile)
    flat = Area(areas[0].low, areas[-1].high)
    objects = Objects(labels, category, np.concatenate(position), wrap(np.concatenate(yaw)), np.array(size))
    return flat, areas, objects, np.array(mobile)


def tidied(
    known: Objects, flat: Area, mobile: FloatArray, tidying: Tidying, rng: np.random.Generator
) -> Objects:
    """The objects some time later."""
    number = len(known.labels)
    position, yaw = known.position.copy(), known.yaw.copy()
    fate = rng.random(number) / np.maximum(mobile, 1e-9)
    swapped = fate < tidying.swapped
    moved = ~swapped & (fate < tidying.swapped + tidying.moved)
    nudged = ~swapped & ~moved & (fate < tidying.swapped + tidying.moved + tidying.nudged)
    category = np.array(known.category)
    for i in np.flatnonzero(swapped):
        twins = np.flatnonzero((category == category[i]) & (np.arange(number) != i))
        if len(twins):
            j = rng.choice(twins)
            position[[i, j]], yaw[[i, j]] = position[[j, i]], yaw[[j, i]]
    far = tidying.nudge_m * np.exp(rng.normal(0, np.log(2), number))
    way = rng.uniform(-np.pi, np.pi, number)
    push = far[:, None] * np.stack([np.sin(way), np.cos(way)], axis=-1)
    position[nudged] += push[nudged]
    yaw[nudged] += rng.normal(0, np.deg2rad(12), int(nudged.sum()))
    inner = Area((flat.low[0] + 0.25, flat.low[1] + 0.25), (flat.high[0] - 0.25, flat.high[1] - 0.25))
    for i in np.flatnonzero(moved):
        drawn = rng.uniform(inner.low, inner.high, (20, 2))
        clear = np.linalg.norm(drawn[:, None] - np.delete(position, i, axis=0), axis=-1).min(axis=1)
        enough = np.flatnonzero(clear > GAP_M)
        position[i] = drawn[enough[0] if len(enough) else clear.argmax()]
        yaw[i] = rng.uniform(-np.pi, np.pi)
    return known.at(np.clip(position, flat.low, flat.high), wrap(yaw))


def flats(
    rng: np.random.Generator, count: int, tidying: Tidying, twins_only: bool = False, partly: bool = False
) -> list[Example]:
    """Pairs of looks at flats, each another one.

    Args:
        rng: where the randomness comes from.
        count: how many pairs.
        tidying: what happens in between.
        twins_only: whether objects that are the only ones of their category are left out.
        partly: whether the second look is that of a headset in one room: what stands behind something is
            not seen, one in ten is missed, poses are measured to 2 cm and 4 degrees.
    """
    examples: list[Example] = []
    while len(examples) < count:
        rooms = [str(name) for name in rng.permutation(list(ROOMS))[: rng.integers(2, 5)]]
        flat, areas, known, mobile = furnished(rng, rooms)
        if twins_only:
            several = np.array([known.category.count(name) > 1 for name in known.category])
            known, mobile = known.some(several), mobile[several]
        now = tidied(known, flat, mobile, tidying, rng)
        camera, detector = None, None
        if partly:
            camera = _headset(areas[rng.integers(len(areas))], rng)
            detector = Detector(occlusion=True, position_sd=0.02, yaw_sd=np.deg2rad(4), miss_rate=0.1)
        example = seen_as(flat, "flat", known, now, rng, camera, detector)
        if example.truth:
            examples.append(example)
    return examples


def _headset(room: Area, rng: np.random.Generator) -> Camera:
    """A camera at the eye's height near the wall of a room, which looks across it."""
    share = rng.uniform(0.1, 0.9)
    eye = np.array([room.low[0] + share * room.size[0], room.low[1] + 0.3])
    aim = room.middle + rng.normal(0, 0.4, 2)
    return Camera(
        eye, np.array(towards(aim - eye)), FieldOfView.symmetric(np.deg2rad(110), 6.0), height=np.array(1.6)
    )


ROWS = (
    Row("flat", "furnished flats, categories known, everything in view", partial(flats, tidying=Tidying())),
    Row(
        "flat-twins",
        "the same, only what there are several of",
        partial(flats, tidying=Tidying(), twins_only=True),
    ),
    Row(
        "flat-untidy",
        "the same, half of it pushed and a fifth put anywhere",
        partial(flats, tidying=Tidying(0.5, 0.2, nudge_m=0.2), twins_only=True),
    ),
    Row(
        "flat-swaps",
        "the same, one in ten changes places with its like",
        partial(flats, tidying=Tidying(0.15, 0.03, swapped=0.05), twins_only=True),
    ),
    Row(
        "flat-partly",
        "one room as a headset sees it: occlusion, misses, errors of 2 cm",
        partial(flats, tidying=Tidying(), partly=True),
        all_in_view=False,
    ),
)
"""The flats' rows."""
