"""The table as an agent meets it: what stands where, what is believed, what the camera sees."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.ordering import line_up
from farm_ar.game_logic import visibility
from farm_ar.reid import dimension_cost, rotation_cost, solve_assignment, total_cost, translation_cost
from farm_ar.reid.margins import margins
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

    @cached_property
    def costs(self) -> FloatArray:
        """(M, M) cost (Eq. 7) to each object of each label, where it is believed; infinite across kinds."""
        truth, believed, weights = self.truth, self.believed, self.scene.cost_weights
        code = truth.category_code
        cost = total_cost(
            translation_cost(truth.position, believed.position, self.scene.diagonal),
            rotation_cost(truth.yaw, believed.yaw),
            dimension_cost(truth.size, believed.size),
            weights.translation,
            weights.rotation,
        )
        return np.where(code[:, None] == code, cost, np.inf)

    @cached_property
    def margins(self) -> FloatArray:
        """(M,) rise of the total cost if an object in view had to have another label; NaN out of view."""
        result = np.full(len(self.truth), np.nan)
        seen = np.flatnonzero(self.in_view)
        if seen.size:
            cost = self.costs[seen]
            result[seen] = margins(cost, solve_assignment(cost))
        return result

    @cached_property
    def ambiguity(self) -> float:
        """Half the sum over movable objects in view of 1 - margin / 0.3, each from 0 (clear) to 1 (a tie)."""
        seen = self.margins[self.movable]
        closeness = 1 - np.clip(seen[np.isfinite(seen)] / 0.3, 0.0, 1.0)
        return float(closeness.sum() / 2)

    @cached_property
    def clutter(self) -> float:
        """Half the sum over movable objects of 1 - margin / 0.3, were they in view and known to stand so.

        The lower it is, the farther anything has to be moved before the rule takes it for another.
        """
        position, yaw = self.truth.position[self.movable], self.truth.yaw[self.movable]
        size, code = self.truth.size[self.movable], self.truth.category_code[self.movable]
        weights = self.scene.cost_weights
        cost = total_cost(
            translation_cost(position, position, self.scene.diagonal),
            rotation_cost(yaw, yaw),
            dimension_cost(size, size),
            weights.translation,
            weights.rotation,
        )
        rises = margins(np.where(code[:, None] == code, cost, np.inf), np.arange(len(code)))
        return float((1 - np.clip(rises / 0.3, 0.0, 1.0)).sum() / 2)

    @cached_property
    def least_margin(self) -> float:
        """The smallest finite margin of a movable object in view; 1 where none has another choice."""
        seen = self.margins[self.movable]
        seen = seen[np.isfinite(seen)]
        return float(seen.min()) if seen.size else 1.0

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
