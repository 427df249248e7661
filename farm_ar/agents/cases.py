"""Cases: what stands where, and who looks, before anybody disturbs it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from farm_ar.agents.validity import Constraints
from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.envs.generator import StartingLayouts, VisitCameras
from farm_ar.game_logic.headset import field_of_view
from farm_ar.geometry import footprint_corners, footprints_overlap
from farm_ar.scenes import Camera, Layout, Scene, visible

TRIES = 200
"""How many cameras are drawn until one sees something that could be taken for something else."""


@dataclass(frozen=True, eq=False)
class Case:
    """A scene whose reference layout is known to the re-identifier, and the camera of the next snapshot.

    Args:
        scene: the room and the reference layout of N objects.
        camera: a single one.
        number: which of the cases it is.
    """

    scene: Scene
    camera: Camera
    number: int = 0

    @property
    def layout(self) -> Layout:
        """The reference layout."""
        return self.scene.layout

    @cached_property
    def in_view(self) -> BoolArray:
        """(N,) objects that the camera sees where they stand."""
        return visible(self.layout, self.camera)

    @cached_property
    def keeps_clear(self) -> BoolArray:
        """(N, N) pairs whose footprints are apart, and have to stay so."""
        layout = self.layout
        overlap = footprints_overlap(
            layout.position[:, None],
            layout.yaw[:, None],
            layout.size[:, None],
            layout.position,
            layout.yaw,
            layout.size,
        )
        return ~overlap

    @cached_property
    def stays_inside(self) -> BoolArray:
        """(N,) objects whose whole footprint is in the room, and has to stay there; of others the pivot."""
        corners = footprint_corners(self.layout.position, self.layout.yaw, self.layout.size)
        inside: BoolArray = np.all((corners >= 0) & (corners <= self.scene.size), axis=(1, 2))
        return inside

    @cached_property
    def constraints(self) -> Constraints:
        """What perturbations have to keep to."""
        layout, room = self.layout, np.array(self.scene.size, dtype=np.float64)
        home, half = (layout.position, layout.yaw), layout.size / 2
        return Constraints(*home, half, layout.fixed, self.keeps_clear, self.stays_inside, room)

    @cached_property
    def inner_radius(self) -> FloatArray:
        """(N,) of the largest circle around the pivot in the footprint, metres."""
        radius: FloatArray = self.layout.size[:, [0, 2]].min(axis=1) / 2
        return radius


def draw_case(scene: Scene, number: int, seed: int, jitter: str = "none") -> Case:
    """One case, a function of its number and the seed.

    The camera is one of a player at the table; in a scene with a camera path, one on it. One that sees
    nothing movable is drawn again.

    Args:
        scene: the room.
        number: which case.
        seed: where the randomness comes from.
        jitter: how far the reference layout strays from the scene's own, as the environments call it.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
    on_path = scene.camera_path is not None
    layout = StartingLayouts(scene, jitter).draw(rng)
    cameras = VisitCameras(scene, field_of_view("photo"), game=not on_path)
    for _ in range(TRIES):
        camera = cameras.draw(rng)
        if np.any(visible(layout, camera) & layout.movable):
            break
    return Case(replace(scene, layout=layout), camera, number)
