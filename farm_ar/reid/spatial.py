"""The paper's method: identities from where things stand, how they are turned and how large they are."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from functools import partial

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray, read_only
from farm_ar.reid.answers import Assurance, Certificate, Identification, IdentificationBatch
from farm_ar.reid.assignment import (
    UNASSIGNED,
    Answer,
    CostModel,
    Known,
    Seen,
    assess,
    in_parts,
    labels_of_one,
    margins_and_runners_up,
    margins_of_one,
    solve_assignment,
)
from farm_ar.reid.assignment.nearest import solve_nearest
from farm_ar.reid.base import Reidentifier
from farm_ar.reid.categories import batch_codes, codes_in
from farm_ar.reid.costs import translation_cost
from farm_ar.reid.pruning import sites_by_probability
from farm_ar.reid.spatial_costs import SpatialCosts, SpatialOptions
from farm_ar.scenes import UNKNOWN, Camera, Detections, Scene, Snapshot, SnapshotBatch

HEIGHTS_COUNT = "look-alikes stand above one another: differences in height count as distances"
"""What is said of it."""


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
        self.scene = scene
        self.options = options or SpatialOptions()
        self.costs = SpatialCosts(scene, self.options)
        self._rng = rng
        self._prunes = self.options.threshold < 1 and len(scene.sites) > 1

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection.

        More detections than labels leave the surplus unidentified, whichever costs least.

        Raises:
            SnapshotError: a detection's category is not one of the scene's.
        """
        seen = snapshot.detections
        category = codes_in(seen, self.costs.declared)
        candidates, sites, widened = self._candidates(snapshot.camera.position, category)
        if self.options.certify:
            return self._certify(seen, category, candidates, sites, widened)
        names = self.scene.layout.labels
        if candidates is not None:
            names = tuple([names[j] for j in candidates.tolist()])
        if self.options.solver == "lsap" and self._rng is None and not self.costs.heights_count(seen):
            problem = self.costs.seen_one(seen, category), self.costs.known(candidates), self.costs.model()
            begin = time.perf_counter()
            column, given = labels_of_one(*problem)
            margins = partial(margins_of_one, *problem)
        else:
            cost = self.costs.gated(seen, category, candidates)
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

    def cost_matrix(self, detections: Detections) -> FloatArray:
        """(N, M) cost of each label for each detection (Eq. 7)."""
        return self.costs.matrix(detections)

    def cost_terms(self, snapshot: Snapshot) -> dict[str, FloatArray]:
        """The terms of the cost, (N, M) each, by name; they sum to `cost_matrix`."""
        return self.costs.terms(snapshot.detections)

    def compiled_problem(self) -> tuple[Known, CostModel]:
        """The labels and the weights that `assess` takes; all labels are considered."""
        return self.costs.known(), self.costs.model()

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
        if candidates is None and self.costs.translation_weight > 0 and len(seen):
            begin = time.perf_counter()
            near = solve_nearest(*self.costs.by_distance(seen, category), len(seen))
            if near is not None:
                chosen_label, cost_of_it, among = near
                names = tuple([layout.labels[j] for j in among.tolist()])
                labels = tuple([layout.labels[j] for j in chosen_label.tolist()])
                assurance = partial(self._assure_all, seen, category, chosen_label)
                took = time.perf_counter() - begin
                return Identification(labels, cost_of_it, names, sites, widened, took, assurance)
        distance = translation_cost(seen.position, layout.position, self.costs.diagonal)
        bound = self.costs.translation_weight * distance  # turning and sizes only add to it
        start = nearest_labels(distance) if candidates is None else candidates

        def cost_of(chosen: IntArray) -> FloatArray:
            return self.costs.gated(seen, category, chosen)

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
        every = self.costs.gated(seen, category, None)
        margins = partial(margins_and_runners_up, every, label)
        return self._assure(seen, category, None, margins, label, self.scene.layout.labels)

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
        category = codes_in(seen, self.costs.declared)
        candidates, _, _ = self._candidates(snapshot.camera.position, category)
        if candidates is None or self.options.certify:
            candidates = np.arange(len(self.scene.layout))
        return self.costs.gated(seen, category, candidates), tuple(
            [self.scene.layout.labels[j] for j in candidates.tolist()]
        )

    def _assure(
        self,
        seen: Detections,
        category: list[int],
        candidates: IntArray | None,
        margins: Callable[[], tuple[FloatArray, IntArray]],
        column: IntArray,
        names: tuple[str, ...],
    ) -> Assurance:
        """Margins of an answer, computed when first asked for, since few ask; its certificate likewise."""
        margin, other = margins()
        runner_up = tuple([None if j == UNASSIGNED else names[j] for j in other.tolist()])
        higher = self.costs.heights_count(seen)  # of which the proof knows nothing
        if self.costs.by_world or higher:  # the world's boxes change as an object turns
            return Assurance(margin, runner_up, warnings=(HEIGHTS_COUNT,) if higher else ())
        return Assurance(
            margin, runner_up, certified=partial(self._proof, seen, category, candidates, column)
        )

    def _proof(
        self, seen: Detections, category: list[int], candidates: IntArray | None, column: IntArray
    ) -> Certificate | None:
        """The certificate of an answer."""
        from farm_ar.reid.certificates import Choices, PoseMetric, certificate

        m = len(self.scene.layout)
        offered = np.ones(m, dtype=bool)
        given = column
        if candidates is not None:
            offered = np.isin(np.arange(m), candidates)
            given = np.where(column == UNASSIGNED, UNASSIGNED, candidates[column])
        possible = np.ones((len(seen), m), dtype=bool)
        if self.options.gate_categories:
            possible = ~self.costs.forbidden(category, None)
        return certificate(
            seen,
            self.scene.layout,
            given.tolist(),
            PoseMetric(self.costs.diagonal, self.costs.translation_weight, self.costs.rotation_weight),
            Choices(np.broadcast_to(self.costs.dimension(seen), possible.shape), possible, offered),
        )

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
        if self.costs.stacked and batch.elevation.any():
            return super().identify_many(batch, margins)
        layout, shape = self.scene.layout, batch.yaw.shape
        exists = np.arange(shape[1]) < batch.count[:, None]
        detection_order, label_order = np.arange(shape[1])[None], np.arange(len(layout))[None]
        if self._rng is not None:
            detection_order = np.argsort(np.where(exists, self._rng.random(shape), 1.0), axis=1)
            label_order = self._rng.permuted(np.tile(label_order, (len(batch), 1)), axis=1)
        codes = batch_codes(batch, exists, self.costs.declared)
        known = self.costs.known()._replace(
            site=read_only(self.scene.object_site, np.int64),
            sites=self.scene.site_positions,
        )
        model = self.costs.model(1.0 if self.options.certify else float(self.options.threshold))

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
                sides=self.costs.detected_sides(size, yaw),
                category=codes[some],
                order=detection_order[some] if len(detection_order) > 1 else detection_order,
            )
            order = label_order[some] if len(label_order) > 1 else label_order
            return assess(seen, known._replace(order=order), model, margins)

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
