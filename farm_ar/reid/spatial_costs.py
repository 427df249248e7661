"""What the paper's method minimises: the costs of one scene's labels, as its options have them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from farm_ar.arrays import WEIGHT, BoolArray, FloatArray, IntArray
from farm_ar.errors import OptionError, SceneError, known_name
from farm_ar.geometry import world_box
from farm_ar.reid.answers import Assurance
from farm_ar.reid.assignment import (
    SOLVERS,
    UNASSIGNED,
    CostModel,
    Known,
    Seen,
    known_at,
    margins_and_runners_up,
)
from farm_ar.reid.assignment.nearest import Near
from farm_ar.reid.categories import declared_codes
from farm_ar.reid.costs import (
    dimension_cost_of_sides,
    rotation_cost,
    sorted_log_sides,
    total_cost,
    translation_cost,
)
from farm_ar.reid.place import USUAL_LENGTH_M, lengths_of, stacked
from farm_ar.scenes import UNKNOWN, Detections, Layout, Scene, Weights

Box = Literal["local", "world"]
Term = Literal["translation", "rotation", "dimension"]
TERMS: tuple[Term, ...] = ("translation", "rotation", "dimension")

_PER_METRE = 0.36 / np.sqrt(2)
"""Cost of a metre by the paper's formula in a square room, however large: w_t / l."""

_NOWHERE: FloatArray = np.zeros((1, 2))
"""The camera, where it does not count."""

_NO_DIMENSION_COST: FloatArray = np.ones((1, 1))
_UNKNOWN_SIDES = (np.nan, np.nan, np.nan)


@dataclass(frozen=True)
class SpatialOptions:
    """How the paper's method is applied.

    Args:
        threshold: of the sites' cumulative probability, 0 (the camera's own site) to 1 (all, the default).
        weights: of translation and rotation; "scene" for the scene's own, which is the paper's formula where
            it has none; "paper" for the formula, 0.36 sqrt(area) and 1, in any case; "scale-free" for the
            formula's weight of a metre in a scene of the usual length, which shrinks and grows with it.
        terms: the cost terms that count.
        gate_categories: whether a detection can only be a label of its own category, as the paper's game has
            it (section 4.3.1); one of unknown category can be any label. Its synthetic experiments have not.
        box: "local" compares sizes before turning, as the paper's text says; "world" compares boxes along the
            world's axes with one template per category, as its published program does.
        solver: a name in `SOLVERS`.
        certify: whether labels are added to those that the threshold keeps until the answer is proven to be
            that with all labels. At threshold 1 it begins with those nearest to the detections. It solves by
            itself, whatever the solver.

    Raises:
        OptionError: a value is out of its limits.
    """

    threshold: float = 1.0
    weights: Weights | Literal["scene", "paper", "scale-free"] = "scene"
    terms: tuple[Term, ...] = TERMS
    gate_categories: bool = True
    box: Box = "local"
    solver: str = "lsap"
    certify: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.threshold <= 1:
            raise OptionError("threshold", "must be from 0 to 1", self.threshold)
        if not isinstance(self.weights, Weights):
            known_name("weights", self.weights, ("scene", "paper", "scale-free"))
        for term in self.terms:
            known_name("terms", term, TERMS)
        known_name("box", self.box, ("local", "world"))
        known_name("solver", self.solver, SOLVERS)


