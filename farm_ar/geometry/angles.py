"""Yaw angles: clockwise seen from above, 0 along +z, a quarter turn along +x."""

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled

FULL_TURN = 2 * np.pi


def wrap(angle: float | FloatArray) -> FloatArray:
    """The same direction as an angle in [-pi, pi); an angle already there is returned unchanged.

    Args:
        angle: (...) angles, radians.

    Returns:
        (...) angles in [-pi, pi), radians.
    """
    # fmod is exact, and so is each subtraction after it: no rounding can leave the interval.
    turned = np.fmod(angle, FULL_TURN)
    turned = np.where(turned >= np.pi, turned - FULL_TURN, turned)
    return np.where(turned < -np.pi, turned + FULL_TURN, turned)


@compiled
def wrap_angle(angle: float) -> float:
    """`wrap` of one angle, radians, for compiled kernels; to the same bits."""
    turned: float = np.fmod(angle, FULL_TURN)
    if turned >= np.pi:
        turned -= FULL_TURN
    if turned < -np.pi:
        turned += FULL_TURN
    return turned


def heading(direction: FloatArray) -> FloatArray:
    """Yaw that faces along a direction; 0 for the zero vector.

    Args:
        direction: (..., 2) directions (x, z) of any length.

    Returns:
        (...) yaws in [-pi, pi], radians.
    """
    direction = np.asarray(direction, dtype=np.float64)
    yaw: FloatArray = np.arctan2(direction[..., 0], direction[..., 1])
    return yaw


def direction(yaw: float | FloatArray) -> FloatArray:
    """Unit vector that a yaw faces along.

    Args:
        yaw: (...) yaws, radians.

    Returns:
        (..., 2) unit vectors (x, z).
    """
    return np.stack([np.sin(yaw), np.cos(yaw)], axis=-1)
