"""Cubic Bézier curves: points along them, cutting and moving them, and walking along them at even speed.

A segment is its four control points (4, 2): anchor, control, control, anchor. A curve of k segments is
either the list of its 3 k + 1 points, neighbours sharing an anchor, or an array (k, 4, 2) of segments.
"""

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.geometry.angles import heading

# Three-point Gauss-Legendre quadrature on [0, 1].
_GAUSS_NODES = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])
_GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18

# Steps shorter than this part of a polyline's length are taken for rounding: their direction means nothing.
_NEGLIGIBLE_STEP = 1e-12


def bezier_point(control: FloatArray, t: float | FloatArray) -> FloatArray:
    """Points on segments.

    Args:
        control: (..., 4, 2) control points, metres.
        t: (...) curve parameters, 0 at the first anchor and 1 at the last; the batch dimensions broadcast,
            so one segment (4, 2) takes any number of parameters.

    Returns:
        (..., 2) points, metres.
    """
    first, second, third, fourth = _control_points(control)
    t = np.asarray(t)[..., None]
    s = 1 - t
    point: FloatArray = s**3 * first + 3 * s**2 * t * second + 3 * s * t**2 * third + t**3 * fourth
    return point


def bezier_tangent(control: FloatArray, t: float | FloatArray) -> FloatArray:
    """Derivatives of segments by the curve parameter: where the curve leads, and how fast.

    Args:
        control: (..., 4, 2) control points, metres.
        t: (...) curve parameters; broadcast as in `bezier_point`.

    Returns:
        (..., 2) derivatives, metres per unit of t; zero where control points coincide with an anchor.
    """
    first, second, third, fourth = _control_points(control)
    t = np.asarray(t)[..., None]
    s = 1 - t
    slope: FloatArray = 3 * (s**2 * (second - first) + 2 * s * t * (third - second) + t**2 * (fourth - third))
    return slope


