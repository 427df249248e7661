"""Starting layouts: how far they stray from the scene's own, by name."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.placing import place_in_turn
from farm_ar.geometry import footprints_overlap, wrap
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
        self._apart = min(HARD_SEPARATION_M * unit, ROOM_EACH * float(np.sqrt(room)))

    def draw(self, rng: np.random.Generator) -> Layout:
        """One at random."""
        layout = self._scene.layout
        if self._jitter == "none":
            return layout
        for restart in range(RESTARTS):
            turns = rng.permutation(self._movable)
            hard, shape = self._jitter == "hard", (len(turns), TRIES, 3)
            drawn = rng.random(shape) if hard else rng.normal(size=shape)
            size, clear = layout.size.copy(), self._keeps_clear
            apart = self._apart * 0.9 ** (restart // 10) if hard else 0.0
            for few in (FEW_TRIES, TRIES):
                tries = (self._anywhere if hard else self._strewn)(turns, drawn[:, :few])
                position, yaw, placed = layout.position.copy(), layout.yaw.copy(), layout.fixed.copy()
                if place_in_turn(turns, tries, position, yaw, size, placed, clear, GAP_M, apart):
                    return layout.placed(position, yaw)
        return layout

    def _strewn(self, turns: IntArray, drawn: FloatArray) -> FloatArray:
        """(K, T, 3) poses near the scene's own, from normal numbers.

        A heading near 0 stays within 30 degrees of it: were any allowed, turning alone would fool the rule.
        """
        layout, (metres, radians) = self._scene.layout, SPREADS[self._jitter]
        tries = drawn * [metres * self._unit, metres * self._unit, radians]
        tries[..., :2] += layout.position[turns, None]
        home = layout.yaw[turns, None]
        turned = wrap(tries[..., 2] + home)
        near = np.abs(wrap(home)) <= YAW_LIMIT
        tries[..., 2] = np.where(near, np.clip(turned, -YAW_LIMIT, YAW_LIMIT), turned)
        return self._inside(tries, turns)

    def _anywhere(self, turns: IntArray, drawn: FloatArray) -> FloatArray:
        """(K, T, 3) poses all over the room, from numbers from 0 to 1."""
        low, high = np.array([0.0, 0.0, -YAW_LIMIT]), np.array([*self._scene.size, YAW_LIMIT])
        return self._inside(low + (high - low) * drawn, turns)

    def _inside(self, tries: FloatArray, turns: IntArray) -> FloatArray:
        """The poses, moved so far into the room that the objects fit however they are turned."""
        edge = self._edge[turns, None]
        tries[..., :2] = np.clip(tries[..., :2], edge, self._scene.size - edge)
        return tries
