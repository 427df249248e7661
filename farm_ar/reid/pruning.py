"""Which labels are worth considering: those of the Voronoi sites near the camera (paper, Eqs. 1 to 3)."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray

SUM_TOLERANCE = 1e-12
"""By how much rounding may keep a sum of probabilities below a threshold that it reaches."""


def site_distance(camera_position: FloatArray, sites: FloatArray) -> FloatArray:
    """Distance from the camera to the centre of each site. Paper, Eq. 1.

    Args:
        camera_position: (..., 2) metres.
        sites: (K, 2) centres, metres.

    Returns:
        (..., K) metres.
    """
    offset = camera_position[..., None, :] - sites
    offset *= offset
    return np.sqrt(offset[..., 0] + offset[..., 1])


def within_site(camera_position: FloatArray, sites: FloatArray) -> BoolArray:
    """Whether the camera is in the cell of each site; if on a border, in the first one's. Paper, Eq. 2.

    Args:
        camera_position: (..., 2) metres.
        sites: (K, 2) centres, metres.

    Returns:
        (..., K) of which one is true.
    """
    nearest = np.argmin(site_distance(camera_position, sites), axis=-1)
    own: BoolArray = np.arange(len(sites)) == nearest[..., None]
    return own


def site_probability(camera_position: FloatArray, sites: FloatArray) -> FloatArray:
    """Probability of considering each of K sites, given where the camera is. Paper, Eq. 3.

    The camera's own site has probability 1 and is left out of the sum over which the others are normalised;
    so read, the equation gives the paper's Table 3.

    Args:
        camera_position: (..., 2) metres.
        sites: (K, 2) centres, distinct, metres.

    Returns:
        (..., K) probabilities; those of the other sites sum to 1.
    """
    own = within_site(camera_position, sites)
    distance = np.where(own, 1.0, site_distance(camera_position, sites))
    closeness = np.where(own, 0.0, 1.0 / distance)
    total = closeness.sum(axis=-1, keepdims=True)
    return np.where(own, 1.0, closeness / np.where(total > 0, total, 1.0))


def sites_by_probability(
    camera_position: FloatArray, sites: FloatArray, threshold: float
) -> tuple[IntArray, IntArray]:
    """The sites from the likeliest down, and how many of them the threshold keeps.

    After the camera's own site, sites join in falling probability, which is the order of their distance,
    until the sum of their probabilities first reaches the threshold: 0 keeps the own site only, 1 keeps all.
    Of equally likely sites the first comes first.

    Args:
        camera_position: (..., 2) metres.
        sites: (K, 2) centres, distinct, metres.
        threshold: 0 to 1.

    Returns:
        (..., K) indices of the sites in falling probability, the camera's own first; (...) how many are kept.
    """
    distance = site_distance(camera_position, sites)
    order = np.argsort(distance, axis=-1, kind="stable")
    if threshold >= 1:
        return order, np.full(order.shape[:-1], len(sites), dtype=np.int64)
    reached = (1.0 / np.sort(distance, axis=-1)[..., 1:]).cumsum(axis=-1)
    short = reached[..., :-1] < (threshold - SUM_TOLERANCE) * reached[..., -1:]
    at_least = 2 if threshold > SUM_TOLERANCE and len(sites) > 1 else 1
    return order, at_least + short.sum(axis=-1)