def split_bezier(control: FloatArray, t: float | FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cut segments in two that together are the same curve (de Casteljau).

    Args:
        control: (..., 4, 2) control points, metres.
        t: (...) where to cut; broadcast as in `bezier_point`.

    Returns:
        (..., 4, 2) the parts before and after the cut, metres.
    """
    t = np.asarray(t)[..., None, None]
    level = np.asarray(control, dtype=np.float64)
    left, right = [level[..., :1, :]], [level[..., -1:, :]]
    for _ in range(3):
        level = (1 - t) * level[..., :-1, :] + t * level[..., 1:, :]
        left.append(level[..., :1, :])
        right.append(level[..., -1:, :])
    shape = level.shape
    before = [np.broadcast_to(point, shape) for point in left]
    after = [np.broadcast_to(point, shape) for point in reversed(right)]
    return np.concatenate(before, axis=-2), np.concatenate(after, axis=-2)


def move_end(control: FloatArray, end: FloatArray) -> FloatArray:
    """Move the last anchors of segments, and the controls before them by the same shift.

    The start and the direction in which the curve leaves it stay, so whoever stands there neither jumps nor
    turns; the direction of arrival stays too.

    Args:
        control: (..., 4, 2) control points, metres.
        end: (..., 2) where the segments are to end, metres.

    Returns:
        (..., 4, 2) new control points, metres.
    """
    first, second, third, fourth = _control_points(control)
    end = np.asarray(end, dtype=np.float64)
    return np.stack(np.broadcast_arrays(first, second, third + (end - fourth), end), axis=-2)


def chain(points: FloatArray) -> FloatArray:
    """Segments of a curve given as one list of points.

    Args:
        points: (3 k + 1, 2) anchor, control, control, anchor, ..., metres; k is at least 1.

    Returns:
        (k, 4, 2) segments, metres.

    Raises:
        ValueError: If the number of points is not 4, 7, 10, ...
    """
    points = np.asarray(points, dtype=np.float64)
    if len(points) < 4 or len(points) % 3 != 1:
        raise ValueError(f"a chain of cubic Béziers has 4, 7, 10, ... points, got {len(points)}")
    segments = (len(points) - 1) // 3
    split: FloatArray = points[3 * np.arange(segments)[:, None] + np.arange(4)]
    return split


def sample_chain(points: FloatArray, per_segment: int = 64) -> FloatArray:
    """A curve as a polyline, evenly spaced in the curve parameter.

    Args:
        points: (3 k + 1, 2) anchor, control, control, anchor, ..., metres.
        per_segment: steps that each segment is cut into.

    Returns:
        (k * per_segment + 1, 2) points along the curve, its two ends included, metres.

    Raises:
        ValueError: If the number of points is not 4, 7, 10, ...
    """
    segments = chain(points)
    inner = bezier_point(segments[:, None], np.arange(per_segment) / per_segment)
    return np.vstack([inner.reshape(-1, 2), segments[-1, -1:]])


def arc_length_table(segments: FloatArray, samples: int = 64) -> FloatArray:
    """Length of each segment from its start to each of evenly spaced curve parameters.

    Three Gauss points a step: for a smooth curve far finer than the chords. `np.interp` on it, or one step
    of Newton from there, turns a length back into a parameter.

    Args:
        segments: (..., 4, 2) control points, metres.
        samples: steps that the parameter's range from 0 to 1 is cut into.

    Returns:
        (..., samples + 1) lengths at the parameters 0, 1 / samples, ..., 1, from 0 to the segment's length,
        metres.
    """
    t = (np.arange(samples)[:, None] + _GAUSS_NODES) / samples
    slope = bezier_tangent(np.asarray(segments)[..., None, None, :, :], t)
    steps = np.hypot(slope[..., 0], slope[..., 1]) @ _GAUSS_WEIGHTS / samples
    return np.concatenate([np.zeros_like(steps[..., :1]), np.cumsum(steps, axis=-1)], axis=-1)


def polyline_length(points: FloatArray, closed: bool = False) -> float:
    """Length of a polyline.

    Args:
        points: (P, 2) points, metres.
        closed: whether the way from the last point back to the first counts.

    Returns:
        The length, metres.
    """
    step = np.diff(_path(points, closed), axis=0)
    return float(np.hypot(step[:, 0], step[:, 1]).sum())


def equally_spaced(points: FloatArray, count: int, closed: bool = False) -> tuple[FloatArray, FloatArray]:
    """Places at equal distances along a polyline, each facing the direction of travel.

    The first is the polyline's first point. On an open polyline the last is its last point; on a closed one
    the way from the last place back to the first is as long as the others. Points may coincide;
    a polyline without length gives its one point, facing along +z.

    Args:
        points: (P, 2) points, dense enough that the polyline stands for the curve, metres; P is at least 1.
            The last point of a closed polyline may or may not repeat the first.
        count: how many places.
        closed: whether the polyline leads from its last point back to its first.

    Returns:
        (count, 2) positions, metres, and (count,) yaws, radians.
    """
    path = _path(points, closed)
    step = np.diff(path, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    moving = length > _NEGLIGIBLE_STEP * length.sum()
    if not moving.any():
        return np.repeat(path[:1], count, axis=0), np.zeros(count)
    start, step, length = path[:-1][moving], step[moving], length[moving]
    travelled = np.concatenate([[0.0], np.cumsum(length)])
    along = travelled[-1] * np.arange(count) / (count if closed else max(count - 1, 1))
    index = np.clip(np.searchsorted(travelled, along, side="right") - 1, 0, len(length) - 1)
    part = (along - travelled[index]) / length[index]
    return start[index] + part[:, None] * step[index], heading(step)[index]


def _control_points(control: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The four control points (..., 2) of segments (..., 4, 2)."""
    control = np.asarray(control, dtype=np.float64)
    return control[..., 0, :], control[..., 1, :], control[..., 2, :], control[..., 3, :]


def _path(points: FloatArray, closed: bool) -> FloatArray:
    """The polyline with the way back to its first point, if there is one."""
    points = np.asarray(points, dtype=np.float64)
    return np.vstack([points, points[:1]]) if closed else points
