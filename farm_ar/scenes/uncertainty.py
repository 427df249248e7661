"""How far the poses of detections can be trusted, where a detector knows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from farm_ar.arrays import ANGLE, BoolArray, FloatArray, Record, first_wrong, read_only
from farm_ar.errors import SnapshotError

LARGEST = 1e12
"""Of a covariance's values, square metres and radians: places are within 1e6 metres."""

_ROUNDING = 1e-6
"""By how much of its largest entry a covariance may miss being one: detectors compute in single precision."""


@dataclass(frozen=True, eq=False)
class Uncertainty(Record):
    """Errors to be expected of N poses, or of (B, N) of a batch of snapshots.

    Args:
        covariance: (N, 3, 3) of the errors of x, z and yaw, metres and radians; zeros where not known, which
            methods take for what is usual.
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
        n = np.shape(np.atleast_1d(self.visible))
        shapes = {"covariance": (*n, 3, 3), "visible": n, "runner_up_yaw": n, "runner_up_weight": n}
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
        allowed: BoolArray = np.all(np.abs(self.covariance) <= LARGEST, axis=(-2, -1))
        spread = np.where(allowed[..., None, None], self.covariance, 0.0)
        rounding = _ROUNDING * np.abs(spread).max(axis=(-2, -1), initial=0.0)
        allowed &= np.abs(spread - np.swapaxes(spread, -1, -2)).max(axis=(-2, -1), initial=0.0) <= rounding
        allowed &= np.linalg.eigvalsh(spread).min(axis=-1, initial=0.0) >= -rounding
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
            place = "".join(f"[{i}]" for i in where)
            raise SnapshotError(f"uncertainty.{name}{place}", expected, value)

    def __len__(self) -> int:
        return int(self.visible.shape[-1])

    @classmethod
    def unknown(cls, *shape: int) -> Uncertainty:
        """That of detectors that say nothing of their errors."""
        nothing = np.full(shape, np.nan)
        return cls(np.zeros((*shape, 3, 3)), np.ones(shape), nothing, nothing)

    def at(self, index: Any) -> Uncertainty:
        """That of some of them, by any index of their arrays."""
        return Uncertainty.trusted(**{name: value[index] for name, value in vars(self).items()})

    def turned(self, turn: float | FloatArray) -> Uncertainty:
        """The same after a turn of the frame about the vertical axis, radians, or (B, 1) of them."""
        cosine, sine = np.cos(turn), np.sin(turn)
        rotation = np.zeros((*np.shape(turn), 3, 3))
        rotation[..., 0, 0], rotation[..., 0, 1], rotation[..., 2, 2] = cosine, sine, 1.0
        rotation[..., 1, 0], rotation[..., 1, 1] = -sine, cosine
        found = rotation @ self.covariance @ np.swapaxes(rotation, -1, -2)
        changed = {"covariance": found, "runner_up_yaw": self.runner_up_yaw + turn}
        return Uncertainty.trusted(**vars(self) | changed)
