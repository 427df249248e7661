"""Rectangles on the plane: footprints of objects, how far apart they are, and the boxes that stand on them.

An object's position is the centre of its footprint; width lies along its own right, depth along its own
forward. Arguments of functions on arrays broadcast over their batch dimensions, written `...` below. Kernels
take one or two rectangles, and angles as Chipmunk has them (`angle = -yaw`); they are the only code for how
far apart two rectangles are.
"""

from __future__ import annotations

from math import cos, fabs, inf, sin, sqrt

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.kernels import compiled

# Front right, front left, back left, back right: counter-clockwise with x to the right and z up the page.
_CORNER_SIGNS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


@compiled
def length(x: float, z: float) -> float:
    """Of a vector; `hypot` is not the same to the last bit everywhere."""
    return sqrt(x * x + z * z)


@compiled
def separation(
    dx: float,
    dz: float,
    angle: float,
    other_angle: float,
    half_width: float,
    half_depth: float,
    other_half_width: float,
    other_half_depth: float,
) -> tuple[float, float, float]:
    """How far apart two rectangles are along that side of either along which they are farthest apart.

    Separating axes: two rectangles are apart exactly if they are apart along a side of one of them.

    Args:
        dx: from the first one's centre to the second's, metres.
        dz: likewise.
        angle: of the first, radians.
        other_angle: of the second, radians.
        half_width: of the first, metres.
        half_depth: likewise.
        other_half_width: of the second, metres.
        other_half_depth: likewise.

    Returns:
        Metres, below 0 where they overlap: then by how much the second has to move to get out by the shortest
        way; and the unit vector along which.
    """
    turn = other_angle - angle
    shared_sine, shared_cosine = fabs(sin(turn)), fabs(cos(turn))
    most, along_x, along_z = -inf, 0.0, 0.0
    for k in range(2):
        sine, cosine = (sin(angle), cos(angle)) if k == 0 else (sin(other_angle), cos(other_angle))
        own_width, own_depth = (half_width, half_depth) if k == 0 else (other_half_width, other_half_depth)
        width, depth = (other_half_width, other_half_depth) if k == 0 else (half_width, half_depth)
        across, ahead = cosine * dx + sine * dz, cosine * dz - sine * dx
        gap = fabs(across) - (own_width + shared_cosine * width + shared_sine * depth)
        if gap > most:
            side = 1.0 if across >= 0 else -1.0
            most, along_x, along_z = gap, side * cosine, side * sine
        gap = fabs(ahead) - (own_depth + shared_sine * width + shared_cosine * depth)
        if gap > most:
            side = 1.0 if ahead >= 0 else -1.0
            most, along_x, along_z = gap, -side * sine, side * cosine
    return most, along_x, along_z


@compiled
def overlap_depth(
    dx: float, dz: float, yaw: float, other_yaw: float, half: FloatArray, other_half: FloatArray
) -> float:
    """How deep two footprints stand in each other, metres; negative where a gap is between them.

    Args:
        dx: from the one's pivot to the other's, metres.
        dz: likewise.
        yaw: heading of the one, radians.
        other_yaw: heading of the other, radians.
        half: (3,) half of the one's size, metres.
        other_half: (3,) half of the other's size, metres.
    """
    gap, _, _ = separation(dx, dz, -yaw, -other_yaw, half[0], half[2], other_half[0], other_half[2])
    return -gap


@compiled
def overlap_depths(offset: FloatArray, yaw: FloatArray, half: FloatArray) -> FloatArray:
    """(P,) `overlap_depth` of pairs.

    Args:
        offset: (P, 2) from the first one's pivot to the second's, metres.
        yaw: (2, P) headings of both, radians.
        half: (2, P, 3) half of their sizes, metres.
    """
    depth = np.empty(len(offset))
    for i in range(len(offset)):
        depth[i] = overlap_depth(offset[i, 0], offset[i, 1], yaw[0, i], yaw[1, i], half[0, i], half[1, i])
    return depth


@compiled
def deepest_overlap(position: FloatArray, yaw: FloatArray, size: FloatArray) -> float:
    """How much of the deepest pair of footprints reaches into the other; 0 where none overlap.

    Args:
        position: (N, 2) centres, metres.
        yaw: (N,) headings, radians.
        size: (N, 3) width, height, depth, metres.

    Returns:
        Metres, at most a whole side.
    """
    deepest = 0.0
    for i in range(len(yaw)):
        for j in range(i):
            dx, dz = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
            depth = overlap_depth(dx, dz, yaw[i], yaw[j], size[i] / 2, size[j] / 2)
            whole = min(min(size[i, 0], size[i, 2]), min(size[j, 0], size[j, 2]))
            deepest = max(deepest, min(depth, whole))
    return deepest


@compiled
def point_distance(dx: float, dz: float, angle: float, half_width: float, half_depth: float) -> float:
    """From a point, at (dx, dz) from its centre, to a rectangle, metres; 0 inside."""
    sine, cosine = sin(angle), cos(angle)
    across = max(fabs(cosine * dx + sine * dz) - half_width, 0.0)
    ahead = max(fabs(cosine * dz - sine * dx) - half_depth, 0.0)
    return length(across, ahead)


@compiled
def half_extent(angle: float, half_width: float, half_depth: float) -> tuple[float, float]:
    """How far a rectangle reaches from its centre along x and along z, metres."""
    sine, cosine = fabs(sin(angle)), fabs(cos(angle))
    return cosine * half_width + sine * half_depth, sine * half_width + cosine * half_depth


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
    offset = np.asarray(other_position, dtype=np.float64) - position
    shape = np.broadcast_shapes(
        *(offset.shape[:-1], np.shape(yaw), np.shape(other_yaw)),
        *(np.shape(size)[:-1], np.shape(other_size)[:-1]),
    )
    between = np.ascontiguousarray(np.broadcast_to(offset, (*shape, 2))).reshape(-1, 2)
    headings = [np.broadcast_to(np.asarray(one, np.float64), shape) for one in (yaw, other_yaw)]
    sides = [np.broadcast_to(np.asarray(one, np.float64), (*shape, 3)) for one in (size, other_size)]
    half = np.stack(sides).reshape(2, -1, 3) / 2
    overlap: BoolArray = overlap_depths(between, np.stack(headings).reshape(2, -1), half).reshape(shape) > 0
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
