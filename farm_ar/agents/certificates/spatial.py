"""The lower bound for the paper's method: what every wrong answer takes.

A case is broken when a detection gets a wrong label. What follows holds for the paper's method with all
labels for candidates, in any partial view, for objects that move and turn at will, in and out of view, as
long as they stay in the room and out of each other's footprints.

Let x_i be what object i's own label then costs it. Where the answer is wrong, it differs from the right one
by cycles (objects that hold each other's labels) and paths (whose last object holds the label of one that is
not detected), of which each costs no more than the right answer: with C_i >= 1 for the sizes,
sum of C_i D(q_i, p_next(i)) <= sum of x_i. So

- T3: sum of x_i >= 1/2 sum of (x_i + D(q_i, p_next(i))) >= 1/2 sum of D(p_i, p_next(i)), D being a metric;
  more where no place between p_i and p_next(i) is in view (`detour`).
- By the same inequality a node can be left out of a longer cycle or path without making it dearer: those of
  two and three objects, and paths of one and two, hold the least.
- Labels of another size: where all C_i are C, sum of x_i >= C sum of (D(p_i, p_next(i)) - x_i), which is
  2 C / (1 + C) times as much as T3. It is used for two that change places and for paths of one object only,
  because longer ones may get from size to size by small steps.
- T5: a path of one object is solved exactly (`single_mover`); an object in view whose label it takes has to
  leave the view first, and the two have to stand clear of one another.
- Two that change places cross, and have to stand clear: with pivots s apart and T between their places,
  |a| + |b| >= |T e + s n| and |c| + |d| >= |T e - s n| for the ways to the own and the other's place, where
  n is the direction between them; of the two right sides one is sqrt(T^2 + s^2) at the least.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.agents.certificates.base import ROUNDING, Bound, Certificate
from farm_ar.agents.certificates.nearest import detour
from farm_ar.agents.certificates.regions import seen_polygons, way_out
from farm_ar.agents.certificates.single import Mover, single_mover
from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.geometry import wrap
from farm_ar.reid import Reidentifier, SpatialReid, dimension_cost


class SpatialCertificate(Certificate):
    """The theorems of this file, for the paper's method as long as all labels are candidates."""

    def covers(self, reid: Reidentifier) -> bool:
        """Whether it is the paper's method, its own `identify`, with options of which the theorems hold."""
        own = isinstance(reid, SpatialReid) and type(reid).identify is SpatialReid.identify
        return own and is_covered(reid)  # type: ignore[arg-type]

    def bound(self, case: Case, reid: Reidentifier) -> Bound:
        """See `Certificate`."""
        assert isinstance(reid, SpatialReid)
        return spatial_bound(case, reid)


class Costs(NamedTuple):
    """What the method makes of a case as it stands.

    Args:
        way: weight of |q - p| / l; 0 if it does not count.
        turn: weight of sin(turn / 2); 0 if it does not count.
        apart: (N, N) distances of the objects' places, by the diagonal.
        between: (N, N) sin(theta / 2) of the angles between their headings.
        stretch: (N, N) C_d, at least 1.
        allowed: (N, N) whether i may be given the label of j, another object.
    """

    way: float
    turn: float
    apart: FloatArray
    between: FloatArray
    stretch: FloatArray
    allowed: BoolArray

    @property
    def rate(self) -> float:
        """Cost of a unit of distance, at the most."""
        return max(self.way, self.turn)

    @property
    def longer(self) -> FloatArray:
        """(N, N) how much more a label of another size takes than T3 says."""
        return 2 * self.stretch / (1 + self.stretch)


def is_covered(reid: SpatialReid) -> bool:
    """Whether all labels are candidates, the own label costs D, and others no less."""
    options = reid.options
    all_candidates = options.threshold >= 1 or len(reid.scene.sites) < 2
    own_size = options.box == "local" or "dimension" not in options.terms
    return all_candidates and own_size and max(reid.costs.translation_weight, reid.costs.rotation_weight) > 0


def spatial_bound(case: Case, reid: SpatialReid) -> Bound:
    """The bound of a case under the paper's method.

    Args:
        case: the case.
        reid: made for its scene; one that `is_covered`.
    """
    costs = _costs(case, reid)
    t1 = np.where(costs.allowed, (costs.way * costs.apart + costs.turn * costs.between) / 2, np.inf)
    t1 /= costs.rate
    seen = seen_polygons(case)
    arc = _arcs(case, costs, seen, t1)
    alone, ending = _last_arcs(case, costs, seen, arc)
    by_object = _least_of_components(arc, alone, ending, _swaps(case, costs, arc))
    by_object[[not len(polygon) for polygon in seen]] = np.inf
    by_object *= 1 - ROUNDING
    return Bound(
        total=float(by_object.min(initial=np.inf)),
        largest=float(t1.min(initial=np.inf)),
        first=float(t1.min(initial=np.inf)),
        by_object=by_object,
        theorem="exchanges along cycles and paths, single movers",
    )


