"""How far the poses of detections can be trusted, where a detector knows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import ANGLE, BoolArray, FloatArray, IntArray, Record, first_wrong, read_only
from farm_ar.errors import SnapshotError

LARGEST = 1e12
"""Of a covariance's values, square metres and radians: places are within 1e6 metres."""

_ROUNDING = 1e-6
"""By how much of its largest entry a covariance may miss being one: detectors compute in single precision."""


@dataclass(frozen=True, eq=False)
class Uncertainty(Record):
    """Errors to be expected of N poses.

    Args:
        covariance: (N, 3, 3) of the errors of x, z and yaw, metres and radians.
        visible: (N,) share of what would be seen of each, were it alone, that is seen.
        runner_up_yaw: (N,) the second most probable heading, radians; NaN where there is none.
        runner_up_weight: (N,) its probability, 0 to 0.5; NaN where there is none.

    Raises:
        SnapshotError: a value is out of its limits, or the shapes do not agree.
    """

    covariance: FloatArray
    visible: FloatArray
    runner_up_yaw: FloatArray
    runner_up_weight: FloatArray

    def __post_init__(self) -> None:
        n = len(np.atleast_1d(self.visible))
        shapes = {"covariance": (n, 3, 3), "visible": (n,), "runner_up_yaw": (n,), "runner_up_weight": (n,)}
        for name, shape in shapes.items():
            try:
                array = read_only(getattr(self, name), np.float64, empty=(0, *shape[1:]))
            except (ValueError, TypeError):
                value = getattr(self, name)
                raise SnapshotError(
                    f"uncertainty.{name}", f"must be numbers of shape {shape}", value
                ) from None
            if array.shape != shape:
                raise SnapshotError(f"uncertainty.{name}", f"must have shape {shape}", array.shape)
            object.__setattr__(self, name, array)
        allowed: BoolArray = np.all(np.abs(self.covariance) <= LARGEST, axis=(1, 2))
        spread = np.where(allowed[:, None, None], self.covariance, 0.0)
        rounding = _ROUNDING * np.abs(spread).max(axis=(1, 2), initial=0.0)
        allowed &= np.abs(spread - spread.transpose(0, 2, 1)).max(axis=(1, 2), initial=0.0) <= rounding
        allowed &= np.linalg.eigvalsh(spread).min(axis=1, initial=0.0) >= -rounding
        self._require("covariance", allowed, f"must be a covariance, symmetric, of at most {LARGEST:.0e}")
        self._require("visible", (self.visible >= 0) & (self.visible <= 1), "must be from 0 to 1")
        yaw, weight = self.runner_up_yaw, self.runner_up_weight
        none = np.isnan(yaw) & np.isnan(weight)
        self._require("runner_up_yaw", none | ANGLE.allow(yaw), ANGLE.expected)
        right = none | ((weight >= 0) & (weight <= 0.5))
        self._require("runner_up_weight", right, "must be from 0 to 0.5, NaN where there is no runner-up")

    def _require(self, name: str, right: BoolArray, expected: str) -> None:
        where = first_wrong(right)
        if where is not None:
            value = getattr(self, name)[where].tolist()
            raise SnapshotError(f"uncertainty.{name}[{where[0]}]", expected, value)

    def __len__(self) -> int:
        return len(self.visible)

    def at(self, index: IntArray) -> Uncertainty:
        """That of some of them."""
        return Uncertainty.trusted(**{name: value[index] for name, value in vars(self).items()})

    def turned(self, turn: float) -> Uncertainty:
        """The same after a turn of the frame about the vertical axis, radians."""
        cosine, sine = np.cos(turn), np.sin(turn)
        rotation = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        found = rotation @ self.covariance @ rotation.T
        changed = {"covariance": found, "runner_up_yaw": self.runner_up_yaw + turn}
        return Uncertainty.trusted(**vars(self) | changed)
