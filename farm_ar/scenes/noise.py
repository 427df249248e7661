"""The paper's noise models: random shifts and turns of a layout (section 4.1.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError
from farm_ar.scenes.layout import Layout


@dataclass(frozen=True)
class Gaussian:
    """A normal distribution: its mean and its standard deviation (SD), which is not negative.

    Raises:
        OptionError: one of them is not finite, or the SD is negative.
    """

    mean: float = 0.0
    sd: float = 0.0

    def __post_init__(self) -> None:
        if not np.isfinite(self.mean):
            raise OptionError("mean", "must be finite", self.mean)
        if not (np.isfinite(self.sd) and self.sd >= 0):
            raise OptionError("sd", "must be a number not below 0", self.sd)


@dataclass(frozen=True)
class LayoutNoise:
    """The paper's T(mean, sd) and R(mean, sd).

    Args:
        translation: of x and of z, independently, metres.
        rotation: of yaw, radians; what it adds is kept within a full turn either way.
    """

    translation: Gaussian = Gaussian()
    rotation: Gaussian = Gaussian()

    @classmethod
    def of(cls, translation_sd: float, rotation_sd_deg: float) -> LayoutNoise:
        """T(0, translation_sd metres) and R(0, rotation_sd_deg degrees)."""
        return cls(Gaussian(0.0, translation_sd), Gaussian(0.0, float(np.deg2rad(rotation_sd_deg))))

    def disturb(
        self,
        layout: Layout,
        room_size: tuple[float, float] | None,
        rng: np.random.Generator,
        batch_shape: tuple[int, ...] = (),
    ) -> Layout:
        """The layout after the noise; what is fixed stays, and nothing leaves a room [0, w] x [0, d].

        Args:
            layout: a single arrangement, or a batch that broadcasts with `batch_shape`.
            room_size: width and depth of the room, metres; None for a place without walls.
            rng: where the randomness comes from.
            batch_shape: how many noisy layouts to draw.

        Returns:
            The same objects with poses of shape `batch_shape` (broadcast with the layout's own).
        """
        shape = (*np.broadcast_shapes(batch_shape, layout.batch_shape), len(layout))
        shift = rng.normal(self.translation.mean, self.translation.sd, (*shape, 2))
        turn = np.clip(rng.normal(self.rotation.mean, self.rotation.sd, shape), -2 * np.pi, 2 * np.pi)
        moved: FloatArray = layout.position + shift
        if room_size is not None:
            moved = np.clip(moved, 0.0, np.asarray(room_size))
        position = np.where(layout.fixed[:, None], layout.position, moved)
        return layout.placed(position, np.where(layout.fixed, layout.yaw, layout.yaw + turn))
