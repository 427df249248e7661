"""An image with what was found in it: outlines of the objects, their labels, confidences."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import INK, Colour, Image
from farm_ar.drawing.game.floating_labels import brightened, label_sprite, stack
from farm_ar.drawing.game.pixels import paste
from farm_ar.rendering import Instance, Mesh, Renderer, View

_LETTER_PX, _LIFT_PX = 13, 14.0
"""Of labels in an image 360 high."""


def draw_on_image(
    image: Image,
    view: View,
    things: Sequence[tuple[Mesh, FloatArray, float]],
    texts: Sequence[str],
    colours: Sequence[Colour],
) -> Image:
    """The image with an outline around each thing and a line of text above it.

    Args:
        image: (H, W, 3).
        view: its camera.
        things: of each the mesh, (2,) where it stands, metres, and its heading, radians.
        texts: of each.
        colours: of each.

    Returns:
        A new image. A thing of which the image shows nothing has no text either.
    """
    drawn, unit = image.copy(), image.shape[0] / 360
    placed = [
        Instance(mesh, np.array([place[0], 0.0, place[1]]), yaw, number)
        for number, (mesh, place, yaw) in enumerate(things)
    ]
    ids = Renderer(placed).ids(view)[1]
    bright = [brightened(colour) for colour in colours]
    seen = [number for number in range(len(placed)) if (ids == number).any()]
    roofs = {}
    for number in seen:
        mask = np.asarray(ids == number, dtype=np.uint8)
        outline = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
        for tone, thick in ((INK, round(3 * unit)), (bright[number], max(1, round(1.4 * unit)))):
            cv2.drawContours(drawn, outline, -1, tone, thick, cv2.LINE_AA)
        columns = np.flatnonzero(mask.any(axis=0))
        roofs[number] = float(columns.mean()), float(np.flatnonzero(mask.any(axis=1))[0])
    seen.sort(key=lambda number: -roofs[number][1])  # the nearest, which are lowest, first
    letter = max(9, round(_LETTER_PX * unit))
    tags = [label_sprite(texts[number], bright[number], letter) for number in seen]
    if not tags:
        return drawn
    half = np.array([tag.pixels.shape[1] / 2 for tag in tags])
    roof = np.array([roofs[number] for number in seen])
    middle = np.clip(roof[:, 0], half, np.maximum(image.shape[1] - half, half))
    line = float(tags[0].pixels.shape[0] + 1)
    base = stack(middle, half, roof[:, 1] - _LIFT_PX * unit, line, line, image.shape[0] - 4.0)
    written = np.flatnonzero(~np.isnan(base))
    for k in written:
        ends = (
            (round(float(middle[k])), round(float(base[k]))),
            tuple(np.rint(roof[k]).astype(int).tolist()),
        )
        for tone, thick in ((INK, round(2.6 * unit)), (bright[seen[k]], max(1, round(1.2 * unit)))):
            cv2.line(drawn, *ends, tone, max(1, thick), cv2.LINE_AA)
    for k in written:
        tag, wide = tags[k], tags[k].pixels.shape[1]
        paste(drawn, tag.pixels, round(float(middle[k])) - wide // 2, round(float(base[k])) + tag.top)
    return drawn
