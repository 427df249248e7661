"""One thing that was detected twice."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry import footprint_corners, inside_footprint
from farm_ar.scenes import Detections, Layout

SURE, LESS_SURE, IN_DOUBT = 0.9, 0.75, 0.5
"""Share of either footprint that the other covers where two are one: as a rule; where one is detected more
surely, or both are at one place to the last digit; and where the category has more detections than labels."""

GRID = 16
"""Points to a side by which a footprint is measured."""

NEAR = 0.02
"""How near two stand that are one, by the labels' spacing, where a size or a heading is not known."""

MOST_PAIRS = 5000
"""Pairs of neighbours beyond which nothing is said: where so many coincide, that is another fault."""


def duplicates(seen: Detections, layout: Layout, spacing: float) -> dict[int, int]:
    """From each detection of a thing that another one, detected more surely, is of to that other.

    Both are of one category, or one is not known, at one height, and their footprints nearly coincide.
    Where labels of the category coincide as nearly, nothing is said.

    Args:
        seen: the detections, all positions finite.
        layout: the scene's labels.
        spacing: of the labels, metres.
    """
    rank = np.empty(len(seen), dtype=np.int64)
    rank[np.lexsort((np.arange(len(seen)), -seen.confidence))] = np.arange(len(seen))
    pairs = _neighbours(seen, spacing)
    pairs = np.where((rank[pairs[:, :1]] < rank[pairs[:, 1:]]), pairs, pairs[:, ::-1])
    result: dict[int, int] = {}
    for surer, other in pairs[np.lexsort((rank[pairs[:, 1]], rank[pairs[:, 0]]))].tolist():
        names = {seen.category[surer], seen.category[other]} - {None}
        if surer in result or other in result or len(names) == 2:
            continue
        name = next(iter(names), None)
        number = sum(name in (None, one) for one in seen.category)
        known = [j for j, one in enumerate(layout.category) if name in (None, one)]
        same_place = (seen.position[surer] == seen.position[other]).all()
        doubtful = same_place or seen.confidence[surer] > seen.confidence[other]
        least = LESS_SURE if doubtful else SURE
        least = IN_DOUBT if number > len(known) else least
        if _coincide(seen, surer, other, spacing) >= least and not _any_coincide(
            layout.subset(known), spacing, least
        ):
            result[other] = surer
    return result


def _neighbours(things: Detections | Layout, spacing: float) -> IntArray:
    """(P, 2) pairs of things near enough to coincide; none if there are very many."""
    from scipy.spatial import KDTree

    if len(things) < 2:
        return np.zeros((0, 2), dtype=np.int64)
    across = np.hypot(things.size[:, 0], things.size[:, 2])
    reach = max(NEAR * spacing, float(np.nanmax(across, initial=0.0)) / 2)
    tree = KDTree(things.position)
    if (tree.count_neighbors(tree, reach) - len(things)) / 2 > MOST_PAIRS:
        return np.zeros((0, 2), dtype=np.int64)
    return tree.query_pairs(reach, output_type="ndarray").astype(np.int64).reshape(-1, 2)


def _any_coincide(things: Layout, spacing: float, least: float) -> bool:
    return any(_coincide(things, a, b, spacing) >= least for a, b in _neighbours(things, spacing).tolist())


def _coincide(things: Detections | Layout, a: int, b: int, spacing: float) -> float:
    """The share of either footprint that the other covers, the smaller of the two; 0 at different heights."""
    between = things.position[a] - things.position[b]
    if np.isnan(things.size[[a, b]]).any() or np.isnan(things.yaw[[a, b]]).any():
        return float(np.hypot(*between) <= NEAR * spacing)
    above = abs(float(things.elevation[a] - things.elevation[b]))
    if above > things.size[[a, b], 1].min() / 2:
        return 0.0
    return min(_covered(things, a, b), _covered(things, b, a))


def _covered(things: Detections | Layout, a: int, b: int) -> float:
    """The share of a's footprint that b's covers."""
    corner = footprint_corners(things.position[a], things.yaw[a], things.size[a])
    part = (np.arange(GRID) + 0.5) / GRID
    along, across = corner[1] - corner[0], corner[-1] - corner[0]
    points: FloatArray = corner[0] + part[:, None, None] * along + part[None, :, None] * across
    return float(inside_footprint(points, things.position[b], things.yaw[b], things.size[b]).mean())
