"""One thing that was detected twice."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry import footprint_corners, inside_footprint
from farm_ar.reid.plausibility.kept import kept
from farm_ar.scenes import Detections, Layout

SURE, LESS_SURE, IN_DOUBT = 0.92, 0.75, 0.5
"""Share of either footprint that the other covers where two are one: as a rule; where one is detected more
surely; and where the category has more detections than labels."""

GRID = 16
"""Points to a side by which a footprint is measured."""

NEAR = 0.02
"""How near two stand that are one, by the labels' spacing, where a size or a heading is not known."""

PILE = 3.0
"""How far from where labels coincided things may coincide and be two, by the labels' spacing."""

MOST_PAIRS = 10_000
"""Pairs of neighbours beyond which nothing is said: where so many coincide, that is another fault."""


def duplicates(seen: Detections, layout: Layout, spacing: float) -> dict[int, int]:
    """From each detection of a thing that another one, detected more surely, is of to that other.

    Both are of one category, or one is not known, at one height, and their footprints nearly coincide.
    Where labels of the category coincided as nearly, two detections may be two things.

    Args:
        seen: the detections, all positions finite.
        layout: the scene's labels.
        spacing: of the labels, metres.
    """
    rank = np.empty(len(seen), dtype=np.int64)
    rank[np.lexsort((np.arange(len(seen)), -seen.confidence))] = np.arange(len(seen))
    pairs = _neighbours(seen, spacing)
    pairs = np.where((rank[pairs[:, :1]] < rank[pairs[:, 1:]]), pairs, pairs[:, ::-1])
    kinds = {name: _Kind.of(name, seen, layout, spacing) for name in {*seen.category, None}}
    result: dict[int, int] = {}
    for surer, other in pairs[np.lexsort((rank[pairs[:, 1]], rank[pairs[:, 0]]))].tolist():
        names = {seen.category[surer], seen.category[other]} - {None}
        if surer in result or other in result or len(names) == 2:
            continue
        kind = kinds[next(iter(names), None)]
        least = LESS_SURE if seen.confidence[surer] > seen.confidence[other] else SURE
        least = IN_DOUBT if kind.surplus else least
        if least <= _coincide(seen, surer, other, spacing) and not kind.piled(seen.position[surer], least):
            result[other] = surer
    return result


class _Kind(NamedTuple):
    """A category: whether more are detected than there are labels, and which of its labels coincide.

    Args:
        surplus: whether more are detected.
        place: (P, 2) of pairs of labels near one another, metres.
        share: (P,) of either footprint that the other covers.
        near: how near a pile must have been to be one still, metres.
    """

    surplus: bool
    place: FloatArray
    share: FloatArray
    near: float

    @classmethod
    def of(cls, name: str | None, seen: Detections, layout: Layout, spacing: float) -> _Kind:
        number = sum(name in (None, one) for one in seen.category)
        found = _piles(layout)
        if (name, spacing) not in found:
            known = layout.subset([j for j, one in enumerate(layout.category) if name in (None, one)])
            pairs = _neighbours(known, spacing)
            share = np.array([_coincide(known, a, b, spacing) for a, b in pairs.tolist()])
            found[name, spacing] = len(known), known.position[pairs[:, 0]], share
        labels, place, share = found[name, spacing]
        return cls(number > labels, place, share, PILE * spacing)

    def piled(self, position: FloatArray, least: float) -> bool:
        """Whether labels that coincide as nearly were near a place (2,)."""
        near = np.linalg.norm(self.place - position, axis=1) <= self.near
        return bool((near & (self.share >= least)).any())


@kept
def _piles(layout: Layout) -> dict[tuple[str | None, float], tuple[int, FloatArray, FloatArray]]:
    """By category and spacing, filled when asked for: how many labels, and which coincide, as in `_Kind`."""
    return {}


def _neighbours(things: Detections | Layout, spacing: float) -> IntArray:
    """(P, 2) pairs of things near enough to coincide; none if there are very many."""
    from scipy.spatial import KDTree

    if len(things) < 2:
        return np.zeros((0, 2), dtype=np.int64)
    half = np.maximum(things.size[:, 0], things.size[:, 2]) / 2
    reach = np.maximum(
        np.nan_to_num(half), NEAR * spacing
    )  # a footprint that covers half another's is nearer
    tree = KDTree(things.position)
    if tree.count_neighbors(tree, reach.max()) > 20 * MOST_PAIRS:
        return np.zeros((0, 2), dtype=np.int64)
    near = tree.query_pairs(reach.max(), output_type="ndarray")
    pairs: IntArray = near.astype(np.int64).reshape(-1, 2)
    between = np.linalg.norm(things.position[pairs[:, 0]] - things.position[pairs[:, 1]], axis=1)
    names = np.array([name or "" for name in things.category])
    first, second = names[pairs[:, 0]], names[pairs[:, 1]]
    pairs = pairs[
        (between <= reach[pairs].min(axis=1)) & ((first == second) | (first == "") | (second == ""))
    ]
    return pairs if len(pairs) <= MOST_PAIRS else pairs[:0]


def _coincide(things: Detections | Layout, a: int, b: int, spacing: float) -> float:
    """The share of either footprint that the other covers, the smaller of the two; 0 at different heights."""
    between = things.position[a] - things.position[b]
    above = abs(float(things.elevation[a] - things.elevation[b]))
    if np.isnan(things.size[[a, b]]).any() or np.isnan(things.yaw[[a, b]]).any():
        return float(np.hypot(np.hypot(*between), above) <= NEAR * spacing)
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
