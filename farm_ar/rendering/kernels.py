"""Compiled: which triangle each pixel shows, and how near it is.

Nearness is 1 / depth, which is linear across a picture; 0 where nothing is. A pixel shows a triangle if its
middle is inside; of two triangles with a common edge exactly one has the pixels along it.
"""

from __future__ import annotations

from math import ceil

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled
from farm_ar.structs import Struct, Structs

Nearness = npt.NDArray[np.float32]
Faces = npt.NDArray[np.int32]
Colours = npt.NDArray[np.uint8]

NOTHING = -1
"""The face of a pixel that shows none."""

_FARTHEST_PX = 1e7
_compile = compiled(error_model="numpy")


class Lens(Struct):
    """A pinhole, or with `parallel` set a camera without perspective, its pixels fx and fy to the metre."""

    fx: float
    fy: float
    cx: float
    cy: float
    near: float
    parallel: bool


@_compile
def rasterise(corners: FloatArray, lens: Structs[Lens], first: int, nearness: Nearness, face: Faces) -> None:
    """Draw triangles (F, 3, 3), in the camera's axes (right, down, forward), over what is there.

    Args:
        corners: of the triangles, metres.
        lens: of the camera, (1,) of them.
        first: number of the first triangle.
        nearness: (H, W), changed.
        face: (H, W) number of the triangle, changed likewise.
    """
    fx, fy, cx, cy = lens[0].fx, lens[0].fy, lens[0].cx, lens[0].cy
    near, parallel = lens[0].near, lens[0].parallel
    cut = np.empty((4, 3))
    for k in range(len(corners)):
        number = 0
        if parallel:
            for i in range(3):
                cut[i, 0] = fx * corners[k, i, 0] + cx
                cut[i, 1] = fy * corners[k, i, 1] + cy
                cut[i, 2] = -corners[k, i, 2]
            number = 3
        else:
            for i in range(3):
                j = i + 1 if i < 2 else 0
                z, following = corners[k, i, 2], corners[k, j, 2]
                if z >= near:
                    cut[number, 0] = fx * corners[k, i, 0] / z + cx
                    cut[number, 1] = fy * corners[k, i, 1] / z + cy
                    cut[number, 2] = 1.0 / z
                    number += 1
                if (z >= near) != (following >= near):
                    share = (z - near) / (z - following)
                    x = corners[k, i, 0] + share * (corners[k, j, 0] - corners[k, i, 0])
                    y = corners[k, i, 1] + share * (corners[k, j, 1] - corners[k, i, 1])
                    cut[number, 0] = fx * x / near + cx
                    cut[number, 1] = fy * y / near + cy
                    cut[number, 2] = 1.0 / near
                    number += 1
        for i in range(2, number):
            _fill(cut, 0, i - 1, i, first + k, nearness, face)


@_compile
def _fill(p: FloatArray, a: int, b: int, c: int, number: int, nearness: Nearness, face: Faces) -> None:
    """One triangle: three of the rows (x, y, nearness) of `p`, pixels."""
    height, width = nearness.shape
    top = min(p[a, 1], p[b, 1], p[c, 1])
    low = max(p[a, 1], p[b, 1], p[c, 1])
    left = min(p[a, 0], p[b, 0], p[c, 0])
    right = max(p[a, 0], p[b, 0], p[c, 0])
    if not (left < width and right >= 0.0 and top < height and low >= 0.0):
        return
    if left < -_FARTHEST_PX or right > _FARTHEST_PX or top < -_FARTHEST_PX or low > _FARTHEST_PX:
        return
    area = (p[b, 0] - p[a, 0]) * (p[c, 1] - p[a, 1]) - (p[c, 0] - p[a, 0]) * (p[b, 1] - p[a, 1])
    if area == 0.0:
        return
    first, second = p[b, 2] - p[a, 2], p[c, 2] - p[a, 2]
    across = (first * (p[c, 1] - p[a, 1]) - second * (p[b, 1] - p[a, 1])) / area
    down = (second * (p[b, 0] - p[a, 0]) - first * (p[c, 0] - p[a, 0])) / area
    begin, end = max(ceil(top), 0), min(ceil(low), height)
    for row in range(begin, end):
        lowest, highest = 1e30, -1e30
        for edge in range(3):
            i = a if edge == 0 else (b if edge == 1 else c)
            j = b if edge == 0 else (c if edge == 1 else a)
            # Both triangles of an edge must find the same column, so it always goes down.
            if p[i, 1] > p[j, 1] or (p[i, 1] == p[j, 1] and p[i, 0] > p[j, 0]):
                i, j = j, i
            if p[i, 1] <= row < p[j, 1]:
                column = p[i, 0] + (row - p[i, 1]) * ((p[j, 0] - p[i, 0]) / (p[j, 1] - p[i, 1]))
                lowest, highest = min(lowest, column), max(highest, column)
        if highest <= lowest or highest < 0.0 or lowest >= width:
            continue
        start, stop = max(ceil(lowest), 0), min(ceil(highest), width)
        value = p[a, 2] + (row - p[a, 1]) * down + (start - p[a, 0]) * across
        for column in range(start, stop):
            if value > nearness[row, column]:
                nearness[row, column] = value
                face[row, column] = number
            value += across
