from dataclasses import replace

import numpy as np
import pytest

from farm_ar.drawing.game.frames import GameFrames
from farm_ar.drawing.game.header import fitting
from farm_ar.drawing.game.pixels import cover, mix_area, paste
from farm_ar.drawing.game.text import text_sprite, text_width
from farm_ar.errors import OptionError
from farm_ar.game_logic.render_state import RenderState
from farm_ar.scenes.builtin import FACING_S1, builtin_scene

FARM = builtin_scene("farm")


def start() -> RenderState:
    n = len(FARM.layout)
    return RenderState(
        FARM, FARM.layout, FARM.layout, np.zeros(n, dtype=bool), FACING_S1, counts=np.zeros(n, int)
    )


@pytest.mark.parametrize("height", [240, 360, 480, 722])
def test_frames_have_the_height_asked_for_and_an_even_width(height: int):
    drawer = GameFrames(FARM, height)
    frame = drawer.frame(start())
    assert frame.shape == (height, drawer.size[0], 3)
    assert drawer.size[0] % 2 == 0


@pytest.mark.parametrize("height", [0, 100, 481])
def test_a_height_that_films_cannot_have_is_refused(height: int):
    with pytest.raises(OptionError, match=f"height: must be an even number of pixels from 120, got {height}"):
        GameFrames(FARM, height)


def test_the_bar_tells_phase_caption_and_time():
    drawer = GameFrames(FARM)
    state = start()
    bars = [
        drawer.frame(m)[:24].tobytes()
        for m in (
            state,
            replace(state, phase="hand"),
            replace(state, caption="The yellow coop is pushed away"),
            replace(state, seconds=61.0),
        )
    ]
    assert len(set(bars)) == 4


def test_a_caption_that_is_too_long_is_cut_short():
    text = "a caption that goes on and on and on"
    width = text_width(text, 12)
    assert fitting(text, width, 12) == text
    shorter = fitting(text, width // 2, 12)
    assert shorter.endswith("...")
    assert text.startswith(shorter[:-3])
    assert text_width(shorter, 12) <= width // 2
    assert fitting(text, 1, 12) == ""


@pytest.mark.parametrize("run", [paste, paste.py_func])
def test_pasting_mixes_by_opacity_and_cuts_off_what_lies_outside(run):
    image = np.full((4, 5, 3), 100, np.uint8)
    sprite = np.zeros((2, 2, 4), np.uint8)
    sprite[0, 0] = 200, 0, 0, 255
    sprite[0, 1] = 50, 50, 50, 128
    run(image, sprite, 3, 3)
    assert image[3, 3].tolist() == [200, 0, 0]
    assert image[3, 4].tolist() == [100, 100, 100]
    assert (image[:3] == 100).all()
    run(image, sprite, -1, -1)
    assert (image[0] == 100).all()


@pytest.mark.parametrize("run", [mix_area, mix_area.py_func])
def test_a_colour_is_mixed_into_the_inside_of_a_polygon_only(run):
    image = np.zeros((10, 10, 3), np.uint8)
    run(image, np.array([(2.0, 2.0), (8.0, 2.0), (8.0, 20.0), (2.0, 20.0)]), 200, 100, 0, 128)
    inside = np.zeros((10, 10), dtype=bool)
    inside[2:, 2:8] = True
    assert (image[inside] == (100, 50, 0)).all()
    assert (image[~inside] == 0).all()


@pytest.mark.parametrize("run", [cover, cover.py_func])
def test_covering_keeps_a_part_and_adds_a_part(run):
    image = np.full((2, 2, 3), 200, np.uint8)
    run(image, np.full((2, 2, 3), 128, np.uint8), np.full((2, 2, 3), 7, np.uint8))
    assert (image == 107).all()


def test_words_can_be_written_without_the_outline_font_of_newer_opencv(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("farm_ar.drawing.game.text._FONT", None)
    words = text_sprite("only in strokes", 12, (255, 0, 0))
    assert (words.pixels[..., 3] > 200).sum() > 50
    assert 60 < words.pixels.shape[1] < 160
