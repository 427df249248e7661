"""Two teams on a field: attracted to their places in a formation, to the ball, and away from one another."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.benchmark.worlds.base import Area, Example, Objects, Row, boxes, limited, seen_as, towards
from farm_ar.geometry import wrap
from farm_ar.scenes import Camera, FieldOfView

PITCH = Area((-52.5, -34.0), (52.5, 34.0))
"""The field, with its origin at the centre spot."""

DT, SETTLE_S, BETWEEN_S = 0.1, 6.0, 5.0
"""Seconds: a step, before the first look, and between first looks of one sequence."""

PAIRS = 8
"""Pairs of looks taken from one sequence."""

TEAM = 11
SIDES = (0.5, 1.8, 0.4)

# 4-4-2, the keeper first: share of the half length in front of the own goal line, and across.
FORMATION = np.array(
    [(0.05, 0.0), (0.32, -0.7), (0.28, -0.25), (0.28, 0.25), (0.32, 0.7), (0.62, -0.65), (0.56, -0.2),
     (0.56, 0.2), (0.62, 0.65), (0.86, -0.2), (0.9, 0.25)]
)  # fmt: skip


class Tracks(NamedTuple):
    """B sequences over T steps: (T, B, 22, 2) positions, (T, B, 22) headings, (T, B, 2) the ball."""

    position: FloatArray
    yaw: FloatArray
    ball: FloatArray


def simulate(rng: np.random.Generator, sequences: int, seconds: float, watching: bool) -> Tracks:
    """Play for some seconds.

    A player accelerates by at most 4.5 m/s^2 towards what he wants: his place in the formation, which follows
    the ball by half of its way, at up to 4.5 m/s; the two of each team who are nearest to the ball run
    for it at up to 7 m/s. Wishes wander (Ornstein-Uhlenbeck, 1 m/s, 1.5 s). The ball rolls from where it is
    to near some player every 1 to 4 s.

    Args:
        rng: where the randomness comes from.
        sequences: how many are played at once.
        seconds: how long.
        watching: whether players face between where they run and the ball; else where they run.
    """
    half = PITCH.size / 2
    home = (2 * FORMATION[:, 0] - 1) * half[0] * 0.55, FORMATION[:, 1] * half[1] * 0.6
    own = np.stack(home, axis=-1)
    place = np.concatenate([own, -own]) + rng.normal(0, 3.0, (sequences, 2 * TEAM, 2))
    position, velocity = place.copy(), np.zeros_like(place)
    wander = np.zeros_like(place)
    ball = rng.uniform(-half, half, (sequences, 2))
    target, until = ball.copy(), np.zeros(sequences)
    yaw = np.repeat([np.pi / 2, -np.pi / 2], TEAM) + np.zeros((sequences, 1))
    steps = round(seconds / DT) + 1
    tracks = Tracks(
        np.empty((steps, *place.shape)), np.empty((steps, *yaw.shape)), np.empty((steps, *ball.shape))
    )
    rows = np.arange(sequences)
    for t in range(steps):
        passed = until <= t * DT
        receiver = position[rows, rng.integers(2 * TEAM, size=sequences)]
        to = np.clip(receiver + rng.normal(0, 4.0, ball.shape), -half, half)
        target = np.where(passed[:, None], to, target)
        until = np.where(passed, t * DT + rng.uniform(1.0, 4.0, sequences), until)
        ball = ball + limited(1.5 * (target - ball), 13.0) * DT
        tracks.position[t], tracks.yaw[t], tracks.ball[t] = position, yaw, ball

        wander += -wander * DT / 1.5 + rng.normal(0, np.sqrt(2 * DT / 1.5), wander.shape)
        wish = limited((place + 0.5 * ball[:, None] - position) / 2.0, 4.5) + wander
        far = np.linalg.norm(position - ball[:, None], axis=-1).reshape(sequences, 2, TEAM)
        far[:, :, 0] += 40.0  # keepers stay
        chasing = (far.argsort(axis=-1).argsort(axis=-1) < 2).reshape(sequences, 2 * TEAM)
        chase = limited(2.0 * (ball[:, None] - position), 7.0)
        wish = np.where(chasing[..., None], chase, wish)
        apart = position[:, :, None] - position[:, None]
        near = np.linalg.norm(apart, axis=-1, keepdims=True)
        wish = wish + np.sum(apart / np.maximum(near, 0.1) * 3.0 * np.exp(-near / 0.8), axis=2)
        velocity = limited(velocity + limited((wish - velocity) / 0.4, 4.5) * DT, 7.5)
        position = np.clip(position + velocity * DT, -half - 2, half + 2)
        ahead = velocity
        if watching:
            ahead = velocity / 2.5 + limited(ball[:, None] - position, 1.0)
        speed = np.linalg.norm(ahead, axis=-1)
        yaw = yaw + wrap(towards(ahead) - yaw) * np.minimum(1.0, DT / 0.25) * np.minimum(speed, 1.0)
    return tracks


def players(
    rng: np.random.Generator,
    count: int,
    gap_s: float,
    teams: bool = True,
    seen: int = TEAM,
    wedge: bool = False,
    points: bool = False,
) -> list[Example]:
    """Pairs of looks at a game, `gap_s` apart.

    Args:
        rng: where the randomness comes from.
        count: how many pairs.
        gap_s: seconds between the two looks.
        teams: whether the teams can be distinguished; where they cannot, players face where they run.
        seen: how many of each team are detected at the second look, drawn at random.
        wedge: whether a camera on the touchline takes the second look, zoomed so that it sees 12 of the 22.
        points: whether nothing but places and teams is known, neither headings nor sizes.
    """
    sequences = -(-count // PAIRS)
    tracks = simulate(rng, sequences, SETTLE_S + PAIRS * BETWEEN_S + gap_s, watching=teams)
    names = [f"{team} {k}" for team in ("red", "blue") for k in range(1, TEAM + 1)]
    category = [name.split()[0] if teams else "player" for name in names]
    wide = Area((PITCH.low[0] - 3, PITCH.low[1] - 3), (PITCH.high[0] + 3, PITCH.high[1] + 3), closed=False)
    examples = []
    for k in range(count):
        b, first = k % sequences, round((SETTLE_S + k // sequences * BETWEEN_S) / DT)
        second = first + round(gap_s / DT)
        known, now = (
            Objects(names, category, tracks.position[t, b], wrap(tracks.yaw[t, b]), boxes(2 * TEAM, SIDES))
            for t in (first, second)
        )
        camera = _zoomed(now.position, tracks.ball[second, b]) if wedge else None
        if seen < TEAM:
            chosen = np.concatenate([team * TEAM + rng.permutation(TEAM)[:seen] for team in (0, 1)])
            now = now.some(np.sort(chosen))
        if points:
            known, now = known.bare(), now.bare()
        examples.append(seen_as(wide, "match", known, now, rng, camera))
    return examples


def _zoomed(position: FloatArray, ball: FloatArray) -> Camera:
    """A camera on the touchline that looks at the ball and just sees 12 players."""
    eye = np.array([0.0, PITCH.low[1] - 20.0])
    aim = towards(ball - eye)
    off = np.sort(np.abs(wrap(towards(position - eye) - aim)))
    half = float(off[11] + off[12]) / 2
    return Camera(eye, np.array(aim), FieldOfView(half, half, 130.0))


ROWS = (
    *(
        Row(
            f"players-{gap:g}s", f"two teams on a field, {gap:g} s between looks", partial(players, gap_s=gap)
        )
        for gap in (1, 2, 4)
    ),
    *(
        Row(
            f"players-alike-{gap:g}s",
            f"22 players all alike, facing where they run, {gap:g} s",
            partial(players, gap_s=gap, teams=False),
        )
        for gap in (1, 2)
    ),
    Row(
        "players-points-1s",
        "two teams as points, without headings and sizes, 1 s",
        partial(players, gap_s=1, points=True),
    ),
    Row(
        "players-half-2s",
        "6 of each team of 11 detected, 2 s",
        partial(players, gap_s=2, seen=6),
        all_in_view=False,
    ),
    Row(
        "players-zoom-2s",
        "a camera on the touchline that sees 12 of 22, 2 s",
        partial(players, gap_s=2, wedge=True),
        all_in_view=False,
    ),
)
"""The field's rows."""
