"""The observations, by name."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.table import TableView
from farm_ar.envs.worlds import World
from farm_ar.geometry import wrap
from farm_ar.scenes import Layout, Scene

MARGIN_SCALE = 0.3
"""The margin that is observed as 1."""

NO_RIVAL = 2.0
"""In place of a cost, where a kind has fewer objects than the largest one."""

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
        self._white_box, self._hand, self._kinds = white_box, hand, kinds
        self._widest = int(np.bincount(layout.category_code).max())
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
                "cost": _box(NO_RIVAL, self._widest * m, low=0.0),
                "margin": _box(1.0, m, low=0.0),
            }
        if hand:
            boxes["hand"] = _box(4.0, 8)
        self.space: spaces.Space[Any] = spaces.Dict(dict(boxes))
        self._limits = {
            name: (float(box.low.flat[0]), float(box.high.flat[0])) for name, box in boxes.items()
        }
        self._met: _Met | None = None
        self._seen: tuple[TableView, Observation] | None = None

    def observe(
        self, view: TableView, left: FloatArray, hand: FloatArray | None, world: World
    ) -> Observation:
        """The observation of one moment.

        Args:
            view: the table.
            left: (4,) what is left of metres, radians, moves and visits, as shares.
            hand: (8,) the hand's x, z, sin and cos of its yaw, velocity, grip, visibility; None without one.
            world: not looked at.
        """
        if self._seen is None or self._seen[0] is not view:
            self._seen = view, self._of_table(view)
        values = {name: array.copy() for name, array in self._seen[1].items()}
        values["budget"] = self._packed("budget", left)
        if self._hand:
            own = np.zeros(8) if hand is None else np.append(_scaled(hand[:2], view), hand[2:])
            values["hand"] = self._packed("hand", own)
        return values

    def _of_table(self, view: TableView) -> Observation:
        """What depends on the table alone."""
        order, truth, believed = view.order, view.truth, view.believed
        if self._met is None or self._met.order is not order:
            self._met = _Met(truth, order, self._kinds, self._widest)
        values: dict[str, FloatArray] = {
            "position": _scaled(truth.position[order], view),
            "heading": _heading(truth.yaw[order]),
            "category": self._met.category,
            "in_view": view.in_view[order].astype(np.float64),
            "fixed": self._met.fixed,
            "camera": np.append(_scaled(view.camera.position, view), _heading(view.camera.yaw)),
        }
        if self._white_box:
            difference = np.empty((len(order), 3))
            difference[:, :2] = 2 * (truth.position - believed.position)[order] / view.size
            difference[:, 2] = wrap(truth.yaw - believed.yaw)[order] / np.pi
            cost = view.costs[order[:, None], self._met.rivals]
            values |= {
                "believed_position": _scaled(believed.position[order], view),
                "believed_heading": _heading(believed.yaw[order]),
                "difference": difference,
                "cost": np.where(self._met.is_rival, cost, NO_RIVAL),
                "margin": np.fmin(view.margins[order] / MARGIN_SCALE, 1.0),  # NaN becomes 1
            }
        return {name: self._packed(name, array) for name, array in values.items()}

    def _packed(self, name: str, values: FloatArray) -> npt.NDArray[np.float32]:
        """The values within their limits, flat."""
        low, high = self._limits[name]
        return np.minimum(np.maximum(values, low), high).astype(np.float32).reshape(-1)


class _Met:
    """What does not change while the agent meets the objects in one order.

    Args:
        layout: M objects.
        order: (M,) the order.
        kinds: how many kinds there are.
        widest: how many objects the largest kind has.

    Attributes:
        category: (M, kinds) one-hot.
        fixed: (M,) 0 or 1.
        rivals: (M, widest) the objects of each one's kind, in order.
        is_rival: (M, widest) whether there are so many.
    """

    def __init__(self, layout: Layout, order: IntArray, kinds: int, widest: int) -> None:
        code = layout.category_code[order]
        self.order = order
        self.category = np.eye(kinds)[code]
        self.fixed = layout.fixed[order].astype(np.float64)
        self.rivals = np.zeros((len(order), widest), dtype=np.int64)
        self.is_rival = np.zeros((len(order), widest), dtype=np.bool_)
        for kind in range(kinds):
            same = order[code == kind]
            self.rivals[code == kind, : len(same)] = same
            self.is_rival[code == kind, : len(same)] = True


class PixelObservation:
    """The table from above, (H, W, 3) bytes.

    Args:
        scene: the table.
        white_box: whether what the game believes is drawn too.
    """

    HEIGHT = 96

    def __init__(self, scene: Scene, white_box: bool) -> None:
        from farm_ar.drawing.game.above import TableFromAbove

        width = round(self.HEIGHT * scene.size[0] / scene.size[1])
        self._white_box = white_box
        self._picture = TableFromAbove(scene, (width, self.HEIGHT))
        self.space: spaces.Space[Any] = spaces.Box(0, 255, (self.HEIGHT, width, 3), np.uint8)

    def observe(self, view: TableView, left: FloatArray, hand: FloatArray | None, world: World) -> Any:
        """The picture of now; the other arguments are not looked at."""
        return self._picture.draw_small(world.moment(), self._white_box)


def _heading(yaw: FloatArray) -> FloatArray:
    """(..., 2) sine and cosine."""
    heading = np.empty((*yaw.shape, 2))
    heading[..., 0], heading[..., 1] = np.sin(yaw), np.cos(yaw)
    return heading


def _scaled(position: FloatArray, view: TableView) -> FloatArray:
    """Positions with the table from -1 to 1."""
    scaled: FloatArray = 2 * position / view.size - 1
    return scaled


def _box(high: float, count: int, low: float | None = None) -> spaces.Box:
    return spaces.Box(-high if low is None else low, high, (count,), np.float32)
