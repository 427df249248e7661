"""Label placement: a box for each label in its colour, near what it names, none over another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import PAPER, WRONG, Colour, Image, darker, legible_on
from farm_ar.drawing.game.pixels import Bytes, paste
from farm_ar.drawing.game.sprites import Sprite
from farm_ar.drawing.game.text import BOLD, text_sprite, text_width
from farm_ar.drawing.labels import place_labels
from farm_ar.game_logic.counters import label_text
from farm_ar.game_logic.render_state import RenderState

_GAP = 2
"""Free pixels between boxes."""


@dataclass(frozen=True, eq=False)
class LabelPlacement:
    """Where the label boxes of a state lie.

    Args:
        index: (P,) the labels that have a box.
        box: (P, 4) left, top, right, bottom of each box, pixels.
        anchor: (P, 2) what each points at, pixels.
    """

    index: list[int]
    box: FloatArray
    anchor: FloatArray


def box_text(state: RenderState, index: int) -> str:
    """The text of a label's box: with its counter where there is one."""
    label, category = state.believed.labels[index], state.believed.category[index]
    return label if state.counts is None else _written(label, category, int(state.counts[index]))


def box_size(state: RenderState, index: int, letter: int, beliefs: bool = True) -> tuple[int, int]:
    """Width and height of a label's box, pixels; with room for two digits, so that it seldom grows."""
    text = box_text(state, index)
    if state.counts is not None and int(state.counts[index]) < 10:
        text = text.replace(f"({int(state.counts[index])})", "(00)")
    wrong = beliefs and bool(state.wrong[index])
    height = letter + max(4, letter // 2 - 1) + 2 * _frame(letter, wrong)
    width = text_width(text, letter, BOLD) + letter - 2 + 2 * _frame(letter, wrong)
    return width + _flag(height) * wrong, height


def _frame(letter: int, wrong: bool) -> int:
    """Width of a box's frame, pixels."""
    return max(2, round(letter / 4)) if wrong else 1


def _flag(height: int) -> int:
    """Width of the cross at the left end of a wrong label's box, pixels."""
    return height - 8


def place_boxes(
    size: FloatArray, anchor: FloatArray, half: FloatArray, avoid: FloatArray, bounds: FloatArray
) -> FloatArray:
    """Boxes for labels beside what they name, none over another while there is room.

    Args:
        size: (P, 2) width and height of each, pixels.
        anchor: (P, 2) middles of what is named, pixels.
        half: (P, 2) half the width and height of the boxes around it, pixels.
        avoid: (O, 4) left, top, right, bottom of what labels should not cover besides.
        bounds: (4,) left, top, right, bottom of the room that there is.

    Returns:
        (P, 4) left, top, right, bottom, whole pixels.
    """
    size = np.asarray(size, dtype=np.float64).reshape(-1, 2) + _GAP
    # `place_labels` has its y axis upwards.
    up = np.array([1.0, -1.0])
    own = np.hstack([anchor * up - half, anchor * up + half])
    others = avoid[:, [0, 3, 2, 1]] * np.array([1.0, -1.0, 1.0, -1.0])
    obstacles = np.vstack([own, others.reshape(-1, 4)])
    page = bounds[[0, 3, 2, 1]] * np.array([1.0, -1.0, 1.0, -1.0])
    beside = np.full_like(anchor, np.nan)
    middle = place_labels(anchor * up, size, half, beside, page, obstacles, np.zeros(len(obstacles)))
    corner = np.rint(middle * up - (size - _GAP) / 2)
    return np.hstack([corner, corner + size - _GAP])


def draw_leaders(image: Image, placement: LabelPlacement, colours: list[Colour], unit: float) -> None:
    """A line from each box to what it names, ending in a dot of the label's colour."""
    starts = np.rint(np.clip(placement.anchor, placement.box[:, :2] + 3, placement.box[:, 2:] - 3)).astype(
        int
    )
    ends = np.rint(placement.anchor).astype(int)
    for (x, y), (dx, dy), colour in zip(ends.tolist(), (starts - ends).tolist(), colours, strict=True):
        leader = _leader(dx, dy, colour, unit)
        paste(image, leader.pixels, x + leader.left, y + leader.top)


@lru_cache(maxsize=1024)
def _leader(dx: int, dy: int, colour: Colour, unit: float) -> Sprite:
    """A line that begins at (dx, dy), pixels, and ends in a dot, which is where it belongs."""
    reach = round(4 * unit) + 3
    left, top = min(dx, 0) - reach, min(dy, 0) - reach
    canvas = np.zeros((abs(dy) + 2 * reach, abs(dx) + 2 * reach, 4), np.uint8)
    begin, end = (dx - left, dy - top), (-left, -top)
    bright, dark = (*colour, 255), (*darker(colour, 0.65), 255)
    cv2.line(canvas, begin, end, dark, max(2, round(2.6 * unit)), cv2.LINE_AA)
    cv2.line(canvas, begin, end, bright, max(1, round(1.2 * unit)), cv2.LINE_AA)
    cv2.circle(canvas, end, round(4 * unit), dark, -1, cv2.LINE_AA)
    cv2.circle(canvas, end, round(2.8 * unit), bright, -1, cv2.LINE_AA)
    return Sprite(canvas, left, top)


def draw_label_box(
    image: Image, text: str, box: FloatArray, colour: Colour, letter: int, wrong: bool
) -> None:
    """One label in its box; a wrong one has a red frame and a cross."""
    left, top, right, bottom = (int(value) for value in box)
    drawn = _label_box(text, right - left, bottom - top, colour, letter, wrong)
    paste(image, drawn, left, top)


@lru_cache(maxsize=1024)
def _label_box(text: str, width: int, height: int, colour: Colour, letter: int, wrong: bool) -> Bytes:
    """(height, width, 4) a label box."""
    frame, flag = _frame(letter, wrong), _flag(height) if wrong else 0
    rim = WRONG if wrong else darker(colour, 0.55)
    canvas = np.zeros((height, width, 4), np.uint8)
    radius = round(0.3 * height)
    _rounded(canvas, 0, (*rim, 255), radius)
    _rounded(canvas, frame, (*colour, 255), radius - frame)
    if wrong:
        _cross(canvas, frame, flag)
    words = text_sprite(text, letter, legible_on(colour), BOLD)
    left = frame + flag + (width - flag - 2 * frame - words.pixels.shape[1]) // 2
    face = np.ascontiguousarray(canvas[..., :3])
    paste(face, words.pixels, left + words.left, (height + round(0.72 * letter)) // 2 + words.top)
    canvas[..., :3] = face
    return canvas


_written = lru_cache(maxsize=4096)(label_text)


def _rounded(canvas: Bytes, margin: int, value: tuple[int, ...], radius: int) -> None:
    """Fill a rectangle with round corners, `margin` pixels from the edges."""
    height, width = canvas.shape[:2]
    right, bottom = width - margin - 1, height - margin - 1
    cv2.rectangle(canvas, (margin + radius, margin), (right - radius, bottom), value, -1)
    cv2.rectangle(canvas, (margin, margin + radius), (right, bottom - radius), value, -1)
    for x in (margin + radius, right - radius):
        for y in (margin + radius, bottom - radius):
            cv2.circle(canvas, (x, y), radius, value, -1)


def _cross(canvas: Bytes, frame: int, flag: int) -> None:
    """A white cross on red at the left end of a label box."""
    height = canvas.shape[0]
    arm, x, y = max(2, height // 5 - 1), frame + flag // 2, height // 2
    cv2.rectangle(canvas, (frame, frame), (frame + flag, height - frame - 1), (*WRONG, 255), -1)
    for slope in (-1, 1):
        cv2.line(
            canvas, (x - arm, y - slope * arm), (x + arm, y + slope * arm), (*PAPER, 255), 2, cv2.LINE_AA
        )
