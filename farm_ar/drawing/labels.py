"""Label placement: beside what each label names, and clear of one another."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray

_DIRECTIONS = np.deg2rad(
    [0.0, 180.0, 90.0, 270.0, 45.0, 135.0, 315.0, 225.0] + [22.5 + 45.0 * k for k in range(8)]
)
"""Ways to leave what is named, the preferred ones first."""

_STEPS = np.array([0.0, 0.4, 0.8, 1.3, 1.9, 2.6, 3.4, 4.3, 5.5, 7.0, 9.0, 12.0])
"""How far to go beyond touching, in heights of the label."""

_SHIFTS = np.array(
    sorted(
        ((x, z) for z in (0.0, 0.9, -0.9, 1.8, -1.8) for x in (0.0, 0.7, -0.7, 1.4, -1.4)), key=np.linalg.norm
    )
)[1:]
"""Where else on its object a label may stand, as parts of its size from its spot, the nearest first."""

_ROUNDS = 6
_FORBIDDEN = 1000.0
_ROUNDING = 1e-9
_COVERS_OBJECT = 6.0
_LOWER = 0.22
_LATER_DIRECTION = 0.02
_INSIDE_EFFORT = 0.05


def place_labels(
    anchor: FloatArray,
    size: FloatArray,
    half_object: FloatArray,
    spot: FloatArray,
    bounds: FloatArray,
    obstacles: FloatArray,
    level: FloatArray,
) -> FloatArray:
    """Centres for labels that do not overlap, as near as may be to what they name.

    Each label has the same few hundred places to choose from: on its object, if it may, else around it, ever
    farther out. One after the other takes the place that costs least given the others; rounds are repeated
    until none wants to move. Overlapping another label or leaving the page costs most, covering objects
    less, distance least. No chance is involved.

    Args:
        anchor: (N, 2) centres of what is named; any unit, the same throughout.
        size: (N, 2) width and height of each label.
        half_object: (N, 2) half the width and height of the box around what is named.
        spot: (N, 2) where on its object each label would stand first; NaN for labels that stay beside it.
        bounds: (4,) left, bottom, right, top of the page.
        obstacles: (O, 4) left, bottom, right, top of what labels should not cover, none without area; the
            first N are the named objects themselves, in their order.
        level: (O,) how high each obstacle lies. A label on its own object covers only what lies higher, and
            beside it covers what lies lower at less cost.

    Returns:
        (N, 2) centres of the labels.
    """
    obstacle_area = np.prod(obstacles[:, 2:] - obstacles[:, :2], axis=1)
    places, costs = [], []
    for i in range(len(anchor)):
        inside = anchor[i] + _inside(size[i], half_object[i], spot[i] - anchor[i])
        around, effort = _around(size[i], half_object[i])
        around = anchor[i] + around
        place = np.vstack([inside, around])
        boxes = _boxes(place, size[i])
        area = size[i].prod()
        covered = _shared_area(boxes, obstacles) / np.minimum(area, obstacle_area)
        covered[: len(inside), level <= level[i]] = 0.0
        covered[:, level < level[i]] *= _LOWER
        covered[:, i] = 0.0
        effort = np.concatenate([_INSIDE_EFFORT * np.arange(len(inside)), effort])
        outside = 1.0 - _shared_area(boxes, bounds[None])[:, 0] / area
        places.append(place)
        costs.append(effort + _forbidding(outside) + _COVERS_OBJECT * covered.sum(axis=1))
    choice = _settle(places, costs, size)
    return np.array([place[k] for place, k in zip(places, choice, strict=True)]).reshape(-1, 2)


def _settle(places: list[FloatArray], costs: list[FloatArray], size: FloatArray) -> IntArray:
    """Index of the place of each label, after rounds in which each takes its best given the others."""
    n = len(places)
    choice = np.full(n, -1, dtype=np.int64)
    boxes = [_boxes(place, wide) for place, wide in zip(places, size, strict=True)]
    # A label that has no place yet is an empty box far away.
    taken = np.full((n, 4), np.inf)
    for _ in range(_ROUNDS):
        before = choice.copy()
        for i in range(n):
            taken[i] = np.inf
            meets = _shared_area(boxes[i], taken).sum(axis=1) / size[i].prod()
            choice[i] = np.argmin(costs[i] + _forbidding(meets))
            taken[i] = boxes[i][choice[i]]
        if np.array_equal(choice, before):
            break
    return choice


def _forbidding(part: FloatArray) -> FloatArray:
    """What it costs that a part of a label, 0 to 1, is where no label may be."""
    return np.where(part > _ROUNDING, _FORBIDDEN * (1.0 + part), 0.0)


def _inside(size: FloatArray, half_object: FloatArray, spot: FloatArray) -> FloatArray:
    """(C, 2) offsets at which a label stands on what it names: its spot, then around it within the object."""
    if np.isnan(spot).any():
        return np.empty((0, 2))
    offset = spot + _SHIFTS * size
    fits = np.all(np.abs(offset) + size / 2 <= half_object, axis=1)
    return np.vstack([spot[None], offset[fits]])


def _around(size: FloatArray, half_object: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(C, 2) offsets at which a label stands beside what it names, and (C,) what each costs of itself."""
    way = np.stack([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)], axis=-1)
    # Along each way, the first place where the two boxes only touch.
    touching = np.min((size / 2 + half_object) / np.maximum(np.abs(way), 1e-12), axis=1)
    offset = (touching[:, None] + size[1] * _STEPS)[..., None] * way[:, None]
    effort = 1.0 + _STEPS + _LATER_DIRECTION * np.arange(len(way))[:, None]
    return offset.reshape(-1, 2), effort.reshape(-1)


def _boxes(centre: FloatArray, size: FloatArray) -> FloatArray:
    """(..., 4) left, bottom, right, top of boxes of one size around centres (..., 2)."""
    return np.concatenate([centre - size / 2, centre + size / 2], axis=-1)


def _shared_area(boxes: FloatArray, others: FloatArray) -> FloatArray:
    """(A, B) area that each of A boxes shares with each of B others."""
    left, low, right, high = boxes[:, None].transpose(2, 0, 1)
    width = np.minimum(right, others[:, 2]) - np.maximum(left, others[:, 0])
    height = np.minimum(high, others[:, 3]) - np.maximum(low, others[:, 1])
    shared: FloatArray = np.maximum(width, 0.0) * np.maximum(height, 0.0)
    return shared
