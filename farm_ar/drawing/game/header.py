"""The bar above a picture of the game, phase, caption and time, and the score in its corner."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from farm_ar.drawing.game.colours import DEEP_ICE, GO, ICE, PAPER, WRONG, Colour, Image
from farm_ar.drawing.game.overlays import dashed_line, outline, play_mark, snowflake, tint_area
from farm_ar.drawing.game.pixels import paste
from farm_ar.drawing.game.sprites import Sprite, paste_art, sprite_of
from farm_ar.drawing.game.text import BOLD, REGULAR, text_sprite, text_width
from farm_ar.game_logic.render_state import RenderState

_BAR: Colour = (34, 39, 48)
_PALE: Colour = (176, 186, 200)
HAND_TEXT = "HAND IN VIEW"
FROZEN_TEXT = f"{HAND_TEXT} - animals frozen"
PLAY_TEXT = "PLAY"


def header_height(picture_height: int) -> int:
    """Height of the bar above a picture, pixels."""
    return 2 * round(12 * picture_height / 480)


def draw_header(image: Image, state: RenderState, unit: float | None = None) -> None:
    """The bar across the top of a picture: phase at the left, caption in the middle, time at the right."""
    unit = image.shape[0] / 480 if unit is None else unit
    frozen = state.phase == "hand"
    words = (FROZEN_TEXT if len(state.animal) else HAND_TEXT) if frozen else PLAY_TEXT
    time = f"{int(state.seconds) // 60}:{int(state.seconds) % 60:02d}"
    bar = _bar(words, frozen, state.caption, time, image.shape[1], unit)
    image[: len(bar)] = bar


@lru_cache(maxsize=32)
def _bar(words: str, frozen: bool, caption: str, time: str, width: int, unit: float) -> Image:
    """The bar, made once for all frames on which it says the same."""
    height = 2 * round(12 * unit)
    image = np.empty((height, width, 3), np.uint8)
    image[:] = DEEP_ICE if frozen else _BAR
    letter = max(8, round(12 * unit))
    base = (height + round(0.72 * letter)) // 2
    end = _draw_phase(image, words, frozen, height, letter, base)
    start = width - text_width(time, letter, BOLD) - round(8 * unit)
    _write(image, time, start, base, letter, PAPER, BOLD)
    caption = fitting(caption, start - end - round(24 * unit), letter)
    middle = (end + start - text_width(caption, letter)) // 2
    if caption:
        _write(image, caption, middle, base, letter, PAPER if frozen else _PALE, REGULAR)
    return image


def _draw_phase(image: Image, words: str, frozen: bool, height: int, letter: int, base: int) -> int:
    """The phase in its colour; the column where it ends."""
    end = height + text_width(words, letter, BOLD) + letter
    cv2.rectangle(image, (0, 0), (end, height - 1), ICE if frozen else GO, -1)
    mark = snowflake(DEEP_ICE) if frozen else play_mark(PAPER)
    paste_art(image, mark, height / 2 + 1, height / 2, 0.76 * height if frozen else 0.6 * height)
    _write(image, words, height + 2, base, letter, DEEP_ICE if frozen else PAPER, BOLD)
    return end


def draw_score(image: Image, state: RenderState, beliefs: bool, unit: float) -> None:
    """How many labels are wrong and how many animals were miscounted, in the lower left corner."""
    letter = max(8, round(11 * unit))
    rows = []
    if beliefs:
        count = int(state.wrong.sum())
        rows.append((f"wrong labels {count}", count))
    if state.misplaced is not None:
        count = int(state.misplaced.sum())
        rows.append((f"miscounted {count}", count))
    line = round(1.35 * letter)
    for k, (text, count) in enumerate(reversed(rows)):
        colour = (255, 116, 110) if count else PAPER
        words = text_sprite(text, letter, colour, BOLD, halo=(20, 22, 28))
        paste(
            image,
            words.pixels,
            round(7 * unit) + words.left,
            image.shape[0] - round(7 * unit) - k * line + words.top,
        )


def draw_legend(image: Image, unit: float) -> None:
    """What outlines and dashed lines mean, in the lower right corner."""
    legend = _legend(image.shape[1], image.shape[0], unit)
    paste(image, legend.pixels, legend.left, legend.top)


@lru_cache(maxsize=8)
def _legend(width: int, height: int, unit: float) -> Sprite:
    """The legend of a picture of that size; the point that it belongs to is the picture's corner."""
    return sprite_of(lambda image: _write_legend(image, unit), width, height)


def _write_legend(image: Image, unit: float) -> None:
    letter = max(8, round(10 * unit))
    line, swatch, margin = round(1.45 * letter), round(1.7 * letter), round(7 * unit)
    rows = ("label believed here", "its object is really there", "label on the wrong object")
    left = image.shape[1] - margin - swatch - round(5 * unit) - max(text_width(row, letter) for row in rows)
    for k, row in enumerate(rows):
        base = image.shape[0] - margin - (len(rows) - 1 - k) * line
        middle = base - round(0.36 * letter)
        box = np.array(
            [
                (left, base - 0.75 * letter),
                (left + swatch, base - 0.75 * letter),
                (left + swatch, base),
                (left, base),
            ]
        )
        if k == 1:
            begin, end = np.array([(left, middle), (left + swatch, middle)], dtype=np.float64)
            dashed_line(image, begin, end, _PALE, max(1, round(1.6 * unit)), 3.5 * unit)
        else:
            tone = _PALE if k == 0 else WRONG
            tint_area(image, box, tone, 0.3)
            outline(image, box, tone, max(1, round(1.6 * unit)))
        words = text_sprite(row, letter, PAPER, REGULAR, halo=(20, 22, 28))
        paste(image, words.pixels, left + swatch + round(5 * unit) + words.left, base + words.top)


def fitting(text: str, width: int, letter: int) -> str:
    """The text, cut short with dots where it would be wider than `width` pixels."""
    if not text or text_width(text, letter) <= width:
        return text
    for end in range(len(text) - 1, 0, -1):
        shorter = text[:end].rstrip() + "..."
        if text_width(shorter, letter) <= width:
            return shorter
    return ""


def _write(image: Image, text: str, x: int, base: int, letter: int, colour: Colour, weight: int) -> None:
    words = text_sprite(text, letter, colour, weight)
    paste(image, words.pixels, x + words.left, base + words.top)