class SpatialCosts:
    """The costs of a scene's labels (Eq. 4 to 7).

    Args:
        scene: the reference layout and its room.
        options: how the paper's method is applied.

    Raises:
        SceneError: the scene has no labels.
    """

    def __init__(self, scene: Scene, options: SpatialOptions) -> None:
        if not len(scene.layout):
            raise SceneError("objects", "must be at least one", len(scene.layout))
        self.scene, self.gates = scene, options.gate_categories
        given, terms, layout = options.weights, options.terms, scene.layout
        if given == "paper":
            given = Weights.of_area(scene.area)
        elif given == "scale-free":
            by_length = scene.diagonal / lengths_of(scene).scene
            given = Weights(min(float(_PER_METRE * USUAL_LENGTH_M * by_length), WEIGHT.high), 1.0)
        self.weights = given if isinstance(given, Weights) else scene.cost_weights
        self.translation_weight = self.weights.translation if "translation" in terms else 0.0
        self.rotation_weight = self.weights.rotation if "rotation" in terms else 0.0
        self.by_world = options.box == "world"
        one_template = self.by_world and len(layout.categories) == 1
        self._compares_sizes = "dimension" in terms and not one_template
        sides = sorted_log_sides(template_boxes(scene) if self.by_world else layout.size)
        # Few labels differ in size, so the dimension cost is computed once for each size, or "kind".
        # (np.unique does this, too, and takes ten times as long for so few.)
        number: dict[tuple[float, ...], int] = {}
        known = [tuple(row) if row[0] == row[0] else _UNKNOWN_SIDES for row in sides.tolist()]
        kind = [number.setdefault(row, len(number)) for row in known]
        self._kind_sides = np.array(list(number))
        self._kind: IntArray = np.array(kind, dtype=np.int64)
        self.declared = declared_codes(layout)
        self.diagonal = scene.diagonal
        self.stacked = stacked(layout)
        self._every: Known | None = None  # made when it is first needed, like the trees by category
        self._trees: dict[int, tuple[Any, IntArray]] = {}

    def matrix(self, detections: Detections, candidates: IntArray | None = None) -> FloatArray:
        """(N, M) cost of each candidate label for each detection (Eq. 7); all labels by default."""
        layout = self.scene.layout
        position, yaw, elevation = layout.position, layout.yaw, layout.elevation
        if candidates is not None:
            position, yaw = position.take(candidates, axis=0), yaw.take(candidates)
            elevation = elevation.take(candidates)
        return total_cost(
            self._shift_cost(detections, position, elevation),
            rotation_cost(detections.yaw, yaw),
            self.dimension(detections, candidates),
            self.translation_weight,
            self.rotation_weight,
        )

    def gated(self, seen: Detections, category: list[int], candidates: IntArray | None) -> FloatArray:
        """`matrix`, infinite where categories must agree and do not."""
        cost = self.matrix(seen, candidates)
        if self.gates:
            cost[self.forbidden(category, candidates)] = np.inf
        return cost

    def forbidden(self, category: list[int], candidates: IntArray | None) -> BoolArray:
        """(N, M) whether the categories are known and differ."""
        offered = self.scene.layout.category_code
        if candidates is not None:
            offered = offered[candidates]
        detected = np.array(category, dtype=np.int64)[:, None]
        forbidden: BoolArray = (detected != UNKNOWN) & (detected != offered)
        return forbidden

    def terms(self, seen: Detections) -> dict[str, FloatArray]:
        """The terms of the cost, (N, M) each, by name; they sum to `matrix`."""
        layout = self.scene.layout
        distance = self.translation_weight * self._shift_cost(seen, layout.position, layout.elevation)
        turn = self.rotation_weight * rotation_cost(seen.yaw, layout.yaw)
        size = (self.dimension(seen) - 1) * (distance + turn)
        return {"distance": distance, "turn": turn, "size": size}

    def _shift_cost(self, seen: Detections, position: FloatArray, elevation: FloatArray) -> FloatArray:
        """(N, M) translation cost, with the heights where these count."""
        flat = translation_cost(seen.position, position, self.diagonal)
        if not self.heights_count(seen):
            return flat
        return np.hypot(flat, (seen.elevation[:, None] - elevation) / self.diagonal)

    def dimension(self, detections: Detections, candidates: IntArray | None = None) -> FloatArray:
        """(N, M) dimension cost (Eq. 6) of the candidates, all by default; (1, 1) where it does not count."""
        if not self._compares_sizes:
            return _NO_DIMENSION_COST
        sides = self.detected_sides(detections.size, detections.yaw)
        kind = self._kind if candidates is None else self._kind.take(candidates)
        return dimension_cost_of_sides(sides, self._kind_sides).take(kind, axis=1)

    def heights_count(self, seen: Detections) -> bool:
        """Whether heights are part of distances: look-alikes stand above one another, and some are known."""
        return self.stacked and bool(seen.elevation.any())

    def detected_sides(self, size: FloatArray, yaw: FloatArray) -> FloatArray:
        """(..., 3) sorted logarithms of the sides of the boxes to compare."""
        return sorted_log_sides(world_box(size, yaw) if self.by_world else size)

    def seen_one(self, seen: Detections, category: list[int]) -> Seen:
        """One snapshot's detections for `assess`, in arrays that can be written to."""
        n = len(category)
        number, order = _first(n)
        if self._compares_sizes:
            sides = self.detected_sides(seen.size, seen.yaw).reshape(1, n, 3)
        else:
            sides = np.zeros((1, n, 3))
        return Seen(
            number=number,
            camera=_NOWHERE,
            position=np.array(seen.position, order="C").reshape(1, n, 2),
            yaw=np.array(seen.yaw).reshape(1, n),
            sides=sides,
            category=np.array([category], dtype=np.int64),
            order=order,
        )

    def known(self, candidates: IntArray | None = None) -> Known:
        """The labels for `assess`, all or some, without the sites, in arrays that can be written to."""
        if candidates is None and self._every is not None:
            return self._every
        layout, kind = self.scene.layout, self._kind
        position, yaw, category = layout.position, layout.yaw, layout.category_code
        if candidates is not None:
            position, yaw = position.take(candidates, axis=0), yaw.take(candidates)
            category, kind = category.take(candidates), kind.take(candidates)
        known = known_at(position, yaw, category)._replace(
            kind=np.array(kind), sides=np.array(self._kind_sides, order="C")
        )
        if candidates is None:
            self._every = known
        return known

    def model(self, threshold: float = 1.0) -> CostModel:
        """The weights and terms for `assess`."""
        return CostModel(
            translation_weight=self.translation_weight / self.diagonal,
            rotation_weight=float(self.rotation_weight),
            compare_sizes=self._compares_sizes,
            gate=bool(self.gates),
            threshold=threshold,
        )

    def by_distance(
        self, seen: Detections, category: list[int]
    ) -> tuple[Callable[[IntArray, int], Near], Callable[[IntArray, IntArray], FloatArray]]:
        """The labels nearest to detections, and their costs, for `solve_nearest`."""
        layout, per_metre = self.scene.layout, self.translation_weight / self.diagonal
        codes = np.array(category, dtype=np.int64)
        if not self.gates:
            codes[:] = UNKNOWN
        sides = self.detected_sides(seen.size, seen.yaw) if self._compares_sizes else None

        def nearest(rows: IntArray, count: int) -> Near:
            label, beyond = np.full((len(rows), count), UNASSIGNED), np.full(len(rows), np.inf)
            for code in np.unique(codes[rows]).tolist():
                if code not in self._trees:
                    self._trees[code] = _index_of(layout, code)
                tree, which = self._trees[code]
                some = np.flatnonzero(codes[rows] == code)
                k = min(count, len(which))
                away, found = tree.query(seen.position[rows[some]], np.arange(1, k + 1))
                label[some, :k] = which[found]
                if k < len(which):
                    beyond[some] = per_metre * away[:, -1]  # turning and sizes only add to it
            return Near(label, beyond)

        def costs(rows: IntArray, label: IntArray) -> FloatArray:
            shift = translation_cost(seen.position[rows, None], layout.position[label], self.diagonal)
            if self.heights_count(seen):
                above = seen.elevation[rows, None, None] - layout.elevation[label][:, None]
                shift = np.hypot(shift, above / self.diagonal)
            turn = rotation_cost(seen.yaw[rows, None], layout.yaw[label])
            size = _NO_DIMENSION_COST
            if sides is not None:
                size = dimension_cost_of_sides(sides[rows, None], self._kind_sides[self._kind[label]])
            cost = total_cost(shift, turn, size, self.translation_weight, self.rotation_weight)
            return np.where(label == UNASSIGNED, np.inf, cost[:, 0])

        return nearest, costs


