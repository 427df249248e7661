"""The pixel observation: the table from above as a small plain picture."""

from __future__ import annotations

import cv2
import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import SKIN, VIEW, Colour, Image, category_colour, label_colours
from farm_ar.drawing.game.sprites import SHIFT, fixed_point
from farm_ar.drawing.game.viewport import viewport_on
from farm_ar.game_logic.physics.gripper import HAND_RADIUS
from farm_ar.game_logic.render_state import RenderState
from farm_ar.geometry import footprint_corners, view_polygon
from farm_ar.scenes import Camera, Layout, Scene

TABLE: Colour = (58, 92, 52)
FLOOR: Colour = (28, 30, 34)
MARK: Colour = (24, 20, 18)

_ARC_POINTS = 12


class PixelObservation:
    """Draws states of a game without text: buildings by category, headings, view, hand, believed labels.

    The table fills the picture; equal states give equal bytes.

    Args:
        scene: the table.
        size: width and height of the pictures, pixels.
    """

    def __init__(self, scene: Scene, size: tuple[int, int] = (144, 96)) -> None:
        width, height = size
        self.scene, self.size = scene, size
        self.viewport = viewport_on(scene.size, width, height, rim=False)
        self._background = np.empty((height, width, 3), np.uint8)
        self._background[:] = FLOOR
        corners = self.viewport.pixels(np.array([(0.0, 0.0), scene.size]))
        (left, bottom), (right, top) = np.rint(corners).astype(int).tolist()
        self._background[top:bottom, left:right] = TABLE
        categories = scene.layout.categories
        self._paint = [category_colour(name, categories) for name in scene.layout.category]
        self._colours = label_colours(scene.layout.labels)

    def draw(self, state: RenderState, beliefs: bool) -> Image:
        """The picture of a state, (H, W, 3) red, green, blue.

        Args:
            state: of this drawer's scene.
            beliefs: whether the outline of each label is drawn, in its colour, where the game believes it.
        """
        image = self._background.copy()
        self._draw_view(image, state.camera)
        self._draw_things(image, state.truth)
        if beliefs:
            self._draw_beliefs(image, state.believed)
        if state.hand is not None:
            x, y = self.viewport.pixels(state.hand.position).tolist()
            radius = HAND_RADIUS * self.viewport.scale * (1 << SHIFT)
            centre = fixed_point(np.array([x, y])).tolist()
            thickness = 1 if state.hand.raised else -1
            cv2.circle(image, centre, round(radius), SKIN, thickness, cv2.LINE_AA, SHIFT)
        return image

    def _draw_view(self, image: Image, camera: Camera) -> None:
        fov = camera.fov
        reach = min(fov.range_m, 4.0 * self.scene.diagonal)
        wedge = view_polygon(camera.position, float(camera.yaw), fov.left, fov.right, reach, _ARC_POINTS)
        corners = [fixed_point(self.viewport.pixels(wedge))]
        cv2.polylines(image, corners, True, VIEW, 1, cv2.LINE_AA, SHIFT)

    def _draw_things(self, image: Image, layout: Layout) -> None:
        corners = footprint_corners(layout.position, layout.yaw, layout.size)
        front, back = corners[:, :2].mean(axis=1), corners[:, 2:].mean(axis=1)
        side = 0.30 * (corners[:, 0] - corners[:, 1])
        base = front + 0.42 * (back - front)
        marks = fixed_point(self.viewport.pixels(np.stack([front, base + side, base - side], axis=1)))
        footprints = fixed_point(self.viewport.pixels(corners))
        for i in _large_first(layout.size):
            cv2.fillConvexPoly(image, footprints[i], self._paint[i], cv2.LINE_AA, SHIFT)
            cv2.fillConvexPoly(image, marks[i], MARK, cv2.LINE_AA, SHIFT)

    def _draw_beliefs(self, image: Image, layout: Layout) -> None:
        corners = footprint_corners(layout.position, layout.yaw, layout.size)
        outlines = fixed_point(self.viewport.pixels(corners))
        for i in np.flatnonzero(layout.movable).tolist():
            cv2.polylines(image, [outlines[i]], True, self._colours[i], 1, cv2.LINE_AA, SHIFT)


def _large_first(size: FloatArray) -> list[int]:
    order: list[int] = np.argsort(-size[:, 0] * size[:, 2], kind="stable").tolist()
    return order
