"""The table top and the floor around it, from above, without anything that moves."""

from __future__ import annotations

import cv2
import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import Colour, Image, darker, lighter
from farm_ar.game_logic.counters import ANIMALS
from farm_ar.scenes import Scene

FLOOR: Colour = (74, 80, 92)
WALL: Colour = (104, 112, 126)
EDGE: Colour = (164, 118, 74)
MEADOW: Colour = (134, 182, 92)
ROOM: Colour = (226, 220, 208)


def is_farm(scene: Scene) -> bool:
    """Whether the scene is one of the game's, with coops or hutches."""
    return any(category in ANIMALS for category in scene.layout.categories)


def table_top(scene: Scene, width: int, height: int) -> Image:
    """(height, width, 3) the top of the table: a meadow, or in other rooms a plain floor with a grid."""
    return _meadow(width, height) if is_farm(scene) else _plain_floor(scene, width, height)


def _meadow(width: int, height: int) -> Image:
    """Grass with softly mown stripes, lighter and darker patches, and fine blades."""
    rng = np.random.default_rng(7)
    patches = cv2.resize(rng.normal(size=(7, 10)), (width, height), interpolation=cv2.INTER_CUBIC)
    blades = cv2.GaussianBlur(rng.normal(size=(height, width)), (3, 3), 0.7)
    stripe = np.sign(np.sin(np.linspace(0, 9 * np.pi, width)))[None]
    shade = 1 + 0.035 * patches + 0.035 * blades + 0.016 * stripe
    return _painted(shade, MEADOW)


def _plain_floor(scene: Scene, width: int, height: int) -> Image:
    """A light floor with a line every metre."""
    top = np.empty((height, width, 3), np.uint8)
    top[:] = ROOM
    line = darker(ROOM, 0.07)
    for x in np.arange(1.0, scene.size[0]):
        cv2.line(top, (round(x / scene.size[0] * width), 0), (round(x / scene.size[0] * width), height), line)
    for z in np.arange(1.0, scene.size[1]):
        row = height - round(z / scene.size[1] * height)
        cv2.line(top, (0, row), (width, row), line)
    return top


def floor(width: int, height: int) -> Image:
    """(height, width, 3) the floor around the table, a little darker towards the corners."""
    x, y = np.linspace(-1, 1, width)[None], np.linspace(-1, 1, height)[:, None]
    light = 1.10 - 0.16 * (x**2 + y**2)
    return _painted(light, FLOOR)


def _painted(light: FloatArray, colour: Colour) -> Image:
    """(H, W, 3) a colour under light (H, W), 1 for the colour as it is."""
    return np.asarray(np.clip(light[..., None] * np.array(colour), 0, 255), dtype=np.uint8)


def draw_rim(image: Image, left: int, top: int, right: int, bottom: int, width: int) -> None:
    """The edge of the table around a rectangle of pixels, with a shadow on the floor."""
    shadow = image.copy()
    cv2.rectangle(
        shadow, (left - width + 4, top - width + 5), (right + width + 4, bottom + width + 5), (18, 20, 26), -1
    )
    soft = cv2.GaussianBlur(shadow, (0, 0), 3.0)
    np.copyto(image, cv2.addWeighted(image, 0.35, soft, 0.65, 0))
    cv2.rectangle(image, (left - width, top - width), (right + width - 1, bottom + width - 1), EDGE, -1)
    cv2.rectangle(
        image, (left - width, top - width), (right + width - 1, bottom + width - 1), darker(EDGE, 0.45), 1
    )
    cv2.rectangle(image, (left - 1, top - 1), (right, bottom), lighter(EDGE, 0.3), 1)
