"""A lower bound on the effort of every attack on one case, as far as a theorem covers the re-identifier.

A case is broken when a detection gets a wrong label. What follows holds for the paper's rule with all labels
for candidates, in any partial view, for objects that move and turn at will, in and out of view, as long as
they stay in the room and out of each other's footprints.

Let x_i be what object i's own label then costs it. Where the answer is wrong, it differs from the right one
by cycles (objects that hold each other's labels) and paths (whose last object holds the label of one that is
not detected), of which each costs no more than the right answer: sum of D(q_i, p_next(i)) <= sum of x_i. So

- T3: sum of x_i >= 1/2 sum of (x_i + D(q_i, p_next(i))) >= 1/2 sum of D(p_i, p_next(i)), D being a metric;
  more where no place between p_i and p_next(i) is in view (`detour`).
- By the same inequality a node can be left out of a longer cycle or path without making it dearer: those of
  two and three objects, and paths of one and two, hold the least.
- T5: a path of one object is solved exactly (`single_mover`); an object in view whose label it takes has to
  leave the view first, and the two have to stand clear of one another.
- Two that change places cross, and have to stand clear: with pivots s apart and T between their places,
  |a| + |b| >= |T e + s n| and |c| + |d| >= |T e - s n| for the ways to the own and the other's place, where
  n is the direction between them; of the two right sides one is sqrt(T^2 + s^2) at the least.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.agents.certificates.nearest import advance_distance, detour
from farm_ar.agents.certificates.regions import distance_to, seen_polygon, way_out
from farm_ar.agents.certificates.single import single_mover
from farm_ar.arrays import BoolArray, FloatArray, Record, read_only
from farm_ar.geometry import wrap
from farm_ar.reid import (
    LastKnownReid,
    NearestReid,
    Reidentifier,
    SpatialReid,
    dimension_cost,
)


@dataclass(frozen=True, eq=False)
class Bound(Record):
    """What no attack on a case can do with less.

    Args:
        total: effort summed over the objects, at the least; infinite where no attack is possible.
        largest: effort of the object that moves most, at the least.
        first: the bound on `total` that T1 alone gives.
        by_object: (N,) total effort after which an object in view has a wrong label, at the least.
        theorem: what proves it; "none" where nothing does, and all numbers are 0.
    """

    total: float
    largest: float
    first: float
    by_object: FloatArray
    theorem: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_object", read_only(self.by_object, np.float64))


ROUNDING = 1e-6
"""Share by which bounds are lowered, so that rounding cannot lift them over what is true."""

NO_BOUND = "none"
"""The theorem where there is none."""


def lower_bound(case: Case, reid: Reidentifier) -> Bound:
    """The bound of a case under a re-identifier that knows the case's layout.

    Args:
        case: the case.
        reid: made for `case.scene`.
    """
    if type(reid).identify is SpatialReid.identify and isinstance(reid, SpatialReid) and _covered(reid):
        return _spatial(case, reid)
    if isinstance(reid, NearestReid):
        return _nearest(case)
    if isinstance(reid, LastKnownReid):
        return _last_known(case, reid)
    return Bound(0.0, 0.0, 0.0, np.zeros(len(case.layout)), NO_BOUND)


def _covered(reid: SpatialReid) -> bool:
    """Whether all labels are candidates, the own label costs D, and others no less."""
    options = reid.options
    all_candidates = options.threshold >= 1 or len(reid.scene.sites) < 2
    own_size = options.box == "local" or "dimension" not in options.terms
    return all_candidates and own_size and max(_weights_in_use(reid)) > 0


def _weights_in_use(reid: SpatialReid) -> tuple[float, float]:
    """Of translation and rotation, 0 for a term that does not count."""
    terms, weights = reid.options.terms, reid.weights
    return (
        weights.translation if "translation" in terms else 0.0,
        weights.rotation if "rotation" in terms else 0.0,
    )


def _spatial(case: Case, reid: SpatialReid) -> Bound:
    layout, diagonal = case.layout, case.scene.diagonal
    way, turn = _weights_in_use(reid)
    n = len(layout)
    same = layout.category_code[:, None] == layout.category_code
    allowed = (same if reid.options.gate_categories else np.ones((n, n), dtype=bool)) & ~np.eye(n, dtype=bool)
    apart = np.linalg.norm(layout.position[:, None] - layout.position, axis=-1) / diagonal
    between = np.abs(np.sin(wrap(layout.yaw[:, None] - layout.yaw) / 2))
    rate = max(way, turn)
    near = np.where(allowed, (way * apart + turn * between) / 2 / rate, np.inf)
    seen = _seen_polygons(case)
    arc = _arcs(case, seen, near, allowed, way, turn, between)
    last = _last_arcs(case, reid, seen, arc, allowed, way, turn, between)
    swap = _swaps(case, arc, apart, between, way, turn)
    by_object = _least_of_components(arc, last, swap)
    by_object[[not len(polygon) for polygon in seen]] = np.inf
    by_object *= 1 - ROUNDING
    return Bound(
        total=float(by_object.min(initial=np.inf)),
        largest=float(near.min(initial=np.inf)),
        first=float(near.min(initial=np.inf)),
        by_object=by_object,
        theorem="T3 over cycles and paths, T5",
    )


def _seen_polygons(case: Case) -> list[FloatArray]:
    """Where each object's pivot can be when it is detected; a fixed one is where it is."""
    layout, polygons = case.layout, []
    for i in range(len(layout)):
        inset = float(case.inner_radius[i]) if case.stays_inside[i] else 0.0
        polygon = seen_polygon(case.camera, case.scene.size, inset)
        if layout.fixed[i]:
            polygon = np.empty((0, 2)) if not case.in_view[i] else np.tile(layout.position[i], (3, 1))
        polygons.append(np.ascontiguousarray(polygon))
    return polygons


