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
from farm_ar.scenes import UNKNOWN, Bounds, Scene

MOST_DETECTIONS, MOST_CELLS = 16, 2_000_000
"""Detections that are compared, and numbers that are held at once."""

ANYWHERE = 0.3
"""Share of the detections that may be anywhere."""

SHIFTS = 7
"""Scales of shift, even by ratio, from `LEAST_SHIFT` of the spacing to the extent."""

LEAST_SHIFT = 0.03

CLOSE = 0.35
"""Scale of shift, by the spacing, up to which mirrored places or other headings are believed: where things
have moved as far as to others' places, as in a crowd after seconds, either fits as well by chance."""

TURNS = (0.03, 0.1, 0.35, 1.0)
"""Scales of turn, radians, beside headings that tell nothing."""

OUTSIDE = 0.05
"""How much less dense things stand outside the bounds than within, if the bounds are right."""


class Places(NamedTuple):
    """The labels as the patterns see them: place, heading, period of symmetry and category, (M, ...)."""

    position: FloatArray
    yaw: FloatArray
    period: FloatArray
    category: IntArray
    spacing: float
    extent: float
    bounds: Bounds | None


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


def places_of(scene: Scene) -> Places:
    """The labels of a scene, with their spacing and extent, metres: positive in any case."""
    layout = scene.layout
    position = layout.position
    extent = diameter(position)
    spacing = spacing_of(position)
    usual = float(np.nanmedian(layout.size)) if np.isfinite(layout.size).any() else 0.0
    extent = extent or usual or scene.fov.range_m
    period = np.array([scene.symmetry.get(name, FULL_TURN) for name in layout.category])
    return Places(position, layout.yaw, period, layout.category_code, spacing or extent, extent, scene.bounds)


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
    position = np.stack([one.position for one in variants])
    yaw = np.stack([one.yaw for one in variants])
    h, n, m = len(variants), len(category), len(places.yaw)
    allowed = (category[:, None] == UNKNOWN) | (category[:, None] == places.category)
    weight = allowed * (np.ones(m) if likely is None else likely + 1e-6)
    share = weight / weight.sum(axis=1, keepdims=True)
    step = max(1, MOST_CELLS // max(1, n * m * (SHIFTS + len(TURNS))))
    close = np.array([one.close for one in variants])
    parts = [
        _log_evidence(places, share, position[k : k + step], yaw[k : k + step], close[k : k + step])
        for k in range(0, h, step)
    ]
    total: FloatArray = np.concatenate(parts) + np.array([one.log_volume for one in variants])
    return total


def _log_evidence(
    places: Places, share: FloatArray, position: FloatArray, yaw: FloatArray, close: BoolArray
) -> FloatArray:
    square = ((position[:, :, None] - places.position) ** 2).sum(axis=-1)
    widths = np.geomspace(LEAST_SHIFT * places.spacing, max(places.extent, places.spacing), SHIFTS)
    shift = np.exp(-square[..., None, :] / (2 * widths[:, None] ** 2)) / (2 * np.pi * widths[:, None] ** 2)
    turn = heading_density(yaw[..., None] - places.yaw, places.period)
    fits = (shift * share[:, None, :]) @ turn  # (H, N, S, R)
    middle = places.position.mean(axis=0)
    away = ((position - middle) ** 2).sum(axis=-1)
    wide = places.extent**2
    anywhere = 0.5 * np.exp(-away / (2 * wide)) / (2 * np.pi * wide)
    anywhere = anywhere + 0.5 * places.extent / (2 * np.pi * (away + wide) ** 1.5)
    each = (1 - ANYWHERE) * fits + ANYWHERE * anywhere[..., None, None] / FULL_TURN
    total = np.log(np.maximum(each, 1e-300)).sum(axis=1)
    total[np.ix_(close, widths > CLOSE * places.spacing)] = -np.inf
    total = total.reshape(len(position), -1)
    if places.bounds is not None:
        total += np.log(OUTSIDE) * (~places.bounds.contains(position)).sum(axis=1)[:, None]
    return log_mean(total)


def heading_density(turn: FloatArray, period: FloatArray) -> FloatArray:
    """(..., M, R + 1) densities of turns (..., M) for each scale, and for headings that tell nothing."""
    known = ~np.isnan(turn) & (period > 0)
    length = np.where(period > 0, period, FULL_TURN)
    off = np.where(known, turn - length * np.round(turn / length), 0.0)
    result = np.full((*turn.shape, len(TURNS) + 1), 1 / FULL_TURN)
    for r, width in enumerate(TURNS):
        around = np.zeros(off.shape)
        for k in (-1, 0, 1):
            around = around + np.exp(-0.5 * ((off + k * length) / width) ** 2)
        density = around / (np.sqrt(FULL_TURN) * width) * length / FULL_TURN
        result[..., r] = np.where(known, density, 1 / FULL_TURN)
    return result


def log_mean(values: FloatArray) -> FloatArray:
    """(H,) logarithms of the means of what (H, K) are the logarithms of."""
    top = values.max(axis=1)
    result: FloatArray = top + np.log(np.exp(values - top[:, None]).mean(axis=1))
    return result
