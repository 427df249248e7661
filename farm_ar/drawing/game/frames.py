"""Frames of a film of the game: the table from above beside the headset's view, under one bar."""

from __future__ import annotations

import numpy as np

from farm_ar.drawing.game.above import TableFromAbove
from farm_ar.drawing.game.colours import PAPER, Image
from farm_ar.drawing.game.header import draw_header, header_height
from farm_ar.drawing.game.headset import HeadsetView
from farm_ar.drawing.game.pixels import paste
from farm_ar.drawing.game.text import BOLD, text_sprite
from farm_ar.errors import OptionError
from farm_ar.game_logic.render_state import RenderState
from farm_ar.scenes import Scene

_LEAST_HEIGHT = 120
_GAP_PX, _GAP_COLOUR = 4, 18


class GameFrames:
    """Draws states of a game as frames of a film; width and height are even.

    Args:
        scene: the table.
        height: of the frames, pixels; the width follows.

    Raises:
        OptionError: the height is odd or below 120.
    """

    def __init__(self, scene: Scene, height: int = 480) -> None:
        if height < _LEAST_HEIGHT or height % 2:
            raise OptionError("height", f"must be an even number of pixels from {_LEAST_HEIGHT}", height)
        self._bar = header_height(height)
        pane = height - self._bar
        wide = 2 * round(pane * 2 / 3)
        self._above = TableFromAbove(scene, (wide, pane), header=False)
        self._headset = HeadsetView(scene, (pane, pane), header=False, scenery=self._above.scenery)
        self._panes = [np.empty((pane, width, 3), np.uint8) for width in (wide, pane)]
        self.size = (wide + _GAP_PX + pane, height)

    def frame(self, state: RenderState, labels: bool = True, beliefs: bool = True) -> Image:
        """The frame of a state, (height, width, 3) red, green, blue.

        Args:
            state: of this drawer's scene.
            labels: as `TableFromAbove.draw` takes them, for the pane from above.
            beliefs: likewise.
        """
        width, height = self.size
        frame = np.empty((height, width, 3), np.uint8)
        above = self._above.draw(state, labels, beliefs, self._panes[0])
        headset = self._headset.draw(state, self._panes[1], truth=beliefs)
        frame[:, above.shape[1] : above.shape[1] + _GAP_PX] = _GAP_COLOUR
        frame[self._bar :, : above.shape[1]] = above
        frame[self._bar :, above.shape[1] + _GAP_PX :] = headset
        draw_header(frame, state)
        self._name_panes(frame, above.shape[1])
        return frame

    def _name_panes(self, frame: Image, split: int) -> None:
        unit = frame.shape[0] / 480
        letter = max(8, round(10 * unit))
        base = self._bar + round(14 * unit)
        for text, x in (("from above", 7), ("through the headset", split + _GAP_PX + 7)):
            words = text_sprite(text, letter, PAPER, BOLD, halo=(20, 22, 28))
            paste(frame, words.pixels, round(x) + words.left, base + words.top)
