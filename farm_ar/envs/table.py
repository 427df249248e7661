"""The table as an agent meets it: what stands where, what is believed, what the camera sees."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.ordering import line_up
from farm_ar.game_logic import visibility
from farm_ar.scenes import Camera, Layout, Scene


@dataclass(frozen=True, eq=False)
class TableView:
    """One moment of a visit.

    Args:
        scene: the room.
        truth: where everything is.
        believed: where everything is believed to be.
        camera: the one that will take the snapshot.
        order: (M,) the objects in the order in which the agent meets them, those that never move last.
        movable: (N,) those of them that move, in the same order: what an action's numbers mean.
    """

    scene: Scene
    truth: Layout
    believed: Layout
    camera: Camera
    order: IntArray
    movable: IntArray

    @property
    def size(self) -> tuple[float, float]:
        """Width and depth of the table, metres."""
        return self.scene.size

    @cached_property
    def in_view(self) -> BoolArray:
        """(M,) objects that the camera sees, in the layout's order."""
        return visibility.seen_by(self.camera, self.truth)[0]

    def number(self, index: int) -> int:
        """How actions number an object that moves."""
        return int(np.flatnonzero(self.movable == index)[0])

    def nearest_movable(self, point: FloatArray, reach: float) -> int | None:
        """The movable object in view whose pivot is nearest to a point, if it is within `reach` metres."""
        seen = self.movable[self.in_view[self.movable]]
        if not seen.size:
            return None
        distance = np.linalg.norm(self.truth.position[seen] - point, axis=1)
        nearest = int(np.argmin(distance))
        return int(seen[nearest]) if distance[nearest] <= reach else None


def meeting_order(layout: Layout, camera: Camera) -> IntArray:
    """(M,) the objects by kind, each kind from left to right as the camera sees it, fixed ones last."""
    order, angle = np.empty(len(layout), dtype=np.int64), np.empty(len(layout))
    line_up(visibility.eye_of(camera), layout.position, layout.category_code, layout.fixed, angle, order)
    return order
