"""How often `align` is right, and its confidence, in worlds that are unlike one another.

    python benchmarks/alignment.py [--worlds 200]

Every snapshot has a frame of its own: any turn, any shift, any unit. Prints a row for each kind of snapshot.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry import in_view
from farm_ar.reid import Alignment, RigidMotion, align
from farm_ar.reid.alignment import spacing_of
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot

Poses = tuple[FloatArray, FloatArray, IntArray]
"""Positions (N, 2), headings (N,) and categories (N,) of a world."""


def room(rng: np.random.Generator) -> Poses:
    n = rng.integers(5, 31)
    return (
        rng.uniform(0, 1, (n, 2)) * rng.uniform(3, 9, 2),
        rng.uniform(-np.pi, np.pi, n),
        rng.integers(0, max(1, n // 3), n),
    )


def tabletop(rng: np.random.Generator) -> Poses:
    n = rng.integers(5, 21)
    return rng.normal(0, 0.3, (n, 2)) * [1.0, 0.6], rng.uniform(-np.pi, np.pi, n), rng.integers(0, 3, n)


def warehouse(rng: np.random.Generator) -> Poses:
    """A grid with breaks, things facing one of two ways."""
    rows, columns = rng.integers(3, 9, 2)
    grid = np.stack(np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"), -1).reshape(-1, 2)
    kept = rng.permutation(len(grid))[: max(5, int(0.7 * len(grid)))][:60]
    n = len(kept)
    return grid[kept] * [1.0, rng.uniform(1, 2)], rng.integers(0, 2, n) * np.pi, np.zeros(n, dtype=np.int64)


def circle(rng: np.random.Generator) -> Poses:
    """Things around a circle, facing its middle: at equal distances they look alike from many sides."""
    n = rng.integers(5, 25)
    angle = np.arange(n) * 2 * np.pi / n if rng.random() < 0.5 else rng.uniform(0, 2 * np.pi, n)
    place = 2 * np.stack([np.sin(angle), np.cos(angle)], axis=1)
    return place, angle + np.pi, rng.integers(0, rng.integers(1, 4), n)


def clusters(rng: np.random.Generator) -> Poses:
    n, k = rng.integers(8, 61), rng.integers(2, 6)
    middle = rng.uniform(0, 20, (k, 2))
    return (
        middle[rng.integers(0, k, n)] + rng.normal(0, 1, (n, 2)),
        rng.normal(0, 0.3, n),
        rng.integers(0, 4, n),
    )


def shelves(rng: np.random.Generator) -> Poses:
    """Rows of things that all face one way."""
    n = rng.integers(5, 41)
    place = np.stack([np.cumsum(rng.uniform(0.5, 1.5, n)), rng.integers(0, 3, n) * 3.0], axis=1)
    return place, np.zeros(n), rng.integers(0, 2, n)


WORLDS: dict[str, Callable[[np.random.Generator], Poses]] = {
    made.__name__: made for made in (room, tabletop, warehouse, circle, clusters, shelves)
}


@dataclass(frozen=True)
class Look:
    """How a snapshot is taken.

    Args:
        moved: share of the things that were moved anywhere and turned anyhow.
        noise: of positions, by the spacing.
        yaw_deg: noise of headings.
        partial: whether a camera within the world sees part of it, not all.
        missed: share of what is in view that is not detected.
        false: mean number of false detections.
        headings: whether they tell anything.
        categories: whether they are known.
    """

    moved: float = 0.3
    noise: float = 0.01
    yaw_deg: float = 1.0
    partial: bool = False
    missed: float = 0.0
    false: float = 0.0
    headings: bool = True
    categories: bool = True


LOOKS = {
    "30% moved": Look(),
    "5% moved": Look(moved=0.05),
    "three times the noise": Look(noise=0.03, yaw_deg=5.0),
    "headings uninformative": Look(headings=False),
    "categories unknown": Look(categories=False),
    "partial view": Look(partial=True),
    "partial view, misses, a false one": Look(partial=True, missed=0.05, false=1.0),
    "partial view, 50% moved": Look(partial=True, moved=0.5),
}
"""The kinds of snapshot."""


@dataclass(frozen=True)
class Case:
    """A map, a snapshot in another frame, and the motion from that frame to the map's."""

    scene: Scene
    snapshot: Snapshot
    motion: RigidMotion

    @property
    def spacing(self) -> float:
        """Metres."""
        return spacing_of(self.scene.layout.position, self.scene.layout.size)

    def error(self, found: Alignment) -> tuple[float, float]:
        """How far an answer is off: at the detections' middle, by the spacing, and degrees."""
        middle = self.snapshot.detections.position.mean(axis=0, keepdims=True)
        off = np.linalg.norm(found.motion.position(middle) - self.motion.position(middle))
        turn = float(found.motion.turn - self.motion.turn)
        return float(off) / self.spacing, abs(float(np.rad2deg((turn + np.pi) % (2 * np.pi) - np.pi)))

    def right(self, found: Alignment) -> bool:
        """Whether an answer is within 5% of the spacing and 2 degrees."""
        off, turn = self.error(found)
        return off < 0.05 and turn < 2


