"""Compiled kernels on pixels: pasting with transparency, mixing a colour into an area, covering all with ice.

All in whole numbers, so that the same picture has the same bytes everywhere.
"""

from __future__ import annotations

import numba
import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray

Bytes = npt.NDArray[np.uint8]


@numba.njit(cache=True, nogil=True)
def paste(image: Bytes, sprite: Bytes, left: int, top: int) -> None:
    """Put a sprite, (h, w, 4), its colours multiplied by its opacity, on a picture (H, W, 3).

    What lies outside the picture is cut off.
    """
    height, width = image.shape[0], image.shape[1]
    for row in range(max(0, -top), min(sprite.shape[0], height - top)):
        for column in range(max(0, -left), min(sprite.shape[1], width - left)):
            alpha = np.int32(sprite[row, column, 3])
            if alpha == 0:
                continue
            for channel in range(3):
                below = np.int32(image[top + row, left + column, channel])
                mixed = np.int32(sprite[row, column, channel]) + (below * (255 - alpha) + 127) // 255
                image[top + row, left + column, channel] = mixed if mixed < 255 else 255


@numba.njit(cache=True, nogil=True)
def cover(image: Bytes, kept: Bytes, added: Bytes) -> None:
    """Keep `kept` / 256 of each value of a picture and add `added`; all of one shape and contiguous."""
    values, parts, more = image.reshape(-1), kept.reshape(-1), added.reshape(-1)
    for i in range(values.size):
        values[i] = np.uint8(
            ((np.uint16(values[i]) * np.uint16(parts[i])) >> np.uint16(8)) + np.uint16(more[i])
        )


@numba.njit(cache=True, nogil=True)
def mix_area(image: Bytes, points: FloatArray, red: int, green: int, blue: int, part: int) -> None:
    """Mix `part` / 256 of a colour into the polygon (V, 2) of a picture, corners in pixels, even-odd."""
    height, width, corners = image.shape[0], image.shape[1], len(points)
    crossing = np.empty(corners)
    first = max(0, int(np.floor(points[:, 1].min())))
    last = min(height - 1, int(np.ceil(points[:, 1].max())))
    for row in range(first, last + 1):
        y, count = row + 0.5, 0
        for k in range(corners):
            x0, y0 = points[k, 0], points[k, 1]
            x1, y1 = points[(k + 1) % corners, 0], points[(k + 1) % corners, 1]
            if (y0 <= y) != (y1 <= y):
                crossing[count] = x0 + (y - y0) / (y1 - y0) * (x1 - x0)
                count += 1
        ends = np.sort(crossing[:count])
        for pair in range(0, count - 1, 2):
            begin = max(0, int(np.ceil(ends[pair] - 0.5)))
            end = min(width, int(np.ceil(ends[pair + 1] - 0.5)))
            for column in range(begin, end):
                pixel = image[row, column]
                pixel[0] = (np.int32(pixel[0]) * (256 - part) + red * part) >> 8
                pixel[1] = (np.int32(pixel[1]) * (256 - part) + green * part) >> 8
                pixel[2] = (np.int32(pixel[2]) * (256 - part) + blue * part) >> 8