def _costs(case: Case, reid: SpatialReid) -> Costs:
    layout = case.layout
    other = ~np.eye(len(layout), dtype=bool)
    same = layout.category_code[:, None] == layout.category_code
    size = layout.size if "dimension" in reid.options.terms else np.ones_like(layout.size)
    return Costs(
        reid.costs.translation_weight,
        reid.costs.rotation_weight,
        apart=np.linalg.norm(layout.position[:, None] - layout.position, axis=-1) / case.scene.diagonal,
        between=np.abs(np.sin(wrap(layout.yaw[:, None] - layout.yaw) / 2)),
        stretch=dimension_cost(size, size),
        allowed=same & other if reid.options.gate_categories else other,
    )


def _arcs(case: Case, costs: Costs, seen: list[FloatArray], t1: FloatArray) -> FloatArray:
    """(N, N) half of x_i + D(q_i, p_j) at the least, in distance: T3 with the view."""
    layout, diagonal = case.layout, case.scene.diagonal
    arc = t1.copy()
    for i, j in np.argwhere(costs.allowed):
        if not len(seen[i]):
            arc[i, j] = np.inf
        elif not layout.fixed[i]:
            ways = detour(seen[i], layout.position[i], layout.position[j]) / diagonal
            arc[i, j] = (costs.way * ways + costs.turn * costs.between[i, j]) / 2 / costs.rate
    return arc


def _last_arcs(
    case: Case, costs: Costs, seen: list[FloatArray], arc: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(N, N) distance of a path's last arc, i to the label of j, which is not detected in the end.

    First where the arc is the whole path, then where others come before it.
    """
    layout, diagonal = case.layout, case.scene.diagonal
    leaving = _leaving(case)
    alone = np.full(arc.shape, np.inf)
    stretched = costs.longer * arc + leaving
    for i, j in np.argwhere(costs.allowed & np.isfinite(stretched)):
        if layout.fixed[i]:
            continue
        clear = case.inner_radius[i] + case.inner_radius[j] if case.keeps_clear[i, j] else 0.0
        mover = Mover(
            seen[i], layout.position[i], layout.position[j], float(costs.between[i, j]), diagonal,
            costs.way, costs.turn, float(leaving[j]), float(clear),
        )  # fmt: skip
        alone[i, j] = max(single_mover(mover), stretched[i, j])
    return alone, arc + leaving


def _leaving(case: Case) -> FloatArray:
    """(N,) distance of each object to be out of view, at the least."""
    layout, leaving = case.layout, np.zeros(len(case.layout))
    for j in np.flatnonzero(case.in_view):
        inset = float(case.inner_radius[j]) if case.stays_inside[j] else 0.0
        metres = way_out(case.camera, layout.position[j], case.scene.size, inset)
        leaving[j] = np.inf if layout.fixed[j] else metres / case.scene.diagonal
    return leaving


def _swaps(case: Case, costs: Costs, arc: FloatArray) -> FloatArray:
    """(N, N) distance after which two objects hold each other's labels, at the least.

    With R for what the headings differ by, in units of the ways, crossing takes R + sqrt(T^2 + s^2 - R^2);
    turning saves no more than it costs as long as the weight of ways is no less than that of turns.
    """
    swap = costs.longer * (arc + arc.T)
    if costs.way <= 0 or costs.turn > costs.way:
        return swap
    radius = case.inner_radius / case.scene.diagonal
    clear = np.where(case.keeps_clear, radius[:, None] + radius, 0.0)
    missing = costs.turn / costs.way * costs.between
    crossing = missing + np.sqrt(costs.apart**2 + np.maximum(clear**2 - missing**2, 0.0))
    return np.where(np.isfinite(swap), np.maximum(swap, crossing), np.inf)


def _least_of_components(
    arc: FloatArray, alone: FloatArray, ending: FloatArray, swap: FloatArray
) -> FloatArray:
    """(N,) the cheapest cycle or path that an object is part of."""
    end = ending.min(axis=1)
    two_steps = np.min(arc[:, :, None] + arc[None, :, :], axis=1, where=_others(len(arc)), initial=np.inf)
    components = (
        alone.min(axis=1),
        (arc + end).min(axis=1),
        arc.min(axis=0) + end,
        swap.min(axis=1),
        (two_steps.T + arc).min(axis=1),
    )
    best: FloatArray = np.min(components, axis=0)
    return best


def _others(n: int) -> BoolArray:
    """(n, n, n) whether i, k, j are three different objects."""
    own = np.eye(n, dtype=bool)
    return ~(own[:, :, None] | own[None, :, :] | own[:, None, :])