def _arcs(
    case: Case,
    seen: list[FloatArray],
    near: FloatArray,
    allowed: BoolArray,
    way: float,
    turn: float,
    between: FloatArray,
) -> FloatArray:
    """(N, N) half of x_i + D(q_i, p_j) at the least, in effort: T3 with the view."""
    layout, diagonal = case.layout, case.scene.diagonal
    arc = near.copy()
    for i, j in np.argwhere(allowed):
        if not len(seen[i]):
            arc[i, j] = np.inf
        elif not layout.fixed[i]:
            ways = detour(seen[i], layout.position[i], layout.position[j]) / diagonal
            arc[i, j] = (way * ways + turn * between[i, j]) / 2 / max(way, turn)
    return arc


def _last_arcs(
    case: Case,
    reid: SpatialReid,
    seen: list[FloatArray],
    arc: FloatArray,
    allowed: BoolArray,
    way: float,
    turn: float,
    between: FloatArray,
) -> FloatArray:
    """(2, N, N) effort of a path's last arc, i to the label of j, which is not detected in the end.

    First where the arc is the whole path, then where others come before it.
    """
    layout, diagonal = case.layout, case.scene.diagonal
    leaving = _leaving(case)
    stretch = np.ones(arc.shape)
    if "dimension" in reid.options.terms and not reid.options.gate_categories:
        stretch = dimension_cost(layout.size, layout.size)
    alone = np.full(arc.shape, np.inf)
    for i, j in np.argwhere(allowed & np.isfinite(arc) & np.isfinite(leaving)):
        if layout.fixed[i]:
            continue
        clear = case.inner_radius[i] + case.inner_radius[j] if case.keeps_clear[i, j] else 0.0
        exact = single_mover(
            seen[i], layout.position[i], layout.position[j], float(between[i, j]), diagonal,
            way, turn, float(leaving[j]), float(clear),
        )  # fmt: skip
        # A label of another size costs C_d times as much: x >= C_d (D(p_i, p_j) - x).
        stretched = arc[i, j] * 2 * stretch[i, j] / (1 + stretch[i, j]) + leaving[j]
        alone[i, j] = max(exact, stretched)
    return np.stack([alone, arc + leaving])


