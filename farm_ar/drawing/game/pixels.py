"""Compiled kernels on pixels: pasting with transparency, mixing a colour into an area, covering all with ice.

All in whole numbers, so that the same picture has the same bytes everywhere.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled

Bytes = npt.NDArray[np.uint8]
Distances = npt.NDArray[np.float32]


@compiled
def paste(image: Bytes, sprite: Bytes, left: int, top: int) -> None:
    """Put a sprite, (h, w, 4), its colours multiplied by its opacity, on a picture (H, W, 3).

    What lies outside the picture is cut off.
    """
    height, width = image.shape[0], image.shape[1]
    first, last = max(0, -left), min(sprite.shape[1], width - left)
    for row in range(max(0, -top), min(sprite.shape[0], height - top)):
        below, above = image[top + row].reshape(-1), sprite[row].reshape(-1)
        for column in range(first, last):
            _mix_pixel(below, 3 * (left + column), above, 4 * column)


@compiled(inline="always")
def _mix_pixel(below: Bytes, at: int, above: Bytes, start: int) -> None:
    """Put one pixel of four bytes on one of three."""
    # Unsigned places spare the question whether they are counted from the end.
    b, a = np.uintp(at), np.uintp(start)
    kept = np.uint32(255) - np.uint32(above[a + np.uintp(3)])
    if kept == 255:
        return
    for channel in range(3):
        c = np.uintp(channel)
        mixed = np.uint32(above[a + c])
        if kept:
            # Divides by 255, rounding to the nearest.
            part = np.uint32(below[b + c]) * kept + np.uint32(128)
            mixed = min(mixed + ((part + (part >> np.uint32(8))) >> np.uint32(8)), np.uint32(255))
        below[b + c] = np.uint8(mixed)


@compiled
def cover(image: Bytes, kept: Bytes, added: Bytes) -> None:
    """Keep `kept` / 256 of each value of a picture and add `added`; all of one shape and contiguous."""
    values, parts, more = image.reshape(-1), kept.reshape(-1), added.reshape(-1)
    for i in range(values.size):
        values[i] = np.uint8(
            ((np.uint16(values[i]) * np.uint16(parts[i])) >> np.uint16(8)) + np.uint16(more[i])
        )


@compiled
def _mix(values: Bytes, added: npt.NDArray[np.uint16], kept: int) -> None:
    """Keep `kept` / 256 of values and add `added` / 256."""
    for i in range(values.size):
        values[i] = np.uint8((np.uint16(values[i]) * np.uint16(kept) + added[i]) >> np.uint16(8))


@compiled
def mix_area(image: Bytes, points: FloatArray, red: int, green: int, blue: int, part: int) -> None:
    """Mix `part` / 256 of a colour into the polygon (V, 2) of a picture, corners in pixels, even-odd."""
    height, width, corners = image.shape[0], image.shape[1], len(points)
    crossing = np.empty(corners)
    # One row of what is added: like that, the innermost loop runs over bytes that lie side by side.
    added = np.empty(3 * width, np.uint16)
    added[0::3], added[1::3], added[2::3] = red * part, green * part, blue * part
    first = max(0, int(np.floor(points[:, 1].min())))
    last = min(height - 1, int(np.ceil(points[:, 1].max())))
    for row in range(first, last + 1):
        y, count = row + 0.5, 0
        for k in range(corners):
            x0, y0 = points[k, 0], points[k, 1]
            x1, y1 = points[(k + 1) % corners, 0], points[(k + 1) % corners, 1]
            if (y0 <= y) != (y1 <= y):
                x, at = x0 + (y - y0) / (y1 - y0) * (x1 - x0), count
                while at > 0 and crossing[at - 1] > x:
                    crossing[at] = crossing[at - 1]
                    at -= 1
                crossing[at] = x
                count += 1
        values = image[row].reshape(-1)
        for pair in range(0, count - 1, 2):
            begin = max(0, int(np.ceil(crossing[pair] - 0.5)))
            end = min(width, int(np.ceil(crossing[pair + 1] - 0.5)))
            if begin < end:
                _mix(values[3 * begin : 3 * end], added[3 * begin : 3 * end], 256 - part)


@compiled
def paste_all(image: Bytes, store: Bytes, sprite: IntArray, corner: IntArray) -> None:
    """Put sprites on a picture (H, W, 3), one after the other.

    Args:
        image: to draw on.
        store: (B,) the pixels of all sprites, four bytes each as `paste` takes them.
        sprite: (S, 3) of each its first byte in the store, its height and its width.
        corner: (S, 2) column and row of its upper left corner; what lies outside is cut off.
    """
    for s in range(len(sprite)):
        start, high, wide = sprite[s, 0], sprite[s, 1], sprite[s, 2]
        paste(
            image, store[start : start + 4 * high * wide].reshape(high, wide, 4), corner[s, 0], corner[s, 1]
        )


@compiled
def paste_in_space(
    image: Bytes,
    away: Distances,
    store: Bytes,
    sprite: IntArray,
    corner: IntArray,
    distance: Distances,
    solid: bool,
) -> None:
    """Put sprites on a picture as `paste_all` does, but only where nothing nearer is.

    Args:
        image: to draw on.
        away: (H, W) how far away is what each pixel shows.
        store: as in `paste_all`.
        sprite: likewise.
        corner: likewise.
        distance: (S,) how far away each sprite is, the farthest first.
        solid: whether the sprites hide what comes later and is farther away.
    """
    height, width = image.shape[0], image.shape[1]
    for s in range(len(sprite)):
        start, high, wide = sprite[s, 0], sprite[s, 1], sprite[s, 2]
        left, top = corner[s, 0], corner[s, 1]
        first, last = max(0, -left), min(wide, width - left)
        for row in range(max(0, -top), min(high, height - top)):
            below, depth = image[top + row].reshape(-1), away[top + row]
            for column in range(first, last):
                at = start + 4 * (row * wide + column)
                if store[at + 3] == 0 or depth[left + column] < distance[s]:
                    continue
                _mix_pixel(below, 3 * (left + column), store, at)
                if solid and store[at + 3] >= 128:
                    depth[left + column] = distance[s]
