"""How much was moved."""

from farm_ar.game_logic.physics.limits import Motion

__all__ = ["Motion"]
