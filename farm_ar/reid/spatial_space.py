"""The paper's method for objects that are lifted and tilted: distances and turns in space."""

from __future__ import annotations

import time
from functools import partial

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import SceneError
from farm_ar.geometry import rotation_matrix
from farm_ar.reid.answers import Identification
from farm_ar.reid.assignment import UNASSIGNED, solve_assignment
from farm_ar.reid.base import Reidentifier
from farm_ar.reid.categories import codes_in, declared_codes, require_places
from farm_ar.reid.costs import dimension_cost, orientation_cost, total_cost, translation_cost
from farm_ar.reid.spatial_costs import assurance_of
from farm_ar.scenes import UNKNOWN, Detections, Scene, Snapshot


class SpatialSpaceReid(Reidentifier):
    """The paper's costs without its assumption that objects stay upright and on their level (section 5.1).

    The translation cost (Eq. 4) has the difference of the heights beside those of x and z, still by the
    diagonal of the room; the rotation cost (Eq. 5) has the angle between the two orientations, about whatever
    axis, in place of the difference of the headings. Of upright objects on one level both are the paper's.
    Categories are kept apart, and all sites are considered.

    Args:
        scene: the reference layout, with heights (`elevation`) and `tilt`.

    Raises:
        SceneError: the scene has no labels.
    """

    def __init__(self, scene: Scene) -> None:
        if not len(scene.layout):
            raise SceneError("objects", "must be at least one", len(scene.layout))
        self.scene = scene
        self._declared = declared_codes(scene.layout)
        self._rotation = rotation_matrix(scene.layout.yaw, scene.layout.tilt)

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection.

        Raises:
            SnapshotError: a detection's category is not one of the scene's, or a position is not known.
        """
        cost, names = self.problem(snapshot)
        begin = time.perf_counter()
        column = solve_assignment(cost)
        solve_time = time.perf_counter() - begin
        given = np.where(column == UNASSIGNED, np.nan, cost[np.arange(len(cost)), column])
        labels = tuple([None if j == UNASSIGNED else names[j] for j in column.tolist()])

        return Identification(
            labels,
            given,
            self.scene.layout.labels,
            solve_time=solve_time,
            assurance=partial(assurance_of, cost, column, names),
        )

    def problem(self, snapshot: Snapshot) -> tuple[FloatArray, tuple[str | None, ...]]:
        """(N, M) costs of all labels, infinite where categories differ, and their names.

        Raises:
            SnapshotError: a detection's category is not one of the scene's, or a position is not known.
        """
        seen, layout = snapshot.detections, self.scene.layout
        require_places(seen)
        category = np.array(codes_in(seen, self._declared), dtype=np.int64)[:, None]
        cost = self.cost_matrix(seen)
        cost[(category != UNKNOWN) & (category != layout.category_code)] = np.inf
        return cost, layout.labels

    def cost_matrix(self, seen: Detections) -> FloatArray:
        """(N, M) cost of each label for each detection, whatever their categories."""
        layout, weights, diagonal = self.scene.layout, self.scene.cost_weights, self.scene.diagonal
        lifted = (seen.elevation[:, None] - layout.elevation) / diagonal
        return total_cost(
            np.hypot(translation_cost(seen.position, layout.position, diagonal), lifted),
            orientation_cost(rotation_matrix(seen.yaw, seen.tilt), self._rotation),
            dimension_cost(seen.size, layout.size),
            weights.translation,
            weights.rotation,
        )
