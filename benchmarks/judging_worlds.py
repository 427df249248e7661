"""What stands on tables in rooms that no training saw: buildings, clutter, a room, arms; as meshes.

Meshes are in the world's frame, so that the farm's own z-buffer and another renderer draw the same ones.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from judging_props import (
    FARM,
    Building,
    Lamp,
    Paint,
    Thing,
    arm_over,
    clutter_beside,
    repainted,
    room_around,
    standing,
    table_under,
)

from farm_ar.arrays import FloatArray
from farm_ar.game_logic.headset import field_of_view, random_camera
from farm_ar.geometry import footprints_overlap
from farm_ar.geometry.rectangles import overlap_depth
from farm_ar.rendering import Intrinsics, View, model
from farm_ar.scenes import Camera

TOUCHING_M = 0.004
"""Two buildings nearer than this stand wall to wall."""


@dataclass(frozen=True, eq=False)
class World:
    """One place with its camera.

    Args:
        view: the camera.
        camera: the same, as a snapshot has it.
        things: all that stands there; building k of `objects` has number k + 1.
        objects: of each building category, (x, z), heading and size.
        touching: (N,) whether each stands wall to wall with another.
        lamps: each (corner, along, along, radiance): a shining parallelogram.
        exposure: what the brightness of the picture's middle half becomes, 0 to 1.
    """

    view: View
    camera: Camera
    things: list[Thing]
    objects: list[Building]
    touching: list[bool]
    lamps: list[Lamp] = field(default_factory=list)
    exposure: float = 0.45


def draw_world(lens: Intrinsics, rng: np.random.Generator, with_hand: bool = False) -> World:
    """A place at random.

    Args:
        lens: of the camera.
        rng: where the randomness comes from.
        with_hand: whether a hand reaches over the table.
    """
    camera = random_camera(FARM, field_of_view("photo"), rng)
    height = np.array(rng.uniform(0.40, 0.50))
    camera = Camera(camera.position, camera.yaw, camera.fov, height, camera.pitch + rng.uniform(-0.06, 0.06))
    objects = _arranged(rng)
    looks: dict[str, dict[tuple[int, ...], Paint]] = {}
    things = []
    for k, (category, place, yaw, size) in enumerate(objects):
        mesh = model(category)
        if category not in looks:
            looks[category] = repainted(mesh, rng)
        things.append(standing(mesh.fitted(*size), (place[0], 0.0, place[1]), yaw, k + 1, looks[category]))
    things += clutter_beside(objects, rng) + table_under(rng)
    room, lamps = room_around(rng)
    things += room
    if with_hand:
        things += arm_over(objects, rng)
    gaps = _gaps(objects)
    touching = [bool((row < TOUCHING_M).any()) for row in gaps]
    view = View.of(camera, lens)
    return World(view, camera, things, objects, touching, lamps, float(rng.uniform(0.32, 0.52)))


def _arranged(rng: np.random.Generator) -> list[Building]:
    """The shed and the buildings: half the time the farm after a visit, half anything at all."""
    layout = FARM.layout
    shed = [i for i in range(len(layout)) if layout.fixed[i]]
    placed = [(layout.category[i], layout.position[i], float(layout.yaw[i]), layout.size[i]) for i in shed]
    near = rng.random() < 0.5
    most = np.pi if rng.random() < 0.5 else np.deg2rad(30.0)
    chosen = rng.permutation([i for i in range(len(layout)) if not layout.fixed[i]])
    chosen = chosen[: len(chosen) if near else rng.integers(5, len(chosen) + 3)]
    pairs = int(rng.integers(1, 4)) if rng.random() < 0.5 else 0
    moved = set(chosen[: rng.integers(0, 5)].tolist())
    for number, i in enumerate(chosen):
        size = layout.size[i]
        for _ in range(60):
            if number < pairs and len(placed) > 1:
                place, yaw = _beside(placed[int(rng.integers(1, len(placed)))], size, rng)
            elif near:
                spread, turn = (0.05, 15.0) if i not in moved else (0.2, 60.0)
                place = layout.position[i] + spread * rng.standard_normal(2)
                yaw = float(layout.yaw[i] + np.deg2rad(turn) * rng.standard_normal())
            else:
                place, yaw = (
                    rng.uniform([0.07, 0.07], np.array(FARM.size) - 0.07),
                    float(rng.uniform(-most, most)),
                )
            inside = ((place > 0.065) & (place < np.array(FARM.size) - 0.065)).all()
            others = [np.stack([one[k] for one in placed]) for k in (1, 2, 3)]
            if inside and not footprints_overlap(place, yaw, size, *others).any():
                placed.append((layout.category[i], place, yaw, size))
                break
    return placed


def _beside(other: Building, size: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, float]:
    """Wall to wall with another."""
    quarter = int(rng.integers(4))
    yaw = other[2] + quarter * np.pi / 2
    width, depth = (size[0], size[2]) if quarter % 2 == 0 else (size[2], size[0])
    gap = rng.uniform(0.0005, 0.003)
    reach = np.array([(other[3][0] + width) / 2 + gap, (other[3][2] + depth) / 2 + gap])
    axis, side = int(rng.integers(2)), rng.choice([-1.0, 1.0])
    local = rng.uniform(-0.03, 0.03, 2)
    local[axis] = side * reach[axis]
    right = np.array([np.cos(other[2]), -np.sin(other[2])])
    ahead = np.array([np.sin(other[2]), np.cos(other[2])])
    return other[1] + local[0] * right + local[1] * ahead, float(yaw)


def _gaps(objects: list[Building]) -> FloatArray:
    """(N, N) metres between footprints along a separating axis; infinite from one to itself."""
    found = np.full((len(objects), len(objects)), np.inf)
    for i, (_, a, yaw, size) in enumerate(objects):
        for j, (_, b, other, extent) in enumerate(objects):
            if i != j:
                found[i, j] = -overlap_depth(*(b - a), yaw, other, size / 2, extent / 2)
    return found
