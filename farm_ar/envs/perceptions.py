"""What the headset of an environment perceives with, by name; and the head that does not keep still."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from farm_ar.errors import OptionError, known_name
from farm_ar.game_logic.perception import OraclePerception, Perceived, Perception
from farm_ar.scenes import Camera, Layout, Scene


def _oracle(scene: Scene, noise: str) -> Perception:
    if noise == "none":
        return OraclePerception()
    from farm_ar.vision.measured_noise import MeasuredPerception

    return MeasuredPerception()


def _pixels(scene: Scene, noise: str) -> Perception:
    from farm_ar.vision.perception import pixel_perception

    return pixel_perception(scene)


PERCEPTIONS: dict[str, Callable[[Scene, str], Perception]] = {"oracle": _oracle, "pixels": _pixels}
"""The perceptions by name, each made with the scene and the oracle's noise."""

ORACLE_NOISE = ("none", "measured")


def perception_of(perception: Any, scene: Scene, noise: str = "none") -> Perception:
    """The perception of a name, or the one given.

    Args:
        perception: either.
        scene: what is perceived.
        noise: of the oracle, one of `ORACLE_NOISE`.

    Raises:
        OptionError: it is neither.
        MeshError: it is to see pixels of a scene without models.
    """
    check_perception(perception)
    made: Perception = PERCEPTIONS[perception](scene, noise) if isinstance(perception, str) else perception
    return made


def check_perception(perception: Any) -> None:
    """See that something is the name of a perception, or one.

    Raises:
        OptionError: it is neither.
    """
    if isinstance(perception, str):
        known_name("perception", perception, PERCEPTIONS)
    elif isinstance(perception, type) or not isinstance(perception, Perception):
        expected = f"must be one of {', '.join(sorted(PERCEPTIONS))}, or a Perception"
        raise OptionError("perception", expected, perception)


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
