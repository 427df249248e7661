"""The headset on the player's head: what it sees, where it looks, and how a head never quite keeps still."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import known_name
from farm_ar.geometry import heading
from farm_ar.scenes import Camera, FieldOfView, Scene

EYE_HEIGHT_M = 0.45
"""Height of the player's eyes above the table."""

RANGE_M = 3.0
"""The paper gives no range for the game; like the farm scene's 1.5 m this is beyond the table."""

FIELDS_OF_VIEW: dict[str, FieldOfView] = {
    "photo": FieldOfView.symmetric(float(np.deg2rad(64.7)), RANGE_M),
    "display": FieldOfView.symmetric(float(np.deg2rad(43.0)), RANGE_M, float(np.deg2rad(29.0))),
}
"""HoloLens 2: the photo camera, 64.7 degrees across, and the display, 43 by 29 degrees."""


def field_of_view(name: str) -> FieldOfView:
    """One of the headset's fields of view.

    Raises:
        OptionError: the name is not known.
    """
    return FIELDS_OF_VIEW[known_name("fov", name, FIELDS_OF_VIEW)]


def look_at(eye: FloatArray, target: FloatArray, fov: FieldOfView, height: float = EYE_HEIGHT_M) -> Camera:
    """The camera of a head at `eye` that looks at a point of the table.

    Args:
        eye: (2,) where the head is, metres.
        target: (2,) the point looked at, metres, on the table top.
        fov: what the camera sees.
        height: of the eyes above the table, metres.
    """
    direction = np.asarray(target, dtype=np.float64) - eye
    pitch = -np.arctan2(height, np.linalg.norm(direction))
    return Camera(np.asarray(eye), heading(direction), fov, np.asarray(height), np.asarray(pitch))


def random_camera(scene: Scene, fov: FieldOfView, rng: np.random.Generator) -> Camera:
    """A head somewhere behind the near edge that looks somewhere at the middle of the table.

    On the farm's table of 1.2 x 0.8 m: at x .6 +- .3, z -.25 to -.40, looking at x .1 to 1.1, z .3 to .6; on
    another the same in proportion to its sides.
    """
    width, depth = scene.size
    x, z = width * rng.uniform(0.25, 0.75), depth * rng.uniform(-0.5, -0.3125)
    dx, dz = width * rng.uniform(1 / 12, 11 / 12) - x, depth * rng.uniform(0.375, 0.75) - z
    height = EYE_HEIGHT_M * depth / 0.8
    return Camera.trusted(
        position=np.array([x, z]),
        yaw=np.array(np.arctan2(dx, dz)),
        fov=fov,
        height=np.array(height),
        pitch=np.array(-np.arctan2(height, np.sqrt(dx * dx + dz * dz))),
    )


def gaze_target(scene: Scene, gaze: str, seconds: float = 0.0) -> FloatArray:
    """(2,) the point of the table that the player looks at.

    Args:
        scene: whose sites are looked at.
        gaze: the name of a site, or "sweep": from the leftmost site on the table to the rightmost and
            back, in 8 s.
        seconds: time since the start, for the sweep.

    Raises:
        OptionError: the gaze is neither a site nor "sweep".
    """
    sites = {site.name: np.array([site.x, site.z]) for site in scene.sites}
    known_name("gaze", gaze, [*sites, "sweep"])
    if gaze != "sweep":
        return sites[gaze]
    on_table = [p for p in sites.values() if np.all(p >= 0) and np.all(p <= scene.size)]
    on_table = on_table or list(sites.values())
    left = min(on_table, key=lambda p: p[0])
    right = max(on_table, key=lambda p: p[0])
    share = (1 - np.cos(2 * np.pi * seconds / 8.0)) / 2
    target: FloatArray = left + share * (right - left)
    return target


@dataclass
class HeadMotion:
    """The small motion of a head that means to keep still: an Ornstein-Uhlenbeck process.

    Args:
        position_sd: of where the eyes are, metres.
        angle_sd: of where they look, radians.
        memory: seconds after which most of a deviation is forgotten.
    """

    position_sd: float = 0.004
    angle_sd: float = 0.006
    memory: float = 1.0

    def __post_init__(self) -> None:
        self._state = np.zeros(5)

    def step(self, seconds: float, rng: np.random.Generator) -> None:
        """Let time pass."""
        kept = np.exp(-seconds / self.memory)
        scale = np.array([self.position_sd] * 3 + [self.angle_sd] * 2)
        self._state = kept * self._state + np.sqrt(1 - kept**2) * scale * rng.normal(size=5)

    def applied(self, camera: Camera) -> Camera:
        """The camera as the head really holds it."""
        dx, dz, dy, dyaw, dpitch = self._state
        height = None if camera.height is None else camera.height + dy
        return Camera(
            camera.position + np.array([dx, dz]), camera.yaw + dyaw, camera.fov, height, camera.pitch + dpitch
        )
