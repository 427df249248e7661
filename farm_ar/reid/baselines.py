"""What the paper's method has to beat: simpler re-identifiers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import OptionError, SceneError
from farm_ar.reid.answers import Assurance, Identification
from farm_ar.reid.assignment.solvers import UNASSIGNED, solve_assignment
from farm_ar.reid.base import Reidentifier
from farm_ar.reid.categories import codes_in, declared_codes
from farm_ar.reid.certificates import Choices, PoseMetric, certificate
from farm_ar.reid.costs import translation_cost
from farm_ar.reid.place import USUAL_LENGTH_M, lengths_of
from farm_ar.reid.spatial import SpatialReid
from farm_ar.reid.spatial_costs import SpatialOptions
from farm_ar.scenes import UNKNOWN, Detections, Scene, Snapshot, Weights


class NearestReid(Reidentifier):
    """Each detection is the label that stood nearest, even if another detection is that label too.

    Args:
        scene: the reference layout.
        gate_categories: whether a detection can only be a label of its own category; one of unknown category
            can be any label.

    Raises:
        SceneError: the scene has no labels.
    """

    def __init__(self, scene: Scene, gate_categories: bool = True) -> None:
        if not len(scene.layout):
            raise SceneError("objects", "must be at least one", len(scene.layout))
        self.scene = scene
        self.gate_categories = gate_categories
        self._declared = declared_codes(scene.layout)

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection; a label may be given twice. Costs are those of Eq. 4.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        layout, seen = self.scene.layout, snapshot.detections
        cost = self.costs(seen)
        nearest = cost.argmin(axis=1)
        labels = tuple(layout.labels[j] for j in nearest)
        given = cost[np.arange(len(seen)), nearest]
        return Identification(
            labels, given, layout.labels, assurance=partial(self._assure, seen, cost, nearest)
        )

    def costs(self, seen: Detections) -> FloatArray:
        """(N, M) costs of Eq. 4, infinite where the categories exclude a label.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        layout = self.scene.layout
        category = np.array(codes_in(seen, self._declared), dtype=np.int64)[:, None]
        cost = translation_cost(seen.position, layout.position, self.scene.diagonal)
        if self.gate_categories:
            cost[(category != UNKNOWN) & (category != layout.category_code)] = np.inf
        return cost

    def _assure(self, seen: Detections, cost: FloatArray, nearest: IntArray) -> Assurance:
        """How much nearer each label is than the next one; what T1 proves holds for this method too."""
        layout, rows = self.scene.layout, np.arange(len(seen))
        certified = certificate(
            seen,
            layout,
            nearest.tolist() if len(set(nearest.tolist())) == len(seen) else [],
            PoseMetric(self.scene.diagonal, 1.0, 0.0),
            Choices(np.ones(cost.shape), np.isfinite(cost), np.ones(len(layout), dtype=bool)),
        )
        others = cost.copy()
        others[rows, nearest] = np.inf
        second = others.argmin(axis=1)
        margin = others[rows, second] - cost[rows, nearest]
        names = [layout.labels[j] for j in second.tolist()]
        runner_up = tuple(name if rise < np.inf else None for name, rise in zip(names, margin, strict=True))
        return Assurance(margin, runner_up, certified=certified)


class DistanceReid(SpatialReid):
    """Each detection gets a label of its own so that the distances sum to the least; nothing else counts.

    Costs are those of Eq. 4.

    Args:
        scene: the reference layout.
        rng: with it, equally good assignments are chosen among at random.
        gate_categories: whether a detection can only be a label of its own category.

    Raises:
        SceneError: the scene has no labels.
    """

    def __init__(
        self, scene: Scene, rng: np.random.Generator | None = None, gate_categories: bool = True
    ) -> None:
        options = SpatialOptions(
            terms=("translation",), weights=Weights(1.0, 0.0), gate_categories=gate_categories
        )
        super().__init__(scene, options, rng)


class SquaredDistanceReid(Reidentifier):
    """Each detection gets a label of its own so that the squares of the distances sum to the least.

    Squares shun one long way where several short ones do. Costs are the squares of those of Eq. 4.

    Args:
        scene: the reference layout.
        gate_categories: whether a detection can only be a label of its own category.

    Raises:
        SceneError: the scene has no labels.
    """

    def __init__(self, scene: Scene, gate_categories: bool = True) -> None:
        self._nearest = NearestReid(scene, gate_categories)
        self.scene = scene
        self.gate_categories = gate_categories

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection; the surplus of detections stays without.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        cost = self._nearest.costs(snapshot.detections) ** 2
        column = solve_assignment(cost)
        given, names = column != UNASSIGNED, self.scene.layout.labels
        labels = tuple(names[j] if named else None for j, named in zip(column, given, strict=True))
        paid = np.where(given, cost[np.arange(len(cost)), np.where(given, column, 0)], np.nan)
        return Identification(labels, paid, names)


class LastKnownReid(Reidentifier):
    """No re-identification: what stands where a label was last known is that label, the rest is nothing.

    Args:
        scene: the reference layout.
        tolerance_m: how far from its place a label still counts as being there, metres; None for 1 cm in a
            scene of the usual length (`place.USUAL_LENGTH_M`).

    Raises:
        SceneError: the scene has no labels.
        OptionError: the tolerance is negative.
    """

    def __init__(self, scene: Scene, tolerance_m: float | None = None) -> None:
        self._nearest = NearestReid(scene, gate_categories=False)
        if tolerance_m is None:
            tolerance_m = 0.01 * lengths_of(scene).scene / USUAL_LENGTH_M
        if not tolerance_m >= 0:
            raise OptionError("tolerance_m", "must not be negative", tolerance_m)
        self.scene = scene
        self.tolerance_m = tolerance_m

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection that stands where that label was; None for the others.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        found = self._nearest.identify(snapshot)
        near = found.cost * self._nearest.scene.diagonal <= self.tolerance_m
        labels = tuple(label if kept else None for label, kept in zip(found.labels, near, strict=True))
        return Identification(labels, np.where(near, found.cost, np.nan), found.candidates)


BASELINES: dict[str, Callable[[Scene], Reidentifier]] = {
    "nearest": NearestReid,
    "distance": DistanceReid,
    "squared-distance": SquaredDistanceReid,
    "last-known": LastKnownReid,
}
"""The simpler methods by name."""
