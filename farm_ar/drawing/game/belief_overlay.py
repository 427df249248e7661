"""The belief overlay of the headset's view: glass boxes where a label is believed and its object is not."""

from __future__ import annotations

import cv2
import numpy as np

from farm_ar.drawing.game.colours import Colour, Image, darker
from farm_ar.drawing.game.marks import displaced
from farm_ar.drawing.game.overlays import tint_area
from farm_ar.drawing.game.pinhole import Pinhole, before_camera
from farm_ar.drawing.game.sprites import SHIFT, fixed_point
from farm_ar.game_logic.render_state import RenderState
from farm_ar.geometry import footprint_corners

_GLASS = 0.22
_FARTHEST_PX = 4000.0


def draw_belief_overlay(image: Image, state: RenderState, view: Pinhole, colours: tuple[Colour, ...]) -> None:
    """Outline every object that is not where its label is believed to be, in the label's colour, there.

    Args:
        image: to draw on.
        state: what is true and what is believed; whether a label is wrong does not show.
        view: the camera.
        colours: of the labels.
    """
    believed = state.believed
    index = np.flatnonzero(displaced(state))
    if not len(index):
        return
    thick = max(1, round(1.1 * image.shape[0] / 480))
    feet = np.insert(
        footprint_corners(believed.position, believed.yaw, believed.size)[index],
        1,
        believed.elevation[index, None],
        axis=2,
    )
    roofs = feet + believed.size[index, None, 1, None] * np.array([0.0, 1.0, 0.0])
    for i, foot, roof in zip(index, view.frame(feet), view.frame(roofs), strict=True):
        walls = [np.stack([foot[k], foot[k - 1], roof[k - 1], roof[k]]) for k in range(4)]
        seen = [
            np.clip(view.pixels(before_camera(side)), -_FARTHEST_PX, _FARTHEST_PX)
            for side in (foot, roof, *walls)
        ]
        if len(seen[0]) > 2:
            tint_area(image, seen[0], colours[i], _GLASS)
        lines = [fixed_point(polygon) for polygon in seen if len(polygon) > 2]
        for tone, width in ((darker(colours[i], 0.6), thick + 1), (colours[i], thick)):
            cv2.polylines(image, lines, True, tone, width, cv2.LINE_AA, SHIFT)
