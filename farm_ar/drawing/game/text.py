"""Text in pictures: as masks and sprites, made once for every text."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.drawing.game.colours import Colour
from farm_ar.drawing.game.sprites import Sprite

# OpenCV 5 brings an outline font; older ones have strokes only.
_FONT = cv2.FontFace("sans") if hasattr(cv2, "FontFace") else None
_STROKES = cv2.FONT_HERSHEY_SIMPLEX

REGULAR, BOLD = 430, 640
"""How heavy letters are."""


@lru_cache(maxsize=4096)
def text_width(text: str, pixels: int, weight: int = REGULAR) -> int:
    """Width of a line of text with letters `pixels` high, pixels."""
    return int(_mask(text, pixels, weight).shape[1])


@lru_cache(maxsize=2048)
def text_sprite(
    text: str, pixels: int, colour: Colour, weight: int = REGULAR, halo: Colour | None = None
) -> Sprite:
    """A line of text; the point that it belongs to is its left end on the base line.

    Args:
        text: the words.
        pixels: height of the letters.
        colour: of the letters.
        weight: of the letters, `REGULAR` or `BOLD`.
        halo: colour of a line around every letter, none by default.
    """
    mask = _mask(text, pixels, weight)
    if halo is None:
        return Sprite(_inks(colour)[mask], 0, -_ascent(pixels))
    margin = max(2, round(pixels / 6))
    ink = np.pad(mask, margin).astype(np.float64) / 255
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * margin - 1, 2 * margin - 1))
    grown = cv2.GaussianBlur(cv2.dilate(ink, kernel), (3, 3), 0)
    around = np.clip(1.15 * np.asarray(grown), 0, 1)
    below = around * (1 - ink)
    rgb = ink[..., None] * np.array(colour) + below[..., None] * np.array(halo)
    pixels_out = np.dstack([rgb, 255 * (ink + below)])
    sprite = np.ascontiguousarray(np.rint(pixels_out), dtype=np.uint8)
    return Sprite(sprite, -margin, -margin - _ascent(pixels))


@lru_cache(maxsize=256)
def _inks(colour: Colour) -> npt.NDArray[np.uint8]:
    """(256, 4) what a pixel of a sprite is that is inked so much."""
    ink = np.arange(256)[:, None]
    return np.hstack([np.rint(ink / 255 * np.array(colour)), ink]).astype(np.uint8)


def _ascent(pixels: int) -> int:
    return round(1.05 * pixels)


@lru_cache(maxsize=4096)
def _mask(text: str, pixels: int, weight: int) -> npt.NDArray[np.uint8]:
    """(h, w) how much of each pixel is inked; the base line is `_ascent` below the upper edge."""
    ascent = _ascent(pixels)
    canvas = np.zeros((ascent + round(0.4 * pixels), pixels * (len(text) + 1)), np.uint8)
    if _FONT is not None:
        cv2.putText(canvas, text, (1, ascent), 255, _FONT, pixels, weight)
    else:
        scale, thickness = 0.033 * pixels, 2 if weight >= BOLD else 1
        cv2.putText(canvas, text, (1, ascent), _STROKES, scale, 255, thickness, cv2.LINE_AA)
    inked = np.flatnonzero(canvas.any(axis=0))
    end = int(inked[-1]) + 2 if inked.size else 1
    return np.ascontiguousarray(canvas[:, :end])
