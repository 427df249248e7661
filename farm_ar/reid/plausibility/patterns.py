"""Whether a snapshot fits the map better in another frame, unit or convention than in its own.

Each way of writing a snapshot down wrongly is a hypothesis; so is that it was written down right. Under each,
a detection is of some label of its category, moved by an unknown scale of shift and of turn (averaged over),
or it is anywhere. What is compared is the marginal likelihood of the whole snapshot, as a density in its own
coordinates, so that a hypothesis pays for the space that it spreads things over: a ratio above 1 / p is met
with a probability below p where the snapshot was written down right. No length enters but the labels' spacing
and extent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry import diameter
from farm_ar.geometry.angles import FULL_TURN
from farm_ar.reid.plausibility.evidence import LEAST_SHIFT, evidence_of_all
from farm_ar.reid.plausibility.kept import kept
from farm_ar.scenes import UNKNOWN, Bounds, Scene

MOST_DETECTIONS = 16
"""Detections that are compared."""

SHIFTS = 7
"""Scales of shift, even by ratio, from `LEAST_SHIFT` of the spacing to the extent."""

CLOSE = 0.35
"""Scale of shift, by the spacing, up to which mirrored places or other headings are believed: where things
have moved as far as to others' places, as in a crowd after seconds, either fits as well by chance."""

OUTSIDE = 0.05
"""How much less dense things stand outside the bounds than within, if the bounds are right."""


class Places(NamedTuple):
    """The labels as the patterns see them: place, heading, period of symmetry and category, (M, ...).

    Args:
        widths: (S,) scales of shift, metres, rising.
    """

    position: FloatArray
    yaw: FloatArray
    period: FloatArray
    category: IntArray
    spacing: float
    extent: float
    bounds: Bounds | None
    widths: FloatArray


class Variant(NamedTuple):
    """A snapshot written down otherwise.

    Args:
        position: (N, 2) places, metres.
        yaw: (N,) headings, radians.
        log_volume: logarithm of the change of volume.
        close: whether it counts only as far as things are then close to where they were: `CLOSE`.
    """

    position: FloatArray
    yaw: FloatArray
    log_volume: float
    close: bool = False


@kept
def places_of(scene: Scene) -> Places:
    """The labels of a scene, with their spacing and extent, metres: positive in any case."""
    layout = scene.layout
    position = layout.position
    extent = diameter(position)
    spacing = spacing_of(position)
    usual = float(np.nanmedian(layout.size)) if np.isfinite(layout.size).any() else 0.0
    extent = extent or usual or scene.fov.range_m
    period = np.array([scene.symmetry.get(name, FULL_TURN) for name in layout.category])
    spacing = spacing or extent
    widths = np.geomspace(LEAST_SHIFT * spacing, max(extent, spacing), SHIFTS)
    return Places(position, layout.yaw, period, layout.category_code, spacing, extent, scene.bounds, widths)


def spacing_of(position: FloatArray) -> float:
    """The median distance to the nearest other place, of places that differ; 0 where there are no two."""
    from scipy.spatial import KDTree

    distinct = np.unique(position, axis=0)
    if len(distinct) < 2:
        return 0.0
    nearest: FloatArray = np.asarray(KDTree(distinct).query(distinct, k=2)[0])[:, 1]
    return float(np.median(nearest))


def log_evidence(
    places: Places, category: IntArray, variants: Sequence[Variant], likely: FloatArray | None = None
) -> FloatArray:
    """(H,) logarithms of the marginal likelihood of a snapshot under each of H variants.

    Args:
        places: the labels.
        category: (N,) codes of the detections.
        variants: the snapshot, written down in H ways.
        likely: (M,) how likely each label is to be detected, not negative; all alike by default.
    """
    weight = may_be(places, category) * (np.ones(len(places.yaw)) if likely is None else likely + 1e-6)
    share = weight / weight.sum(axis=1, keepdims=True)
    position, place = _distinct([one.position for one in variants])
    yaw, heading = _distinct([one.yaw for one in variants])
    close = np.array([one.close for one in variants])
    total = evidence_of_all(
        (position, yaw, np.column_stack([place, heading]), close),
        share,
        (places.position, places.yaw, places.period),
        places.widths,
        CLOSE * places.spacing,
        places.extent,
    )
    if places.bounds is not None:
        total += np.log(OUTSIDE) * (~places.bounds.contains(position)).sum(axis=1)[place]
    total += np.array([one.log_volume for one in variants])
    return total


def may_be(places: Places, category: IntArray) -> BoolArray:
    """(N, M) which label each detection of a category (N,) may be."""
    allowed: BoolArray = (category[:, None] == UNKNOWN) | (category[:, None] == places.category)
    return allowed


def _distinct(arrays: Sequence[FloatArray]) -> tuple[FloatArray, IntArray]:
    """(K, ...) the arrays that are not the same object, and (H,) which of them each is."""
    first = {id(one): one for one in arrays}
    number = {name: k for k, name in enumerate(first)}
    return np.stack(list(first.values())), np.array([number[id(one)] for one in arrays])


def log_mean(values: FloatArray) -> FloatArray:
    """(H,) logarithms of the means of what (H, K) are the logarithms of."""
    top = values.max(axis=1)
    result: FloatArray = top + np.log(np.exp(values - top[:, None]).mean(axis=1))
    return result
