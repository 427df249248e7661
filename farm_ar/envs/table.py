"""The table as an agent observes it: true and believed poses, what is in view, and the object ordering."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.game_logic import visibility
from farm_ar.geometry.camera import Eye, bearing_to
from farm_ar.kernels import compiled
from farm_ar.scenes import Camera, Layout, Scene


@dataclass(frozen=True, eq=False)
class TableView:
    """The state of the table during a visit.

    Args:
        scene: the room.
        truth: where everything is.
        believed: where everything is believed to be.
        camera: the one that will take the snapshot.
        order: (M,) the objects in the agent's order, those that never move last.
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


class Objects(NamedTuple):
    """M objects in the agent's order, which stays the same for an episode.

    Args:
        number: (M,) how the layout numbers them.
        kind: (M,) their kinds.
        fixed: (M,) whether they never move.
        rivals: (M, W) those of their kind in the same order, as the layout numbers them; -1 for none.
    """

    number: IntArray
    kind: IntArray
    fixed: BoolArray
    rivals: IntArray

    @classmethod
    def unmet(cls, layout: Layout) -> Objects:
        """Room for the objects of a layout."""
        m, widest = len(layout), int(np.bincount(layout.category_code).max())
        number, kind = np.zeros(m, dtype=np.int64), np.zeros(m, dtype=np.int64)
        return cls(number, kind, np.zeros(m, dtype=np.bool_), np.zeros((m, widest), dtype=np.int64))


@compiled
def line_up(
    eye: Eye, place: FloatArray, kind: IntArray, fixed: BoolArray, angle: FloatArray, order: IntArray
) -> None:
    """Sort objects: those that move first, then by kind, then from left to right as a camera sees them.

    Args:
        eye: the camera, as `visibility.eye_of` has it.
        place: (M, 2) metres.
        kind: (M,) their kinds.
        fixed: (M,) whether they never move.
        angle: (M,) filled with how far to the right of where it looks each is, radians.
        order: (M,) filled with their numbers.
    """
    for i in range(len(place)):
        angle[i] = bearing_to(eye, place[i, 0], place[i, 1])
        k = i
        while k > 0:
            j = order[k - 1]
            if fixed[j] != fixed[i]:
                before = bool(fixed[i] < fixed[j])
            elif kind[j] != kind[i]:
                before = bool(kind[i] < kind[j])
            else:
                before = bool(angle[i] < angle[j])
            if not before:
                break
            order[k] = j
            k -= 1
        order[k] = i


@compiled
def introduce(order: IntArray, kind: IntArray, fixed: BoolArray, objects: Objects) -> None:
    """Fill in the objects in the agent's order.

    Args:
        order: (M,) their numbers in that order.
        kind: (M,) by number.
        fixed: (M,) by number.
        objects: filled.
    """
    objects.rivals[:] = -1
    for k in range(len(order)):
        i = order[k]
        objects.number[k], objects.kind[k], objects.fixed[k] = i, kind[i], fixed[i]
        column = 0
        for j in order:
            if kind[j] == kind[i]:
                objects.rivals[k, column] = j
                column += 1