def _leaving(case: Case) -> FloatArray:
    """(N,) effort of each object to be out of view, at the least."""
    layout, leaving = case.layout, np.zeros(len(case.layout))
    for j in np.flatnonzero(case.in_view):
        inset = float(case.inner_radius[j]) if case.stays_inside[j] else 0.0
        metres = way_out(case.camera, layout.position[j], case.scene.size, inset)
        leaving[j] = np.inf if layout.fixed[j] else metres / case.scene.diagonal
    return leaving


def _swaps(
    case: Case, arc: FloatArray, apart: FloatArray, between: FloatArray, way: float, turn: float
) -> FloatArray:
    """(N, N) effort after which two objects hold each other's labels, at the least.

    With R for what the headings differ by, in units of the ways, crossing takes R + sqrt(T^2 + s^2 - R^2);
    turning saves no more than it costs as long as the ways weigh no less than the turns.
    """
    swap = arc + arc.T
    if way <= 0 or turn > way:
        return swap
    radius = case.inner_radius / case.scene.diagonal
    clear = np.where(case.keeps_clear, radius[:, None] + radius, 0.0)
    missing = turn / way * between
    crossing = missing + np.sqrt(apart**2 + np.maximum(clear**2 - missing**2, 0.0))
    return np.where(np.isfinite(swap), np.maximum(swap, crossing), np.inf)


def _least_of_components(arc: FloatArray, last: FloatArray, swap: FloatArray) -> FloatArray:
    """(N,) the cheapest cycle or path that an object is part of."""
    alone, ending = last
    end = ending.min(axis=1)
    path = np.minimum(alone.min(axis=1), (arc + end).min(axis=1))
    two_steps = np.min(arc[:, :, None] + arc[None, :, :], axis=1, where=_others(len(arc)), initial=np.inf)
    three = (two_steps.T + arc).min(axis=1)
    best: FloatArray = np.minimum(np.minimum(path, swap.min(axis=1)), three)
    return best


def _others(n: int) -> BoolArray:
    """(n, n, n) whether i, k, j are three different objects."""
    own = np.eye(n, dtype=bool)
    return ~(own[:, :, None] | own[None, :, :] | own[:, None, :])


def _nearest(case: Case) -> Bound:
    """Every label can be taken by one object alone, when its place is the nearest."""
    layout, diagonal = case.layout, case.scene.diagonal
    seen, by_object = _seen_polygons(case), np.full(len(layout), np.inf)
    largest = np.inf
    for i in np.flatnonzero(layout.movable):
        for j in range(len(layout)):
            if i != j:
                clear = case.inner_radius[i] + case.inner_radius[j] if case.keeps_clear[i, j] else 0.0
                way = advance_distance(seen[i], layout.position[i], layout.position[j], 0.0)
                largest = min(largest, way / diagonal)
                by_object[i] = min(by_object[i], max(way, clear) / diagonal)
    total = float(by_object.min(initial=np.inf))
    return Bound(total, float(largest), float(largest), by_object, "the nearest label's cell")


def _last_known(case: Case, reid: LastKnownReid) -> Bound:
    """An object has to move by the tolerance, and to be in view."""
    layout, diagonal = case.layout, case.scene.diagonal
    by_object = np.full(len(layout), np.inf)
    for i in np.flatnonzero(layout.movable):
        inset = float(case.inner_radius[i]) if case.stays_inside[i] else 0.0
        into_view = distance_to(seen_polygon(case.camera, case.scene.size, inset), layout.position[i])
        by_object[i] = max(reid.tolerance_m, into_view) / diagonal
    total = float(by_object.min(initial=np.inf))
    return Bound(total, total, total, by_object, "the tolerance")
