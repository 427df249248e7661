"""What the headset of an environment perceives with, by name; and the head that does not keep still."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from farm_ar.errors import OptionError, known_name
from farm_ar.game_logic.perception import OraclePerception, Perceived, Perception
from farm_ar.scenes import Camera, Layout

PERCEPTIONS: dict[str, Callable[[], Perception]] = {"oracle": OraclePerception}
"""The perceptions by name."""


def perception_of(perception: Any) -> Perception:
    """The perception of a name, or the one given.

    Raises:
        OptionError: it is neither.
    """
    if isinstance(perception, str):
        return PERCEPTIONS[known_name("perception", perception, PERCEPTIONS)]()
    if isinstance(perception, type) or not isinstance(perception, Perception):
        expected = f"must be one of {', '.join(sorted(PERCEPTIONS))}, or a Perception"
        raise OptionError("perception", expected, perception)
    return perception


@dataclass(frozen=True)
class UnsteadyHead:
    """Perceives with a camera that has been turned a little since it was last looked at.

    Args:
        perception: what makes the snapshot.
        yaw_sd: of the turn, radians.
    """

    perception: Perception
    yaw_sd: float

    def perceive(self, truth: Layout, camera: Camera, rng: np.random.Generator) -> Perceived:
        """The snapshot that the turned camera takes of the objects where they truly are."""
        turned = replace(camera, yaw=camera.yaw + self.yaw_sd * rng.normal())
        return self.perception.perceive(truth, turned, rng)
