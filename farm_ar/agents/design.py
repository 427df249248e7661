"""Designing layouts: placements of identical objects that take the most to be mistaken for one another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from farm_ar.agents.validity import outside_by
from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import OptionError
from farm_ar.geometry import wrap
from farm_ar.geometry.rectangles import overlap_depth
from farm_ar.kernels import compiled
from farm_ar.scenes import Layout, Scene

GAP_M = 0.01
"""Room left between two footprints, metres."""

STEEPNESS = 20.0
"""What a metre of overlap costs beside the radius."""


@dataclass(frozen=True, eq=False)
class Design:
    """A placement and what it certifies.

    Args:
        scene: with the placement for its layout.
        radius: T1's: no label in any snapshot is wrong while every object's D is below it.
        metres: how far that lets every object move without turning; infinite where ways do not count.
        degrees: how far it lets every object turn where it stands, at most 180.
    """

    scene: Scene
    radius: float
    metres: float
    degrees: float


def certified_radius(scene: Scene) -> float:
    """T1's radius of a layout: half the least D of two objects of one category; infinite without two."""
    layout, weights = scene.layout, scene.cost_weights
    apart = np.linalg.norm(layout.position[:, None] - layout.position, axis=-1) / scene.diagonal
    turned = np.abs(np.sin(wrap(layout.yaw[:, None] - layout.yaw) / 2))
    code = layout.category_code
    rivals = (code[:, None] == code) & ~np.eye(len(code), dtype=bool)
    distance = weights.translation * apart + weights.rotation * turned
    return float(distance[rivals].min(initial=np.inf) / 2)


def described(scene: Scene) -> Design:
    """What a scene's own layout certifies."""
    radius, weights = certified_radius(scene), scene.cost_weights
    metres = radius * scene.diagonal / weights.translation if weights.translation else np.inf
    sine = radius / weights.rotation if weights.rotation else np.inf
    return Design(scene, radius, float(metres), float(np.rad2deg(2 * np.arcsin(min(sine, 1.0)))))


def with_objects(scene: Scene, counts: Mapping[str, int]) -> Scene:
    """The scene with as many movable objects of each category as asked for, all at the room's middle.

    Args:
        scene: its objects give the categories' sizes; fixed ones stay.
        counts: how many of each category.

    Raises:
        OptionError: a category is none of the scene's movable ones, or a number is negative, or all are 0.
    """
    layout = scene.layout
    sizes = {layout.category[i]: layout.size[i] for i in np.flatnonzero(layout.movable)[::-1]}
    for category, count in counts.items():
        if category not in sizes:
            raise OptionError("objects", f"must be of the categories {', '.join(sorted(sizes))}", category)
        if count < 0:
            raise OptionError("objects", "must not be negative", f"{category}={count}")
    if not sum(counts.values()):
        raise OptionError("objects", "must be at least one", dict(counts))
    kept = layout.subset(layout.fixed)
    names = [(f"{category}-{k + 1}", category) for category, n in counts.items() for k in range(n)]
    total = len(kept) + len(names)
    middle = np.divide(scene.size, 2)
    return replace(
        scene,
        layout=Layout(
            labels=(*(name for name, _ in names), *kept.labels),
            category=(*(category for _, category in names), *kept.category),
            position=np.vstack([np.tile(middle, (len(names), 1)), kept.position]),
            yaw=np.concatenate([np.zeros(len(names)), kept.yaw]),
            size=np.vstack([*(sizes[category] for _, category in names), *kept.size]),
            fixed=np.arange(total) >= len(names),
        ),
    )


