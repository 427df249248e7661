"""How deep footprints stand inside each other."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.geometry import direction, footprint_corners


def deepest_overlap(position: FloatArray, yaw: FloatArray, size: FloatArray) -> float:
    """How deep the deepest pair of footprints reaches into each other; 0 where none overlap.

    Separating axes: the depth of two rectangles is the least that their shadows share along any side.

    Args:
        position: (N, 2) centres, metres.
        yaw: (N,) headings, radians.
        size: (N, 3) width, height, depth, metres.

    Returns:
        Metres.
    """
    if len(yaw) < 2:
        return 0.0
    corners = footprint_corners(position, yaw, size)
    axes = np.stack([direction(yaw), direction(yaw + np.pi / 2)], axis=1)
    shadow = np.einsum("iad,jcd->iajc", axes, corners)
    low, high = shadow.min(axis=-1), shadow.max(axis=-1)
    each = np.arange(len(yaw))
    own_low, own_high = low[each, :, each], high[each, :, each]
    shared = np.minimum(high, own_high[..., None]) - np.maximum(low, own_low[..., None])
    depth = shared.min(axis=1)
    depth = np.minimum(depth, depth.T)
    first, second = np.triu_indices(len(yaw), 1)
    return float(max(0.0, depth[first, second].max()))
