"""Rooms with chairs as instances for the renderer."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.envs.delivery import Room
from farm_ar.rendering import Instance, Light
from farm_ar.rendering.interior import CHAIR_SIZE, chair, shell, table
from farm_ar.scenes import Layout

LAMP = Light(toward=np.array([0.25, 1.0, -0.3]), sun=0.4, sky=0.6, ground=0.55)


def fixed_instances(room: Room) -> list[Instance]:
    """Floor, walls and tables."""
    width, depth = room.scene.size
    tables = room.tables
    return [
        Instance(shell(width, depth), np.zeros(3), number=0, casts_shadow=False),
        *(
            Instance(table(*size), raised(place), number=1)
            for size, place in zip(tables.size.tolist(), tables.position, strict=True)
        ),
    ]


def chair_instances(chairs: Layout) -> list[Instance]:
    """The chairs; number 10 and up."""
    meshes = [
        chair().fitted(*size) if tuple(size) != CHAIR_SIZE else chair() for size in chairs.size.tolist()
    ]
    poses = zip(meshes, chairs.position, chairs.yaw.tolist(), strict=True)
    return [Instance(mesh, raised(place), yaw, 10 + i) for i, (mesh, place, yaw) in enumerate(poses)]


def raised(place: FloatArray, height: float = 0.0) -> FloatArray:
    """(3,) a place (x, z) of the plane at a height."""
    return np.array([place[0], height, place[1]])
