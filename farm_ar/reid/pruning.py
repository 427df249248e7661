"""Which labels are candidates: those of the Voronoi sites near the camera (paper, Eqs. 1 to 3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.kernels import compiled

if TYPE_CHECKING:
    from farm_ar.reid.assignment import Known

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


@compiled
def sites_kept(camera: FloatArray, sites: FloatArray, threshold: float, order: IntArray) -> int:
    """What `sites_by_probability` says of one camera: how many sites the threshold keeps.

    Args:
        camera: (2,) metres.
        sites: (K, 2) centres, distinct, metres.
        threshold: 0 to 1.
        order: (K,) filled with the sites in falling probability (Eq. 3), which is rising distance.
    """
    k = len(sites)
    distance = np.empty(k)
    for s in range(k):
        dx, dz = camera[0] - sites[s, 0], camera[1] - sites[s, 1]
        distance[s] = np.sqrt(dx * dx + dz * dz)
        place = s
        while place > 0 and distance[order[place - 1]] > distance[s]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = s
    if threshold >= 1.0:
        return k
    total = 0.0
    for place in range(1, k):
        total += 1.0 / distance[order[place]]
    kept, reached = 1, 0.0
    while kept < k and reached < (threshold - SUM_TOLERANCE) * total:
        reached += 1.0 / distance[order[kept]]
        kept += 1
    return kept


@compiled
def enough(detected: IntArray, offered: IntArray, gate: bool) -> bool:
    """Whether every detection can have a label of its own.

    Args:
        detected: (C + 1,) detections of each category, those of none last.
        offered: (C + 1,) candidate labels of each category; the last entry is 0.
        gate: whether a label must be of the detection's category, where that is known.
    """
    wanted, had = 0, 0
    for c in range(len(detected)):
        if gate and c < len(detected) - 1 and detected[c] > offered[c]:
            return False
        wanted += detected[c]
        had += offered[c]
    return wanted <= had


@compiled
def choose_candidates(
    known: Known,
    b: int,
    detected: IntArray,
    gate: bool,
    rank: IntArray,
    kept: int,
    chosen: IntArray,
    offered: IntArray,
) -> tuple[int, bool]:
    """Fill `chosen` with the labels of the first `kept` sites, and of more where those are too few.

    Args:
        known: the labels.
        b: the snapshot.
        detected: (C + 1,) its detections of each category, those of none last.
        gate: whether a label must be of the detection's category, where that is known.
        rank: (S,) place of each site in the order of falling probability.
        kept: how many sites the threshold keeps.
        chosen: (M,) filled from the front.
        offered: (C + 1,) filled with the labels chosen of each category.

    Returns:
        How many labels were chosen, and whether that took more sites than `kept`.
    """
    sites = kept
    while True:
        offered[:] = 0
        m = 0
        for j in known.order[b % len(known.order)]:
            if rank[known.site[j]] < sites:
                chosen[m] = j
                offered[known.category[j]] += 1
                m += 1
        if sites >= len(rank) or enough(detected, offered, gate):
            return m, sites > kept
        sites += 1
