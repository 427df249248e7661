"""A school of fish in a small tank: alignment, cohesion, distance, walls, and bursts of swimming."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.benchmark.worlds.base import Area, Example, Objects, Row, boxes, limited, seen_as, towards

TANK = Area((0.0, 0.0), (0.7, 0.4))
SIDES = (0.008, 0.012, 0.035)
DT, SETTLE_S, BETWEEN_S, PAIRS = 0.05, 8.0, 2.5, 12
"""Seconds: a step, before the first look, between first looks of one sequence; pairs of one sequence."""

SCHOOLS = (8, 9, 10, 11, 12, 13, 14, 15)
"""Fish in a tank, in turn."""

PIXELS_PER_METRE, PIXEL_ORIGIN = 1280.0, (192.0, -640.0)
"""Where the tank lies in an image whose pixels are taken for metres, its rows counted downwards."""


class Swum(NamedTuple):
    """B schools of N fish over T steps: (T, B, N, 2) positions and velocities, metres and metres a second."""

    position: FloatArray
    velocity: FloatArray


def simulate(rng: np.random.Generator, schools: int, fish: int, seconds: float) -> Swum:
    """Swim for some seconds.

    A fish turns to the mean velocity of those within 13 cm (.8 s), to their middle (3 m/s^2 a metre), away
    from those within 3.5 cm, and from walls within 6 cm; it beats its tail about every .8 s, which adds up
    to .1 m/s along its heading, and glides with a time constant of .9 s. Turning wanders.
    """
    shape = (schools, fish)
    position = rng.uniform(0.1, 0.3, (*shape, 2))
    velocity = 0.06 * _unit(rng.normal(size=(*shape, 2)))
    steps = round(seconds / DT) + 1
    swum = Swum(np.empty((steps, *shape, 2)), np.empty((steps, *shape, 2)))
    spin = np.zeros(shape)
    low, high = np.asarray(TANK.low), np.asarray(TANK.high)
    for t in range(steps):
        swum.position[t], swum.velocity[t] = position, velocity
        apart = position[:, None] - position[:, :, None]  # from each to the others
        distance = np.linalg.norm(apart, axis=-1)
        near = (distance < 0.13) & (distance > 0)
        number = np.maximum(near.sum(axis=-1, keepdims=True), 1)
        others = np.any(near, axis=-1, keepdims=True)
        mean = np.sum(np.where(near[..., None], velocity[:, None], 0.0), axis=2) / number
        middle = np.sum(np.where(near[..., None], apart, 0.0), axis=2) / number
        force = np.where(others, (mean - velocity) / 0.8, 0.0) + 3.0 * middle
        close = near & (distance < 0.035)
        away = apart / np.maximum(distance, 1e-3)[..., None] * (0.035 - distance[..., None])
        force -= 40.0 * np.sum(np.where(close[..., None], away, 0.0), axis=2)
        force += 4.0 * np.maximum(low + 0.06 - position, 0) - 4.0 * np.maximum(position - high + 0.06, 0)
        spin += -spin * DT / 0.7 + rng.normal(0, 2.0 * np.sqrt(2 * DT / 0.7), shape)
        ahead = _unit(velocity)
        side = np.stack([ahead[..., 1], -ahead[..., 0]], axis=-1)
        speed = np.linalg.norm(velocity, axis=-1)
        beat = np.where(rng.random(shape) < DT / 0.8, rng.uniform(0.03, 0.1, shape), 0.0)
        velocity = velocity + (force + (spin * speed)[..., None] * side - velocity / 0.9) * DT
        velocity = limited(velocity + beat[..., None] * ahead, 0.25)
        outside = (position + velocity * DT < low + 0.005) | (position + velocity * DT > high - 0.005)
        velocity = np.where(outside, -0.5 * velocity, velocity)
        position = np.clip(position + velocity * DT, low + 0.005, high - 0.005)
    return swum


def school(
    rng: np.random.Generator, count: int, gap_s: float, pixels: bool = False, points: bool = False
) -> list[Example]:
    """Pairs of looks at schools of 8 to 15 fish.

    Args:
        rng: where the randomness comes from.
        count: how many pairs.
        gap_s: seconds between the two looks.
        pixels: whether positions and sizes are those of an image, its pixels taken for metres.
        points: whether neither headings nor sizes are known; else headings are those of swimming.
    """
    each = -(-count // len(SCHOOLS))
    examples = []
    for fish in SCHOOLS:
        schools = -(-each // PAIRS)
        swum = simulate(rng, schools, fish, SETTLE_S + PAIRS * BETWEEN_S + gap_s)
        for k in range(each):
            b, first = k % schools, round((SETTLE_S + k // schools * BETWEEN_S) / DT)
            looks = [_fish(swum, b, t, pixels) for t in (first, first + round(gap_s / DT))]
            if points:
                looks = [look.bare() for look in looks]
            examples.append(seen_as(_tank(pixels), "tank", looks[0], looks[1], rng))
    return [examples[(k % len(SCHOOLS)) * each + k // len(SCHOOLS)] for k in range(count)]


def _fish(swum: Swum, b: int, t: int, pixels: bool) -> Objects:
    position, velocity = swum.position[t, b], swum.velocity[t, b]
    number = len(position)
    size = boxes(number, SIDES)
    if pixels:
        position = np.asarray(PIXEL_ORIGIN) + PIXELS_PER_METRE * position
        size = PIXELS_PER_METRE * size
    names = [f"fish {i}" for i in range(number)]
    return Objects(names, ["fish"] * number, position, towards(velocity), size)


def _tank(pixels: bool) -> Area:
    if not pixels:
        return TANK
    low, high = (
        np.asarray(PIXEL_ORIGIN) + PIXELS_PER_METRE * np.asarray(end) for end in (TANK.low, TANK.high)
    )
    return Area((float(low[0]), float(low[1])), (float(high[0]), float(high[1])))


def _unit(vector: FloatArray) -> FloatArray:
    unit: FloatArray = vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), 1e-9)
    return unit


ROWS = (
    *(
        Row(f"fish-{gap:g}s", f"8 to 15 fish in a tank, {gap:g} s between looks", partial(school, gap_s=gap))
        for gap in (0.25, 1.0)
    ),
    *(
        Row(
            f"fish-pixels-{gap:g}s",
            f"the same in pixels that are taken for metres, {gap:g} s",
            partial(school, gap_s=gap, pixels=True),
        )
        for gap in (0.25, 1.0)
    ),
    Row("fish-points-0.5s", "the same as points in metres, 0.5 s", partial(school, gap_s=0.5, points=True)),
)
"""The tank's rows."""