def make_case(kind: str, seed: int, look: Look) -> Case:
    """A world, things moved in it, and a snapshot in a frame of its own."""
    rng = np.random.default_rng([seed, list(WORLDS).index(kind)])
    place, yaw, code = WORLDS[kind](rng)
    unit, n = 10 ** rng.uniform(-2, 2), len(place)
    place = unit * (place + rng.uniform(-1000, 1000, 2))
    size = np.full((n, 3), 0.1 * unit)
    layout = Layout(tuple(f"o{i}" for i in range(n)), tuple(f"c{i}" for i in code), place, yaw, size)
    low, extent = place.min(axis=0), np.ptp(place, axis=0)
    place, yaw = place.copy(), yaw.copy()
    away = rng.permutation(n)[: round(look.moved * n)]
    place[away] = low + extent * rng.uniform(0, 1, (len(away), 2))
    yaw[away] = rng.uniform(-np.pi, np.pi, len(away))
    reach = float(np.hypot(*extent))
    camera = low + extent * rng.uniform(0, 1, 2) if look.partial else low - 0.3 * reach
    facing = rng.uniform(-np.pi, np.pi)
    view = (0.6, 0.6, 0.7 * reach) if look.partial else (np.pi, np.pi, 10 * reach)
    seen = in_view(place, camera, facing, *view) & (rng.random(n) >= look.missed)
    place += spacing_of(layout.position, size) * look.noise * rng.normal(size=(n, 2))
    yaw += np.deg2rad(look.yaw_deg) * rng.normal(size=n)
    false = rng.poisson(look.false)
    place = np.vstack([place[seen], low + extent * rng.uniform(0, 1, (false, 2))])
    yaw = np.concatenate([yaw[seen], rng.uniform(-np.pi, np.pi, false)])
    which = np.concatenate([np.flatnonzero(seen), rng.integers(0, n, false)])
    if not look.headings:
        yaw = rng.uniform(-np.pi, np.pi, len(yaw))
    order = rng.permutation(len(place))
    category = tuple(layout.category[i] if look.categories else None for i in which[order])
    motion = RigidMotion(
        np.zeros(2), unit * rng.uniform(-1000, 1000, 2), np.array(rng.uniform(-np.pi, np.pi))
    )
    back = motion.inverse()
    detections = Detections(
        category, back.position(place[order]), back.yaw(yaw[order]), np.full((len(order), 3), 0.1 * unit)
    )
    eye = Camera(back.position(camera[None])[0], facing + back.turn, FieldOfView(*view))
    return Case(Scene(kind, None, layout), Snapshot(eye, detections), motion)


def measure(look: Look, worlds: int) -> dict[str, float]:
    """How `align` does in so many worlds, of each kind as many."""
    rows = []
    for seed in range(worlds):
        case = make_case(list(WORLDS)[seed % len(WORLDS)], seed, look)
        if not len(case.snapshot.detections):
            continue
        start = time.perf_counter()
        found = align(case.scene, case.snapshot)
        rows.append((case.right(found), found.certain, time.perf_counter() - start))
    right, certain, seconds = (np.array(column) for column in zip(*rows, strict=True))
    return {
        "snapshots": len(rows),
        "right": float(right.mean()),
        "certain": float(certain.mean()),
        "right of certain": float(right[certain].mean()) if certain.any() else float("nan"),
        "median ms": 1e3 * float(np.median(seconds)),
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=200)
    worlds = parser.parse_args().worlds
    print(
        "| snapshots | number | right | certain | right of certain | median ms |\n|---|--:|--:|--:|--:|--:|"
    )
    for name, look in LOOKS.items():
        row = measure(look, worlds)
        print(
            f"| {name} | {row['snapshots']} | {row['right']:.3f} | {row['certain']:.3f} "
            f"| {row['right of certain']:.3f} | {row['median ms']:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