def _index_of(layout: Layout, code: int) -> tuple[Any, IntArray]:
    """A tree of the places of a category's labels, of all for `UNKNOWN`, and the labels' indices."""
    from scipy.spatial import cKDTree

    alike = layout.category_code == code if code != UNKNOWN else np.ones(len(layout), dtype=bool)
    which = np.flatnonzero(alike)
    return cKDTree(layout.position[which]), which


@lru_cache(maxsize=64)
def _first(n: int) -> tuple[IntArray, IntArray]:
    """The number of detections of one snapshot, and their order, for `Seen`."""
    return np.array([n]), np.arange(n).reshape(1, n)


def assurance_of(cost: FloatArray, column: IntArray, names: Sequence[str | None]) -> Assurance:
    """Margins and runners-up of an answer.

    Args:
        cost: (N, K) of the labels considered.
        column: (N,) which of them each detection has; `UNASSIGNED` for none.
        names: K labels.
    """
    margin, other = margins_and_runners_up(cost, column)
    return Assurance(margin, tuple([None if j == UNASSIGNED else names[j] for j in other.tolist()]))


def template_boxes(scene: Scene) -> FloatArray:
    """(M, 3) box along the world's axes of the template of each label's category.

    A category without a template has its first object for one.
    """
    layout = scene.layout
    boxes = {t.category: world_box(np.array(t.size), np.array(t.yaw)) for t in scene.templates}
    for i, name in enumerate(layout.category):
        if name not in boxes:
            boxes[name] = world_box(layout.size[i], layout.yaw[i])
    return np.array([boxes[name] for name in layout.category])
