"""The costs of giving a label to a detection: the paper's Eqs. 4 to 7."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray


def translation_cost(
    detected_position: FloatArray, label_position: FloatArray, diagonal: float
) -> FloatArray:
    """Cost of moving each label to each detection: the distance by the room's diagonal. Paper, Eq. 4.

    Args:
        detected_position: (..., N, 2) positions of the detections, metres.
        label_position: (..., M, 2) positions of the labels in the reference layout, metres.
        diagonal: `l`, the diagonal of the room, metres.

    Returns:
        (..., N, M) costs.
    """
    dx = detected_position[..., :, None, 0] - label_position[..., None, :, 0]
    dz = detected_position[..., :, None, 1] - label_position[..., None, :, 1]
    return np.sqrt(dx * dx + dz * dz) / diagonal


def rotation_cost(detected_yaw: FloatArray, label_yaw: FloatArray) -> FloatArray:
    """Cost of turning each label to each detection, 0 (same heading) to 1 (opposite).

    Symmetric about 180 degrees, so the difference needs no wrapping. Paper, Eq. 5. A heading that is not
    known costs nothing.

    Args:
        detected_yaw: (..., N) headings of the detections, radians; NaN where not known.
        label_yaw: (..., M) headings of the labels in the reference layout, radians; likewise.

    Returns:
        (..., N, M) costs.
    """
    half = (detected_yaw[..., :, None] - label_yaw[..., None, :]) / 2
    return np.where(np.isnan(half), 0.0, np.abs(np.sin(half)))


def orientation_cost(detected_rotation: FloatArray, label_rotation: FloatArray) -> FloatArray:
    """Cost of turning each label to each detection in space: the sine of half the angle between them.

    It is Eq. 5 for rotations about any axis: of upright objects it is `rotation_cost`. The distance of two
    rotation matrices (Frobenius) is 2 sqrt(2) times it. A heading that is not known costs nothing.

    Args:
        detected_rotation: (..., N, 3, 3) of the detections; NaN where the heading is not known.
        label_rotation: (..., M, 3, 3) of the labels in the reference layout; likewise.

    Returns:
        (..., N, M) costs, 0 to 1.
    """
    difference = detected_rotation[..., :, None, :, :] - label_rotation[..., None, :, :, :]
    apart = np.sqrt((difference**2).sum(axis=(-2, -1)) / 8)
    return np.where(np.isnan(apart), 0.0, np.minimum(apart, 1.0))


def dimension_cost(detected_size: FloatArray, label_size: FloatArray) -> FloatArray:
    """Cost of the sizes' difference, 1 where they agree: the product of the sides' ratios. Paper, Eq. 6.

    The sides are paired so that the product is smallest, since a pose estimate may have its axes swapped. The
    logarithm of the product is a sum of absolute differences, which is smallest when both are sorted. A size
    that is not known costs nothing.

    Args:
        detected_size: (..., N, 3) sides of the detections, metres; NaN where not known.
        label_size: (..., M, 3) sides of the labels, metres; likewise.

    Returns:
        (..., N, M) costs, at least 1.
    """
    return dimension_cost_of_sides(sorted_log_sides(detected_size), sorted_log_sides(label_size))


def sorted_log_sides(size: FloatArray) -> FloatArray:
    """(..., 3) natural logarithms of the sides in metres, smallest first."""
    sides: FloatArray = np.ascontiguousarray(np.log(size))
    sides.sort(axis=-1)
    return sides


def dimension_cost_of_sides(detected_sides: FloatArray, label_sides: FloatArray) -> FloatArray:
    """`dimension_cost` of what `sorted_log_sides` has made: (..., N, 3) and (..., M, 3) to (..., N, M)."""
    difference = np.abs(detected_sides[..., :, None, :] - label_sides[..., None, :, :])
    gap = difference[..., 0] + difference[..., 1] + difference[..., 2]
    return np.where(np.isnan(gap), 1.0, np.exp(gap))


def total_cost(
    translation: FloatArray,
    rotation: FloatArray,
    dimension: FloatArray,
    translation_weight: float,
    rotation_weight: float,
) -> FloatArray:
    """Cost of giving each label to each detection, (..., N, M): C_d (w_t C_t + w_r C_r). Paper, Eq. 7."""
    return dimension * (translation_weight * translation + rotation_weight * rotation)
