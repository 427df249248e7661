"""Random materials: every face of a mesh in another colour or pattern, so that no colour can be relied on."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.rendering import Mesh

_PATCH, _ACROSS = 48, 4
"""Pixels of a patch of an atlas, each way, and patches along its sides."""

_MARGIN = 2
"""Pixels of a patch that no face reaches, so that neighbours do not bleed."""


def random_colour(rng: np.random.Generator) -> FloatArray:
    """(3,) any colour: grey, pale or strong, dark or light, 0 to 255."""
    saturation = rng.choice([0.0, 0.3, 1.0], p=[0.15, 0.45, 0.4]) * rng.random()
    value = rng.uniform(0.08, 1.0)
    return 255.0 * np.array(colorsys.hsv_to_rgb(rng.random(), saturation, value))


def pattern(rng: np.random.Generator, colour: FloatArray, size: int, strength: float = 1.0) -> FloatArray:
    """(size, size, 3) a random pattern around a colour: noise, planks, checks, spots, a gradient, or none."""
    kind = rng.integers(7)
    place = np.arange(size) / size
    across, down = np.meshgrid(place, place)
    field = np.zeros((size, size))
    if kind == 1:
        field = _noise(rng, size, int(rng.choice([3, 6, 12, 24])))
    elif kind == 2:  # grain of wood
        fine = _noise(rng, size, int(rng.choice([6, 12, 24])))[:, :4]
        field = np.asarray(cv2.resize(fine, (size, size)), np.float64)
        field = field.T if rng.random() < 0.5 else field
    elif kind == 3:
        angle, count = rng.uniform(0, np.pi), rng.uniform(2, 10)
        field = np.sign(np.sin(2 * np.pi * count * (np.cos(angle) * across + np.sin(angle) * down)))
    elif kind == 4:
        fields = int(rng.integers(2, 7))
        field = np.where((np.floor(across * fields) + np.floor(down * fields)) % 2 == 0, 1.0, -1.0)
    elif kind == 5:
        field = np.where(_noise(rng, size, int(rng.choice([4, 8]))) > 0.6, 2.0, -0.3)
    elif kind == 6:
        angle = rng.uniform(0, 2 * np.pi)
        field = 2.0 * (np.cos(angle) * (across - 0.5) + np.sin(angle) * (down - 0.5))
    other = random_colour(rng) if rng.random() < 0.3 else colour * rng.uniform(0.4, 1.6)
    share = strength * rng.uniform(0.05, 0.4) * field[..., None]
    return np.clip(colour + share * (other - colour) + 4 * strength * field[..., None], 0, 255)


def surface(rng: np.random.Generator, size: int = 256) -> npt.NDArray[np.uint8]:
    """(size, size, 3) the picture of a large surface: a pattern, printed shapes, and soft dark places."""
    plain = pattern(rng, random_colour(rng), size, rng.uniform(0.2, 1.5))
    picture = np.ascontiguousarray(plain, dtype=np.float32)
    for _ in range(rng.integers(0, 12)):
        _print_shape(rng, picture)
    if rng.random() < 0.7:
        shade = np.exp(-rng.uniform(0, 0.5) * np.maximum(_noise(rng, size, int(rng.choice([4, 8, 16]))), 0))
        picture *= shade[..., None].astype(np.float32)
    if rng.random() < 0.5:
        picture += rng.uniform(2, 14) * rng.standard_normal(picture.shape, dtype=np.float32)
    return np.clip(picture, 0, 255).astype(np.uint8)


class Paintable:
    """A mesh that can be painted over and over.

    Args:
        mesh: with any colours; its texture is not used.
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        tones = np.rint(mesh.colour / 12).astype(np.int64)
        keys = np.column_stack([mesh.part, tones])
        _, self._group = np.unique(keys, axis=0, return_inverse=True)
        self._group = self._group.reshape(-1)
        self._unit = _unit_places(mesh)
        self._groups = int(self._group.max()) + 1
        self._base = np.array([mesh.colour[self._group == g].mean(axis=0) for g in range(self._groups)])
        self._part = np.array([mesh.part[self._group == g][0] for g in range(self._groups)])

    def painted(self, rng: np.random.Generator) -> Mesh:
        """The mesh in random colours and patterns: near its own, one for each part, or anything."""
        style = rng.choice(4, p=[0.35, 0.35, 0.2, 0.1])
        if style == 0:
            colour = (
                self._base * rng.uniform(0.75, 1.25) * (1 + 0.15 * rng.standard_normal((self._groups, 3)))
            )
        elif style == 1:
            of_part = [random_colour(rng) for _ in self.mesh.parts]
            colour = np.array([of_part[p] * rng.uniform(0.7, 1.3) for p in self._part])
        elif style == 2:
            colour = np.array([random_colour(rng) for _ in range(self._groups)])
        else:
            colour = np.tile(random_colour(rng), (self._groups, 1)) * rng.uniform(0.6, 1.4, (self._groups, 1))
        if rng.random() < 0.35:  # plain faces, each a little or quite different
            own = colour[self._group] * (1 + rng.choice([0.0, 0.05, 0.2]) * _each(rng, self.mesh))
            return Mesh(self.mesh.corners, own.clip(0, 255), self.mesh.part, self.mesh.parts)
        strength = rng.uniform(0.2, 1.2)
        patches = _ACROSS * _ACROSS
        group = self._group % patches
        count = min(patches, self._groups)
        tiles = [pattern(rng, colour[g].clip(0, 255), _PATCH, strength) for g in range(count)]
        atlas = np.zeros((_ACROSS * _PATCH, _ACROSS * _PATCH, 3), np.uint8)
        for g, tile in enumerate(tiles):
            row, column = divmod(g, _ACROSS)
            atlas[row * _PATCH : (row + 1) * _PATCH, column * _PATCH : (column + 1) * _PATCH] = tile
        zoom = rng.uniform(0.4, 1.0)
        start = rng.uniform(0, 1 - zoom, 2)
        inside = (_MARGIN + (_PATCH - 2 * _MARGIN) * (start + zoom * self._unit)) / _PATCH
        corner = np.stack([group % _ACROSS, group // _ACROSS], axis=-1)[:, None]
        uv = (corner + inside) / _ACROSS
        own = colour[self._group].clip(0, 255)
        return Mesh(self.mesh.corners, own, self.mesh.part, self.mesh.parts, atlas, uv)


def textured_quad(corners: FloatArray, picture: npt.NDArray[np.uint8], repeats: float = 1.0) -> Mesh:
    """A flat piece (4, 3) with a picture on it, several times each way if so wished."""
    place = np.array([(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)]) * repeats
    faces = [[0, 1, 2], [0, 2, 3]]
    return Mesh(
        corners[faces], np.full((2, 3), 128.0), np.zeros(2, np.int64), ("all",), picture, place[faces]
    )


def _each(rng: np.random.Generator, mesh: Mesh) -> FloatArray:
    """(F, 1) a random number for each flat piece, the same for its triangles."""
    normal = np.cross(mesh.corners[:, 1] - mesh.corners[:, 0], mesh.corners[:, 2] - mesh.corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    keys = np.column_stack([mesh.part, np.rint(4 * normal).astype(np.int64)])
    _, piece = np.unique(keys, axis=0, return_inverse=True)
    return rng.standard_normal(int(piece.max()) + 1)[piece.reshape(-1), None]


def _unit_places(mesh: Mesh) -> FloatArray:
    """(F, 3, 2) corners in the mesh's box, from 0 to 1, without the axis along which each face looks most."""
    low, high = mesh.bounds
    unit = (mesh.corners - low) / np.maximum(high - low, 1e-12).max()
    normal = np.abs(np.cross(unit[:, 1] - unit[:, 0], unit[:, 2] - unit[:, 0]))
    axis: IntArray = normal.argmax(axis=1)
    kept = np.array([(2, 1), (0, 2), (0, 1)])[axis]
    return np.take_along_axis(unit, kept[:, None, :].repeat(3, axis=1), axis=2)


def _noise(rng: np.random.Generator, size: int, cells: int) -> FloatArray:
    """(size, size) smooth noise of about unit SD with some bumps along each side, and finer ones."""
    field = np.zeros((size, size), np.float32)
    for octave in range(2):
        grid = rng.standard_normal((cells << octave, cells << octave), dtype=np.float32)
        field += np.asarray(cv2.resize(grid, (size, size), interpolation=cv2.INTER_CUBIC)) / (1 + octave)
    return field.astype(np.float64)


def _print_shape(rng: np.random.Generator, picture: npt.NDArray[np.float32]) -> None:
    size = len(picture)
    colour = tuple(random_colour(rng).tolist())
    middle, extent = rng.integers(0, size, 2), rng.integers(3, max(size // 4, 4), 2)
    kind = rng.integers(4)
    if kind == 0:
        cv2.ellipse(picture, middle.tolist(), extent.tolist(), rng.uniform(0, 180), 0, 360, colour, -1)
    elif kind == 1:
        end = rng.integers(0, size, 2)
        cv2.line(picture, middle.tolist(), end.tolist(), colour, int(rng.integers(1, 8)))
    else:
        points: Sequence[FloatArray] = [middle + extent * rng.uniform(-1, 1, 2) for _ in range(3 + kind)]
        cv2.fillPoly(picture, [np.rint(points).astype(np.int32)], colour)
