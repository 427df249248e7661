"""What a detector says of its errors, for each pair of `AdaptiveReid`."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.reid.adaptive.records import Errors
from farm_ar.scenes import Uncertainty

NO_ERRORS = Errors(*(np.zeros(0),) * 6)
"""Where no detector says any."""


def errors_of(
    uncertainty: Uncertainty | None,
    spacing: float,
    i: IntArray,
    shift: FloatArray,
    yaw: FloatArray,
    period: FloatArray,
) -> Errors:
    """The errors of P pairs.

    Args:
        uncertainty: of the N detections.
        spacing: of the labels, metres.
        i: (P,) which detection each is of.
        shift: (P, 2) from the label to the detection.
        yaw: (P,) of the labels, radians; NaN where not known.
        period: (P,) of their symmetry, radians.
    """
    if uncertainty is None:
        return NO_ERRORS
    place = uncertainty.covariance[:, :2, :2] / spacing**2
    square, axes = np.linalg.eigh((place + place.transpose(0, 2, 1)) / 2)
    square = np.maximum(square, 0.0)
    along = np.einsum("pk,pk->p", shift, axes[i, :, 1]) ** 2
    length = np.maximum((shift**2).sum(axis=1), 1e-300)
    harmonic = np.where(period > 0, 2 * np.pi / np.where(period > 0, period, 1.0), 0.0)
    rival = uncertainty.runner_up_yaw[i] - yaw
    told = np.isfinite(rival)
    return Errors(
        wide=square[i, 1],
        narrow=square[i, 0],
        along=np.minimum(along / length, 1.0),
        turn=np.maximum(uncertainty.covariance[i, 2, 2], 0.0) * harmonic**2,
        rival_turn=np.cos(np.where(told, rival, 0.0) * harmonic),
        rival_weight=np.where(told, np.nan_to_num(uncertainty.runner_up_weight[i]), 0.0),
    )
