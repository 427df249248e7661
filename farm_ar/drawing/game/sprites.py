"""Drawings as small pictures, made once and pasted many times."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import Colour, Image
from farm_ar.drawing.game.pixels import paste
from farm_ar.drawing.game.shapes import Art, Part

SHIFT = 4
"""Binary places of the coordinates that OpenCV is given."""

_SHADOW = 64

_FINER = 4  # sprites are drawn so many times larger, then averaged

PHASES = 2
"""Positions of a drawing between two pixels, across and down."""


class Sprite(NamedTuple):
    """A small picture with transparency.

    Args:
        pixels: (h, w, 4) red, green, blue, each multiplied by the opacity, and the opacity.
        left: its left edge, in pixels from the point that it belongs to.
        top: its upper edge, likewise, downwards.
    """

    pixels: npt.NDArray[np.uint8]
    left: int
    top: int


def fixed_point(pixels: FloatArray) -> npt.NDArray[np.int32]:
    """Coordinates in pixels, (..., 2), as OpenCV wants them with `SHIFT`."""
    return np.rint((pixels - 0.5) * (1 << SHIFT)).astype(np.int32, order="C")


def sprite_of(draw: Callable[[Image], None], width: int, height: int) -> Sprite:
    """What a function draws on a picture of that size, as a sprite that belongs to its upper left corner.

    It is drawn on black and on white: where the two differ, the picture below is seen.
    """
    black = np.zeros((height, width, 3), np.uint8)
    white = np.full((height, width, 3), 255, np.uint8)
    draw(black)
    draw(white)
    opacity = (255 - (white.astype(np.int64) - black)).clip(0, 255).max(axis=2)
    rows, columns = (np.flatnonzero(opacity.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return Sprite(np.zeros((1, 1, 4), np.uint8), 0, 0)
    part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    pixels = np.ascontiguousarray(np.dstack([black, opacity])[part], dtype=np.uint8)
    return Sprite(pixels, int(columns[0]), int(rows[0]))


def paste_art(
    image: Image, art: Art, x: float, y: float, scale: float, yaw: float = 0.0, step: float = 7.5
) -> None:
    """Draw onto a picture.

    Args:
        image: to draw on.
        art: what to draw.
        x: where its middle goes, pixels from the left.
        y: the same, from the top.
        scale: pixels a metre.
        yaw: its heading, radians, clockwise from up the page.
        step: degrees to which the heading is rounded.
    """
    heading = round(np.rad2deg(yaw) / step) * step % 360.0
    column, row = int(np.floor(x)), int(np.floor(y))
    sprite = rendered(art, scale, heading, int((x - column) * PHASES), int((y - row) * PHASES))
    paste(image, sprite.pixels, column + sprite.left, row + sprite.top)


@lru_cache(maxsize=4096)
def rendered(art: Art, scale: float, heading: float, phase_x: int, phase_y: int) -> Sprite:
    """A drawing at a scale, a heading in degrees and a place within the pixel, in halves."""
    canvas, left, top = _finer(art, scale, heading)
    height, width = (side // _FINER - 1 for side in canvas.shape[:2])
    down, right = (_FINER - phase * (_FINER // PHASES) for phase in (phase_y, phase_x))
    shifted = canvas[down : down + height * _FINER, right : right + width * _FINER]
    pixels = cv2.resize(shifted, (width, height), interpolation=cv2.INTER_AREA)
    return Sprite(np.ascontiguousarray(pixels, dtype=np.uint8), left, top)


@lru_cache(maxsize=1024)
def _finer(art: Art, scale: float, heading: float) -> tuple[npt.NDArray[np.uint8], int, int]:
    """A drawing several times larger, in the first of its places, with a free pixel before it; left, top."""
    turn = np.deg2rad(heading)
    # Ahead is up the page, where rows fall.
    to_page = scale * np.array([[np.cos(turn), np.sin(turn)], [np.sin(turn), -np.cos(turn)]])
    placed = [(part.points @ to_page.T + 0.5 / PHASES, part) for part in art.parts]
    every = np.concatenate([points for points, _ in placed])
    widest = max(part.width for part in art.parts)
    reach = scale * (widest / 2 + art.outline + art.shadow) + 1.5
    low = np.floor(every.min(axis=0) - reach).astype(int)
    width, height = (np.ceil(every.max(axis=0) + 1.0 + reach) - low).astype(int) + 1
    canvas = np.zeros((height * _FINER, width * _FINER, 4), np.uint8)
    outlines = [((points - low + 1) * _FINER, part) for points, part in placed]
    if art.shadow:
        fall = art.shadow * scale * _FINER * np.array([0.8, 0.6])
        for points, part in outlines:
            _draw(canvas, points + fall, part, (0, 0, 0), _SHADOW, scale, 0.0)
    if art.outline:
        for points, part in outlines:
            _draw(canvas, points, part, art.ink, 255, scale, art.outline)
    for points, part in outlines:
        _draw(canvas, points, part, part.colour, part.alpha, scale, 0.0)
    return canvas, int(low[0]), int(low[1])


def _draw(
    canvas: npt.NDArray[np.uint8],
    points: FloatArray,
    part: Part,
    colour: Colour,
    alpha: int,
    scale: float,
    swell: float,
) -> None:
    """Fill a part on the finer canvas, made wider by `swell` metres all round."""
    value = (*(channel * alpha // 255 for channel in colour), alpha)
    corners = [fixed_point(points)]
    if part.width:
        thickness = max(1, round((part.width + 2 * swell) * scale * _FINER))
        cv2.polylines(canvas, corners, False, value, thickness, cv2.LINE_8, SHIFT)
        return
    cv2.fillPoly(canvas, corners, value, cv2.LINE_8, SHIFT)
    if swell:
        thickness = max(1, round(2 * swell * scale * _FINER))
        cv2.polylines(canvas, corners, True, value, thickness, cv2.LINE_8, SHIFT)
