"""Starting layouts: how far they stray from the scene's own, by name."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.placing import place_in_turn, poses_anywhere, poses_nearby
from farm_ar.geometry import footprints_overlap
from farm_ar.scenes import Layout, Scene

FARM_DIAGONAL_M = float(np.hypot(1.2, 0.8))
"""Lengths are given for the farm's table and scaled to the diagonal of other scenes."""

SPREADS = {"easy": (0.02, np.deg2rad(6.0)), "default": (0.05, np.deg2rad(15.0))}
"""SD of position, metres on the farm, and of yaw, radians."""

HARD_SEPARATION_M = 0.13
YAW_LIMIT = float(np.deg2rad(30.0))
GAP_M = 0.005
"""Room left between two footprints."""

TRIES = 50
"""Poses tried for an object before all are taken up and placed anew."""

FEW_TRIES = 6
"""Poses of these that are worked out at first: they nearly always do."""

RESTARTS = 100

ROOM_EACH = 0.6
"""How far apart random places may be asked to be, in roots of the room that there is for each object."""


def unit_of(scene: Scene) -> float:
    """How much larger a scene is than the farm's table, by diagonal."""
    return scene.diagonal / FARM_DIAGONAL_M


class StartingLayouts:
    """A scene's layout with its movable objects strewn about.

    "none" leaves them; "easy" and "default" add normal noise to their places (SD .02 and .05 m) and headings
    (SD 6 and 15 degrees); "hard" draws places anywhere, .13 m apart or as far as there is room, and headings
    within 30 degrees of 0. All stay in the room. Objects whose footprints are apart in the scene's own layout
    stay so; where no such layout is found, it is the scene's own.

    Args:
        scene: the room.
        jitter: one of those names.
    """

    def __init__(self, scene: Scene, jitter: str) -> None:
        layout, unit = scene.layout, unit_of(scene)
        self._scene, self._jitter, self._unit = scene, jitter, unit
        self._movable = np.flatnonzero(layout.movable)
        diagonal = np.hypot(layout.size[:, 0], layout.size[:, 2])
        self._edge = np.minimum(diagonal[:, None] / 2, np.divide(scene.size, 2))
        place, turned = layout.position[:, None], layout.yaw[:, None]
        overlap = footprints_overlap(
            place, turned, layout.size[:, None], layout.position, layout.yaw, layout.size
        )
        self._keeps_clear = ~overlap | (jitter == "hard")
        room = scene.area / len(layout)
        self._room, self._size = np.array(scene.size, dtype=np.float64), layout.size.copy()
        self._apart = min(HARD_SEPARATION_M * unit, ROOM_EACH * float(np.sqrt(room)))

    def draw(self, rng: np.random.Generator) -> Layout:
        """One at random."""
        layout = self._scene.layout
        if self._jitter == "none":
            return layout
        hard = self._jitter == "hard"
        for restart in range(RESTARTS):
            turns = rng.permutation(self._movable)
            shape = (len(turns), TRIES, 3)
            drawn = rng.random(shape) if hard else rng.normal(size=shape)
            apart = self._apart * 0.9 ** (restart // 10) if hard else 0.0
            for few in (FEW_TRIES, TRIES):
                tries = self._poses(turns, np.ascontiguousarray(drawn[:, :few]), hard)
                position, yaw, placed = layout.position.copy(), layout.yaw.copy(), layout.fixed.copy()
                clear, size = self._keeps_clear, self._size
                if place_in_turn(turns, tries, position, yaw, size, placed, clear, GAP_M, apart):
                    return layout.placed(position, yaw)
        return layout

    def _poses(self, turns: IntArray, drawn: FloatArray, hard: bool) -> FloatArray:
        """(K, T, 3) poses to try for each, from what was drawn."""
        if hard:
            return poses_anywhere(turns, drawn, self._edge, self._room, YAW_LIMIT)
        home, (metres, radians) = self._scene.layout, SPREADS[self._jitter]
        spread = (metres * self._unit, float(radians))
        return poses_nearby(turns, drawn, home.position, home.yaw, self._edge, self._room, spread, YAW_LIMIT)
