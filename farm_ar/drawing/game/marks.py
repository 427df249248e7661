"""Marks over the table from above: the headset's view, and where belief and truth differ."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.drawing.game.colours import VIEW, WRONG, Colour, Image, darker
from farm_ar.drawing.game.overlays import dashed_line, outline, tint_area
from farm_ar.drawing.game.player import head
from farm_ar.drawing.game.sprites import paste_art
from farm_ar.drawing.game.viewport import Viewport
from farm_ar.game_logic.render_state import RenderState
from farm_ar.geometry import footprint_corners, view_polygon, wrap
from farm_ar.scenes import Camera

_FAR = 0.008
"""Distance from which belief and truth count as different, in diagonals of the table."""

_TURNED = np.deg2rad(8.0)
HEAD_RADIUS_M = 0.05
_LEAST_HEAD_PX = 9.0


class CameraMark:
    """Draws the field of view as a light wedge, and the player's head; one out of the picture looks in.

    Args:
        viewport: what the picture shows.
    """

    def __init__(self, viewport: Viewport) -> None:
        self._viewport = viewport
        self._wedge: tuple[Camera, FloatArray] | None = None

    def draw(self, image: Image, camera: Camera) -> None:
        """Draw the mark of a camera."""
        viewport, unit = self._viewport, self._viewport.height / 480
        if self._wedge is None or self._wedge[0] is not camera:
            self._wedge = camera, _wedge(camera, viewport)
        pixels = self._wedge[1]
        tint_area(image, pixels, VIEW, 0.17)
        outline(image, pixels, VIEW, max(1, round(1.4 * unit)))
        grown = max(1.0, _LEAST_HEAD_PX * unit / (HEAD_RADIUS_M * viewport.scale))
        x, y = np.clip(viewport.pixels(camera.position), 0, [viewport.width, viewport.height]).tolist()
        paste_art(image, head(), x, y, round(grown * viewport.scale, 3), float(camera.yaw), step=1.0)


def _wedge(camera: Camera, viewport: Viewport) -> FloatArray:
    """(V, 2) the field of view, pixels, as far as it can be in the picture."""
    fov = camera.fov
    edges = np.array([(x, y) for x in (0, viewport.width) for y in (0, viewport.height)], dtype=np.float64)
    farthest = float(np.linalg.norm(viewport.metres(edges) - camera.position, axis=1).max())
    reach = min(fov.range_m, 1.05 * farthest)
    return viewport.pixels(
        view_polygon(camera.position, float(camera.yaw), fov.left, fov.right, reach, arc_points=24)
    )


def draw_beliefs(image: Image, state: RenderState, viewport: Viewport, colours: tuple[Colour, ...]) -> None:
    """Outlines where a label is believed but its object is not, with a dashed line to where that is.

    Args:
        image: to draw on.
        state: what is true and what is believed.
        viewport: what the picture shows.
        colours: of the labels; what is wrong is red besides.
    """
    believed, truth = state.believed, state.truth
    unit = viewport.height / 480
    thick = max(1, round(1.3 * unit))
    corners = viewport.pixels(footprint_corners(believed.position, believed.yaw, believed.size))
    start, end = viewport.pixels(believed.position), viewport.pixels(truth.position)
    for i in np.flatnonzero(differs(state)):
        colour, dark = colours[i], darker(colours[i], 0.6)
        dashed_line(image, start[i], end[i], dark, thick + 2, 5 * unit)
        dashed_line(image, start[i], end[i], colour, thick, 5 * unit)
        tint_area(image, corners[i], colour, 0.34)
        outline(image, corners[i], dark, thick + 2)
        outline(image, corners[i], colour, thick)
    for i in np.flatnonzero(state.wrong):
        outline(image, corners[i], WRONG, thick + 1)


def differs(state: RenderState) -> BoolArray:
    """(N,) labels that are wrong, or whose object is not where it is believed to be."""
    return displaced(state) | state.wrong


def displaced(state: RenderState) -> BoolArray:
    """(N,) labels whose object is not where it is believed to be."""
    believed, truth = state.believed, state.truth
    apart = np.linalg.norm(believed.position - truth.position, axis=1)
    turned = np.abs(wrap(believed.yaw - truth.yaw))
    different: BoolArray = (apart > _FAR * state.scene.diagonal) | (turned > _TURNED)
    return different
