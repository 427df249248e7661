"""Solids and upright drawings as a pinhole camera sees them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.drawing.game.colours import Colour, Image
from farm_ar.drawing.game.pinhole import NEAR_M, Pinhole, before_camera
from farm_ar.drawing.game.pixels import Distances
from farm_ar.drawing.game.solids import Solid, light_on
from farm_ar.drawing.game.sprites import SHIFT, fixed_point

_STEP = np.log(1.03)
"""Sizes of what stands upright are rounded to steps of 3%."""

_TOO_NEAR_M = 0.05
_LEAST_SCALE = 20.0
_FARTHEST_PX = 4000.0
_MARGIN_PX = 200.0


def fill(image: Image, pixels: FloatArray, colour: Colour) -> None:
    """Fill a polygon (V, 2), pixels; one without area is left out."""
    if len(pixels) > 2:
        corners = fixed_point(np.clip(pixels, -_FARTHEST_PX, _FARTHEST_PX))
        cv2.fillPoly(image, [corners], colour, cv2.LINE_AA, SHIFT)


@dataclass(frozen=True, eq=False)
class Block:
    """A solid in its place.

    Args:
        solid: what it is.
        yaw: its heading, radians.
        foot: (3,) the middle of its foot, metres.
        away: its distance from the eye along the line of sight, metres.
    """

    solid: Solid
    yaw: float
    foot: FloatArray
    away: float


def draw_solids(image: Image, away: Distances, view: Pinhole, blocks: Sequence[Block]) -> None:
    """Draw of solids those faces that face the eye.

    Args:
        image: to draw on.
        away: (H, W) to write into how far away what each pixel shows is.
        view: the camera.
        blocks: the farthest first.
    """
    if not blocks:
        return
    for block, frame, seen, tones in zip(blocks, *_transformed(view, blocks), strict=True):
        solid = block.solid
        whole = bool((frame[:, 2] >= NEAR_M).all())
        corners = _corners(view, frame) if whole else None
        for k, (begin, end) in enumerate(solid.ends):
            if not seen[solid.face[k]]:
                continue
            polygon = (
                _corners(view, before_camera(frame[begin:end])) if corners is None else corners[begin:end]
            )
            if len(polygon) < 3:
                continue
            cv2.fillPoly(image, [polygon], tones[k], cv2.LINE_AA, SHIFT)
            if k == 0 or solid.face[k] != solid.face[k - 1]:
                ink = [channel // 2 for channel in tones[k]]
                cv2.polylines(image, [polygon], True, ink, 1, cv2.LINE_AA, SHIFT)
                cv2.fillPoly(away, [polygon], block.away, cv2.LINE_8, SHIFT)


def _transformed(
    view: Pinhole, blocks: Sequence[Block]
) -> tuple[list[FloatArray], list[list[bool]], list[list[list[int]]]]:
    """Of each solid its points in the camera's axes, which faces are seen, the colours of its polygons."""
    solids = [block.solid for block in blocks]
    yaw, foot = np.array([block.yaw for block in blocks]), np.array([block.foot for block in blocks])
    of_point, of_face, of_colour = (
        np.repeat(np.arange(len(blocks)), [len(values) for values in parts])
        for parts in (
            [solid.points for solid in solids],
            [solid.normals for solid in solids],
            [solid.colours for solid in solids],
        )
    )
    points = _turned(np.concatenate([solid.points for solid in solids]), yaw[of_point]) + foot[of_point]
    normals = _turned(np.concatenate([solid.normals for solid in solids]), yaw[of_face])
    starts = _turned(np.concatenate([solid.starts for solid in solids]), yaw[of_face]) + foot[of_face]
    seen = ((view.eye - starts) * normals).sum(axis=1) > 0
    first_face = np.concatenate([[0], np.cumsum([len(solid.faces) for solid in solids])])
    face = np.concatenate([np.array(solid.face) for solid in solids]) + first_face[of_colour]
    light = light_on(normals)[face, None]
    tones = np.clip(np.concatenate([solid.colours for solid in solids]) * light, 0, 255).astype(int)
    ends = [np.flatnonzero(np.diff(owner)) + 1 for owner in (of_point, of_face, of_colour)]
    frames = np.split(view.frame(points), ends[0])
    return (
        frames,
        [part.tolist() for part in np.split(seen, ends[1])],
        [part.tolist() for part in np.split(tones, ends[2])],
    )


def _turned(vectors: FloatArray, yaw: FloatArray) -> FloatArray:
    """Vectors (P, 3) turned about the upright axis by (P,) radians, clockwise seen from above."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    x, y, z = vectors.T
    return np.stack([x * cosine + z * sine, y, z * cosine - x * sine], axis=1)


def _corners(view: Pinhole, frame: FloatArray) -> npt.NDArray[np.int32]:
    return fixed_point(np.clip(view.pixels(frame), -_FARTHEST_PX, _FARTHEST_PX))


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
