"""Compiled: which triangle each pixel shows and how near it is, and the light on it.

Nearness is 1 / depth, which is linear across a picture; 0 where nothing is. A pixel shows a triangle if its
middle is inside; of two triangles with a common edge exactly one has the pixels along it.
"""

from __future__ import annotations

from math import ceil, floor

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
_BIAS = 1.5
"""How far behind the first surface the light still reaches, in pixels of the shadow map."""

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


class Sun(Struct):
    """The light, for kernels: strengths, and where the shadow map lies."""

    sun: float
    sky: float
    ground: float
    scale: float
    """Pixels of the map to the metre."""
    left: float
    top: float
    """Of the map, metres along the light's first two axes."""


class Skin(Struct):
    """Where the colours of a mesh are in all textures one after the other; none where it is 0 wide."""

    start: int
    width: int
    height: int


@_compile
def shade(
    shown: tuple[Nearness, Faces],
    lens: Structs[Lens],
    pose: tuple[FloatArray, FloatArray],
    faces: tuple[FloatArray, FloatArray, FloatArray],
    textures: tuple[Faces, FloatArray, Structs[Skin], Colours],
    light: tuple[Structs[Sun], FloatArray, Nearness],
    background: FloatArray,
    rgb: Colours,
) -> None:
    """The colour of every pixel.

    Args:
        shown: (H, W) nearness and face.
        lens: (1,) of the camera.
        pose: (3,) the eye and (3, 3) its axes in the world.
        faces: (F, 3, 3) corners, (F, 3) unit normals, (F, 3) colours, in the world.
        textures: (F,) which skin each face has, (F, 3, 2) where its corners are in it, the (S,) skins, and
            their pixels (P, 3).
        light: (1,) the sun, (3, 3) its axes, and the shadow map, (0, 0) for none.
        background: (3,) colour where nothing is.
        rgb: (H, W, 3), filled in.
    """
    nearness, face = shown
    eye, axes = pose
    corners, normal, colour = faces
    skin_of, uv, skins, pixels = textures
    sun, across, shadow = light
    fx, fy, cx, cy = lens[0].fx, lens[0].fy, lens[0].cx, lens[0].cy
    diffuse, direct = np.empty(len(normal)), np.empty(len(normal))
    for k in range(len(normal)):
        facing = toward = 0.0
        for c in range(3):
            facing += normal[k, c] * (eye[c] - corners[k, 0, c])
            toward += normal[k, c] * across[2, c]
        side = 1.0 if facing >= 0.0 else -1.0  # both sides of a face can be seen
        diffuse[k] = sun[0].ground + (sun[0].sky - sun[0].ground) * (0.5 + 0.5 * side * normal[k, 1])
        direct[k] = max(side * toward, 0.0)
    # From right, below and ahead of the eye to the pixels of the shadow map, and towards the sun.
    to_map, start = across @ axes.T, across @ eye
    size, scale = shadow.shape[0], sun[0].scale
    start[0] -= sun[0].left
    start[1] -= sun[0].top
    for c in range(2):
        start[c] *= scale
        for i in range(3):
            to_map[c, i] *= scale
    spot, paint = np.empty(3), np.empty(3)
    height, width = nearness.shape
    for row in range(height):
        below = (row - cy) / fy
        for column in range(width):
            k = face[row, column]
            if k < 0:
                for c in range(3):
                    rgb[row, column, c] = np.uint8(min(max(background[c] + 0.5, 0.0), 255.0))
                continue
            right = (column - cx) / fx
            away = 1.0 / nearness[row, column]
            strength = diffuse[k]
            if direct[k] > 0.0:
                reached = 1.0
                if size:
                    x = start[0] + away * (to_map[0, 0] * right + to_map[0, 1] * below + to_map[0, 2])
                    y = start[1] + away * (to_map[1, 0] * right + to_map[1, 1] * below + to_map[1, 2])
                    level = start[2] + away * (to_map[2, 0] * right + to_map[2, 1] * below + to_map[2, 2])
                    if 0.0 <= x < size - 1 and 0.0 <= y < size - 1:
                        slope = min(
                            np.sqrt(1.0 - min(direct[k] * direct[k], 1.0)) / max(direct[k], 0.05), 8.0
                        )
                        reached = _reached(x, y, level + (_BIAS + slope) / scale, shadow)
                strength += sun[0].sun * direct[k] * reached
            if skin_of[k] >= 0:
                for c in range(3):
                    spot[c] = eye[c] + away * (right * axes[0, c] + below * axes[1, c] + axes[2, c])
                    paint[c] = colour[k, c]
                _look_up(k, spot, corners, uv, skins, skin_of[k], pixels, paint)
                for c in range(3):
                    rgb[row, column, c] = np.uint8(min(paint[c] * strength + 0.5, 255.0))
            else:
                for c in range(3):
                    rgb[row, column, c] = np.uint8(min(colour[k, c] * strength + 0.5, 255.0))


@_compile
def _reached(x: float, y: float, level: float, shadow: Nearness) -> float:
    """Which share of the sun reaches a place on its way: of the four pixels of the map around (x, y)."""
    left, top = floor(x), floor(y)
    x -= left
    y -= top
    reached = 0.0
    for i in range(2):
        for j in range(2):
            if level >= shadow[top + i, left + j]:
                reached += (x if j else 1.0 - x) * (y if i else 1.0 - y)
    return reached


@_compile
def _look_up(
    k: int,
    spot: FloatArray,
    corners: FloatArray,
    uv: FloatArray,
    skins: Structs[Skin],
    skin: int,
    pixels: Colours,
    paint: FloatArray,
) -> None:
    """The texture's colour at a place (3,) of a face; unchanged where the face has no place in it."""
    if not (np.isfinite(uv[k, 0, 0]) and np.isfinite(uv[k, 1, 0]) and np.isfinite(uv[k, 2, 0])):
        return
    aa = ab = bb = pa = pb = 0.0
    for c in range(3):
        first, second = corners[k, 1, c] - corners[k, 0, c], corners[k, 2, c] - corners[k, 0, c]
        here = spot[c] - corners[k, 0, c]
        aa += first * first
        ab += first * second
        bb += second * second
        pa += here * first
        pb += here * second
    whole = aa * bb - ab * ab
    if whole <= 0.0:
        return
    s, t = (bb * pa - ab * pb) / whole, (aa * pb - ab * pa) / whole
    u = uv[k, 0, 0] + s * (uv[k, 1, 0] - uv[k, 0, 0]) + t * (uv[k, 2, 0] - uv[k, 0, 0])
    v = uv[k, 0, 1] + s * (uv[k, 1, 1] - uv[k, 0, 1]) + t * (uv[k, 2, 1] - uv[k, 0, 1])
    if not (abs(u) < 1e6 and abs(v) < 1e6):
        return
    wide, tall, start = skins[skin].width, skins[skin].height, skins[skin].start
    # Between the middles of four texels, over the edges to the other side.
    x, y = (u - floor(u)) * wide - 0.5, (v - floor(v)) * tall - 0.5
    left, top = floor(x), floor(y)
    x -= left
    y -= top
    for c in range(3):
        paint[c] = 0.0
    for i in range(2):
        for j in range(2):
            row, column = (top + i) % tall, (left + j) % wide
            share = (x if j else 1.0 - x) * (y if i else 1.0 - y)
            for c in range(3):
                paint[c] += share * pixels[start + row * wide + column, c]
