"""What a player's pointer does, as a page sends it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from farm_ar.errors import OptionError

STEPS_PER_SECOND = 30
"""Of a game's clock."""


@dataclass
class Pointer:
    """What the player's pointer does.

    Args:
        x: over the table, metres; None while it is away.
        z: likewise.
        grip: whether it is pressed.
        turn: how far it has turned since the visit began, clockwise, radians.
    """

    x: float | None = None
    z: float | None = None
    grip: bool = False
    turn: float = 0.0

    @property
    def away(self) -> bool:
        """Whether it is not over the table."""
        return self.x is None or self.z is None

    @classmethod
    def told(cls, message: Mapping[str, Any]) -> Pointer:
        """The pointer that a page sends.

        Raises:
            OptionError: a value is not what it should be.
        """
        values: dict[str, float | None] = {}
        for name in ("x", "z", "turn"):
            value = message.get(name)
            if value is None:
                values[name] = None
                continue
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not (number and abs(value) <= 1e6):  # neither NaN nor infinity is
                raise OptionError(name, "must be a number from -1e6 to 1e6", value)
            values[name] = float(value)
        grip = message.get("grip", False)
        if not isinstance(grip, bool):
            raise OptionError("grip", "must be true or false", grip)
        return cls(values["x"], values["z"], grip, values["turn"] or 0.0)
