"""Compiled: the colour of each pixel, of a triangle's colour or texture and of the light on it."""

from __future__ import annotations

from math import floor

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled
from farm_ar.rendering.kernels import Colours, Faces, Lens, Nearness
from farm_ar.structs import Struct, Structs

_BIAS = 1.5
"""How far behind the first surface the light still reaches, in pixels of the shadow map."""

_compile = compiled(error_model="numpy")


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
    """Where the colours of a texture are among those of all textures, one after the other."""

    start: int
    width: int
    height: int


class Changed(Struct):
    """Which pixels are shaded anew: those of faces from a number on, and those in a part of the map."""

    first: int
    left: float
    right: float
    top: float
    bottom: float


@_compile
def shade(
    shown: tuple[Nearness, Faces],
    camera: tuple[Structs[Lens], FloatArray, FloatArray],
    faces: tuple[FloatArray, FloatArray, FloatArray],
    textures: tuple[Faces, FloatArray, Structs[Skin], Colours],
    light: tuple[Structs[Sun], FloatArray, Nearness],
    background: FloatArray,
    changed: Structs[Changed],
    rgb: Colours,
) -> None:
    """The colour of every pixel that has changed.

    Args:
        shown: (H, W) nearness and face.
        camera: (1,) lens, (3,) the eye and (3, 3) its axes in the world.
        faces: (F, 3, 3) corners, (F, 3) unit normals, (F, 3) colours, in the world.
        textures: (F,) which skin each face has, (F, 3, 2) where its corners are in it, the (S,) skins, and
            their pixels (P, 3).
        light: (1,) the sun, (3, 3) its axes, and the shadow map, (0, 0) for none.
        background: (3,) colour where nothing is.
        changed: (1,) which pixels.
        rgb: (H, W, 3), filled in.
    """
    nearness, face = shown
    lens, eye, axes = camera
    fx, fy, cx, cy = lens[0].fx, lens[0].fy, lens[0].cx, lens[0].cy
    sun, across, shadow = light
    size, scale = shadow.shape[0], sun[0].scale
    first, begin, end = changed[0].first, changed[0].left, changed[0].right
    top, bottom = changed[0].top, changed[0].bottom
    diffuse, direct, bias = _light_on(faces[0], faces[1], eye, sun, across)
    to_skin = _places_in_textures(faces[0], textures[0], textures[1], eye, axes)
    # From right, below and ahead of the eye to the pixels of the shadow map, and towards the sun.
    to_map, start = across @ axes.T, across @ eye
    for c in range(2):
        start[c] = (start[c] - (sun[0].left if c == 0 else sun[0].top)) * scale
        for i in range(3):
            to_map[c, i] *= scale
    paint = np.empty(3)
    height, width = nearness.shape
    for row in range(height):
        below = (row - cy) / fy
        for column in range(width):
            k = face[row, column]
            if k < 0:
                if first == 0:
                    for c in range(3):
                        rgb[row, column, c] = np.uint8(min(max(background[c] + 0.5, 0.0), 255.0))
                continue
            if k < first and direct[k] <= 0.0:
                continue
            right = (column - cx) / fx
            away = 1.0 / nearness[row, column]
            strength = diffuse[k]
            if direct[k] > 0.0:
                x = start[0] + away * (to_map[0, 0] * right + to_map[0, 1] * below + to_map[0, 2])
                y = start[1] + away * (to_map[1, 0] * right + to_map[1, 1] * below + to_map[1, 2])
                if k < first and not (begin <= x <= end and top <= y <= bottom):
                    continue
                reached = 1.0
                if 0.0 <= x < size - 1 and 0.0 <= y < size - 1:
                    level = start[2] + away * (to_map[2, 0] * right + to_map[2, 1] * below + to_map[2, 2])
                    reached = _reached(x, y, level + bias[k], shadow)
                strength += direct[k] * reached
            for c in range(3):
                paint[c] = faces[2][k, c]
            if len(to_skin):
                skin = textures[0][k]
                if skin >= 0:
                    u = to_skin[k, 0, 3] + away * (
                        to_skin[k, 0, 0] * right + to_skin[k, 0, 1] * below + to_skin[k, 0, 2]
                    )
                    v = to_skin[k, 1, 3] + away * (
                        to_skin[k, 1, 0] * right + to_skin[k, 1, 1] * below + to_skin[k, 1, 2]
                    )
                    _look_up(u, v, textures[2], skin, textures[3], paint)
            for c in range(3):
                rgb[row, column, c] = np.uint8(min(paint[c] * strength + 0.5, 255.0))


