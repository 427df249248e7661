"""Other origins, units and habits: a warehouse, a board, carts, bad detectors, objects that come and go."""

from __future__ import annotations

from functools import partial

import numpy as np

from farm_ar.benchmark.worlds.base import Area, Example, Objects, Row, boxes, seen_as, spaced_points, towards
from farm_ar.geometry import wrap
from farm_ar.scenes import Camera, Detector, FieldOfView

WAREHOUSE = Area((-2460.0, 812.0), (-2424.0, 836.0))
"""With the origin of the map of the whole site."""

PALLET, BAY_M = (1.2, 1.1, 0.8), 1.8

BOARD = Area((-300.0, -200.0), (300.0, 200.0))
"""A table of 60 by 40 cm, in millimetres that are taken for metres."""

YARD = Area((100.0, 100.0), (160.0, 140.0), closed=False)
LOUNGE, SHIFT_M = Area((-4.0, 0.0), (2.5, 5.0)), 0.3


def pallets(rng: np.random.Generator, count: int, moved: float = 0.08) -> list[Example]:
    """Identical pallets in the bays of a warehouse; some are carried to an empty bay, turned by half or not.

    Headings are by the quarter turn, either end in front, so that they say next to nothing. A camera on a
    forklift sees 14 m ahead.

    Args:
        rng: where the randomness comes from.
        count: how many pairs.
        moved: share that is carried elsewhere; the others are nudged by about 8 cm.
    """
    x, z = (np.arange(WAREHOUSE.low[i] + 1.5, WAREHOUSE.high[i], BAY_M) for i in (0, 1))
    bays = np.stack(np.meshgrid(x, z[::2], indexing="ij"), axis=-1).reshape(-1, 2)
    examples = []
    for _ in range(count):
        order = rng.permutation(len(bays))
        number = int(0.7 * len(bays))
        place = bays[order[:number]] + rng.normal(0, 0.05, (number, 2))
        free = list(order[number:])
        later = place + rng.normal(0, 0.08, place.shape)
        for i in np.flatnonzero(rng.random(number) < moved):
            bay = free.pop(int(rng.integers(len(free))))
            free.append(order[i])
            later[i] = bays[bay] + rng.normal(0, 0.08, 2)
        names = [f"pallet {i:03d}" for i in range(number)]
        looks = [
            Objects(
                names,
                ["pallet"] * number,
                where,
                wrap(rng.integers(2, size=number) * np.pi + rng.normal(0, 0.03, number)),
                boxes(number, PALLET),
            )
            for where in (place, later)
        ]
        eye = rng.uniform(np.add(WAREHOUSE.low, 4), np.subtract(WAREHOUSE.high, 4))
        aim = towards(WAREHOUSE.middle + rng.normal(0, 3, 2) - eye)
        camera = Camera(eye, np.array(aim), FieldOfView.symmetric(np.deg2rad(100), 14.0))
        examples.append(seen_as(WAREHOUSE, "warehouse", looks[0], looks[1], rng, camera))
    return examples


def pieces(rng: np.random.Generator, count: int, headings: str = "random") -> list[Example]:
    """Round pieces of two colours on a table, in millimetres; most slide a little, some far.

    Lengths of slides are log-normal around 12 mm by a factor of 3.5.

    Args:
        rng: where the randomness comes from.
        count: how many pairs.
        headings: "random" where they are drawn anew for each look, "none" where they are not measured.
    """
    inner = Area((BOARD.low[0] + 20, BOARD.low[1] + 20), (BOARD.high[0] - 20, BOARD.high[1] - 20))
    examples = []
    for _ in range(count):
        number = int(rng.integers(10, 19))
        category = ["black" if i % 2 else "white" for i in range(number)]
        names = [f"{name} {i // 2 + 1}" for i, name in enumerate(category)]
        place = spaced_points(inner, number, 45.0, rng)
        far = 12.0 * np.exp(rng.normal(0, np.log(3.5), number))
        way = rng.uniform(-np.pi, np.pi, number)
        later = np.clip(
            place + far[:, None] * np.stack([np.sin(way), np.cos(way)], axis=-1), inner.low, inner.high
        )
        known, now = (
            Objects(
                names,
                category,
                where,
                np.full(number, np.nan) if headings == "none" else rng.uniform(-np.pi, np.pi, number),
                boxes(number, (28.0, 9.0, 28.0)),
            )
            for where in (place, later)
        )
        examples.append(seen_as(BOARD, "board", known, now, rng))
    return examples


