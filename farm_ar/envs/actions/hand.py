"""Actions that steer the hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from farm_ar.arrays import BoolArray
from farm_ar.envs.actions.base import HandAction
from farm_ar.game_logic.physics.gripper import MAX_HAND_SPEED, MAX_TWIST


class VelocityAction(HandAction):
    """The hand, steered: velocity x, z (1 is 1.5 m/s), twist (1 is pi rad/s), grip when positive."""

    def __init__(self) -> None:
        self.space = spaces.Box(-1.0, 1.0, (4,), np.float32)

    def decode(self, action: Any) -> tuple[float, float, float, bool]:
        """Velocity along x and z, metres a second; twist, radians a second; whether the hand is closed."""
        x, z, twist, grip = action
        if not (-1.0 <= x <= 1.0 and -1.0 <= z <= 1.0 and -1.0 <= twist <= 1.0):
            x, z, twist = (min(max(value, -1.0), 1.0) for value in (x, z, twist))
        return MAX_HAND_SPEED * x, MAX_HAND_SPEED * z, MAX_TWIST * twist, grip > 0

    def mirror(self, action: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """(..., 4) the other way along x and round."""
        turned: npt.NDArray[Any] = action * np.array([-1, 1, -1, 1], dtype=action.dtype)
        return turned


class SteeringAction(HandAction):
    """One of 20: nine ways (still, or one of eight directions), open or closed; a twist to either side.

    The hand goes at half of its highest speed, the most at which it carries, and twists what it holds at its
    highest. Choice w is way w with an open hand, 9 + w the same closed; 18 and 19 twist anticlockwise and
    clockwise, standing still and closed.
    """

    SPEED = MAX_HAND_SPEED / 2
    WAYS = 9
    TWISTS = 2

    def __init__(self) -> None:
        self.space = spaces.Discrete(2 * self.WAYS + self.TWISTS)
        still_first = [(0, 0), *((x, z) for z in (-1, 0, 1) for x in (-1, 0, 1) if (x, z) != (0, 0))]
        way = np.array(still_first, dtype=np.float64)
        length = np.linalg.norm(way, axis=1, keepdims=True)
        self._velocity = self.SPEED * way / np.maximum(length, 1.0)
        mirrored = [still_first.index((-x, z)) for x, z in still_first]
        closed = [self.WAYS + w for w in mirrored]
        self._mirrored = np.array([*mirrored, *closed, 2 * self.WAYS + 1, 2 * self.WAYS])

    def decode(self, action: Any) -> tuple[float, float, float, bool]:
        """Velocity along x and z, metres a second; twist, radians a second; whether the hand is closed."""
        turned, way = divmod(int(action), self.WAYS)
        if turned == 2:  # the last two
            return 0.0, 0.0, MAX_TWIST if way else -MAX_TWIST, True
        x, z = self._velocity[way].tolist()
        return x, z, 0.0, turned == 1

    def mask(self, holds: bool) -> BoolArray:
        """(20,) all; but only what is held can be twisted."""
        mask = np.ones(2 * self.WAYS + self.TWISTS, dtype=np.bool_)
        mask[2 * self.WAYS :] = holds
        return mask

    def mirror(self, action: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """(...) the other way along x and round."""
        turned: npt.NDArray[Any] = self._mirrored[action]
        return turned
