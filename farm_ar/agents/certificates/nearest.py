"""Nearest points of convex polygons under the conditions of the certificates, compiled.

Polygons are (V, 2), counter-clockwise; one without vertices is empty, and what is asked of it infinite.
"""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled

SLACK = 1e-12
"""By how much rounding may make a condition seem to fail; bounds stay bounds, being a little lower."""

TOUCHING = 1e-7
"""Metres by which a place may miss the condition: what rounding does to a root where an edge just touches."""


@compiled
def holds(polygon: FloatArray, x: float, z: float) -> bool:
    """Whether a convex polygon holds a point, its edges included."""
    n = len(polygon)
    for v in range(n):
        ax, az = polygon[v]
        bx, bz = polygon[(v + 1) % n]
        if (bx - ax) * (z - az) - (bz - az) * (x - ax) < -SLACK:
            return False
    return n > 2


@compiled
def advance_distance(polygon: FloatArray, home: FloatArray, goal: FloatArray, ahead: float) -> float:
    """How far from `home` one must go, within a polygon, to be nearer to `goal` than to `home` by `ahead`.

    The places that are, |q - home| - |q - goal| >= ahead, are one side of a branch of a hyperbola. The
    nearest of them to `home` is the branch's vertex, between the two; where the polygon does not hold that,
    the nearest one lies on an edge, because along the branch the distance from `home` grows from the vertex
    on both ways.

    Args:
        polygon: (V, 2) metres.
        home: (2,) metres.
        goal: (2,) metres.
        ahead: metres; may be negative.

    Returns:
        Metres; infinite where there is no such place.
    """
    n = len(polygon)
    if n < 3:
        return np.inf
    apart = np.hypot(goal[0] - home[0], goal[1] - home[1])
    if ahead > apart + SLACK:
        return np.inf
    if -apart >= ahead and holds(polygon, home[0], home[1]):
        return 0.0
    if apart > 0 and ahead > -apart:
        share = (apart + ahead) / 2 / apart
        x, z = home[0] + share * (goal[0] - home[0]), home[1] + share * (goal[1] - home[1])
        if holds(polygon, x, z):
            return float(share * apart)
    best: float = np.inf
    candidates = np.empty(5)
    for v in range(n):
        ax, az = polygon[v]
        dx, dz = polygon[(v + 1) % n, 0] - ax, polygon[(v + 1) % n, 1] - az
        square = dx * dx + dz * dz
        if square == 0:
            continue
        hx, hz, gx, gz = ax - home[0], az - home[1], ax - goal[0], az - goal[1]
        candidates[0], candidates[1] = 0.0, 1.0
        candidates[2] = -(hx * dx + hz * dz) / square
        # |q - home|^2 - |q - goal|^2 = k + m s is to be ahead^2 + 2 ahead |q - goal|.
        k = hx * hx + hz * hz - gx * gx - gz * gz - ahead * ahead
        m = 2 * (dx * (hx - gx) + dz * (hz - gz))
        f = 4 * ahead * ahead
        a, b, c = m * m - f * square, 2 * (k * m - f * (gx * dx + gz * dz)), k * k - f * (gx * gx + gz * gz)
        candidates[3], candidates[4] = _roots(a, b, c)
        for candidate in candidates:
            s = min(max(float(candidate), 0.0), 1.0) if candidate == candidate else 0.0
            to_home = np.hypot(hx + s * dx, hz + s * dz)
            to_goal = np.hypot(gx + s * dx, gz + s * dz)
            if to_home - to_goal >= ahead - TOUCHING:
                best = min(best, float(to_home))
    return best


@compiled
def _roots(a: float, b: float, c: float) -> tuple[float, float]:
    """The real roots of a s^2 + b s + c; NaN for those that are none."""
    scale = max(abs(a), abs(b), abs(c))
    if scale == 0 or (abs(a) < 1e-14 * scale and abs(b) < 1e-14 * scale):
        return np.nan, np.nan
    if abs(a) < 1e-14 * scale:
        return -c / b, np.nan
    inside = b * b - 4 * a * c
    if inside < 0:
        # Where the edge just touches the branch, rounding may take both roots away.
        return -b / (2 * a), np.nan
    half = -(b + np.copysign(np.sqrt(inside), b)) / 2
    return half / a, c / half if half != 0 else np.nan


@compiled
def detour(polygon: FloatArray, home: FloatArray, goal: FloatArray) -> float:
    """The least sum of the distances to `home` and to `goal` of a place in a polygon, metres.

    It is their own distance where the polygon has a place between them; otherwise the best place lies on an
    edge, where it is known from the reflection of light.
    """
    n = len(polygon)
    if n < 3:
        return np.inf
    apart = np.hypot(goal[0] - home[0], goal[1] - home[1])
    if holds(polygon, home[0], home[1]) or holds(polygon, goal[0], goal[1]):
        return float(apart)
    best: float = np.inf
    for v in range(n):
        ax, az = polygon[v]
        dx, dz = polygon[(v + 1) % n, 0] - ax, polygon[(v + 1) % n, 1] - az
        length = np.hypot(dx, dz)
        if length == 0:
            continue
        hx, hz, gx, gz = home[0] - ax, home[1] - az, goal[0] - ax, goal[1] - az
        along_home, along_goal = (hx * dx + hz * dz) / length, (gx * dx + gz * dz) / length
        off_home, off_goal = abs(hx * dz - hz * dx) / length, abs(gx * dz - gz * dx) / length
        both = off_home + off_goal
        place = along_home
        if both > 0:
            place = (along_home * off_goal + along_goal * off_home) / both
        elif along_goal < along_home:
            place = along_goal
        place = min(max(place, 0.0), length)
        ways = np.hypot(place - along_home, off_home) + np.hypot(place - along_goal, off_goal)
        best = min(best, float(ways))
    return best
