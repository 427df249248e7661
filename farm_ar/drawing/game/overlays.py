"""Overlays: translucent areas, dashed lines, ice."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import ICE, Colour, Image
from farm_ar.drawing.game.pixels import cover, mix_area
from farm_ar.drawing.game.shapes import Art, Part, ellipse, polygon, stroke
from farm_ar.drawing.game.sprites import SHIFT, fixed_point

_CLEAR = 0.70
"""How much is still seen through clear ice."""

_PALE_ICE = np.array([150.0, 190.0, 235.0])
_FROST = np.array([236.0, 246.0, 255.0])


def tint_area(image: Image, points: FloatArray, colour: Colour, part: float) -> None:
    """Mix a colour into a polygon of a picture.

    Args:
        image: to draw on.
        points: (V, 2) corners, pixels; they may lie outside.
        colour: to mix in.
        part: how much of it, 0 to 1.
    """
    mix_area(image, np.asarray(points, dtype=np.float64), *colour, round(256 * part))


def outline(image: Image, points: FloatArray, colour: Colour, thickness: int, closed: bool = True) -> None:
    """A smooth line through points (V, 2), pixels."""
    cv2.polylines(image, [fixed_point(points)], closed, colour, thickness, cv2.LINE_AA, SHIFT)


def dashed_line(
    image: Image, start: FloatArray, end: FloatArray, colour: Colour, thickness: int, dash: float
) -> None:
    """A dashed line between two points (2,), pixels, its dashes about `dash` long."""
    length = float(np.hypot(*(end - start)))
    count = max(1, round(length / (2 * dash)))
    begin = np.arange(count) / count
    share = np.stack([begin, begin + 0.55 / count], axis=1)[..., None]
    segments = fixed_point(start + share * (end - start))
    cv2.polylines(image, list(segments), False, colour, thickness, cv2.LINE_AA, SHIFT)


def freeze(image: Image) -> None:
    """Cover a picture with ice: paler and bluer, with frost at its edges."""
    cover(image, *_ice(image.shape[1], image.shape[0]))


@lru_cache(maxsize=8)
def _ice(width: int, height: int) -> tuple[Image, Image]:
    """What is kept of a picture, in 256ths, and what is added: white crystals that grow from its edges."""
    rng = np.random.default_rng(11)
    x, y = np.arange(width)[None], np.arange(height)[:, None]
    inward = np.minimum(np.minimum(x, width - 1 - x), np.minimum(y, height - 1 - y)) / (0.075 * height)
    coarse = cv2.resize(rng.uniform(size=(24, 32)), (width, height), interpolation=cv2.INTER_CUBIC)
    fine = cv2.resize(rng.uniform(size=(96, 128)), (width, height), interpolation=cv2.INTER_CUBIC)
    crystal = np.clip(1.0 - inward + 0.7 * (coarse - 0.5) + 0.35 * (fine - 0.5), 0, 1) ** 1.5
    frost = 0.80 * crystal[..., None]
    kept = np.broadcast_to(_CLEAR * (1 - frost), (height, width, 3))
    added = (1 - _CLEAR) * _PALE_ICE * (1 - frost) + frost * _FROST
    return np.rint(256 * kept).astype(np.uint8), np.floor(added).astype(np.uint8)


@lru_cache(maxsize=4)
def ice_block(radius: float, height: float = 0.0) -> Art:
    """Clear ice around an animal, `radius` metres, its middle `height` above the foot of the drawing."""
    body = ellipse(0.0, height, radius, radius, ICE)
    rim = np.vstack([body.points, body.points[:1]])
    glint = [(-0.55 * radius, height + 0.25 * radius), (-0.2 * radius, height + 0.62 * radius)]
    clear = Part(body.points, ICE, 0.0, 84)
    return Art(
        (clear, stroke(rim, (226, 242, 255), 0.12 * radius), stroke(glint, (255, 255, 255), 0.16 * radius))
    )


@lru_cache(maxsize=4)
def snowflake(colour: Colour) -> Art:
    """A snowflake one unit across."""
    arms: list[Part] = []
    for k in range(6):
        turn = np.pi * k / 3
        axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        arms.append(stroke(np.array([(0.0, 0.0), (0.0, 0.5)]) @ axes, colour, 0.09))
        arms.append(stroke(np.array([(-0.14, 0.44), (0.0, 0.28), (0.14, 0.44)]) @ axes, colour, 0.08))
    return Art(tuple(arms))


@lru_cache(maxsize=4)
def play_mark(colour: Colour) -> Art:
    """A triangle that says that the game runs, one unit high."""
    return Art((polygon([(-0.34, -0.42), (0.44, 0.0), (-0.34, 0.42)], colour),))
