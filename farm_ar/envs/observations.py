"""The observations, by name."""

from __future__ import annotations

from operator import itemgetter
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from farm_ar.envs.features import NO_RIVAL, Reading
from farm_ar.envs.worlds import World
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.scenes import Layout, Scene

Left = tuple[float, float, float, float]
"""What is left of metres, radians, moves (or time) and visits, as shares."""

Observation = dict[str, Any]


class StateObservation:
    """Numbers: a Dict of flat Boxes of about 1, every bound finite; object by object where there are several.

    Args:
        layout: the objects, for their number and kinds.
        white_box: whether what the game believes is part of it.
        hand: whether the hand is part of it.
    """

    def __init__(self, layout: Layout, white_box: bool, hand: bool) -> None:
        m, kinds = len(layout), len(layout.categories)
        widest = int(np.bincount(layout.category_code).max())
        boxes: dict[str, spaces.Box] = {
            "position": _box(2.0, 2 * m),
            "heading": _box(1.0, 2 * m),
            "category": _box(1.0, kinds * m, low=0.0),
            "in_view": _box(1.0, m, low=0.0),
            "fixed": _box(1.0, m, low=0.0),
            "camera": _box(4.0, 4),
            "budget": _box(1.0, 4, low=0.0),
        }
        if white_box:
            boxes |= {
                "believed_position": _box(2.0, 2 * m),
                "believed_heading": _box(1.0, 2 * m),
                "difference": _box(2.0, 3 * m),
                "cost": _box(NO_RIVAL, widest * m, low=0.0),
                "margin": _box(1.0, m, low=0.0),
            }
        if hand:
            boxes["hand"] = _box(4.0, 8)
        self.space: spaces.Space[Any] = spaces.Dict(dict(boxes))
        ends = np.cumsum([box.shape[0] for box in boxes.values()]).tolist()
        self._names = list(boxes)
        parts = [slice(end - box.shape[0], end) for box, end in zip(boxes.values(), ends, strict=True)]
        self.length = ends[-1]
        places = dict(zip(self._names, parts, strict=True))
        self._motion_left = (1.0, 1.0)
        self._parts_of = itemgetter(*parts)
        self._budget, self._hand = places["budget"], places.get("hand")
        self._budget_at = self._budget.start

    def observe(self, reading: Reading, left: Left, world: World) -> Observation:
        """The observation of one moment.

        Args:
            reading: the table.
            left: what is left of metres, radians, moves and visits, as shares.
            world: for its hand.
        """
        numbers = reading.numbers
        numbers[self._budget] = left
        if self._hand is not None:
            assert isinstance(world, FarmGame)
            world.describe_hand(numbers[self._hand])
        return self._named(numbers)

    def observe_on(
        self, reading: Reading, moves_left: float, motion_left: tuple[float, float], world: World
    ) -> Observation:
        """The same, where since the last observation only the hand of the same visit was steered.

        Args:
            reading: the table.
            moves_left: share of the moves, or of the time, that is left.
            motion_left: shares of metres and of radians.
            world: for its hand.
        """
        numbers, at = reading.numbers, self._budget_at
        if self._hand is not None:
            world.describe_hand(numbers[self._hand])  # type: ignore[attr-defined]  # a game, as `observe` saw
        numbers[at + 2] = moves_left
        if motion_left is not self._motion_left:
            numbers[at], numbers[at + 1] = self._motion_left = motion_left
        return self._named(numbers)

    def _named(self, numbers: npt.NDArray[np.float32]) -> Observation:
        return dict(zip(self._names, self._parts_of(numbers.copy()), strict=True))


class PixelObservation:
    """The table from above, (H, W, 3) bytes.

    Args:
        scene: the table.
        white_box: whether what the game believes is drawn too.
    """

    HEIGHT = 96

    def __init__(self, scene: Scene, white_box: bool) -> None:
        from farm_ar.drawing.game.above import TableFromAbove

        self.length = StateObservation(scene.layout, white_box=False, hand=False).length
        width = round(self.HEIGHT * scene.size[0] / scene.size[1])
        self._white_box = white_box
        self._picture = TableFromAbove(scene, (width, self.HEIGHT))
        self.space: spaces.Space[Any] = spaces.Box(0, 255, (self.HEIGHT, width, 3), np.uint8)

    def observe(self, reading: Reading, left: Left, world: World) -> Any:
        """The picture of now; the other arguments are not looked at."""
        return self._picture.draw_pixel_observation(world.render_state(), self._white_box)

    def observe_on(
        self, reading: Reading, moves_left: float, motion_left: tuple[float, float], world: World
    ) -> Any:
        """The same."""
        return self._picture.draw_pixel_observation(world.render_state(), self._white_box)


def _box(high: float, count: int, low: float | None = None) -> spaces.Box:
    return spaces.Box(-high if low is None else low, high, (count,), np.float32)
