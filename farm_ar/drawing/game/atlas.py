"""Many drawings at once: their sprites lie in one store, from which one compiled loop pastes them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.drawing.game.colours import Image
from farm_ar.drawing.game.figures import TURN_DEG, Figure
from farm_ar.drawing.game.pixels import Bytes, Distances, paste_all, paste_in_space
from farm_ar.drawing.game.shapes import Art
from farm_ar.drawing.game.sprites import PHASES, rendered

_LARGEST = 1 << 26
"""Bytes in the store after which it begins anew."""

_HALF_DEGREES = 720
_SIZES = 1 << 12


class Atlas:
    """Sprites of drawings at the sizes, headings and places between pixels at which they were needed.

    Args:
        scale_of: pixels a metre of each size, sizes being whole numbers below 4096.
        largest: bytes of sprites after which it forgets them.
    """

    def __init__(self, scale_of: Callable[[int], float], largest: int = _LARGEST) -> None:
        self._scale_of, self._largest = scale_of, largest
        self._arts: list[Art | Figure] = []
        self._numbers: dict[Art | Figure, int] = {}
        self._store: Bytes = np.zeros(1 << 16, np.uint8)
        self._entries: IntArray = np.zeros((256, 5), np.int64)
        self._known: dict[int, int] = {}
        self._used = 0

    def number(self, art: Art | Figure) -> int:
        """What a drawing is called in `paste`."""
        if art not in self._numbers:
            self._numbers[art] = len(self._arts)
            self._arts.append(art)
        return self._numbers[art]

    def paste(
        self,
        image: Image,
        art: IntArray,
        place: FloatArray,
        yaw: FloatArray | float = 0.0,
        step: FloatArray | float = 7.5,
        size: IntArray | int = 0,
    ) -> None:
        """Draw onto a picture, one after the other.

        Args:
            image: to draw on.
            art: (S,) the numbers of the drawings.
            place: (S, 2) column and row of the middle of each, pixels.
            yaw: (S,) their headings, radians, clockwise from up the page.
            step: (S,) degrees to which the headings are rounded, whole or half ones.
            size: (S,) their sizes.
        """
        if len(art):
            sprite, corner = self._find(art, place, yaw, step, size)
            paste_all(image, self._store, sprite, corner)

    def paste_in_space(
        self,
        image: Image,
        away: Distances,
        art: IntArray,
        place: FloatArray,
        size: IntArray,
        distance: FloatArray,
        solid: bool,
        yaw: FloatArray | None = None,
    ) -> None:
        """Draw upright objects, the farthest first, where nothing nearer is.

        Args:
            image: to draw on.
            away: (H, W) how far away is what each pixel shows.
            art: (S,) the numbers of the drawings.
            place: (S, 2) column and row of the foot of each, pixels.
            size: (S,) their sizes.
            distance: (S,) how far away they are.
            solid: whether they hide what is drawn later.
            yaw: (S,) headings of figures away from the eye, radians; 0 by default.
        """
        if len(art):
            far_first = np.argsort(-distance, kind="stable")
            turn = 0.0 if yaw is None else yaw[far_first]
            sprite, corner = self._find(art[far_first], place[far_first], turn, TURN_DEG, size[far_first])
            near = distance[far_first].astype(np.float32)
            paste_in_space(image, away, self._store, sprite, corner, near, solid)

    def _find(
        self,
        art: IntArray,
        place: FloatArray,
        yaw: FloatArray | float,
        step: FloatArray | float,
        size: IntArray | int,
    ) -> tuple[IntArray, IntArray]:
        """(S, 3) where the sprites lie in the store, and (S, 2) where their upper left corners go."""
        pixel = np.floor(place)
        phase = ((place - pixel) * PHASES).astype(np.int64)
        turn = (2 * np.rint(np.rad2deg(yaw) / step) * step).astype(np.int64) % _HALF_DEGREES
        code = (art * _SIZES + size) * _HALF_DEGREES + turn
        code = (code * PHASES + phase[:, 0]) * PHASES + phase[:, 1]
        if self._used > self._largest:
            self._known.clear()
            self._used = 0
        codes = code.tolist()
        known = self._known
        index = [known[key] if key in known else self._add(key) for key in codes]
        entry = self._entries[index]
        return entry[:, :3], pixel.astype(np.int64) + entry[:, 3:]

    def _add(self, code: int) -> int:
        """Render a sprite; its place among the entries."""
        rest, phase_y = divmod(code, PHASES)
        rest, phase_x = divmod(rest, PHASES)
        rest, turn = divmod(rest, _HALF_DEGREES)
        art, size = divmod(rest, _SIZES)
        drawing, scale = self._arts[art], self._scale_of(size)
        if isinstance(drawing, Figure):
            sprite = drawing.sprite(scale, turn / 2, phase_x, phase_y)
        else:
            sprite = rendered(drawing, scale, turn / 2, phase_x, phase_y)
        height, width = sprite.pixels.shape[:2]
        end = self._used + sprite.pixels.size
        if end > len(self._store):
            self._store = _longer(self._store, end)
        self._store[self._used : end] = sprite.pixels.reshape(-1)
        count = len(self._known)
        if count == len(self._entries):
            self._entries = _longer(self._entries, count + 1)
        self._entries[count] = self._used, height, width, sprite.left, sprite.top
        self._used = end
        self._known[code] = count
        return count


def _longer(array: npt.NDArray[Any], least: int) -> npt.NDArray[Any]:
    """The array with room for more, at least twice as long."""
    longer = np.zeros((max(least, 2 * len(array)), *array.shape[1:]), array.dtype)
    longer[: len(array)] = array
    return longer
