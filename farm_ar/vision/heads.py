"""What the network's output means: its channels, and how things are read from them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry import wrap
from farm_ar.vision.canonical import STRIDE

FOOT = slice(0, 2)
"""From a cell's middle to the image of the foot's middle, cells."""

HEADING, AXIS = slice(2, 4), slice(4, 6)
"""Sine and cosine of the heading relative to the ray from the eye, and of twice that: the mean over what is
possible, so that the first is shorter than the second where front and back may be confused."""

VISIBLE = 6
"""Share of the thing that is seen."""

SPREAD = slice(7, 9)
"""Logarithm of the mean absolute error of the foot, cells, and of the axis."""

FOREGROUND = 9
"""Logit of the share of the cell that shows objects."""

_LEAST_SHARE, _AGREE = 0.35, 1.5
"""Share of a peak's heat that a cell beside it has, and cells by which it may differ, for it to count."""

REGRESSED = 10
"""Channels beside the heat of each category, which come first."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """N objects that the network may have seen.

    Args:
        category: (N,) index.
        heat: (N,) of the peak, 0 to 1.
        foot: (N, 2) canonical pixels of the foot's middle.
        heading: (N,) relative to the ray from the eye, radians.
        flipped: (N,) probability that the heading is the opposite.
        visible: (N,) share that is seen, as the network has it.
        spread: (N, 2) expected absolute errors of the foot, pixels, and of the heading, radians.
    """

    category: IntArray
    heat: FloatArray
    foot: FloatArray
    heading: FloatArray
    flipped: FloatArray
    visible: FloatArray
    spread: FloatArray


def read(output: npt.NDArray[np.float32], least: float = 0.1, most: int = 128) -> Candidates:
    """The objects whose peaks are highest.

    Args:
        output: (C + `REGRESSED`, H, W) of one image.
        least: heat of a peak.
        most: objects.
    """
    categories = len(output) - REGRESSED
    heat = 1 / (1 + np.exp(-output[:categories].astype(np.float64)))
    peaks = np.stack([np.asarray(cv2.dilate(layer, np.ones((3, 3)))) for layer in heat])
    found = np.argwhere((heat >= peaks) & (heat >= least))
    order = np.argsort(-heat[tuple(found.T)], kind="stable")[:most]
    category, row, column = found[order].T
    rest = output[categories:].astype(np.float64)
    height, width = heat.shape[1:]
    # What the cells around a peak say counts, too, by their heat.
    reach = np.array([(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)])
    rows, columns = row[:, None] + reach[:, 0], column[:, None] + reach[:, 1]
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    rows, columns = rows.clip(0, height - 1), columns.clip(0, width - 1)
    values = rest[:, rows, columns]  # (R, N, 5)
    foot_cells = values[FOOT] + np.stack([columns + 0.5, rows + 0.5])
    # Of cells with little heat nothing was learnt, and some speak of something else.
    beside = heat[category[:, None], rows, columns]
    agree = np.abs(foot_cells - foot_cells[:, :, :1]).max(axis=0) < _AGREE
    weight = np.where(inside & agree & (beside > _LEAST_SHARE * beside[:, :1]), beside**2, 0.0)
    weight /= np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)
    foot = STRIDE * (foot_cells * weight).sum(axis=2) - 0.5
    mean = (values * weight).sum(axis=2)
    heading, flipped = _heading(mean[HEADING], mean[AXIS])
    spread = np.exp(np.clip(mean[SPREAD], -8, 3)) * [[STRIDE], [1.0]]
    visible = mean[VISIBLE].clip(0, 1)
    return Candidates(category, heat[category, row, column], foot.T, heading, flipped, visible, spread.T)


def _heading(once: FloatArray, twice: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N,) heading by the axis and the side that is more probable; probability of the other side."""
    axis = np.arctan2(twice[0], twice[1]) / 2
    along = once[0] * np.sin(axis) + once[1] * np.cos(axis)
    heading = wrap(np.where(along >= 0, axis, axis + np.pi))
    share = np.abs(along) / np.maximum(np.hypot(*twice), 1e-6)
    return heading, ((1 - share) / 2).clip(0.0, 0.5)
