"""The ways in which the paper's rule can err, one by one: cycles and paths of objects, cheapest first."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.agents.attacks.surrogate import Model, stretch_of
from farm_ar.agents.cases import Case
from farm_ar.agents.certificates.regions import distance_to, seen_polygon, way_out
from farm_ar.arrays import FloatArray
from farm_ar.geometry import wrap


class Component(NamedTuple):
    """Objects that are to be taken for one another's labels.

    Args:
        chain: the objects; each is to be given the label of the next.
        closed: whether the last is to be given the first's label; otherwise it is given that of `end`.
        end: the object whose label the last takes; -1 in a cycle.
        hidden: whether that object must not be detected, for its label to be free.
        guess: about how much effort that takes.
    """

    chain: tuple[int, ...]
    closed: bool
    end: int
    hidden: bool
    guess: float


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
    """(N,) effort for an object to leave the view; 0 out of view, infinite if it cannot move."""
    leaving = np.zeros(len(case.layout))
    for i in np.flatnonzero(case.in_view):
        metres = way_out(case.camera, case.layout.position[i], case.scene.size, 0.0)
        leaving[i] = np.inf if case.layout.fixed[i] else metres / case.scene.diagonal
    return leaving


def _into_view(case: Case) -> FloatArray:
    """(N,) about the effort for an object to come into view; 0 in view."""
    polygon = seen_polygon(case.camera, case.scene.size, 0.0)
    ways = [distance_to(polygon, place) / case.scene.diagonal for place in case.layout.position]
    return np.where(case.in_view, 0.0, ways)