@_compile
def _light_on(
    corners: FloatArray, normal: FloatArray, eye: FloatArray, sun: Structs[Sun], across: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(F,) light of the sky and of the sun on the side of each face that is seen.

    And how far it may lie behind what the shadow map has and still be lit, metres.
    """
    count = len(normal)
    diffuse, direct, bias = np.empty(count), np.empty(count), np.empty(count)
    for k in range(count):
        facing = toward = 0.0
        for c in range(3):
            facing += normal[k, c] * (eye[c] - corners[k, 0, c])
            toward += normal[k, c] * across[2, c]
        side = 1.0 if facing >= 0.0 else -1.0
        diffuse[k] = sun[0].ground + (sun[0].sky - sun[0].ground) * (0.5 + 0.5 * side * normal[k, 1])
        toward = max(side * toward, 0.0)
        direct[k] = sun[0].sun * toward
        slope = np.sqrt(1.0 - min(toward * toward, 1.0)) / max(toward, 0.05)
        bias[k] = (_BIAS + min(slope, 8.0)) / sun[0].scale
    return diffuse, direct, bias


@_compile
def _places_in_textures(
    corners: FloatArray, skin_of: Faces, uv: FloatArray, eye: FloatArray, axes: FloatArray
) -> FloatArray:
    """(F, 2, 4) from right, below and ahead of the eye, and 1, to the place in the texture."""
    found = np.zeros((len(uv), 2, 4))
    edge, inverse = np.empty((2, 3)), np.empty((2, 3))
    for k in range(len(uv)):
        if skin_of[k] < 0:
            continue
        aa = ab = bb = 0.0
        for c in range(3):
            edge[0, c] = corners[k, 1, c] - corners[k, 0, c]
            edge[1, c] = corners[k, 2, c] - corners[k, 0, c]
            aa += edge[0, c] * edge[0, c]
            ab += edge[0, c] * edge[1, c]
            bb += edge[1, c] * edge[1, c]
        whole = aa * bb - ab * ab
        for i in range(2):
            first, second = uv[k, 1, i] - uv[k, 0, i], uv[k, 2, i] - uv[k, 0, i]
            found[k, i, 3] = uv[k, 0, i]
            if whole <= 0.0:
                continue
            for c in range(3):
                inverse[0, c] = (bb * edge[0, c] - ab * edge[1, c]) / whole
                inverse[1, c] = (aa * edge[1, c] - ab * edge[0, c]) / whole
                slope = first * inverse[0, c] + second * inverse[1, c]
                found[k, i, 3] += slope * (eye[c] - corners[k, 0, c])
                for j in range(3):
                    found[k, i, j] += slope * axes[j, c]
    return found


@_compile
def _reached(x: float, y: float, level: float, shadow: Nearness) -> float:
    """Which share of the sun reaches a place on its way: of the four pixels of the map around (x, y)."""
    left, top = int(x), int(y)
    x -= left
    y -= top
    reached = 0.0
    if level >= shadow[top, left]:
        reached += (1.0 - x) * (1.0 - y)
    if level >= shadow[top, left + 1]:
        reached += x * (1.0 - y)
    if level >= shadow[top + 1, left]:
        reached += (1.0 - x) * y
    if level >= shadow[top + 1, left + 1]:
        reached += x * y
    return reached


@_compile
def _look_up(u: float, v: float, skins: Structs[Skin], skin: int, pixels: Colours, paint: FloatArray) -> None:
    """The texture's colour at a place, over its edges to the other side; unchanged where that is NaN."""
    if not (abs(u) < 1e6 and abs(v) < 1e6):
        return
    wide, tall, start = skins[skin].width, skins[skin].height, skins[skin].start
    # Between the middles of four texels.
    x, y = (u - floor(u)) * wide - 0.5, (v - floor(v)) * tall - 0.5
    column, row = floor(x), floor(y)
    x -= column
    y -= row
    left, right = (column if column >= 0 else wide - 1), (column + 1 if column + 1 < wide else 0)
    upper, lower = (row if row >= 0 else tall - 1), (row + 1 if row + 1 < tall else 0)
    a, b = start + upper * wide, start + lower * wide
    for c in range(3):
        above = pixels[a + left, c] + x * (float(pixels[a + right, c]) - pixels[a + left, c])
        below = pixels[b + left, c] + x * (float(pixels[b + right, c]) - pixels[b + left, c])
        paint[c] = above + y * (below - above)


@_compile
def smooth(face: Faces, rgb: Colours, out: Colours) -> None:
    """Soften edges: a pixel beside one of another face is a third its own colour, the rest its neighbours'.

    Args:
        face: (H, W) which face each pixel shows.
        rgb: (H, W, 3) its colours.
        out: (H, W, 3), filled in.
    """
    height, width = face.shape
    for row in range(height):
        above, below = max(row - 1, 0), min(row + 1, height - 1)
        for column in range(width):
            k, left, right = face[row, column], max(column - 1, 0), min(column + 1, width - 1)
            edge = (
                face[row, left] != k
                or face[row, right] != k
                or face[above, column] != k
                or face[below, column] != k
            )
            for c in range(3):
                own = rgb[row, column, c]
                if edge:
                    around = (
                        np.int64(rgb[row, left, c])
                        + rgb[row, right, c]
                        + rgb[above, column, c]
                        + rgb[below, column, c]
                    )
                    out[row, column, c] = np.uint8((2 * np.int64(own) + around + 3) // 6)
                else:
                    out[row, column, c] = own
