"""Pictures of meshes in their places: red, green, blue; depth; and which thing each pixel shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import ANGLE, POSITION, FloatArray, Record, read_only
from farm_ar.errors import SceneError
from farm_ar.rendering.camera import NEAR_M, View
from farm_ar.rendering.kernels import NOTHING, Faces, Lens, Nearness, rasterise
from farm_ar.rendering.light import Light
from farm_ar.rendering.mesh import Mesh
from farm_ar.rendering.shading import Changed, Skin, Sun, shade, smooth
from farm_ar.structs import Structs, new_structs

SKY = (168.0, 186.0, 204.0)
"""Colour of what no mesh covers, by default."""


@dataclass(frozen=True, eq=False)
class Instance(Record):
    """A mesh in its place.

    Args:
        mesh: the mesh.
        position: (3,) of its foot's middle (x, y, z), metres; y is the height.
        yaw: heading, radians, clockwise seen from above.
        number: what the picture's ids call it, not negative.
        rotation: (3, 3) in place of the heading, for what is tilted: its right, up and ahead in the columns.
        casts_shadow: whether it keeps the sun from what lies behind.

    Raises:
        SceneError: a value is out of its limits.
    """

    mesh: Mesh
    position: FloatArray
    yaw: float = 0.0
    number: int = 0
    rotation: FloatArray | None = None
    casts_shadow: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", read_only(self.position, np.float64))
        if self.position.shape != (3,) or not POSITION.allow(self.position).all():
            raise SceneError("position", "must be (x, y, z), each from -1e6 to 1e6 metres", self.position)
        if not ANGLE.allow(self.yaw):
            raise SceneError("yaw", ANGLE.expected, self.yaw)
        if not 0 <= self.number < 2**31:
            raise SceneError("number", "must be from 0 to 2147483647", self.number)
        if self.rotation is not None:
            object.__setattr__(self, "rotation", read_only(self.rotation, np.float64))
            if self.rotation.shape != (3, 3) or not np.isfinite(self.rotation).all():
                raise SceneError("rotation", "must be a finite 3 x 3 matrix", self.rotation)

    @cached_property
    def corners(self) -> FloatArray:
        """(F, 3, 3) of its triangles in the world, metres."""
        turn = self.rotation
        if turn is None:
            cosine, sine = np.cos(self.yaw), np.sin(self.yaw)
            turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
        placed: FloatArray = self.mesh.corners @ turn.T + self.position
        return placed

    @cached_property
    def normals(self) -> FloatArray:
        """(F, 3) unit vectors outwards; 0 for a triangle without area."""
        first, second = self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 1]
        across = np.cross(second, first)  # right, up, ahead is a left-handed frame
        length = np.linalg.norm(across, axis=1, keepdims=True)
        unit: FloatArray = across / np.maximum(length, 1e-300)
        return unit


@dataclass(frozen=True, eq=False)
class Picture:
    """What a camera sees.

    Args:
        rgb: (H, W, 3) red, green, blue, 0 to 255.
        depth: (H, W) along the line of sight, metres; infinite where nothing is.
        ids: (H, W) number of the instance; `NOTHING` where none is.
    """

    rgb: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float32]
    ids: Faces


class Renderer:
    """Draws what stands in a place; equal instances and views give equal bytes, however they are split.

    Args:
        instances: what stands there. What is here is prepared once; what moves is given to `draw`.
        light: the light.
        background: (3,) colour where nothing is.
        smooth: whether the edges of faces are softened.
        shaded: (2, 3) corners of the box outside of which no shadow falls, metres; that of the instances that
            cast shadows by default, so that what moves out of it has none.
    """

    def __init__(
        self,
        instances: Sequence[Instance],
        light: Light | None = None,
        background: Sequence[float] = SKY,
        smooth: bool = False,
        shaded: npt.ArrayLike | None = None,
    ) -> None:
        self.light = light or Light()
        self._smooth = smooth
        self._background = np.array(background, dtype=np.float64)
        self._static = _Soup(instances)
        self._sun, self._shadow = self._cast_static(shaded)
        self._kept: tuple[tuple[bytes, ...], Nearness, Faces] | None = None
        self._rgb: npt.NDArray[np.uint8] | None = None

    def draw(self, view: View, moving: Sequence[Instance] = ()) -> Picture:
        """The picture of a view.

        Args:
            view: the camera in its place.
            moving: what stands there besides.
        """
        nearness, face = self._kept_layer(view)
        if self._rgb is None:
            self._rgb = np.empty((*face.shape, 3), np.uint8)
            self._shade(view, self._static, (nearness, face), self._shadow, _all_changed(), self._rgb)
        rgb, soup = self._rgb.copy(), self._static
        if moving:
            soup, nearness, face = self._with(view, moving, nearness, face)
            shadow, changed = self._cast(soup)
            self._shade(view, soup, (nearness, face), shadow, changed, rgb)
        if self._smooth:
            sharp, rgb = rgb, np.empty_like(rgb)
            smooth(face, sharp, rgb)
        return Picture(rgb, *_depth_and_ids(nearness, face, soup))

    def ids(self, view: View, moving: Sequence[Instance] = ()) -> tuple[npt.NDArray[np.float32], Faces]:
        """(H, W) depth and ids alone, without colours: as in `Picture`."""
        nearness, face = self._kept_layer(view)
        soup = self._static
        if moving:
            soup, nearness, face = self._with(view, moving, nearness, face)
        return _depth_and_ids(nearness, face, soup)

    def _kept_layer(self, view: View) -> tuple[Nearness, Faces]:
        """What the static instances leave in a picture, kept for as long as the view stays."""
        lens = view.intrinsics
        key = (view.eye.tobytes(), view.rotation.tobytes(), repr(lens).encode())
        if self._kept is None or self._kept[0] != key:
            nearness = np.zeros((lens.height, lens.width), np.float32)
            face = np.full((lens.height, lens.width), NOTHING, np.int32)
            rasterise(view.axes(self._static.corners), lens_of(view), 0, nearness, face)
            self._kept, self._rgb = (key, nearness, face), None
        return self._kept[1:]

    def _with(
        self, view: View, moving: Sequence[Instance], nearness: Nearness, face: Faces
    ) -> tuple[_Soup, Nearness, Faces]:
        """All triangles, and which of them each pixel shows."""
        nearness, face = nearness.copy(), face.copy()
        soup, added = _Soup.joined(self._static, moving), len(self._static.corners)
        rasterise(view.axes(soup.corners[added:]), lens_of(view), added, nearness, face)
        return soup, nearness, face

    def _shade(
        self,
        view: View,
        soup: _Soup,
        shown: tuple[Nearness, Faces],
        shadow: Nearness,
        changed: Structs[Changed],
        rgb: npt.NDArray[np.uint8],
    ) -> None:
        shade(
            shown,
            (lens_of(view), view.eye, view.rotation),
            (soup.corners, soup.normals, soup.colours),
            (soup.skin_of, soup.uv, soup.skins, soup.pixels),
            (self._sun, self.light.axes, shadow),
            self._background,
            changed,
            rgb,
        )

    def _cast_static(self, shaded: npt.ArrayLike | None) -> tuple[Structs[Sun], Nearness]:
        """The sun; the map of what static instances it reaches first, the larger the nearer to it."""
        light, across = self.light, self.light.axes
        sun = new_structs(Sun, 1)
        sun["sun"], sun["sky"], sun["ground"], sun["scale"] = light.sun, light.sky, light.ground, 1.0
        casting = self._static.corners[self._static.casts]
        if not light.shadows or (shaded is None and not len(casting)):
            return sun, np.zeros((0, 0), np.float32)
        if shaded is None:
            place = casting.reshape(-1, 3) @ across.T
        else:
            corners = np.asarray(shaded, dtype=np.float64)
            place = np.array(list(product(*corners.T.tolist()))) @ across.T
        corner, extent = place[:, :2].min(axis=0), float(np.ptp(place[:, :2], axis=0).max())
        margin = 2 / light.shadows  # so that the edges have pixels around them
        extent = max(extent, 1e-6) / (1 - 2 * margin)
        sun["scale"] = (light.shadows - 1) / extent
        sun["left"], sun["top"] = (corner - margin * extent).tolist()
        reached = np.full((light.shadows, light.shadows), -np.inf, np.float32)
        self._cast_on(reached, casting, sun)
        return sun, reached

    def _cast(self, soup: _Soup) -> tuple[Nearness, Structs[Changed]]:
        """The map with what moves; which pixels of the picture that may change."""
        added = len(self._static.corners)
        changed = _all_changed()
        changed["first"] = added
        changed["left"], changed["right"] = np.inf, -np.inf
        casting = soup.corners[added:][soup.casts[added:]]
        if not (self._shadow.size and len(casting)):
            return self._shadow, changed
        reached = self._shadow.copy()
        place = self._cast_on(reached, casting, self._sun)
        low, high = place.min(axis=0) - 1, place.max(axis=0) + 1
        changed["left"], changed["right"], changed["top"], changed["bottom"] = (
            low[0],
            high[0],
            low[1],
            high[1],
        )
        return reached, changed

    def _cast_on(self, reached: Nearness, corners: FloatArray, sun: Structs[Sun]) -> FloatArray:
        """Draw triangles on a map; (3 F, 2) where their corners are on it."""
        place = corners @ self.light.axes.T
        scale, left, top = (float(sun[name][0]) for name in ("scale", "left", "top"))
        face = np.empty(reached.shape, np.int32)
        place[..., 2] *= -1
        rasterise(place, _lens(scale, scale, -left * scale, -top * scale, parallel=True), 0, reached, face)
        on_map: FloatArray = (place[..., :2].reshape(-1, 2) - [left, top]) * scale
        return on_map


class _Soup:
    """All triangles of some instances as arrays."""

    def __init__(self, instances: Sequence[Instance]) -> None:
        sizes = [len(one.mesh) for one in instances]
        nothing = np.empty((0, 3, 3))
        self.corners = np.concatenate([nothing, *[one.corners for one in instances]])
        self.normals = np.concatenate([nothing[:, 0], *[one.normals for one in instances]])
        self.colours = np.concatenate([nothing[:, 0], *[one.mesh.colour for one in instances]])
        self.number = np.repeat(np.array([one.number for one in instances], np.int32), sizes)
        self.casts = np.repeat(np.array([one.casts_shadow for one in instances], bool), sizes)
        textures = {id(t): t for one in instances if (t := one.mesh.texture) is not None}
        order = {key: k for k, key in enumerate(textures)}
        which = [order.get(id(one.mesh.texture), NOTHING) for one in instances]
        self.skin_of = np.repeat(np.array(which, np.int32), sizes)
        self.uv = np.full((len(self.corners), 3, 2), np.nan) if textures else np.empty((0, 3, 2))
        at = 0
        for one, size in zip(instances, sizes, strict=True):
            if one.mesh.uv is not None:
                self.uv[at : at + size] = one.mesh.uv
            at += size
        self.skins = new_structs(Skin, max(len(textures), 1))
        start = 0
        for k, texture in enumerate(textures.values()):
            self.skins["start"][k], self.skins["height"][k], self.skins["width"][k] = (
                start,
                *texture.shape[:2],
            )
            start += texture.shape[0] * texture.shape[1]
        none = np.empty((0, 3), np.uint8)
        self.pixels = np.concatenate([none, *[texture.reshape(-1, 3) for texture in textures.values()]])

    @classmethod
    def joined(cls, static: _Soup, moving: Sequence[Instance]) -> _Soup:
        """What is static and then what moves."""
        added, both = cls(moving), cls.__new__(cls)
        for name in ("corners", "normals", "colours", "number", "casts", "pixels"):
            setattr(both, name, np.concatenate([getattr(static, name), getattr(added, name)]))
        textured = len(static.pixels) or len(added.pixels)
        later = np.where(added.skin_of >= 0, added.skin_of + len(static.skins), NOTHING).astype(np.int32)
        both.skin_of = np.concatenate([static.skin_of, later])
        parts = [
            soup.uv if len(soup.uv) else np.full((len(soup.corners), 3, 2), np.nan)
            for soup in (static, added)
        ]
        both.uv = np.concatenate(parts) if textured else np.empty((0, 3, 2))
        both.skins = new_structs(Skin, len(static.skins) + len(added.skins))
        for k, (soup, offset) in enumerate(((static, 0), (added, len(static.pixels)))):
            begin = k * len(static.skins)
            for name in ("start", "width", "height"):
                both.skins[name][begin : begin + len(soup.skins)] = soup.skins[name]
            both.skins["start"][begin : begin + len(soup.skins)] += offset
        return both


def _all_changed() -> Structs[Changed]:
    changed = new_structs(Changed, 1)
    changed["left"] = changed["top"] = -np.inf
    changed["right"] = changed["bottom"] = np.inf
    return changed


def lens_of(view: View) -> Structs[Lens]:
    """(1,) a view's lens, for kernels."""
    lens = view.intrinsics
    return _lens(lens.fx, lens.fy, lens.cx, lens.cy)


def _lens(fx: float, fy: float, cx: float, cy: float, parallel: bool = False) -> Structs[Lens]:
    lens = new_structs(Lens, 1)
    lens["fx"], lens["fy"], lens["cx"], lens["cy"] = fx, fy, cx, cy
    lens["near"], lens["parallel"] = NEAR_M, parallel
    return lens


def _depth_and_ids(nearness: Nearness, face: Faces, soup: _Soup) -> tuple[npt.NDArray[np.float32], Faces]:
    with np.errstate(divide="ignore"):
        depth = np.float32(1) / nearness
    return depth, np.append(soup.number, np.int32(NOTHING))[face]
