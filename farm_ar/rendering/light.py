"""The light: one sun that throws shadows, and the sky."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from farm_ar.arrays import FloatArray, Record, read_only
from farm_ar.errors import OptionError


@dataclass(frozen=True, eq=False)
class Light(Record):
    """Light that falls on everything, as shares of full light.

    Args:
        toward: (3,) direction to the sun (x, y, z), of any length; y must be positive.
        sun: what it adds on a face turned to it.
        sky: on a face turned upwards.
        ground: on a face turned downwards.
        shadows: pixels of the shadow map along each side; 0 for no shadows.

    Raises:
        OptionError: a value is out of its limits.
    """

    toward: FloatArray = field(default_factory=lambda: np.array([-0.45, 0.80, -0.40]))
    sun: float = 0.62
    sky: float = 0.50
    ground: float = 0.28
    shadows: int = 1024

    def __post_init__(self) -> None:
        object.__setattr__(self, "toward", read_only(self.toward, np.float64))
        if self.toward.shape != (3,) or not np.isfinite(self.toward).all() or self.toward[1] <= 0:
            raise OptionError(
                "light.toward", "must be a direction (x, y, z) that points upwards", self.toward
            )
        for name in ("sun", "sky", "ground"):
            if not 0 <= getattr(self, name) <= 10:
                raise OptionError(f"light.{name}", "must be from 0 to 10", getattr(self, name))
        if self.shadows and not 16 <= self.shadows <= 8192:
            raise OptionError("light.shadows", "must be 0, or from 16 to 8192", self.shadows)

    @property
    def axes(self) -> FloatArray:
        """(3, 3) unit vectors in its rows: two across the light, and the one towards the sun."""
        toward = self.toward / np.linalg.norm(self.toward)
        first = np.cross(toward, [0.0, 0.0, 1.0] if abs(toward[2]) < 0.9 else [1.0, 0.0, 0.0])
        first /= np.linalg.norm(first)
        return np.ascontiguousarray([first, np.cross(toward, first), toward])
