"""The player's hand."""

from farm_ar.game_logic.physics.gripper import HAND_RADIUS, MAX_HAND_SPEED, MAX_TWIST, HandState

__all__ = ["HAND_RADIUS", "MAX_HAND_SPEED", "MAX_TWIST", "HandState"]
