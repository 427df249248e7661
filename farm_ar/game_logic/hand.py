"""The player's hand: a disc that bumps into buildings while it is low, and that holds one when it grips.

Hovering it is not in the space at all. Low it is a disc, holding it is a point of the building, and an arm of
limited force makes the disc or the building move as it is steered. The arm follows a velocity, not a place:
when something holds it up it presses, but does not make up for it afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass

from farm_ar.arrays import FloatArray
from farm_ar.game_logic.arm import HAND_RADIUS, MAX_HAND_SPEED, MAX_TWIST

__all__ = ["HAND_RADIUS", "MAX_HAND_SPEED", "MAX_TWIST", "HandState"]


@dataclass(frozen=True, eq=False)
class HandState:
    """A hand as it is now.

    Args:
        position: (2,) middle of the hand (x, z), metres.
        yaw: heading, radians, in [-pi, pi); 0 when it comes in.
        velocity: (2,) how it moves, metres a second.
        gripped: index of the building that it holds, None for none.
        raised: whether it hovers above the buildings and touches none.
    """

    position: FloatArray
    yaw: float
    velocity: FloatArray
    gripped: int | None
    raised: bool