def design(
    scene: Scene,
    rng: np.random.Generator,
    yaw_limit_deg: float = 30.0,
    steps: int = 30_000,
    restarts: int = 4,
) -> Design:
    """Place a scene's movable objects so that T1's radius is as large as a search finds it.

    An evolution strategy from several random placements; objects stay in the room, clear of each other, with
    their headings within a limit of 0.

    Args:
        scene: what is to be placed, and what is fixed.
        rng: where the randomness comes from.
        yaw_limit_deg: how far objects may be turned either way, degrees; 0 for not at all.
        steps: children of each start.
        restarts: how many starts.

    Raises:
        OptionError: no placement was found that is clear; the room is too full.
    """
    if not 0 <= yaw_limit_deg <= 180:
        raise OptionError("yaw_limit_deg", "must be from 0 to 180", yaw_limit_deg)
    layout, limit = scene.layout, float(np.deg2rad(yaw_limit_deg))
    movers = np.flatnonzero(layout.movable)
    best: Design | None = None
    for _ in range(restarts):
        position, yaw = layout.position.copy(), layout.yaw.copy()
        position[movers] = rng.uniform(0.1, 0.9, (len(movers), 2)) * scene.size
        yaw[movers] = rng.uniform(-limit, limit, len(movers))
        things = Things(
            layout.size / 2,
            layout.category_code,
            movers,
            np.array(scene.size, dtype=np.float64),
            scene.cost_weights.translation / scene.diagonal,
            scene.cost_weights.rotation,
            limit,
        )
        normals, picks = rng.normal(size=(steps, 3)), rng.integers(len(movers), size=steps)
        clear = _spread_out(position, yaw, things, normals, picks)
        if clear:
            found = described(replace(scene, layout=layout.with_poses(position, yaw)))
            if best is None or found.radius > best.radius:
                best = found
    if best is None:
        raise OptionError("objects", "must be few enough to stand clear in the room", len(movers))
    return best


class Things(NamedTuple):
    """What is to be placed, and under which constraints.

    Args:
        half: (N, 3) half sizes, metres.
        category: (N,) numbers.
        movers: (M,) the objects that may be moved.
        size: (2,) of the room, metres.
        way_weight: of metres, in cost.
        turn_weight: of sin(turn / 2), in cost.
        limit: headings are within this of 0, radians.
    """

    half: FloatArray
    category: IntArray
    movers: IntArray
    size: FloatArray
    way_weight: float
    turn_weight: float
    limit: float


@compiled
def _nearness(
    i: int, position: FloatArray, yaw: FloatArray, things: Things, sharpness: float
) -> tuple[float, float]:
    """How near object i is to its look-alikes, smoothly, and how far it violates the constraints, metres."""
    near, half, size = 0.0, things.half, things.size
    x, z = position[i]
    broken = outside_by(x, z, yaw[i], half[i], size[0], size[1], True)
    for j in range(len(yaw)):
        if j == i:
            continue
        dx, dz = position[j, 0] - x, position[j, 1] - z
        depth = overlap_depth(dx, dz, yaw[i], yaw[j], half[i], half[j]) + GAP_M
        broken += max(0.0, depth)
        if things.category[j] == things.category[i]:
            apart = things.way_weight * np.sqrt(dx * dx + dz * dz)
            apart += things.turn_weight * abs(np.sin((yaw[i] - yaw[j]) / 2))
            near += np.exp(-sharpness * apart)
    return near, broken


@compiled
def _spread_out(
    position: FloatArray, yaw: FloatArray, things: Things, normals: FloatArray, picks: IntArray
) -> bool:
    """Move objects apart in place; whether all constraints hold in the end.

    One object at a time takes a random step, which stands if it is then less near to those of its kind. The
    nearest ones count ever more, and steps grow ever shorter, as the search goes on.
    """
    size, limit = things.size, things.limit
    extent = np.sqrt(size[0] ** 2 + size[1] ** 2)
    for s in range(len(picks)):
        share = s / len(picks)
        i = things.movers[picks[s]]
        sharpness = 10.0 * 30.0**share
        spread = 0.2 * 0.01**share
        near, broken = _nearness(i, position, yaw, things, sharpness)
        x, z, heading = position[i, 0], position[i, 1], yaw[i]
        position[i, 0] = min(max(x + spread * extent * normals[s, 0], 0.0), size[0])
        position[i, 1] = min(max(z + spread * extent * normals[s, 1], 0.0), size[1])
        yaw[i] = min(max(heading + 3 * spread * normals[s, 2], -limit), limit)
        new_near, new_broken = _nearness(i, position, yaw, things, sharpness)
        before = np.log(near + 1e-300) / sharpness + STEEPNESS * broken
        after = np.log(new_near + 1e-300) / sharpness + STEEPNESS * new_broken
        if after > before:
            position[i, 0], position[i, 1], yaw[i] = x, z, heading
    for i in things.movers:
        near, broken = _nearness(i, position, yaw, things, 1.0)
        # Objects may stand a little nearer than the gap asks for, but never in each other.
        if broken > GAP_M / 2:
            return False
    return True
