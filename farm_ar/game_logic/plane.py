"""The length of a tick."""

from farm_ar.game_logic.physics.state import TICK

__all__ = ["TICK"]
