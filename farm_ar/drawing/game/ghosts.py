"""Ghosts through the headset: boxes of glass where a label is believed and its object is not."""

from __future__ import annotations

import numpy as np

from farm_ar.drawing.game.colours import Colour, Image, darker
from farm_ar.drawing.game.marks import displaced
from farm_ar.drawing.game.overlays import outline, tint_area
from farm_ar.drawing.game.pinhole import Pinhole
from farm_ar.game_logic.moment import Moment
from farm_ar.geometry import footprint_corners

_GLASS = 0.22
_FARTHEST_PX = 4000.0


def draw_ghosts(image: Image, moment: Moment, view: Pinhole, colours: tuple[Colour, ...]) -> None:
    """Outline every object that is not where its label is believed to be, in the label's colour, there.

    Args:
        image: to draw on.
        moment: what is true and what is believed; whether a label is wrong does not show.
        view: the camera.
        colours: of the labels.
    """
    believed = moment.believed
    index = np.flatnonzero(displaced(moment))
    if not len(index):
        return
    thick = max(1, round(1.1 * image.shape[0] / 480))
    corners = footprint_corners(believed.position, believed.yaw, believed.size)
    for i in index:
        foot = np.insert(corners[i], 1, believed.elevation[i], axis=1)
        roof = foot + np.array([0.0, believed.size[i, 1], 0.0])
        walls = [np.stack([foot[k], foot[k - 1], roof[k - 1], roof[k]]) for k in range(4)]
        seen = [np.clip(view.polygon(side), -_FARTHEST_PX, _FARTHEST_PX) for side in (foot, roof, *walls)]
        seen = [polygon for polygon in seen if len(polygon) > 2]
        for polygon in seen[:1]:
            tint_area(image, polygon, colours[i], _GLASS)
        for tone, width in ((darker(colours[i], 0.6), thick + 1), (colours[i], thick)):
            for polygon in seen:
                outline(image, polygon, tone, width)
