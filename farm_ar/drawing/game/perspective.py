"""Upright drawings as a pinhole camera sees them."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.drawing.game.pinhole import Pinhole

_STEP = np.log(1.03)
"""Sizes of what stands upright are rounded to steps of 3%."""

_TOO_NEAR_M = 0.05
_LEAST_SCALE = 20.0
_FARTHEST_PX = 4000.0
_MARGIN_PX = 200.0


def upright_scale(size: int) -> float:
    """Pixels a metre of what stands upright in one of the sizes that `upright_places` gives."""
    return round(float(np.exp(_STEP * size)), 4)


def upright_places(
    view: Pinhole, feet: FloatArray, picture: tuple[int, int]
) -> tuple[FloatArray, IntArray, FloatArray, BoolArray]:
    """Where things are seen that stand upright and face the eye.

    Args:
        view: the camera.
        feet: (F, 3) where they stand, metres.
        picture: its width and height, pixels.

    Returns:
        (F, 2) columns and rows; (F,) sizes, whole numbers for `upright_scale`; (F,) how far away they are,
        metres; and (F,) whether they may be in the picture.
    """
    frame = view.frame(feet)
    distance = frame[:, 2]
    scale = view.focal / np.maximum(distance, _TOO_NEAR_M)
    pixels = view.pixels(frame)
    inside = (pixels > -_MARGIN_PX).all(axis=1) & (pixels < np.array(picture) + _MARGIN_PX).all(axis=1)
    seen = inside & (distance > _TOO_NEAR_M) & (scale > _LEAST_SCALE)
    size = np.rint(np.log(np.maximum(scale, 1.0)) / _STEP).astype(np.int64)
    return pixels, size, distance, seen
