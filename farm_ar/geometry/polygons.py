"""Simple polygons on the plane: area, what is inside, whether sides cross; and how far points lie apart."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray

_ON_EDGE = 1e-12
_FEW = 256
_AT_ONCE = 100_000


def polygon_area(corners: FloatArray) -> float:
    """Area within the corners (P, 2), positive where they run counter-clockwise with z up the page."""
    x, z = (corners - corners[0]).T
    return float(np.sum(x * np.roll(z, -1) - z * np.roll(x, -1))) / 2


def in_polygon(points: FloatArray, corners: FloatArray) -> BoolArray:
    """Whether points lie within a simple polygon or on its edge.

    Args:
        points: (..., 2) metres.
        corners: (P, 2) metres, in order either way.

    Returns:
        (...) true where the point is inside.
    """
    points = np.asarray(points, dtype=np.float64)
    scale = float(np.ptp(corners, axis=0).max())
    inside = np.zeros(points.shape[:-1], dtype=np.bool_)
    edge = np.zeros_like(inside)
    following, offsets = np.roll(corners, -1, axis=0), points[..., None, :]
    step = max(1, _AT_ONCE // max(inside.size, 1))
    for k in range(0, len(corners), step):
        start, end = corners[k : k + step], following[k : k + step]
        side, offset = end - start, offsets - start  # (..., S, 2)
        across = side[:, 0] * offset[..., 1] - side[:, 1] * offset[..., 0]
        level = (start[:, 1] > offsets[..., 1]) != (end[:, 1] > offsets[..., 1])
        inside ^= np.logical_xor.reduce(level & ((across > 0) == (side[:, 1] > 0)), axis=-1)
        along = np.clip((offset * side).sum(axis=-1) / (side * side).sum(axis=-1), 0.0, 1.0)
        away = np.abs(offset - along[..., None] * side).max(axis=-1)
        edge |= (away <= _ON_EDGE * scale).any(axis=-1)
    return inside | edge


def crossing_sides(corners: FloatArray) -> tuple[int, int] | None:
    """The first two sides of a polygon, by the index of their first corner, that meet where they must not.

    Sides that follow one another share a corner and must not run back over each other.
    """
    count = len(corners)
    following = np.roll(corners, -1, axis=0)
    for i in range(count - 1):
        others = np.arange(i + 1, count)
        meet = _meet(corners[i], following[i], corners[others], following[others])
        meet[others == i + 1] = False
        if i == 0:
            meet[-1] = False
        ahead, back = following[i] - corners[i], following[(i + 1) % count] - following[i]
        if ahead[0] * back[1] == ahead[1] * back[0] and ahead @ back < 0:
            meet[0] = True
        if meet.any():
            return i, int(others[meet.argmax()])
    ahead, back = corners[0] - corners[-1], corners[1] - corners[0]
    turns_back = ahead[0] * back[1] == ahead[1] * back[0] and ahead @ back < 0
    return (count - 1, 0) if turns_back else None


def diameter(points: FloatArray) -> float:
    """The largest distance between two of the points (N, 2), the same however they are turned; 0 for one."""
    points = np.asarray(points, dtype=np.float64)
    if len(points) > _FEW:
        points = _hull(points)
    largest = 0.0
    for i in range(len(points) - 1):
        offset = points[i + 1 :] - points[i]
        largest = max(largest, float(np.hypot(offset[:, 0], offset[:, 1]).max()))
    return largest


def _meet(start: FloatArray, end: FloatArray, starts: FloatArray, ends: FloatArray) -> BoolArray:
    """Whether one line segment meets each of others (K, 2) to (K, 2), ends included."""

    def side_of(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
        result: FloatArray = np.sign(
            (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1])
            - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])
        )
        return result

    apart = np.any(
        (np.maximum(starts, ends) < np.minimum(start, end))
        | (np.minimum(starts, ends) > np.maximum(start, end)),
        axis=-1,
    )
    parted = side_of(start, end, starts) * side_of(start, end, ends) > 0
    parted |= side_of(starts, ends, start) * side_of(starts, ends, end) > 0
    meet: BoolArray = ~apart & ~parted
    return meet


def _hull(points: FloatArray) -> FloatArray:
    """The corners of the convex hull (Andrew's monotone chain, 1979)."""
    points = np.unique(points, axis=0)
    chains = []
    for run in (points, points[::-1]):
        chain: list[tuple[float, float]] = []
        for x, z in run.tolist():
            while len(chain) > 1 and (
                (chain[-1][0] - chain[-2][0]) * (z - chain[-2][1])
                <= (chain[-1][1] - chain[-2][1]) * (x - chain[-2][0])
            ):
                chain.pop()
            chain.append((x, z))
        chains += chain
    return np.unique(np.array(chains), axis=0)
