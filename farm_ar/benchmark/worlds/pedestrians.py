"""People on foot: a corridor, a crossing, a dense crowd; social forces, and people who come and go."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.benchmark.worlds.base import Area, Example, Objects, Row, boxes, limited, seen_as, towards
from farm_ar.geometry import wrap

DT, SETTLE_S, BETWEEN_S, PAIRS = 0.1, 25.0, 6.0, 10
"""Seconds: a step, before the first look, between first looks of one sequence; pairs of one sequence."""

SIDES = (0.5, 1.7, 0.35)
SPEED, SPEED_SD = 1.3, 0.25
"""Of walking, metres a second, and how people differ."""

Ways = Callable[[np.random.Generator, int], tuple[FloatArray, FloatArray]]
"""Draws where so many people come in and where each of them goes, two (N, 2)."""


class Place(NamedTuple):
    """Where people walk.

    Args:
        area: the bounds, in which looks are taken.
        slots: the most people at a time.
        ways: where they come from and go to.
        pause_s: mean time until somebody else comes in the place of one who has left; None for a closed
            place, where who arrives goes on to somewhere else.
        walls: whether the long sides of the area push people back.
    """

    area: Area
    slots: int
    ways: Ways
    pause_s: float | None
    walls: bool = False


def _corridor(rng: np.random.Generator, number: int) -> tuple[FloatArray, FloatArray]:
    side = rng.choice([-1.0, 1.0], number)
    across = rng.uniform(0.4, 3.6, (2, number))
    return np.stack([11 + 12.5 * side, across[0]], -1), np.stack([11 - 12.5 * side, across[1]], -1)


def _crossing(rng: np.random.Generator, number: int) -> tuple[FloatArray, FloatArray]:
    side = rng.choice([-1.0, 1.0], number)
    lane = rng.uniform(-3.0, 3.0, (2, number))
    start, end = np.stack([9 * side, lane[0]], -1), np.stack([-9 * side, lane[1]], -1)
    swap = (rng.random(number) < 0.5)[:, None]
    centre = np.array([640.0, -215.0])
    return centre + np.where(swap, start[:, ::-1], start), centre + np.where(swap, end[:, ::-1], end)


def _square(rng: np.random.Generator, number: int) -> tuple[FloatArray, FloatArray]:
    side = rng.choice([-1.0, 1.0], number)
    across = rng.uniform(-3.5, 3.5, (2, number))
    start, end = np.stack([-6.5 * side, across[0]], -1), np.stack([6.5 * side, across[1]], -1)
    swap = (rng.random(number) < 0.5)[:, None]
    return np.where(swap, start[:, ::-1], start), np.where(swap, end[:, ::-1], end)


PLACES = {
    "corridor": Place(Area((0.0, 0.0), (22.0, 4.0), closed=False), 14, _corridor, 2.5, walls=True),
    "crossing": Place(Area((633.0, -222.0), (647.0, -208.0), closed=False), 16, _crossing, 2.0),
    "crowd": Place(Area((-8.0, -8.0), (8.0, 8.0), closed=False), 35, _square, None),
}
"""The places by name, each with an origin of its own."""


class Walked(NamedTuple):
    """B sequences over T steps of N slots: (T, B, N, 2), (T, B, N) headings, who (T, B, N), there or not."""

    position: FloatArray
    yaw: FloatArray
    who: IntArray
    there: BoolArray


def simulate(rng: np.random.Generator, place: Place, sequences: int, seconds: float) -> Walked:
    """Walk for some seconds.

    Social forces: everybody turns to the own speed towards the goal within .5 s, and is pushed by others with
    2.6 exp((.5 - d) / .3) m/s^2, those in front counting three times as much as those behind; the walls of
    a corridor push alike. Wishes wander by .25 m/s. Who has arrived leaves, and somebody else comes after a
    while, or goes on, in a closed place. Headings are those of walking, with an error of 8 degrees.
    """
    shape = (sequences, place.slots)
    start, goal = (flat.reshape(*shape, 2) for flat in place.ways(rng, sequences * place.slots))
    position = start + rng.uniform(0.0, 1.0, (*shape, 1)) * (goal - start)
    speed = np.maximum(rng.normal(SPEED, SPEED_SD, shape), 0.5)
    velocity = limited(goal - position, speed)
    there = np.ones(shape, dtype=bool)
    wait, wander = np.zeros(shape), np.zeros((*shape, 2))
    who = np.tile(np.arange(place.slots), (sequences, 1))
    steps = round(seconds / DT) + 1
    walked = Walked(
        np.empty((steps, *shape, 2)),
        np.empty((steps, *shape)),
        np.empty((steps, *shape), dtype=np.int64),
        np.empty((steps, *shape), dtype=bool),
    )
    for t in range(steps):
        walked.position[t], walked.who[t], walked.there[t] = position, who, there
        walked.yaw[t] = towards(velocity)
        wander += -wander * DT / 2.0 + rng.normal(0, 0.25 * np.sqrt(2 * DT / 2.0), wander.shape)
        push = (limited(goal - position, speed) + wander - velocity) / 0.5
        push += _pushed(position, velocity, there)
        if place.walls:
            low, high = place.area.low[1], place.area.high[1]
            push[..., 1] += 3 * np.exp((low + 0.2 - position[..., 1]) / 0.2)
            push[..., 1] -= 3 * np.exp((position[..., 1] - high + 0.2) / 0.2)
        velocity = limited(velocity + push * DT, 1.4 * speed)
        position = position + velocity * DT
        arrived = there & (np.linalg.norm(goal - position, axis=-1) < 0.8)
        entered, next_goal = (flat.reshape(*shape, 2) for flat in place.ways(rng, sequences * place.slots))
        if place.pause_s is None:
            goal = np.where(arrived[..., None], next_goal, goal)
            continue
        wait = np.where(arrived, rng.exponential(place.pause_s, shape), wait - DT)
        there = there & ~arrived
        comes = ~there & (wait <= 0)
        there = there | comes
        who = np.where(comes, who + place.slots, who)
        position = np.where(comes[..., None], entered, position)
        goal = np.where(comes[..., None], next_goal, goal)
        speed = np.where(comes, np.maximum(rng.normal(SPEED, SPEED_SD, shape), 0.5), speed)
        velocity = np.where(comes[..., None], limited(goal - position, speed), velocity)
    return walked


def _pushed(position: FloatArray, velocity: FloatArray, there: BoolArray) -> FloatArray:
    """(B, N, 2) acceleration by the others."""
    apart = position[:, :, None] - position[:, None]
    distance = np.linalg.norm(apart, axis=-1)
    away = apart / np.maximum(distance, 0.05)[..., None]
    walking = velocity / np.maximum(np.linalg.norm(velocity, axis=-1, keepdims=True), 1e-6)
    ahead = -np.sum(away * walking[:, :, None], axis=-1)
    force = 2.6 * np.exp((0.5 - distance) / 0.3) * (2 + ahead) / 3
    counts = there[:, None] & there[:, :, None] & (distance > 0)
    pushed: FloatArray = np.sum(np.where(counts, force, 0.0)[..., None] * away, axis=2)
    return pushed


def pedestrians(rng: np.random.Generator, count: int, where: str, gap_s: float) -> list[Example]:
    """Pairs of looks at people, `gap_s` apart; who came in between has no label, who left is not seen.

    Args:
        rng: where the randomness comes from.
        count: how many pairs.
        where: a name in `PLACES`.
        gap_s: seconds between the two looks.
    """
    place = PLACES[where]
    sequences = -(-count // PAIRS)
    walked = simulate(rng, place, sequences, SETTLE_S + PAIRS * BETWEEN_S + gap_s)
    examples = []
    for k in range(count):
        b, first = k % sequences, round((SETTLE_S + k // sequences * BETWEEN_S) / DT)
        known, now = (_people(walked, place, b, t, rng) for t in (first, first + round(gap_s / DT)))
        examples.append(seen_as(place.area, where, known, now, rng))
    return examples


def _people(walked: Walked, place: Place, b: int, t: int, rng: np.random.Generator) -> Objects:
    """Who is in the area at one time."""
    position = walked.position[t, b]
    inside = np.all((position >= place.area.low) & (position <= place.area.high), axis=-1)
    index = np.flatnonzero(walked.there[t, b] & inside)
    if not len(index):  # an empty place: its last visitor, at the edge
        index = np.array([int(walked.there[t, b].argmax())])
        position = np.clip(position, place.area.low, place.area.high)
    yaw = wrap(walked.yaw[t, b, index] + rng.normal(0, np.deg2rad(8), len(index)))
    names = [f"person {i}" for i in walked.who[t, b, index]]
    return Objects(names, ["person"] * len(index), position[index], yaw, boxes(len(index), SIDES))


ROWS = tuple(
    Row(
        f"{where}-{gap:g}s",
        f"{about}, {gap:g} s between looks",
        partial(pedestrians, where=where, gap_s=gap),
    )
    for where, about in (
        ("corridor", "people in a two-way corridor, coming and going"),
        ("crossing", "people who cross from four sides, coming and going"),
        ("crowd", "a dense crowd of 35 who walk all ways"),
    )
    for gap in (1.2, 4.0)
)
"""The rows of people on foot."""
