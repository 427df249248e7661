"""What may be chosen of a delivery: arguments, defaults and checks, in one place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from numbers import Real
from typing import Any

import numpy as np

from farm_ar.envs.delivery.rgbd import DepthCamera
from farm_ar.envs.generator import scene_of
from farm_ar.errors import OptionError, known_name
from farm_ar.reid import ReidFactory, reid_factory
from farm_ar.scenes import LayoutNoise, Scene

RENDER_MODES = ("rgb_array",)

_LIMITS = {
    "shift_sd": (0.0, 100.0, "metres"),
    "turn_sd_deg": (0.0, 720.0, "degrees"),
    "seconds": (1.0, 3600.0, "seconds"),
}


@dataclass(frozen=True, kw_only=True)
class DeliveryConfig:
    """What may be chosen of a delivery; all values are JSON, except for objects in place of names.

    Args:
        scene: a built-in scene's name, a `.json` file, or a `Scene`.
        chairs: the labels that stand in the room; None for all of the scene.
        target: the label that is to get the delivery.
        reid: a re-identifier's name, or a function from a `Scene` to a `Reidentifier`.
        shift_sd: SD of how far chairs were moved along x and along z, metres.
        turn_sd_deg: SD of how far they were turned, degrees.
        fov_deg: the camera's field of view across and from top to bottom, degrees.
        seconds: after which an episode is truncated.
        render_mode: one of `RENDER_MODES`, or None.

    Raises:
        OptionError: a name is not known, or a number is out of its limits.
    """

    scene: str | Scene = "lab"
    chairs: Sequence[str] | None = ("4", "5", "6", "7")
    target: str = "4"
    reid: str | ReidFactory = "spatial"
    shift_sd: float = 0.6
    turn_sd_deg: float = 120.0
    fov_deg: Sequence[float] = (87.0, 58.0)
    seconds: float = 120.0
    render_mode: str | None = None

    def __post_init__(self) -> None:
        if self.render_mode not in (None, *RENDER_MODES):
            expected = "must be rgb_array, through gym.make also rgb_array_list, or None; there is no window"
            raise OptionError("render_mode", expected, self.render_mode)
        reid_factory(self.reid)
        for name, (low, high, unit) in _LIMITS.items():
            value = getattr(self, name)
            real = isinstance(value, Real) and not isinstance(value, bool)
            if not (real and low <= float(value) <= high):
                raise OptionError(name, f"must be {low:g} to {high:g} {unit}", value)
            object.__setattr__(self, name, float(value))
        if self.chairs is not None:
            if isinstance(self.chairs, str) or not all(isinstance(one, str) for one in self.chairs):
                raise OptionError("chairs", "must be a list of labels, or None", self.chairs)
            object.__setattr__(self, "chairs", tuple(self.chairs))
        angles = tuple(self.fov_deg) if isinstance(self.fov_deg, Sequence) else ()
        if len(angles) != 2 or not all(isinstance(one, Real) and 1 <= one < 180 for one in angles):
            raise OptionError("fov_deg", "must be two angles from 1 to below 180 degrees", self.fov_deg)
        object.__setattr__(self, "fov_deg", tuple(float(one) for one in angles))

    def arguments(self) -> dict[str, Any]:
        """The arguments, by name, of which an equal one is made."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def known(self) -> Scene:
        """The scene as it was last known, with the chairs that stand there.

        Raises:
            OptionError: a chair, or the target, is not in it.
        """
        scene = scene_of(self.scene, False)
        labels = scene.layout.labels if self.chairs is None else self.chairs
        for label in labels:
            known_name("chairs", label, scene.layout.labels)
        known_name("target", self.target, labels)
        return scene.knowing(scene.layout.subset([scene.layout.index(label) for label in labels]))

    def noise(self) -> LayoutNoise:
        """How the chairs were moved."""
        return LayoutNoise.of(self.shift_sd, self.turn_sd_deg)

    def camera(self) -> DepthCamera:
        """The camera."""
        across, down = np.deg2rad(self.fov_deg).tolist()
        return DepthCamera(across=across, down=down)