def carts(rng: np.random.Generator, count: int, gap_s: float = 3.0) -> list[Example]:
    """Carts that drive along their headings, turning slowly, at .5 to 3 m/s; a quarter is parked.

    Args:
        rng: where the randomness comes from.
        count: how many pairs.
        gap_s: seconds between the two looks.
    """
    examples = []
    for _ in range(count):
        number = int(rng.integers(8, 25))
        place = spaced_points(YARD, number, 2.0, rng)
        yaw = rng.uniform(-np.pi, np.pi, number)
        speed = np.where(rng.random(number) < 0.25, 0.0, rng.uniform(0.5, 3.0, number))
        rate = rng.normal(0, 0.18, number)
        later, turned = place.copy(), yaw.copy()
        for _ in range(round(gap_s / 0.1)):
            turned += np.where(speed > 0, rate, 0.0) * 0.1
            later += 0.1 * speed[:, None] * np.stack([np.sin(turned), np.cos(turned)], axis=-1)
        names = [f"cart {i + 1}" for i in range(number)]
        known = Objects(names, ["cart"] * number, place, yaw, boxes(number, (0.9, 1.0, 1.6)))
        inside = np.all((later >= YARD.low) & (later <= YARD.high), axis=-1)
        error = rng.normal(0, np.deg2rad(3), number)
        now = known.at(later + rng.normal(0, 0.05, later.shape), wrap(turned + error))
        examples.append(seen_as(YARD, "yard", known, now.some(inside), rng))
    return examples


def lounges(
    rng: np.random.Generator,
    count: int,
    left: float = 0.0,
    new: float = 0.0,
    detector: Detector | None = None,
) -> list[Example]:
    """A lounge with identical chairs and tables, pushed about by shifts with a heavy tail.

    Shifts are Student's t with 3 degrees of freedom times 30 cm on each axis, turns normal, 20 degrees.

    Args:
        rng: where the randomness comes from.
        count: how many pairs.
        left: probability that an object has left in between.
        new: mean number of new objects, of the same categories.
        detector: what goes wrong when they are seen; by default nothing.
    """
    examples = []
    for _ in range(count):
        chairs, tables = int(rng.integers(7, 13)), int(rng.integers(2, 5))
        more = int(rng.poisson(new))
        category = ["chair"] * chairs + ["table"] * tables + list(rng.choice(["chair", "table"], more))
        number = chairs + tables
        names = [f"{name} {category[: i + 1].count(name)}" for i, name in enumerate(category)]
        place = spaced_points(LOUNGE, number + more, 0.6, rng)
        yaw = rng.uniform(-np.pi, np.pi, number + more)
        size = np.array([(0.5, 0.9, 0.5) if name == "chair" else (0.8, 0.45, 0.8) for name in category])
        every = Objects(names, category, place, yaw, size)
        shift = SHIFT_M * rng.standard_t(3, place.shape)
        later = np.clip(place + shift, LOUNGE.low, LOUNGE.high)
        now = every.at(later, wrap(yaw + rng.normal(0, np.deg2rad(20), len(yaw))))
        stays = rng.random(number + more) >= left
        stays[rng.integers(number)] = True
        known = every.some(np.arange(number))
        examples.append(seen_as(LOUNGE, "lounge", known, now.some(stays), rng, detector=detector))
    return examples


ROWS = (
    Row(
        "warehouse",
        "identical pallets far from the origin, seen from a forklift, headings that say nothing",
        pallets,
        all_in_view=False,
    ),
    Row("board", "round pieces on a table in millimetres, headings that say nothing", pieces),
    Row(
        "board-bare",
        "the same, headings not measured",
        partial(pieces, headings="none"),
    ),
    Row("carts-3s", "carts that drive along their headings, 3 s", carts),
    Row("lounge", "chairs and tables pushed about, a heavy tail", lounges),
    Row(
        "lounge-missed",
        "the same, one in seven missed and one false detection a snapshot",
        partial(lounges, detector=Detector(position_sd=0.03, yaw_sd=0.1, miss_rate=0.15, false_rate=1.0)),
    ),
    Row("lounge-left", "the same, one in ten has left", partial(lounges, left=0.1)),
    Row("lounge-new", "the same, one or two new objects", partial(lounges, new=1.5)),
)
"""The rows of elsewhere."""
