"""Solids and upright drawings as a pinhole camera sees them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.drawing.game.colours import Colour, Image
from farm_ar.drawing.game.pinhole import NEAR_M, Pinhole, before_camera
from farm_ar.drawing.game.solids import Solid, light_on
from farm_ar.drawing.game.sprites import SHIFT, Sprite, fixed_point

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
    """

    solid: Solid
    yaw: float
    foot: FloatArray


def solid_sprites(view: Pinhole, blocks: Sequence[Block], picture: tuple[int, int]) -> list[Sprite | None]:
    """What is seen of solids, each as a sprite that belongs to the picture's corner; None if nothing is.

    Args:
        view: the camera.
        blocks: what to draw.
        picture: its width and height, pixels.
    """
    if not blocks:
        return []
    parts = zip(blocks, *_transformed(view, blocks), strict=True)
    return [
        _solid_sprite(view, block.solid, frame, seen, tones, picture) for block, frame, seen, tones in parts
    ]


def _solid_sprite(
    view: Pinhole,
    solid: Solid,
    frame: FloatArray,
    seen: list[bool],
    tones: list[list[int]],
    picture: tuple[int, int],
) -> Sprite | None:
    """Those faces of a solid that face the eye, given its points (P, 3) in the camera's axes."""
    whole = bool((frame[:, 2] >= NEAR_M).all())
    pieces = [frame] if whole else [before_camera(frame[begin:end]) for begin, end in solid.ends]
    outlines = [view.pixels(piece) for piece in pieces]
    every = np.concatenate(outlines)
    if not len(every):
        return None
    low = np.clip(np.floor(every.min(axis=0)) - 2, 0, picture).astype(int)
    high = np.clip(np.ceil(every.max(axis=0)) + 2, 0, picture).astype(int)
    (left, top), (wide, tall) = low.tolist(), (high - low).tolist()
    if wide <= 0 or tall <= 0:
        return None
    canvas = np.zeros((tall, wide, 4), np.uint8)
    corners = [fixed_point(np.clip(points, -_FARTHEST_PX, _FARTHEST_PX) - low) for points in outlines]
    for k, (begin, end) in enumerate(solid.ends):
        polygon = corners[0][begin:end] if whole else corners[k]
        if not seen[solid.face[k]] or len(polygon) < 3:
            continue
        cv2.fillPoly(canvas, [polygon], [*tones[k], 255], cv2.LINE_AA, SHIFT)
        if k == 0 or solid.face[k] != solid.face[k - 1]:
            ink = [channel // 2 for channel in tones[k]]
            cv2.polylines(canvas, [polygon], True, [*ink, 255], 1, cv2.LINE_AA, SHIFT)
    return Sprite(canvas, left, top)


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
