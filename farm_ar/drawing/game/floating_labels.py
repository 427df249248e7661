"""The labels that float above the buildings in the headset: in their colours, none over another."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import INK, WRONG, Colour, Image, lighter, luminance
from farm_ar.drawing.game.label_placement import box_text
from farm_ar.drawing.game.pinhole import Pinhole
from farm_ar.drawing.game.pixels import paste
from farm_ar.drawing.game.sprites import Sprite
from farm_ar.drawing.game.text import BOLD, text_sprite
from farm_ar.game_logic.render_state import RenderState
from farm_ar.geometry import direction
from farm_ar.scenes import Camera, Layout

_LETTER_PX = 13
"""Height of the letters in a picture 480 high."""

_LIFT_PX = 20.0
"""How high labels float above their roofs, in a picture 480 high: the buildings behind stay in sight."""

_LIGHT_ENOUGH = 0.74
_GLASS: Colour = (22, 24, 30)
_GLASS_ALPHA, _FRAME_ALPHA = 0.62, 0.9

_APPROACH_PX, _GLIDE_PX = 24.0, 160.0
"""How near labels come to each other sideways before one begins to rise, and how far, pixels."""

_ORDER_STEP = np.deg2rad(30.0)


class FloatingLabels:
    """Writes each label above where the game believes it, if that is in the picture.

    Args:
        colours: of the labels.
        top: rows at the top of the picture to keep free.
    """

    def __init__(self, colours: tuple[Colour, ...], top: int) -> None:
        self._bright = [brightened(colour) for colour in colours]
        self._top = top
        self._seen: tuple[Camera, Layout, tuple[int, ...], list[int], FloatArray] | None = None

    def draw(self, image: Image, state: RenderState, view: Pinhole, truth: bool = False) -> None:
        """Write the labels.

        Args:
            image: to draw on.
            state: what is believed, and the counters.
            view: the camera.
            truth: whether those on the wrong object are framed in red.
        """
        unit = image.shape[0] / 480
        letter = max(9, round(_LETTER_PX * unit))
        index, roof = self._in_picture(state, view, image.shape)
        tags = [label_sprite(box_text(state, i), self._bright[i], letter) for i in index]
        half = np.array([tag.pixels.shape[1] / 2 for tag in tags])
        middle = np.clip(roof[:, 0], half, np.maximum(image.shape[1] - half, half))
        line = float(label_sprite("", INK, letter).pixels.shape[0] + 1)
        base = stack(middle, half, roof[:, 1] - _LIFT_PX * unit, line, self._top + line, image.shape[0] - 4.0)
        written = [k for k in range(len(index)) if not np.isnan(base[k])]
        begins = np.rint(np.stack([middle, np.nan_to_num(base)], axis=1)).astype(int).tolist()
        ends = np.rint(roof).astype(int).tolist()
        thick, thin = max(2, round(2.6 * unit)), max(1, round(1.2 * unit))
        for k in written:
            cv2.line(image, begins[k], ends[k], INK, thick, cv2.LINE_AA)
            cv2.line(image, begins[k], ends[k], self._bright[index[k]], thin, cv2.LINE_AA)
        for k in written:
            pixels = tags[k].pixels
            left, top = begins[k][0] - pixels.shape[1] // 2, begins[k][1] + tags[k].top
            paste(image, pixels, left, top)
            if truth and state.wrong[index[k]]:
                right, low = left + pixels.shape[1] - 1, top + pixels.shape[0] - 1
                cv2.rectangle(
                    image, (left - 1, top - 1), (right + 1, low + 1), WRONG, max(2, round(2.4 * unit))
                )

    def _in_picture(
        self, state: RenderState, view: Pinhole, shape: tuple[int, ...]
    ) -> tuple[list[int], FloatArray]:
        """As `_in_picture`, and kept for as long as neither the head nor the belief changes."""
        seen = self._seen
        if seen is None or seen[0] is not state.camera or seen[1] is not state.believed or seen[2] != shape:
            found = _in_picture(state, view, shape[1], shape[0])
            self._seen = seen = state.camera, state.believed, shape, *found
        return seen[3], seen[4]


def stack(
    middle: FloatArray, half: FloatArray, base: FloatArray, line: float, highest: float, lowest: float
) -> FloatArray:
    """Raise lines of text until none covers another.

    Each is raised above all earlier ones that it would cover. It begins to rise before the two touch, so that
    labels glide, not jump, when the head moves. One for which there is no room above goes below the others,
    and is left out if there is none there either.

    Args:
        middle: (L,) columns of their middles, those of the nearest labels first.
        half: (L,) half their widths.
        base: (L,) rows where they would stand.
        line: height of a line.
        highest: the least row.
        lowest: the largest row.

    Returns:
        (L,) rows where they stand, NaN for those left out.
    """
    rows: list[float] = []
    placed: list[tuple[float, float, float]] = []
    # So few are written in loops: arrays would take longer.
    for x, reach, wanted in zip(middle.tolist(), half.tolist(), base.tolist(), strict=True):
        free = []
        for other, width, row in placed:
            closeness = min(1 - (abs(other - x) - width - reach) / _APPROACH_PX, 1.0)
            if closeness > 0:
                free.append((row, (1 - closeness) * _GLIDE_PX - line))
        start = min(max(wanted, highest), lowest)
        row = min([start, *(other + room for other, room in free)])
        if row < highest:
            row = max([start, *(other - room for other, room in free)])
        if row <= lowest:
            placed.append((x, reach, row))
        rows.append(row if row <= lowest else np.nan)
    return np.array(rows)


def _in_picture(state: RenderState, view: Pinhole, width: int, height: int) -> tuple[list[int], FloatArray]:
    """The labels believed to be in the picture, the nearest first, and (L, 2) pixels of their roofs."""
    layout = state.believed
    top = np.insert(layout.position, 1, layout.elevation + layout.size[:, 1], axis=1)
    frame = view.frame(top)
    pixels = view.pixels(frame)
    near = np.linalg.norm(layout.position - state.camera.position, axis=1) <= state.camera.fov.range_m
    inside = near & ((pixels >= 0) & (pixels <= [width, height + 30])).all(axis=1) & (frame[:, 2] > 0.05)
    index = np.flatnonzero(inside & layout.movable)
    # The order must not change with every small turn of the head.
    ahead = direction(np.rint(view.yaw / _ORDER_STEP) * _ORDER_STEP)
    index = index[np.argsort(layout.position[index] @ ahead, kind="stable")]
    return [int(i) for i in index], pixels[index]


@lru_cache(maxsize=512)
def label_sprite(text: str, colour: Colour, letter: int) -> Sprite:
    """A line of text with a thin frame on dark glass; the point that it belongs to is on the base line."""
    words = text_sprite(text, letter, colour, BOLD, halo=_GLASS)
    inside = round(0.34 * letter)
    height = round(1.42 * letter)
    width = words.pixels.shape[1] + 2 * inside
    canvas = _glass(width, height, colour).copy()
    top = (height - words.pixels.shape[0] + round(0.34 * letter)) // 2
    low, rows = max(top, 0), min(height - max(top, 0), words.pixels.shape[0] - max(-top, 0))
    ink = words.pixels[max(-top, 0) :][:rows].astype(np.float64)
    spot = canvas[low : low + rows, inside : width - inside]
    canvas[low : low + rows, inside : width - inside] = ink + spot * (1 - ink[..., 3:] / 255)
    pixels = np.ascontiguousarray(np.rint(np.clip(canvas, 0, 255)), dtype=np.uint8)
    return Sprite(pixels, 0, -round(0.72 * letter + (height - 0.72 * letter) / 2))


@lru_cache(maxsize=256)
def _glass(width: int, height: int, colour: Colour) -> FloatArray:
    """(height, width, 4) dark glass in a thin frame."""
    frame = _rounded(width, height, 0.0)[..., None]
    glass = _rounded(width, height, 1.0)[..., None]
    tinted = frame * np.array([*colour, 255.0]) * _FRAME_ALPHA
    dark: FloatArray = glass * np.array([*_GLASS, 255.0]) * _GLASS_ALPHA
    dark += tinted * (1 - glass)
    return dark


def _rounded(width: int, height: int, margin: float) -> FloatArray:
    """(height, width) how much of each pixel is in a box with round ends, `margin` pixels from the edges."""
    finer = 4
    mask = np.zeros((height * finer, width * finer))
    radius = round((height / 2 - margin) * finer)
    middle, left = height * finer // 2, radius + round(margin * finer)
    ends = (left, middle), (width * finer - left - 1, middle)
    cv2.line(mask, *ends, 1.0, 2 * radius)
    smooth: FloatArray = cv2.resize(mask, (width, height), interpolation=cv2.INTER_AREA).astype(np.float64)
    return smooth


def brightened(colour: Colour) -> Colour:
    """A label's colour, light enough to be read in dark outlines."""
    return lighter(colour, max(0.0, _LIGHT_ENOUGH - luminance(colour)))
