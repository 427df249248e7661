"""A scene: its bounds, the reference layout in it, the sites, and how a camera sees and moves there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import ANGLE, POSITION, SIDE, SPEED, WEIGHT, FloatArray, IntArray, Record, read_only
from farm_ar.errors import SceneError
from farm_ar.geometry import diameter, nearest_site
from farm_ar.scenes.bounds import Bounds, turned
from farm_ar.scenes.camera import PAPER_FIELD_OF_VIEW, CameraPath, FieldOfView
from farm_ar.scenes.kinds import is_text
from farm_ar.scenes.layout import NO_CATEGORY, Layout
from farm_ar.scenes.worlds import OURS, World


@dataclass(frozen=True)
class Site:
    """The centre of a Voronoi cell: its name and where it is, metres. It may lie outside the room."""

    name: str
    x: float
    z: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "x", float(self.x))
        object.__setattr__(self, "z", float(self.z))


@dataclass(frozen=True)
class Weights:
    """Weights of the translation and rotation costs, w_t and w_r, 0 to 1e6.

    Raises:
        SceneError: one of them is out of these limits.
    """

    translation: float
    rotation: float = 1.0

    def __post_init__(self) -> None:
        for name in ("translation", "rotation"):
            value = float(getattr(self, name))
            if not WEIGHT.allow(value):
                raise SceneError(f"weights.{name}", WEIGHT.expected, value)
            object.__setattr__(self, name, value)

    @classmethod
    def of_area(cls, area: float) -> Weights:
        """The paper's weights for a room of `area` square metres: 0.36 sqrt(area) and 1 (section 4.1.1)."""
        return cls(0.36 * float(np.sqrt(area)), 1.0)


@dataclass(frozen=True)
class Template:
    """The example of a category that detections are compared with under `box="world"`.

    Args:
        category: the category it stands for.
        yaw: heading of the example, radians.
        size: its width, height and depth, metres.

    Raises:
        SceneError: the heading or the size is out of its limits.
    """

    category: str
    yaw: float
    size: tuple[float, float, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "yaw", float(self.yaw))
        object.__setattr__(self, "size", tuple(float(side) for side in self.size))
        if not ANGLE.allow(self.yaw):
            raise SceneError("template.yaw", ANGLE.expected, self.yaw)
        if len(self.size) != 3 or not SIDE.allow(self.size).all():
            raise SceneError(
                "template.size", "must be 3 positive numbers in metres, from 1e-6 to 1e6", self.size
            )


