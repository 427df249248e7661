"""Lower bounds for the baselines that look at one detection at a time."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.agents.certificates.base import Bound, Certificate
from farm_ar.agents.certificates.nearest import advance_distance
from farm_ar.agents.certificates.regions import distance_to, seen_polygon, seen_polygons
from farm_ar.arrays import BoolArray
from farm_ar.reid import LastKnownReid, NearestReid, Reidentifier


class NearestCertificate(Certificate):
    """Every label can be taken by one object alone, when its place is the nearest."""

    def covers(self, reid: Reidentifier) -> bool:
        """Whether it is the nearest label's."""
        return isinstance(reid, NearestReid)

    def bound(self, case: Case, reid: Reidentifier) -> Bound:
        """See `Certificate`."""
        assert isinstance(reid, NearestReid)
        return nearest_bound(case, reid)


class LastKnownCertificate(Certificate):
    """An object has to move by the tolerance, or to where another label is nearest, and to be in view."""

    def covers(self, reid: Reidentifier) -> bool:
        """Whether it is the last known place's."""
        return isinstance(reid, LastKnownReid)

    def bound(self, case: Case, reid: Reidentifier) -> Bound:
        """See `Certificate`."""
        assert isinstance(reid, LastKnownReid)
        return last_known_bound(case, reid)


def nearest_bound(case: Case, reid: NearestReid) -> Bound:
    """Every label that may be an object's can be taken by it alone, when its place is the nearest."""
    code = case.layout.category_code
    possible = code[:, None] == code if reid.gate_categories else np.ones((len(code), len(code)), dtype=bool)
    return _cell_bound(case, possible)


def _cell_bound(case: Case, possible: BoolArray) -> Bound:
    """The bound where an object may be given a label, (N, N), once that label's place is the nearest."""
    layout, diagonal = case.layout, case.scene.diagonal
    seen, by_object = seen_polygons(case), np.full(len(layout), np.inf)
    largest = np.inf
    for i in np.flatnonzero(layout.movable):
        for j in range(len(layout)):
            if i != j and possible[i, j]:
                clear = case.inner_radius[i] + case.inner_radius[j] if case.keeps_clear[i, j] else 0.0
                way = advance_distance(seen[i], layout.position[i], layout.position[j], 0.0)
                largest = min(largest, way / diagonal)
                by_object[i] = min(by_object[i], max(way, clear) / diagonal)
    total = float(by_object.min(initial=np.inf))
    return Bound(total, float(largest), float(largest), by_object, "the nearest label's cell")


def last_known_bound(case: Case, reid: LastKnownReid) -> Bound:
    """An object has to move by the tolerance, or to where another label is nearest, and to be in view."""
    layout, diagonal = case.layout, case.scene.diagonal
    by_object = _cell_bound(case, np.ones((len(layout), len(layout)), dtype=bool)).by_object.copy()
    for i in np.flatnonzero(layout.movable):
        inset = float(case.inner_radius[i]) if case.stays_inside[i] else 0.0
        into_view = distance_to(seen_polygon(case.camera, case.scene.size, inset), layout.position[i])
        by_object[i] = min(by_object[i], max(reid.tolerance_m, into_view) / diagonal)
    total = float(by_object.min(initial=np.inf))
    return Bound(total, total, total, by_object, "the tolerance")
