"""The paper's method: identities from where things stand, how they are turned and how large they are."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any, Literal

import numpy as np

from farm_ar.arrays import WEIGHT, BoolArray, FloatArray, IntArray, read_only
from farm_ar.errors import OptionError, SceneError, known_name
from farm_ar.geometry import world_box
from farm_ar.reid.answers import Assurance, Identification, IdentificationBatch
from farm_ar.reid.assignment import (
    SOLVERS,
    UNASSIGNED,
    Answer,
    Known,
    Rule,
    Seen,
    assess,
    in_parts,
    known_at,
    labels_of_one,
    margins_and_runners_up,
    solve_assignment,
)
from farm_ar.reid.assignment.nearest import Near, solve_nearest
from farm_ar.reid.base import Reidentifier
from farm_ar.reid.categories import batch_codes, codes_in, declared_codes
from farm_ar.reid.costs import (
    dimension_cost_of_sides,
    rotation_cost,
    sorted_log_sides,
    total_cost,
    translation_cost,
)
from farm_ar.reid.place import USUAL_LENGTH_M, lengths_of, stacked
from farm_ar.reid.pruning import sites_by_probability
from farm_ar.scenes import UNKNOWN, Camera, Detections, Layout, Scene, Snapshot, SnapshotBatch, Weights

Box = Literal["local", "world"]
Term = Literal["translation", "rotation", "dimension"]
TERMS: tuple[Term, ...] = ("translation", "rotation", "dimension")

HEIGHTS_COUNT = "look-alikes stand above one another: differences in height count as distances"
"""What is said of it."""

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


class SpatialReid(Reidentifier):
    """The paper's method for one scene (section 3.2).

    Args:
        scene: the reference layout and its room.
        options: how the method is applied.
        rng: with it, equally good assignments are chosen among at random.

    Raises:
        SceneError: the scene has no labels.
    """

    def __init__(
        self,
        scene: Scene,
        options: SpatialOptions | None = None,
        rng: np.random.Generator | None = None,
    ) -> None:
        if not len(scene.layout):
            raise SceneError("objects", "must be at least one", len(scene.layout))
        self.scene = scene
        self.options = options or SpatialOptions()
        self._rng = rng
        given, terms, layout = self.options.weights, self.options.terms, scene.layout
        if given == "paper":
            given = Weights.of_area(scene.area)
        elif given == "scale-free":
            by_length = scene.diagonal / lengths_of(scene).scene
            given = Weights(min(float(_PER_METRE * USUAL_LENGTH_M * by_length), WEIGHT.high), 1.0)
        self.weights = given if isinstance(given, Weights) else scene.cost_weights
        self._translation_weight = self.weights.translation if "translation" in terms else 0.0
        self._rotation_weight = self.weights.rotation if "rotation" in terms else 0.0
        self._world = self.options.box == "world"
        one_template = self._world and len(layout.categories) == 1
        self._compares_sizes = "dimension" in terms and not one_template
        self._prunes = self.options.threshold < 1 and len(scene.sites) > 1
        sides = sorted_log_sides(template_boxes(scene) if self._world else layout.size)
        # Few labels differ in size, so the dimension cost is computed once for each size, or "kind".
        # (np.unique does this, too, and takes ten times as long for so few.)
        number: dict[tuple[float, ...], int] = {}
        known = [tuple(row) if row[0] == row[0] else _UNKNOWN_SIDES for row in sides.tolist()]
        kind = [number.setdefault(row, len(number)) for row in known]
        self._kind_sides = np.array(list(number))
        self._kind: IntArray = np.array(kind, dtype=np.int64)
        self._declared = declared_codes(layout)
        self._diagonal = scene.diagonal
        self._stacked = stacked(layout)
        self._every: Known | None = None  # made when it is first needed, like the trees by category
        self._trees: dict[int, tuple[Any, IntArray]] = {}

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection.

        More detections than labels leave the surplus unidentified, whichever costs least.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        seen = snapshot.detections
        category = codes_in(seen, self._declared)
        candidates, sites, widened = self._candidates(snapshot.camera.position, category)
        if self.options.certify:
            return self._certify(seen, category, candidates, sites, widened)
        names = self.scene.layout.labels
        if candidates is not None:
            names = tuple([names[j] for j in candidates.tolist()])
        if self.options.solver == "lsap" and self._rng is None and not self._heights_count(seen):
            problem = self._seen_one(seen, category), self._known(candidates), self._rule()
            begin = time.perf_counter()
            column, given = labels_of_one(*problem)
            margins = partial(_margins_of, *problem)
        else:
            cost = self._gated_costs(seen, category, candidates)
            begin = time.perf_counter()
            column = solve_assignment(cost, self.options.solver, self._rng)
            given = np.where(column == UNASSIGNED, np.nan, cost[np.arange(len(seen)), column])
            margins = partial(margins_and_runners_up, cost, column)
        solve_time = time.perf_counter() - begin
        labels = tuple([None if j == UNASSIGNED else names[j] for j in column.tolist()])
        assurance = partial(self._assure, seen, category, candidates, margins, column, names)
        return Identification.trusted(
            labels=labels,
            cost=given,
            candidates=names,
            sites=sites,
            widened=widened,
            solve_time=solve_time,
            assurance=assurance,
            reason=(None,) * len(labels),
        )

    def _gated_costs(self, seen: Detections, category: list[int], candidates: IntArray | None) -> FloatArray:
        """`cost_matrix`, infinite where categories must agree and do not."""
        cost = self.cost_matrix(seen, candidates)
        if self.options.gate_categories:
            cost[self._forbidden(category, candidates)] = np.inf
        return cost

    def _seen_one(self, seen: Detections, category: list[int]) -> Seen:
        """One snapshot's detections for `assess`, in arrays that can be written to."""
        n = len(category)
        number, order = _first(n)
        if self._compares_sizes:
            sides = self._detected_sides(seen.size, seen.yaw).reshape(1, n, 3)
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

    def compiled_problem(self) -> tuple[Known, Rule]:
        """The labels and the weights that `assess` takes; all labels are considered."""
        return self._known(), self._rule()

    def _known(self, candidates: IntArray | None = None) -> Known:
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

    def _rule(self, threshold: float = 1.0) -> Rule:
        """The weights and terms for `assess`."""
        return Rule(
            translation_weight=self._translation_weight / self._diagonal,
            rotation_weight=float(self._rotation_weight),
            compare_sizes=self._compares_sizes,
            gate=bool(self.options.gate_categories),
            threshold=threshold,
        )

    def _certify(
        self,
        seen: Detections,
        category: list[int],
        candidates: IntArray | None,
        sites: tuple[str, ...],
        widened: bool,
    ) -> Identification:
        """The answer with all labels, from the candidates and those that have to be added to prove it."""
        from farm_ar.reid.certificates import nearest_labels, solve_certified

        layout = self.scene.layout
        if candidates is None and self._translation_weight > 0 and len(seen):
            begin = time.perf_counter()
            near = solve_nearest(*self._by_distance(seen, category), len(seen))
            if near is not None:
                chosen_label, cost_of_it, among = near
                names = tuple([layout.labels[j] for j in among.tolist()])
                labels = tuple([layout.labels[j] for j in chosen_label.tolist()])
                assurance = partial(self._assure_all, seen, category, chosen_label)
                took = time.perf_counter() - begin
                return Identification(labels, cost_of_it, names, sites, widened, took, assurance)
        distance = translation_cost(seen.position, layout.position, self._diagonal)
        bound = self._translation_weight * distance  # turning and sizes only add to it
        start = nearest_labels(distance) if candidates is None else candidates

        def cost_of(chosen: IntArray) -> FloatArray:
            return self._gated_costs(seen, category, chosen)

        begin = time.perf_counter()
        label, cost, chosen = solve_certified(cost_of, bound, start)
        solve_time = time.perf_counter() - begin
        column = np.where(label == UNASSIGNED, UNASSIGNED, np.searchsorted(chosen, label))
        given = np.full(len(seen), np.nan)
        assigned = column != UNASSIGNED
        given[assigned] = cost[assigned, column[assigned]]
        names = tuple([layout.labels[j] for j in chosen.tolist()])
        labels = tuple([None if j == UNASSIGNED else layout.labels[j] for j in label.tolist()])
        widened = widened or (candidates is not None and len(chosen) > len(candidates))

        assurance = partial(self._assure_all, seen, category, label)
        return Identification(labels, given, names, sites, widened, solve_time, assurance)

    def _assure_all(self, seen: Detections, category: list[int], label: IntArray) -> Assurance:
        """The assurance of labels that are the best of all: so its margins are over all, too."""
        every = self._gated_costs(seen, category, None)
        margins = partial(margins_and_runners_up, every, label)
        return self._assure(seen, category, None, margins, label, self.scene.layout.labels)

    def _by_distance(
        self, seen: Detections, category: list[int]
    ) -> tuple[Callable[[IntArray, int], Near], Callable[[IntArray, IntArray], FloatArray]]:
        """The labels nearest to detections, and their costs, for `solve_nearest`."""
        layout, per_metre = self.scene.layout, self._translation_weight / self._diagonal
        codes = np.array(category, dtype=np.int64)
        if not self.options.gate_categories:
            codes[:] = UNKNOWN
        sides = self._detected_sides(seen.size, seen.yaw) if self._compares_sizes else None

        def nearest(rows: IntArray, count: int) -> Near:
            label, beyond = np.full((len(rows), count), UNASSIGNED), np.full(len(rows), np.inf)
            for code in np.unique(codes[rows]).tolist():
                if code not in self._trees:
                    self._trees[code] = index_of(layout, code)
                tree, which = self._trees[code]
                some = np.flatnonzero(codes[rows] == code)
                k = min(count, len(which))
                away, found = tree.query(seen.position[rows[some]], np.arange(1, k + 1))
                label[some, :k] = which[found]
                if k < len(which):
                    beyond[some] = per_metre * away[:, -1]  # turning and sizes only add to it
            return Near(label, beyond)

        def costs(rows: IntArray, label: IntArray) -> FloatArray:
            shift = translation_cost(seen.position[rows, None], layout.position[label], self._diagonal)
            if self._heights_count(seen):
                above = seen.elevation[rows, None, None] - layout.elevation[label][:, None]
                shift = np.hypot(shift, above / self._diagonal)
            turn = rotation_cost(seen.yaw[rows, None], layout.yaw[label])
            size = _NO_DIMENSION_COST
            if sides is not None:
                size = dimension_cost_of_sides(sides[rows, None], self._kind_sides[self._kind[label]])
            cost = total_cost(shift, turn, size, self._translation_weight, self._rotation_weight)
            return np.where(label == UNASSIGNED, np.inf, cost[:, 0])

        return nearest, costs

    def identify_objects(self, objects: Detections, cameras: Sequence[Camera]) -> Identification:
        """The label of each object, from all sites: objects seen from another camera must keep theirs."""
        reid = copy(self)  # not made anew: a subclass may be made of other arguments
        reid.options, reid._prunes = replace(self.options, threshold=1.0), False
        return reid.identify(Snapshot(cameras[-1], objects))

    def problem(self, snapshot: Snapshot) -> tuple[FloatArray, tuple[str | None, ...]]:
        """(N, K) costs of the labels considered, infinite where categories must agree but do not; names.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        seen = snapshot.detections
        category = codes_in(seen, self._declared)
        candidates, _, _ = self._candidates(snapshot.camera.position, category)
        if candidates is None or self.options.certify:
            candidates = np.arange(len(self.scene.layout))
        return self._gated_costs(seen, category, candidates), tuple(
            [self.scene.layout.labels[j] for j in candidates.tolist()]
        )

    def cost_terms(self, snapshot: Snapshot) -> dict[str, FloatArray]:
        """The terms of the cost, (N, M) each, by name; they sum to `cost_matrix`."""
        seen, layout = snapshot.detections, self.scene.layout
        distance = self._translation_weight * self._shift_cost(seen, layout.position, layout.elevation)
        turn = self._rotation_weight * rotation_cost(seen.yaw, layout.yaw)
        size = (self._dimension(seen, self._kind) - 1) * (distance + turn)
        return {"distance": distance, "turn": turn, "size": size}

    def _assure(
        self,
        seen: Detections,
        category: list[int],
        candidates: IntArray | None,
        margins: Callable[[], tuple[FloatArray, IntArray]],
        column: IntArray,
        names: tuple[str, ...],
    ) -> Assurance:
        """Margins and certificate of an answer, computed when first asked for, since few ask."""
        from farm_ar.reid.certificates import Choices, PoseMetric, certificate

        margin, other = margins()
        m = len(self.scene.layout)
        offered = np.ones(m, dtype=bool)
        given = column
        if candidates is not None:
            offered = np.isin(np.arange(m), candidates)
            given = np.where(column == UNASSIGNED, UNASSIGNED, candidates[column])
        possible = np.ones((len(seen), m), dtype=bool)
        if self.options.gate_categories:
            possible = ~self._forbidden(category, None)
        certified = None
        higher = self._heights_count(seen)  # of which the proof knows nothing
        if not self._world and not higher:  # whose sizes change as an object turns
            certified = certificate(
                seen,
                self.scene.layout,
                given.tolist(),
                PoseMetric(self._diagonal, self._translation_weight, self._rotation_weight),
                Choices(
                    np.broadcast_to(self._dimension(seen, self._kind), possible.shape), possible, offered
                ),
            )
        runner_up = tuple([None if j == UNASSIGNED else names[j] for j in other.tolist()])
        return Assurance(margin, runner_up, certified=certified, warnings=(HEIGHTS_COUNT,) if higher else ())

    def _heights_count(self, seen: Detections) -> bool:
        """Whether heights are part of distances: look-alikes stand above one another, and some are known."""
        return self._stacked and bool(seen.elevation.any())

    def _shift_cost(self, seen: Detections, position: FloatArray, elevation: FloatArray) -> FloatArray:
        """(N, M) translation cost, with the heights where these count."""
        flat = translation_cost(seen.position, position, self._diagonal)
        if not self._heights_count(seen):
            return flat
        return np.hypot(flat, (seen.elevation[:, None] - elevation) / self._diagonal)

    def cost_matrix(self, detections: Detections, candidates: IntArray | None = None) -> FloatArray:
        """(N, M) cost of each candidate label for each detection (Eq. 7); all labels by default."""
        layout = self.scene.layout
        position, yaw, elevation, kind = layout.position, layout.yaw, layout.elevation, self._kind
        if candidates is not None:
            position, yaw = position.take(candidates, axis=0), yaw.take(candidates)
            elevation, kind = elevation.take(candidates), kind.take(candidates)
        return total_cost(
            self._shift_cost(detections, position, elevation),
            rotation_cost(detections.yaw, yaw),
            self._dimension(detections, kind),
            self._translation_weight,
            self._rotation_weight,
        )

    def _dimension(self, detections: Detections, kind: IntArray) -> FloatArray:
        """(N, M) dimension cost of labels of those kinds; (1, 1) where it does not count."""
        if not self._compares_sizes:
            return _NO_DIMENSION_COST
        sides = self._detected_sides(detections.size, detections.yaw)
        return dimension_cost_of_sides(sides, self._kind_sides).take(kind, axis=1)

    def identify_many(self, batch: SnapshotBatch, margins: bool = False) -> IdentificationBatch:
        """The labels of the detections of many snapshots, by one compiled kernel, on all processors.

        The answers are those of `identify`, whatever its solver; of several optimal ones it may be another.
        They do not depend on how many processors there are; NUMBA_NUM_THREADS says how many are used.

        Args:
            batch: the snapshots.
            margins: whether margins and runners-up are found too.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        if self._stacked and batch.elevation.any():
            return super().identify_many(batch, margins)
        layout, shape = self.scene.layout, batch.yaw.shape
        exists = np.arange(shape[1]) < batch.count[:, None]
        detection_order, label_order = np.arange(shape[1])[None], np.arange(len(layout))[None]
        if self._rng is not None:
            detection_order = np.argsort(np.where(exists, self._rng.random(shape), 1.0), axis=1)
            label_order = self._rng.permuted(np.tile(label_order, (len(batch), 1)), axis=1)
        codes = batch_codes(batch, exists, self._declared)
        known = self._known()._replace(
            site=read_only(self.scene.object_site, np.int64),
            sites=self.scene.site_positions,
        )
        rule = self._rule(1.0 if self.options.certify else float(self.options.threshold))

        def assessed(some: slice) -> Answer:
            there = exists[some]
            size, yaw = (
                np.where(there[..., None], batch.size[some], 1.0),
                np.where(there, batch.yaw[some], 0.0),
            )
            seen = Seen(
                number=batch.count[some],
                camera=np.broadcast_to(batch.camera.position, (len(batch), 2))[some],
                position=batch.position[some],
                yaw=batch.yaw[some],
                sides=self._detected_sides(size, yaw),
                category=codes[some],
                order=detection_order[some] if len(detection_order) > 1 else detection_order,
            )
            order = label_order[some] if len(label_order) > 1 else label_order
            return assess(seen, known._replace(order=order), rule, margins)

        label, cost, candidates, widened, margin, runner_up, _ = in_parts(
            assessed, len(batch), shape[1] * len(layout)
        )
        found = IdentificationBatch(layout.labels, label, cost, candidates, widened)
        return replace(found, margin=margin, runner_up=runner_up) if margins else found

    def _candidates(
        self, camera_position: FloatArray, category: list[int]
    ) -> tuple[IntArray | None, tuple[str, ...], bool]:
        """Candidate labels (None for all), the sites they are of, and whether sites had to be added."""
        if not self._prunes:
            return None, (), False
        sites = self.scene.sites
        order, kept_at_threshold = sites_by_probability(
            camera_position, self.scene.site_positions, self.options.threshold
        )
        site_rank = np.argsort(order)[self.scene.object_site]
        kept = wanted = int(kept_at_threshold)
        while kept < len(sites) and not self._enough(category, site_rank < kept):
            kept += 1
        names = tuple([sites[s].name for s in order[:kept].tolist()])
        (candidates,) = (site_rank < kept).nonzero()
        return candidates, names, kept > wanted

    def _enough(self, detected: list[int], offered: BoolArray) -> bool:
        """Whether each detection, by category code, can have a label of its own of those offered, (M,)."""
        if len(detected) > np.count_nonzero(offered):
            return False
        if not self.options.gate_categories:
            return True
        codes = self.scene.layout.category_code[offered].tolist()
        return all(detected.count(code) <= codes.count(code) for code in set(detected) - {UNKNOWN})

    def _forbidden(self, category: list[int], candidates: IntArray | None) -> BoolArray:
        """(N, M) whether the categories are known and differ."""
        offered = self.scene.layout.category_code
        if candidates is not None:
            offered = offered[candidates]
        detected = np.array(category, dtype=np.int64)[:, None]
        forbidden: BoolArray = (detected != UNKNOWN) & (detected != offered)
        return forbidden

    def _detected_sides(self, size: FloatArray, yaw: FloatArray) -> FloatArray:
        return sorted_log_sides(world_box(size, yaw) if self._world else size)


def index_of(layout: Layout, code: int) -> tuple[Any, IntArray]:
    """A tree of the places of a category's labels, of all for `UNKNOWN`, and the labels' indices."""
    from scipy.spatial import cKDTree

    alike = layout.category_code == code if code != UNKNOWN else np.ones(len(layout), dtype=bool)
    which = np.flatnonzero(alike)
    return cKDTree(layout.position[which]), which


@lru_cache(maxsize=64)
def _first(n: int) -> tuple[IntArray, IntArray]:
    """The number of detections of one snapshot, and their order, for `Seen`."""
    return np.array([n]), np.arange(n).reshape(1, n)


def _margins_of(seen: Seen, known: Known, rule: Rule) -> tuple[FloatArray, IntArray]:
    """The margins and runners-up of one snapshot."""
    answer = assess(seen, known, rule, margins=True)
    return answer.margin[0], answer.runner_up[0]


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
