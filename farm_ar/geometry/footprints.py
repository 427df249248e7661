"""Footprints: the rectangles that objects cover on the plane, and the boxes that stand on them.

An object's position is the centre of its footprint; width lies along its own right, depth along its own
forward. All arguments broadcast over their batch dimensions, written `...` below.
"""

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray

# Front right, front left, back left, back right: counter-clockwise with x to the right and z up the page.
_CORNER_SIGNS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


def footprint_corners(position: FloatArray, yaw: float | FloatArray, size: FloatArray) -> FloatArray:
    """Corners of footprints, counter-clockwise: front right, front left, back left, back right.

    Args:
        position: (..., 2) centres, metres.
        yaw: (...) headings, radians.
        size: (..., 3) width, height, depth, metres.

    Returns:
        (..., 4, 2) corners, metres.
    """
    right, forward = _own_axes(yaw)
    offset = _CORNER_SIGNS * _half_sizes(size)[..., None, :]
    along_right = offset[..., 0, None] * right[..., None, :]
    along_forward = offset[..., 1, None] * forward[..., None, :]
    return np.asarray(position)[..., None, :] + along_right + along_forward


def inside_footprint(
    point: FloatArray, position: FloatArray, yaw: float | FloatArray, size: FloatArray
) -> BoolArray:
    """Whether points lie in footprints, their edges included.

    Args:
        point: (..., 2) points, metres.
        position: (..., 2) centres, metres.
        yaw: (...) headings, radians.
        size: (..., 3) width, height, depth, metres.

    Returns:
        (...) true where the point is inside.
    """
    local = _to_own_axes(np.asarray(point) - position, yaw)
    inside: BoolArray = np.all(np.abs(local) <= _half_sizes(size), axis=-1)
    return inside


def footprints_overlap(
    position: FloatArray,
    yaw: float | FloatArray,
    size: FloatArray,
    other_position: FloatArray,
    other_yaw: float | FloatArray,
    other_size: FloatArray,
) -> BoolArray:
    """Whether footprints have area in common; standing edge to edge is not overlapping.

    Separating axes: two rectangles are apart exactly if they are apart along a side of one of them.

    Args:
        position: (..., 2) centres, metres.
        yaw: (...) headings, radians.
        size: (..., 3) width, height, depth, metres.
        other_position: (..., 2) centres of the other footprints, metres.
        other_yaw: (...) headings of the other footprints, radians.
        other_size: (..., 3) width, height, depth of the other footprints, metres.

    Returns:
        (...) true where the two overlap.
    """
    apart = np.asarray(other_position) - position
    half, other_half = _half_sizes(size), _half_sizes(other_size)
    turn = np.asarray(other_yaw) - yaw
    reach = half + _turned_box(other_half, turn)
    other_reach = other_half + _turned_box(half, turn)
    gap = np.abs(_to_own_axes(apart, yaw))
    other_gap = np.abs(_to_own_axes(apart, other_yaw))
    overlap: BoolArray = np.all((gap < reach) & (other_gap < other_reach), axis=-1)
    return overlap


def world_box(size: FloatArray, yaw: float | FloatArray) -> FloatArray:
    """Size of the smallest box along the world's axes around each turned box.

    Args:
        size: (..., 3) width, height, depth, metres.
        yaw: (...) headings, radians.

    Returns:
        (..., 3) extents along x, y and z, metres.
    """
    size = np.asarray(size)
    extent = _turned_box(size[..., [0, 2]], yaw)
    height = np.broadcast_to(size[..., 1], extent.shape[:-1])
    return np.stack([extent[..., 0], height, extent[..., 1]], axis=-1)


def segment_hits_footprint(
    start: FloatArray, end: FloatArray, position: FloatArray, yaw: float | FloatArray, size: FloatArray
) -> BoolArray:
    """Whether straight segments touch footprints; a segment wholly inside counts.

    Args:
        start: (..., 2) one end of each segment, metres.
        end: (..., 2) its other end, metres.
        position: (..., 2) centres, metres.
        yaw: (...) headings, radians.
        size: (..., 3) width, height, depth, metres.

    Returns:
        (...) true where they have a point in common.
    """
    local_start = _to_own_axes(np.asarray(start) - position, yaw)
    local_end = _to_own_axes(np.asarray(end) - position, yaw)
    return _segment_enters_box(local_start, local_end, _half_sizes(size))


def segment_hits_box(
    start3: FloatArray,
    end3: FloatArray,
    position: FloatArray,
    yaw: float | FloatArray,
    size: FloatArray,
    elevation: float | FloatArray,
) -> BoolArray:
    """Whether straight segments in space touch upright boxes; a segment wholly inside counts.

    Args:
        start3: (..., 3) one end of each segment (x, y, z), metres.
        end3: (..., 3) its other end, metres.
        position: (..., 2) centres of the footprints (x, z), metres.
        yaw: (...) headings, radians.
        size: (..., 3) width, height, depth, metres.
        elevation: (...) y of the boxes' undersides, metres.

    Returns:
        (...) true where they have a point in common.
    """
    half = np.asarray(size) / 2
    middle = elevation + half[..., 1]

    def to_box(point: FloatArray) -> FloatArray:
        local = _to_own_axes(point[..., [0, 2]] - position, yaw)
        right, up, forward = np.broadcast_arrays(local[..., 0], point[..., 1] - middle, local[..., 1])
        return np.stack([right, up, forward], axis=-1)

    return _segment_enters_box(to_box(np.asarray(start3)), to_box(np.asarray(end3)), half)


def _half_sizes(size: FloatArray) -> FloatArray:
    """(..., 2) half the width and half the depth."""
    half: FloatArray = np.asarray(size)[..., [0, 2]] / 2
    return half


def _own_axes(yaw: float | FloatArray) -> tuple[FloatArray, FloatArray]:
    """(..., 2) the right and the forward of objects that face along `yaw`, in the world."""
    sine, cosine = np.sin(yaw), np.cos(yaw)
    return np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)


def _to_own_axes(offset: FloatArray, yaw: float | FloatArray) -> FloatArray:
    """(..., 2) how far to the object's own right and forward each offset (..., 2) leads."""
    right, forward = _own_axes(yaw)
    return np.stack([np.sum(offset * right, axis=-1), np.sum(offset * forward, axis=-1)], axis=-1)


def _turned_box(extent: FloatArray, turn: float | FloatArray) -> FloatArray:
    """(..., 2) extent along both axes of a rectangle (..., 2) that has been turned."""
    sine, cosine = np.abs(np.sin(turn)), np.abs(np.cos(turn))
    width, depth = extent[..., 0], extent[..., 1]
    return np.stack([width * cosine + depth * sine, width * sine + depth * cosine], axis=-1)


def _segment_enters_box(start: FloatArray, end: FloatArray, half: FloatArray) -> BoolArray:
    """Slab test, in the box's own axes: somewhere the segment is between all pairs of opposite sides."""
    along = end - start
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        crossings = np.stack([(-half - start) / along, (half - start) / along])
    between = np.abs(start) <= half
    parallel = along == 0
    enters = np.where(parallel, np.where(between, -np.inf, np.inf), crossings.min(axis=0))
    leaves = np.where(parallel, np.where(between, np.inf, -np.inf), crossings.max(axis=0))
    first = np.maximum(enters.max(axis=-1), 0.0)
    last = np.minimum(leaves.min(axis=-1), 1.0)
    enters_box: BoolArray = first <= last
    return enters_box
