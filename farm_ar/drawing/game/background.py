"""The background: a table's edges and shadow, the walls of a room, as a pinhole camera sees them."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game import ground
from farm_ar.drawing.game.colours import Image, darker, lighter
from farm_ar.drawing.game.perspective import fill
from farm_ar.drawing.game.pinhole import Pinhole

_BOARD_M = 0.03
"""Thickness of the table top."""

_RIM_M = 0.016
_TABLE_HEIGHT_M = 0.74
_WALL_M = 2.6


def draw_table_edges(image: Image, view: Pinhole, size: tuple[float, float]) -> None:
    """The wooden rim of a table and the edges of its top.

    Args:
        image: to draw on.
        view: the camera.
        size: width and depth of the table, metres.
    """
    top = _corners(size, _RIM_M)
    for k in range(4):
        side = top[[k, (k + 1) % 4]]
        wall = np.vstack([side, side[::-1] - np.array([0.0, _BOARD_M, 0.0])])
        fill(image, view.polygon(wall), darker(ground.EDGE, 0.35 if k == 0 else 0.5))
    fill(image, view.polygon(top), ground.EDGE)


def draw_table_shadow(image: Image, view: Pinhole, size: tuple[float, float]) -> None:
    """The shadow of a table on the floor under it."""
    shadow = _corners(size, 0.05) - np.array([0.0, _TABLE_HEIGHT_M, 0.0])
    fill(image, view.polygon(shadow), darker(ground.FLOOR, 0.28))


def draw_walls(image: Image, view: Pinhole, size: tuple[float, float]) -> None:
    """The walls of a room around the camera, those that face it."""
    foot = _corners(size, 0.0)
    for k in range(4):
        side = foot[[k, (k + 1) % 4]]
        along = side[1] - side[0]
        inwards = np.array([-along[2], 0.0, along[0]])
        if (view.eye - side[0]) @ inwards <= 0:
            continue
        wall = np.vstack([side, side[::-1] + np.array([0.0, _WALL_M, 0.0])])
        board = np.vstack([side, side[::-1] + np.array([0.0, 0.08, 0.0])])
        fill(image, view.polygon(wall), lighter(ground.WALL, 0.10 * (k % 2) + 0.30))
        fill(image, view.polygon(board), lighter(ground.WALL, 0.62))


def _corners(size: tuple[float, float], margin: float) -> FloatArray:
    """(4, 3) corners of a table or room, `margin` beyond its edges, from the near left, metres."""
    width, depth = size[0] + margin, size[1] + margin
    low = -margin
    return np.array([(low, 0.0, low), (width, 0.0, low), (width, 0.0, depth), (low, 0.0, depth)])