@dataclass(frozen=True, eq=False, init=False)
class Scene(Record):
    """A place with what the headset last knew of it.

    Args:
        name: its name.
        size: width (x) and depth (z) of the room [0, width] x [0, depth], metres: the bounds, where they are
            such a room. None otherwise.
        layout: the reference layout.
        sites: centres of the Voronoi cells, distinct; none means that nothing is ever pruned.
        camera_path: where the camera wanders, if anywhere.
        fov: what the camera sees.
        camera_speed: speed along the path, metres a second.
        weights: of the costs; None for the paper's formula.
        templates: at most one per category, for `box="world"`.
        symmetry: period in radians, 0 to 2 pi, of the categories that look the same when turned by it; 0 for
            those that look the same however they are turned.
        bounds: within which the objects stand, wherever that is; None where they are not known.
        world: how its file writes poses, for what is said of them; our own frame and metres by default.

    Raises:
        SceneError: a value is out of its limits, two sites share a name or a place, or a size is given beside
            bounds that are no room from [0, 0].
    """

    name: str
    layout: Layout
    sites: tuple[Site, ...]
    camera_path: CameraPath | None
    fov: FieldOfView
    camera_speed: float
    weights: Weights | None
    templates: tuple[Template, ...]
    symmetry: Mapping[str, float]
    bounds: Bounds | None
    world: World

    def __init__(
        self,
        name: str,
        size: tuple[float, float] | None = None,
        layout: Layout = None,  # type: ignore[assignment]  # needed, but `size` is not
        sites: Iterable[Site] = (),
        camera_path: CameraPath | None = None,
        fov: FieldOfView = PAPER_FIELD_OF_VIEW,
        camera_speed: float = 1.0,
        weights: Weights | None = None,
        templates: Iterable[Template] = (),
        symmetry: Mapping[str, float] = MappingProxyType({}),
        bounds: Bounds | None = None,
        world: World = OURS,
    ) -> None:
        for field, value in locals().items():
            if field not in ("self", "size"):
                object.__setattr__(self, field, value)
        if size is not None:
            object.__setattr__(self, "bounds", _room(size, bounds))
        object.__setattr__(self, "sites", tuple(self.sites))
        object.__setattr__(self, "camera_speed", float(self.camera_speed))
        object.__setattr__(self, "templates", tuple(self.templates))
        object.__setattr__(self, "symmetry", MappingProxyType(dict(self.symmetry)))
        if not is_text(self.name):
            raise SceneError("name", "must be a non-empty string of Unicode", self.name)
        if not isinstance(self.layout, Layout):
            raise SceneError("layout", "must be a layout", self.layout)
        if self.layout.batch_shape:
            raise SceneError("layout", "must be a single arrangement", self.layout.batch_shape)
        if not SPEED.allow(self.camera_speed):
            raise SceneError("camera.speed_m_s", SPEED.expected, self.camera_speed)
        self._check_sites()
        self._check_categories()

    def _check_sites(self) -> None:
        names: set[str] = set()
        places: set[tuple[float, float]] = set()
        for i, site in enumerate(self.sites):
            place = (site.x, site.z)
            if not is_text(site.name):
                raise SceneError(f"sites[{i}].name", "must be a non-empty string of Unicode", site.name)
            if not POSITION.allow(place).all():
                raise SceneError(f"sites[{i}]", "must have a finite x and z, from -1e6 to 1e6 metres", place)
            if site.name in names:
                raise SceneError(f"sites[{i}].name", "must not repeat an earlier site's", site.name)
            if place in places:
                raise SceneError(f"sites[{i}]", "must not stand where an earlier site does", place)
            names.add(site.name)
            places.add(place)

    def _check_categories(self) -> None:
        seen: set[str] = set()
        for i, template in enumerate(self.templates):
            if template.category in seen:
                expected = "must not repeat an earlier template's"
                raise SceneError(f"templates[{i}].category", expected, template.category)
            seen.add(template.category)
        for category, period in self.symmetry.items():
            if not 0 <= period <= 2 * np.pi:
                expected = "must be an angle from 0 to 360 degrees"
                raise SceneError(f"symmetry[{category!r}]", expected, period)

    def knowing(self, layout: Layout) -> Scene:
        """The same place, with the same objects known to be elsewhere."""
        values = vars(self) | {"layout": layout}
        values.pop("object_site", None)
        if self.bounds is None:
            values.pop("diagonal", None)
        return self.trusted(**values)

    def unnamed(self) -> Scene:
        """The same place, with no object's category known."""
        layout = replace(self.layout, category=(NO_CATEGORY,) * len(self.layout))
        return replace(self, layout=layout, templates=(), symmetry={})

    def moved(self, shift: npt.ArrayLike = (0.0, 0.0), turn: float = 0.0) -> Scene:
        """The same place in another frame: turned clockwise about the origin, then shifted.

        Args:
            shift: (x, z), metres.
            turn: radians.
        """

        def there(points: FloatArray) -> FloatArray:
            return turned(points, turn) + np.asarray(shift, dtype=np.float64)

        path, layout = self.camera_path, self.layout
        return replace(
            self,
            layout=layout.with_poses(there(layout.position), layout.yaw + turn),
            sites=tuple(
                Site(site.name, *place.tolist())
                for site, place in zip(self.sites, there(self.site_positions), strict=True)
            ),
            camera_path=path and CameraPath(there(path.points), path.closed),
            templates=tuple(Template(one.category, one.yaw + turn, one.size) for one in self.templates),
            bounds=self.bounds and self.bounds.moved(shift, turn),
            world=OURS,
        )

    def in_room(self) -> Scene:
        """The same place moved so that its bounds are a room [0, width] x [0, depth], with all poses known.

        Physics, games and attacks are played there.

        Raises:
            SceneError: the bounds are no rectangle, or the heading or the size of an object is not known.
        """
        unknown = np.isnan(self.layout.yaw) | np.isnan(self.layout.size).any(axis=-1)
        if unknown.any():
            i = int(unknown.argmax())
            raise SceneError(f"objects[{i}]", "must have a heading and a size here", self.layout.labels[i])
        if self.room is not None:
            return self
        pose = None if self.bounds is None else self.bounds.as_rectangle
        if pose is None:
            expected = "must be a rectangle here, as size_m, or bounds with a size, give it"
            raise SceneError("bounds", expected, self.bounds)
        scene = self.moved(-turned(pose.corner, -pose.yaw), -pose.yaw)
        return replace(scene, bounds=Bounds.rectangle(pose.width, pose.depth))

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        values = [getattr(self, field.name) for field in fields(self)]
        values[8] = dict(self.symmetry)
        return type(self), (values[0], None, *values[1:])

    def __repr__(self) -> str:
        n, k = len(self.layout), len(self.sites)
        where = "no bounds" if self.bounds is None else repr(self.bounds)
        if self.room is not None:
            where = f"{self.room[0]:g} x {self.room[1]:g} m"
        return f"Scene({self.name!r}, {where}, {n} objects, {k} sites)"

    @property
    def room(self) -> tuple[float, float] | None:
        """Width and depth, metres, where the bounds are [0, width] x [0, depth]; None where they are not."""
        return None if self.bounds is None else self.bounds.room

    @property
    def size(self) -> tuple[float, float]:
        """Width and depth, metres, of the room [0, width] x [0, depth].

        Raises:
            SceneError: the bounds are others, or not known.
        """
        room = self.room
        if room is None:
            expected = "must be a rectangle from [0, 0] along the axes here, as size_m alone gives it"
            raise SceneError("bounds", expected, self.bounds)
        return room

    @cached_property
    def diagonal(self) -> float:
        """The `l` of Eq. 4, metres: the diagonal of the room, or the largest distance within its bounds.

        Without bounds it is that between two objects; of a single one, the diagonal of its footprint, or 1
        metre where its size is not known.
        """
        if self.bounds is not None:
            return self.bounds.extent
        apart = diameter(self.layout.position)
        if apart > 0:
            return apart
        footprint = np.hypot(self.layout.size[:, 0], self.layout.size[:, 2])
        return float(np.nanmax(footprint)) if np.isfinite(footprint).any() else 1.0

    @property
    def area(self) -> float:
        """Area within the bounds, square metres; without bounds that of a square with the diagonal."""
        return self.diagonal**2 / 2 if self.bounds is None else self.bounds.area

    @cached_property
    def site_positions(self) -> FloatArray:
        """(K, 2) centres of the sites."""
        return read_only(np.reshape([(site.x, site.z) for site in self.sites], (-1, 2)), np.float64)

    @cached_property
    def object_site(self) -> IntArray:
        """(N,) index of the site in whose cell each object stands; all 0 where there are no sites."""
        if not self.sites:
            return np.zeros(len(self.layout), dtype=np.int64)
        return nearest_site(self.layout.position, self.site_positions)

    @property
    def cost_weights(self) -> Weights:
        """The scene's own weights, or the paper's formula where it has none."""
        return self.weights or Weights.of_area(self.area)


def _room(size: tuple[float, float], bounds: Bounds | None) -> Bounds:
    """The bounds that a size means."""
    sides = tuple(float(side) for side in size)
    if len(sides) != 2 or not SIDE.allow(sides).all():
        raise SceneError("size_m", "must be 2 positive numbers in metres, from 1e-6 to 1e6", list(sides))
    if bounds is not None and bounds.room is None:  # another room is replaced by `replace(scene, size=...)`
        raise SceneError("size_m, bounds", "must be one of the two", (list(sides), bounds))
    return Bounds.rectangle(*sides)
