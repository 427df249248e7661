"""How right an identification is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import SnapshotError
from farm_ar.reid.answers import Identification


def accuracy(identification: Identification, truth: Sequence[str | None]) -> float:
    """Correct labels as a share of the detections; NaN if there are none. Paper, Eq. 10.

    Args:
        identification: the answer for N detections.
        truth: N labels that they really are; None for a false detection, for which None is the right answer.

    Raises:
        SnapshotError: there is not one true label per detection.
    """
    given = identification.labels
    if len(given) != len(truth):
        raise SnapshotError("truth", f"must have {len(given)} labels", len(truth))
    if not given:
        return float("nan")
    return sum(a == b for a, b in zip(given, truth, strict=True)) / len(given)


def batch_accuracy(label: IntArray, truth: IntArray, count: IntArray) -> FloatArray:
    """Eq. 10 of many snapshots at once.

    Args:
        label: (..., K) index of the label given to each detection.
        truth: (..., K) index of the label that it really is.
        count: (...) how many of the K detections exist.

    Returns:
        (...) shares; NaN where nothing was detected.
    """
    exists = np.arange(label.shape[-1]) < count[..., None]
    correct = np.sum((label == truth) & exists, axis=-1)
    return np.where(count > 0, correct / np.maximum(count, 1), np.nan)
