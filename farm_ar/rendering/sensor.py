"""What a sensor makes of a picture: gain, vignette, noise and JPEG."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.errors import OptionError


@dataclass(frozen=True)
class Sensor:
    """How a camera's picture differs from what is there.

    Args:
        gain: least and greatest brightness of a frame, as a share.
        tint: SD of each colour's own gain.
        vignette: share of the light that is missing in the corners.
        noise: SD of each pixel's noise, of 255.
        jpeg: quality, 1 to 100; 0 for none.

    Raises:
        OptionError: a value is out of its limits.
    """

    gain: tuple[float, float] = (0.85, 1.15)
    tint: float = 0.03
    vignette: float = 0.2
    noise: float = 8.0
    jpeg: int = 80

    def __post_init__(self) -> None:
        if not 0 < self.gain[0] <= self.gain[1] <= 10:
            raise OptionError(
                "sensor.gain", "must be two numbers above 0, up to 10, the smaller first", self.gain
            )
        for name, most in (("tint", 1.0), ("vignette", 1.0), ("noise", 255.0), ("jpeg", 100)):
            if not 0 <= getattr(self, name) <= most:
                raise OptionError(f"sensor.{name}", f"must be from 0 to {most:g}", getattr(self, name))

    def expose(self, rgb: npt.NDArray[np.uint8], rng: np.random.Generator) -> npt.NDArray[np.uint8]:
        """The picture (H, W, 3) as the sensor gives it."""
        height, width = rgb.shape[:2]
        gain = rng.uniform(*self.gain) * (1 + self.tint * rng.standard_normal(3))
        row, column = np.linspace(-1, 1, height)[:, None], np.linspace(-1, 1, width)[None]
        fall = 1 - self.vignette * ((row**2 + column**2) / 2) ** 2
        value = np.asarray(rgb * (gain * fall[..., None]), dtype=np.float32)
        if self.noise:
            value = value + self.noise * rng.standard_normal(rgb.shape, dtype=np.float32)
        seen: npt.NDArray[np.uint8] = np.clip(np.rint(value), 0, 255).astype(np.uint8)
        if not self.jpeg:
            return seen
        done, data = cv2.imencode(".jpg", seen[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, int(self.jpeg)])
        if not done:
            raise RuntimeError("OpenCV cannot write JPEG")
        back = cv2.imdecode(data, cv2.IMREAD_COLOR)
        assert back is not None
        return np.ascontiguousarray(back[..., ::-1], dtype=np.uint8)
