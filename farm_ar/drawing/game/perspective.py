"""Solids and upright drawings as a pinhole camera sees them."""

from __future__ import annotations

import cv2
import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import Colour, Image
from farm_ar.drawing.game.pinhole import NEAR_M, Pinhole, before_camera
from farm_ar.drawing.game.solids import Solid, light_on
from farm_ar.drawing.game.sprites import SHIFT, fixed_point

_STEP = np.log(1.03)
"""Sizes of what stands upright are rounded to steps of 3%."""

_TOO_NEAR_M = 0.05
_LEAST_SCALE = 20.0
_FARTHEST_PX = 4000.0


def fill(image: Image, pixels: FloatArray, colour: Colour) -> None:
    """Fill a polygon (V, 2), pixels; one without area is left out."""
    if len(pixels) > 2:
        corners = fixed_point(np.clip(pixels, -_FARTHEST_PX, _FARTHEST_PX))
        cv2.fillPoly(image, [corners], colour, cv2.LINE_AA, SHIFT)


def draw_solid(image: Image, view: Pinhole, solid: Solid, yaw: float, foot: FloatArray) -> None:
    """Draw those faces of a solid that face the eye.

    Args:
        image: to draw on.
        view: the camera.
        solid: what to draw.
        yaw: its heading, radians.
        foot: (3,) the middle of its foot, metres.
    """
    cosine, sine = float(np.cos(yaw)), float(np.sin(yaw))
    axes = np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])
    normals = solid.normals @ axes
    faces_eye = ((view.eye - foot - solid.starts @ axes) * normals).sum(axis=1) > 0
    tones = np.clip(solid.colours * light_on(normals)[solid.face, None], 0, 255).astype(int).tolist()
    frame = view.frame(solid.points @ axes + foot)
    whole = bool((frame[:, 2] >= NEAR_M).all())
    corners = fixed_point(np.clip(view.pixels(frame), -_FARTHEST_PX, _FARTHEST_PX)) if whole else None
    for k, (begin, end) in enumerate(solid.ends):
        if not faces_eye[solid.face[k]]:
            continue
        if corners is not None:
            polygon = corners[begin:end]
        else:
            polygon = fixed_point(
                np.clip(view.pixels(before_camera(frame[begin:end])), -_FARTHEST_PX, _FARTHEST_PX)
            )
        if len(polygon) > 2:
            cv2.fillPoly(image, [polygon], tones[k], cv2.LINE_AA, SHIFT)
            if k == 0 or solid.face[k] != solid.face[k - 1]:
                ink = [channel // 2 for channel in tones[k]]
                cv2.polylines(image, [polygon], True, ink, 1, cv2.LINE_AA, SHIFT)


def upright_scales(view: Pinhole, depth: FloatArray) -> FloatArray:
    """(...) pixels a metre of what stands upright at a depth (...), metres, in steps; 0 if it is not seen."""
    scale = view.focal / np.maximum(depth, _TOO_NEAR_M)
    rounded = np.exp(_STEP * np.rint(np.log(scale) / _STEP))
    return np.where((depth > _TOO_NEAR_M) & (scale > _LEAST_SCALE), np.round(rounded, 4), 0.0)
