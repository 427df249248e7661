"""Meshes: triangles with colours, in named parts, read from glTF, OBJ and whatever else trimesh reads."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray, Record, first_wrong, read_only
from farm_ar.errors import InputError, escaped

MOST_FACES = 2_000_000
"""In one mesh."""

LARGEST_M = 50.0
"""A mesh that is larger is in other units than metres."""

SMALLEST_M = 1e-3
"""So is one that is smaller."""

FORMATS = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
"""The files that are read."""

_PLAIN = (180, 180, 180)


class MeshError(InputError):
    """A mesh that cannot be used."""


@dataclass(frozen=True, eq=False)
class Mesh(Record):
    """F triangles, to the right, up and ahead of the middle of their foot.

    Args:
        corners: (F, 3, 3) metres; counter-clockwise as seen from outside.
        colour: (F, 3) red, green, blue in full light, 0 to 255.
        part: (F,) index into `parts`.
        parts: names of what can be taken off or moved.
        texture: (H, W, 3) picture that colours some faces; None for none.
        uv: (F, 3, 2) columns and rows of the corners in the texture, from its upper left corner to (1, 1);
            NaN for faces without it; None for none.

    Raises:
        MeshError: there are no faces or too many, a corner is not finite, or the shapes do not agree.
    """

    corners: FloatArray
    colour: FloatArray
    part: IntArray
    parts: tuple[str, ...] = ("all",)
    texture: npt.NDArray[np.uint8] | None = None
    uv: FloatArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners", read_only(self.corners, np.float64))
        count = len(self.corners)
        if not 1 <= count <= MOST_FACES:
            raise MeshError("faces", f"must be from 1 to {MOST_FACES}", count)
        for name, dtype, shape in (
            ("corners", np.float64, (count, 3, 3)),
            ("colour", np.float64, (count, 3)),
            ("part", np.int64, (count,)),
            ("uv", np.float64, (count, 3, 2)),
        ):
            value = getattr(self, name)
            if value is None:
                continue
            object.__setattr__(self, name, read_only(value, dtype))
            if getattr(self, name).shape != shape:
                raise MeshError(name, f"must have shape {shape}", getattr(self, name).shape)
        wrong = first_wrong(np.isfinite(self.corners) & (np.abs(self.corners) <= 1e6))
        if wrong is not None:
            raise MeshError(
                f"corners{list(wrong)}", "must be finite, at most 1e6", float(self.corners[wrong])
            )
        if not np.isfinite(self.colour).all():
            raise MeshError("colour", "must be finite", "NaN or infinity")
        if self.part.min() < 0 or self.part.max() >= len(self.parts):
            raise MeshError("part", f"must be from 0 to {len(self.parts) - 1}", int(self.part.max()))
        if self.texture is not None:
            object.__setattr__(self, "texture", read_only(self.texture, np.uint8))

    def __len__(self) -> int:
        return len(self.corners)

    @property
    def bounds(self) -> FloatArray:
        """(2, 3) least and largest right, up and ahead, metres."""
        return np.stack([self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))])

    def only(self, *parts: str) -> Mesh:
        """Some of its parts.

        Raises:
            MeshError: there is no such part, or nothing is left.
        """
        for name in parts:
            if name not in self.parts:
                raise MeshError("part", f"must be one of {', '.join(self.parts)}", name)
        return self._chosen(np.isin(self.part, [self.parts.index(name) for name in parts]))

    def without(self, *parts: str) -> Mesh:
        """The same without some of its parts, or without parts that it has not."""
        gone = [k for k, name in enumerate(self.parts) if name in parts]
        return self._chosen(~np.isin(self.part, gone))

    def turned(self, part: str, about: FloatArray, angle: float) -> Mesh:
        """The same with a part turned about an upright axis through a point, clockwise seen from above.

        Args:
            part: its name.
            about: (3,) a point of the axis, metres.
            angle: radians.
        """
        index = self.parts.index(part)
        cosine, sine = np.cos(angle), np.sin(angle)
        turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
        moved = (self.corners - about) @ turn.T + about
        return replace(self, corners=np.where((self.part == index)[:, None, None], moved, self.corners))

    def fitted(self, width: float, height: float, depth: float, to: str | None = None) -> Mesh:
        """The same stretched to a size, its foot's middle at the origin.

        Args:
            width: to the right, metres.
            height: upwards.
            depth: ahead.
            to: the part that is to have that size, if the mesh has it: others may stick out. The whole mesh
                by default.
        """
        measured = self.only(to) if to in self.parts else self
        low, high = measured.bounds
        size = np.maximum(high - low, 1e-9)
        foot = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
        return replace(self, corners=(self.corners - foot) / size * [width, height, depth])

    def _chosen(self, faces: npt.NDArray[np.bool_]) -> Mesh:
        uv = None if self.uv is None else self.uv[faces]
        return Mesh(self.corners[faces], self.colour[faces], self.part[faces], self.parts, self.texture, uv)


def merged(parts: dict[str, Mesh]) -> Mesh:
    """One mesh of several without textures, each a part of its own, in order of their names."""
    parts = dict(sorted(parts.items()))
    return Mesh(
        np.concatenate([mesh.corners for mesh in parts.values()]),
        np.concatenate([mesh.colour for mesh in parts.values()]),
        np.repeat(np.arange(len(parts)), [len(mesh) for mesh in parts.values()]),
        tuple(parts),
    )


def read_mesh(path: str | Path, unit: float = 1.0) -> Mesh:
    """A mesh from a file in glTF's axes: y up, its front towards +z, right-handed.

    Each node of the file is a part. A node's texture is kept if the file has a single one; of several, faces
    have the texture's colour at their middle.

    Args:
        path: of the file, one of `FORMATS`.
        unit: of the file's lengths, metres.

    Raises:
        MeshError: the file cannot be read, has no faces, or is not from `SMALLEST_M` to `LARGEST_M` large.
    """
    import trimesh

    path = Path(path)
    source = escaped(str(path))
    if path.suffix.lower() not in FORMATS:
        raise MeshError("file", f"must end in one of {', '.join(FORMATS)}", path.name, source)
    try:
        with warnings.catch_warnings():  # of numbers that are looked at below
            warnings.simplefilter("ignore")
            loaded: Any = trimesh.load_scene(path)
            nodes = [
                (str(node), loaded.geometry[name].copy().apply_transform(transform))
                for node in sorted(loaded.graph.nodes_geometry)
                for transform, name in [loaded.graph[node]]
            ]
    except Exception as error:  # trimesh's loaders raise whatever their parsers do
        raise MeshError("file", "must be a mesh that trimesh can read", f"{error!r}", source) from None
    nodes = [(name, one) for name, one in nodes if len(getattr(one, "faces", ()))]
    if not nodes:
        raise MeshError("faces", "must be at least one", 0, source)
    corners = np.concatenate([np.asarray(one.triangles, dtype=np.float64) for _, one in nodes])
    # Right is -x of a right-handed frame whose front is +z.
    corners = corners * [-unit, unit, unit]
    skins = [_skin(one) for _, one in nodes]
    pictures = [picture for _, picture, _ in skins if picture is not None]
    texture = pictures[0] if len(pictures) == 1 else None
    uv = None
    if texture is not None:
        uv = np.concatenate([np.full((len(c), 3, 2), np.nan) if u is None else u for c, _, u in skins])
    try:
        mesh = Mesh(
            corners,
            np.concatenate([colour for colour, _, _ in skins]),
            np.repeat(np.arange(len(nodes)), [len(one.faces) for _, one in nodes]),
            tuple(name for name, _ in nodes),
            texture,
            uv,
        )
    except MeshError as error:
        raise MeshError(error.field, error.expected, error.got, source) from None
    extent = float(np.ptp(mesh.bounds, axis=0).max())
    if not SMALLEST_M <= extent <= LARGEST_M:
        expected = f"must be from {SMALLEST_M:g} to {LARGEST_M:g} m (in millimetres? then unit=0.001)"
        raise MeshError("size", expected, f"{extent:.6g} m", source)
    return mesh


def _skin(one: Any) -> tuple[FloatArray, npt.NDArray[np.uint8] | None, FloatArray | None]:
    """(F, 3) colours of a mesh's faces; its texture and (F, 3, 2) their corners in it, if it has one."""
    visual, faces = one.visual, np.asarray(one.faces)
    uv = getattr(visual, "uv", None)
    material = getattr(visual, "material", None)
    picture = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    if uv is not None and picture is not None:
        pixels = np.asarray(picture.convert("RGB"), dtype=np.uint8)
        place = np.asarray(uv, dtype=np.float64)[faces] * [1.0, -1.0] + [0.0, 1.0]
        middle = place.mean(axis=1) % 1.0
        row = (middle[:, 1] * len(pixels)).astype(int).clip(0, len(pixels) - 1)
        column = (middle[:, 0] * pixels.shape[1]).astype(int).clip(0, pixels.shape[1] - 1)
        return pixels[row, column].astype(np.float64), pixels, place
    try:
        if getattr(visual, "kind", None) == "texture":
            visual = visual.to_color()
        colour = np.asarray(visual.face_colors, dtype=np.float64)[:, :3]
    except Exception:  # a file without colours, or with half of one
        colour = np.empty((0, 3))
    if colour.shape != (len(faces), 3):
        colour = np.tile(np.array(_PLAIN, dtype=np.float64), (len(faces), 1))
    return colour, None, None
