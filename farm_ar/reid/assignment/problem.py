"""What the compiled method is asked and answers: detections, labels and weights of many snapshots at once."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from farm_ar.arrays import BoolArray, FloatArray, IntArray


class Seen(NamedTuple):
    """The detections of B snapshots, rows padded to K, and where each was taken from.

    Args:
        number: (B,) detections in each snapshot: the first so many of `order`.
        camera: (B or 1, 2) metres; for pruning only.
        position: (B, K, 2) metres.
        yaw: (B, K) radians; NaN where not known.
        sides: (B or 1, K, 3) sorted logarithms of the sides; NaN where not known.
        category: (B or 1, K) codes, `UNKNOWN` where not known.
        order: (B or 1, K) the order in which the detections are given labels, which settles ties.
    """

    number: IntArray
    camera: FloatArray
    position: FloatArray
    yaw: FloatArray
    sides: FloatArray
    category: IntArray
    order: IntArray


class Known(NamedTuple):
    """The M labels of U different sizes, and the S sites.

    Args:
        position: (B or 1, M, 2) metres.
        yaw: (B or 1, M) radians; NaN where not known.
        category: (M,) codes, from 0.
        kind: (M,) index into `sides`.
        sides: (U, 3) sorted logarithms of the sides; NaN where not known.
        site: (M,) the site of each label.
        sites: (S, 2) centres, metres; (0, 2) for no pruning.
        order: (B or 1, M) the order in which the labels are tried, which settles ties.
    """

    position: FloatArray
    yaw: FloatArray
    category: IntArray
    kind: IntArray
    sides: FloatArray
    site: IntArray
    sites: FloatArray
    order: IntArray


class CostModel(NamedTuple):
    """How labels are given to detections.

    Args:
        translation_weight: w_t divided by the room's diagonal.
        rotation_weight: w_r.
        compare_sizes: whether the dimension cost counts.
        gate: whether a label must be of the detection's category, where that is known.
        threshold: of the sites' cumulative probability, 0 to 1.
    """

    translation_weight: float
    rotation_weight: float
    compare_sizes: bool = False
    gate: bool = True
    threshold: float = 1.0


class Answer(NamedTuple):
    """What is found out of B snapshots.

    Args:
        label: (B, K) index of the label of each detection, `UNKNOWN` for none.
        cost: (B, K) its cost, NaN for none.
        candidates: (B,) labels considered.
        widened: (B,) whether sites were added because there were fewer candidates than detections.
        margin: (B or 0, K) rise of the total cost if the detection must give up its label, NaN for none.
        runner_up: (B or 0, K) the label it then has, `UNKNOWN` for none.
        costs: (B or 0, K, M) of every label for every row, detected or not; infinite across known categories
            where these are kept apart.
    """

    label: IntArray
    cost: FloatArray
    candidates: IntArray
    widened: BoolArray
    margin: FloatArray
    runner_up: IntArray
    costs: FloatArray


def seen_at(
    position: FloatArray,
    yaw: FloatArray,
    category: IntArray,
    present: BoolArray | None = None,
    sides: FloatArray | None = None,
) -> Seen:
    """Detections of B snapshots by their poses, for `assess`.

    Args:
        position: (B, K, 2) metres.
        yaw: (B, K) radians.
        category: (K,) or (B, K) codes, `UNKNOWN` where not known.
        present: (B, K) which of them are detected; all by default.
        sides: (K, 3) or (B, K, 3) sorted logarithms of the sides (`sorted_log_sides`); not needed where sizes
            do not count.
    """
    b, k = yaw.shape
    present = np.ones((b, k), dtype=bool) if present is None else present
    sides = np.zeros((1, k, 3)) if sides is None else sides if sides.ndim == 3 else sides[None]
    return Seen(
        _array(present.sum(axis=1), np.int64),
        _array(np.zeros((1, 2)), np.float64),
        _array(position, np.float64),
        _array(yaw, np.float64),
        _array(sides, np.float64),
        _array(category if category.ndim == 2 else category[None], np.int64),
        _array(np.argsort(~present, axis=1, kind="stable"), np.int64),
    )


def known_at(
    position: FloatArray, yaw: FloatArray, category: IntArray, sides: FloatArray | None = None
) -> Known:
    """Labels by their poses, for `assess`: all are considered.

    Args:
        position: (M, 2) metres, or (B, M, 2) where each snapshot has its own.
        yaw: (M,) or (B, M) radians.
        category: (M,) codes, from 0.
        sides: (M, 3) sorted logarithms of the sides; not needed where sizes do not count.
    """
    m = len(category)
    return Known(
        _array(position if position.ndim == 3 else position[None], np.float64),
        _array(yaw if yaw.ndim == 2 else yaw[None], np.float64),
        _array(category, np.int64),
        _array(np.zeros(m) if sides is None else np.arange(m), np.int64),
        _array(np.zeros((1, 3)) if sides is None else sides, np.float64),
        _array(np.zeros(m), np.int64),
        _array(np.zeros((0, 2)), np.float64),
        _array(np.arange(m)[None], np.int64),
    )


def _array(values: NDArray[Any], dtype: type[np.generic]) -> NDArray[Any]:
    return np.array(values, dtype=dtype, order="C")
