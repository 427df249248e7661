"""The attack that knows the paper's cost: each error in turn, at its cheapest."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.attacks.base import Attack, QueryOracle
from farm_ar.agents.attacks.boundary_refinement import refine
from farm_ar.agents.attacks.cost_model import Model, model_of, stretch_of
from farm_ar.agents.attacks.minimal_perturbation import Component, Perturbation, perturb, room_of
from farm_ar.agents.cases import Case
from farm_ar.agents.certificates.regions import distance_to, seen_polygon, way_out
from farm_ar.arrays import FloatArray
from farm_ar.geometry import wrap

COMPONENTS = 60
"""Errors that are looked at."""

STEPS = 2500
"""Children in the search of each."""

MARGINS = (1.0, 1.03, 1.1, 1.3, 1.6)
"""How far a constructed displacement is extrapolated, for methods that need more than the paper's."""


class Analytic(Attack):
    """Construct the cheapest displacements of pairs, cycles and paths; ask; refine the cheapest failure.

    Construction needs no queries, being arithmetic on the paper's cost (T2, T3, T5); what it promises is
    asked of the re-identifier at hand, which may be another.
    """

    def __call__(self, oracle: QueryOracle, rng: np.random.Generator) -> None:
        """See `Attack`."""
        perturbations = cheapest_perturbations(oracle, rng)
        for one in perturbations:
            if oracle.left <= 0 or (oracle.cheapest is not None and one.distance >= oracle.least):
                break
            home, home_yaw = oracle.case.layout.position, oracle.case.layout.yaw
            scale = np.array(MARGINS)
            position = home + scale[:, None, None] * (one.position - home)
            oracle.query(position, home_yaw + scale[:, None] * (one.yaw - home_yaw))
        refine(oracle, rng)


def cheapest_perturbations(oracle: QueryOracle, rng: np.random.Generator) -> list[Perturbation]:
    """The displacements constructed for the cheapest errors, cheapest first, without hopelessly dear ones."""
    case = oracle.case
    model = model_of(oracle)
    room = room_of(case, model)
    found: list[Perturbation] = []
    least = oracle.budget
    for component in cheapest_components(case, model, COMPONENTS):
        if component.guess > 1.02 * least and len(found) > 3:
            break
        one = perturb(case, room, component, rng, STEPS)
        if one.distance <= oracle.budget:
            found.append(one)
            least = min(least, one.distance)
    return sorted(found, key=lambda one: one.distance)


def cheapest_components(case: Case, model: Model, number: int) -> list[Component]:
    """Paths of one and two objects, and cycles of two and three, cheapest first.

    Args:
        case: the case.
        model: what the re-identifier is taken for.
        number: how many at the most.
    """
    layout, diagonal, weights = case.layout, case.scene.diagonal, model.weights
    code = layout.category_code
    apart = np.linalg.norm(layout.position[:, None] - layout.position, axis=-1) / diagonal
    between = np.abs(np.sin(wrap(layout.yaw[:, None] - layout.yaw) / 2))
    rate = max(weights.translation, weights.rotation, 1e-12)
    half = (weights.translation * apart + weights.rotation * between) / 2 / rate
    if model.categories_apart:
        half[code[:, None] != code] = np.inf
    half *= 2 * stretch_of(case, model) / (1 + stretch_of(case, model))
    np.fill_diagonal(half, np.inf)
    into = _into_view(case)
    half = np.maximum(half, into[:, None])
    half[~layout.movable] = np.inf
    hidden = not model.labels_shared
    leaving = _out_of_view(case) if hidden else np.zeros(len(layout))
    found: list[Component] = []
    alone = half + leaving
    for i, j in _smallest(alone, number):
        found.append(Component((i,), False, j, hidden, float(alone[i, j])))
    if model.labels_shared:
        return sorted(found, key=lambda one: one.guess)
    both = half + half.T
    for i, j in _smallest(np.where(np.triu(np.ones(both.shape, dtype=bool)), both, np.inf), number):
        found.append(Component((i, j), True, -1, True, float(both[i, j])))
    near = [np.argsort(row, kind="stable")[:4].tolist() for row in half]
    for i in range(len(layout)):
        for j in near[i]:
            for k in near[j]:
                two = float(half[i, j] + half[j, k])
                if k == i or not np.isfinite(two):
                    continue
                found.append(Component((i, j), False, k, True, two + float(leaving[k])))
                if i < min(j, k):
                    found.append(Component((i, j, k), True, -1, True, two + float(half[k, i])))
    found = [one for one in found if np.isfinite(one.guess)]
    return sorted(found, key=lambda one: one.guess)[:number]


def _smallest(values: FloatArray, number: int) -> list[tuple[int, int]]:
    order = np.argsort(values, axis=None, kind="stable")[:number]
    pairs = np.stack(np.unravel_index(order, values.shape), axis=1)
    return [(int(i), int(j)) for i, j in pairs if np.isfinite(values[i, j])]


def _out_of_view(case: Case) -> FloatArray:
    """(N,) distance for an object to leave the view; 0 out of view, infinite if it cannot move."""
    leaving = np.zeros(len(case.layout))
    for i in np.flatnonzero(case.in_view):
        metres = way_out(case.camera, case.layout.position[i], case.scene.size, 0.0)
        leaving[i] = np.inf if case.layout.fixed[i] else metres / case.scene.diagonal
    return leaving


def _into_view(case: Case) -> FloatArray:
    """(N,) about the distance for an object to come into view; 0 in view."""
    polygon = seen_polygon(case.camera, case.scene.size, 0.0)
    ways = [distance_to(polygon, place) / case.scene.diagonal for place in case.layout.position]
    return np.where(case.in_view, 0.0, ways)
