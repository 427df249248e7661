"""The one camera that the network knows, and how any other camera's image becomes one of it."""

from __future__ import annotations

import cv2
import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.rendering import Intrinsics, View
from farm_ar.vision.base import Image

WIDTH, HEIGHT = 320, 192
STRIDE = 4
"""Pixels of the input to a cell of the output, each way."""

FIELD_OF_VIEW = float(np.deg2rad(64.69))
"""Of the canonical camera from left to right, radians: the HoloLens 2's."""

PADDING = 114
"""Grey level of what an image does not cover."""


def canonical_view(camera: View) -> View:
    """The camera without roll and distortion of its pixels, in the same place; a wider one is kept whole.

    An image of 16 : 9 leaves 6 rows empty at the top and at the bottom.
    """
    lens = Intrinsics.of_view(WIDTH, HEIGHT, FIELD_OF_VIEW)
    upright = View(lens, camera.eye, camera.yaw, camera.pitch)
    corners = _warped(homography(camera, upright), _corners(camera.intrinsics))
    middle = np.array([lens.cx, lens.cy])
    room = np.array([WIDTH, 0.9375 * HEIGHT]) / 2
    beyond = float((np.abs(corners - middle) / room).max()) if np.isfinite(corners).all() else 1.0
    # A few pixels may be lost at the edges before everything is made smaller; much smaller is of no use.
    shrink = min(max(beyond / 1.02, 1.0), 3.0)
    smaller = Intrinsics(lens.fx / shrink, lens.fy / shrink, lens.cx, lens.cy, WIDTH, HEIGHT)
    return View(smaller, camera.eye, camera.yaw, camera.pitch)


def homography(camera: View, other: View) -> FloatArray:
    """(3, 3) from pixels of a camera to those of another in the same place."""
    turn = other.rotation @ camera.rotation.T
    whole: FloatArray = other.intrinsics.matrix @ turn @ np.linalg.inv(camera.intrinsics.matrix)
    return whole


def canonical_image(image: Image, camera: View, canonical: View) -> Image:
    """An image as the canonical camera would have taken it, (`HEIGHT`, `WIDTH`, 3)."""
    fewer = int(np.clip(round(camera.intrinsics.fx / canonical.intrinsics.fx / 2), 1, 16))
    if fewer > 1:  # bilinear look-ups average over two pixels at most
        lens = camera.intrinsics
        size = max(lens.width // fewer, 1), max(lens.height // fewer, 1)
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
        camera = View(lens.resized(*size), camera.eye, camera.yaw, camera.pitch, camera.roll)
    return np.asarray(
        cv2.warpPerspective(
            image,
            homography(camera, canonical),
            (WIDTH, HEIGHT),
            flags=cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=(PADDING,) * 3,
        ),
        np.uint8,
    )


def on_plane(camera: View, pixels: FloatArray) -> FloatArray:
    """(..., 2) places on the plane y = 0 that pixels (..., 2) show; NaN where they show none."""
    lens = camera.intrinsics
    local = np.stack(
        [
            (pixels[..., 0] - lens.cx) / lens.fx,
            (pixels[..., 1] - lens.cy) / lens.fy,
            np.ones(pixels.shape[:-1]),
        ],
        axis=-1,
    )
    ray = local @ camera.rotation
    with np.errstate(divide="ignore", invalid="ignore"):
        away = np.where(ray[..., 1] < -1e-6, -camera.eye[1] / ray[..., 1], np.nan)
    place: FloatArray = camera.eye[[0, 2]] + away[..., None] * ray[..., [0, 2]]
    return place


def azimuth(camera: View, places: FloatArray) -> FloatArray:
    """(...) headings from the eye to places (..., 2) on the plane, radians."""
    away = places - camera.eye[[0, 2]]
    return np.arctan2(away[..., 0], away[..., 1])


def _corners(lens: Intrinsics) -> FloatArray:
    right, low = lens.width - 0.5, lens.height - 0.5
    return np.array([(-0.5, -0.5), (right, -0.5), (right, low), (-0.5, low)])


def _warped(matrix: FloatArray, pixels: FloatArray) -> FloatArray:
    place = np.column_stack([pixels, np.ones(len(pixels))]) @ matrix.T
    with np.errstate(divide="ignore", invalid="ignore"):
        warped: FloatArray = np.where(place[:, 2:] > 1e-9, place[:, :2] / place[:, 2:], np.inf)
    return warped
