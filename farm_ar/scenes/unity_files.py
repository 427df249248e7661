"""Scenes from Unity's scene files: groups of objects, sites and templates by their parent's name, and a path.

A file of Unity (`.unity`, text form) is a list of YAML documents, each a component that names others by
number. Only what a scene needs is read: names, transforms, box colliders, prefab instances, and the points of
a Bézier path as the package PathCreator keeps them.
"""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from farm_ar.arrays import SIDE, FloatArray, number_in
from farm_ar.errors import SceneError
from farm_ar.scenes.camera import CameraPath
from farm_ar.scenes.files import read_text
from farm_ar.scenes.kinds import NEEDED, written
from farm_ar.scenes.layout import Layout
from farm_ar.scenes.scene import Scene, Site, Template

Size = tuple[float, float, float]

_DOCUMENT = re.compile(r"^--- !u!(\d+) &(-?\d+)( stripped)?$", re.MULTILINE)
_LINK = re.compile(r"\{fileID: (-?\d+)(?:, guid: (\w+))?")
LARGEST = 1e9
"""The largest number that is read: a larger one is a mistake."""

_NUMBER = r"(-?\d*\.?\d+(?:[eE][-+]?\d+)?)"
_VECTOR = re.compile(rf"\{{x: {_NUMBER}, y: {_NUMBER}, z: {_NUMBER}(?:, w: {_NUMBER})?\}}")
_CHANGE = re.compile(
    r"- target: \{fileID: (-?\d+), guid: (\w+),\s+type: \d+\}\s+propertyPath: (\S+)\s+value: ?([^\n]*)\n"
)
_GAME_OBJECT, _TRANSFORM, _BOX, _SCRIPT, _PREFAB = "1", "4", "65", "114", "1001"


@dataclass
class _Node:
    """A transform: the name of its object, its parent, and where it is in that."""

    name: str
    father: str
    position: FloatArray
    rotation: FloatArray
    scale: FloatArray
    box: FloatArray | None = None
    prefab: str | None = None


@dataclass(frozen=True)
class UnityGroups:
    """The names of the parents of what is read.

    Args:
        objects: of the labelled objects, each named `category_label`, or `category (label)` as Unity numbers
            copies.
        sites: of the centres of the Voronoi cells.
        templates: of an example of each category, named like it.
        path: of the object that has the camera's path.
    """

    objects: str = "OriginalObjects"
    sites: str = "Sites"
    templates: str = "Templates"
    path: str = "Path"


def load_unity_scene(
    path: str | os.PathLike[str],
    room: tuple[float, float] | None = None,
    sizes: Mapping[str, Size] | None = None,
    groups: UnityGroups | None = None,
) -> Scene:
    """A scene from a Unity scene file in text form, in Unity's own frame.

    An object's size is that of its box collider, times its scale; where it has none, that in `sizes`.

    Args:
        path: of the file.
        room: width and depth of the room from the origin, metres; the file's `meshSize` by default, if any of
            its scripts has one, else not known.
        sizes: width, height and depth in metres, by name of a prefab (its `guid`) or of a category.
        groups: the names of the parents of what is read; those of the paper's authors by default.

    Raises:
        SceneError: it is no such file, the parent of the objects is missing or has no children, a name has no
            label, or an object has no size.
    """
    source = str(path)
    text = read_text(path, SceneError, "a Unity scene").replace("\r\n", "\n")
    if not text.startswith("%YAML"):
        raise SceneError(
            "file", 'must be a Unity scene in text form, which begins with "%YAML"', text[:20], source
        )
    groups, sizes = groups or UnityGroups(), sizes or {}
    parsed = _Parsed(text, source)
    labels, categories, places, yaws, extents, heights = [], [], [], [], [], []
    for number in parsed.children(groups.objects, needed=True):
        name = parsed.nodes[number].name
        category, label = _category_and_label(name, source)
        position, yaw = parsed.pose(number)
        labels.append(label)
        categories.append(category)
        places.append(position[[0, 2]])
        heights.append(position[1])
        yaws.append(yaw)
        extents.append(parsed.size(number, category, sizes))
    order = sorted(range(len(labels)), key=lambda i: (categories[i], len(labels[i]), labels[i]))
    layout = Layout(
        tuple(labels[i] for i in order),
        tuple(categories[i] for i in order),
        np.array([places[i] for i in order]),
        np.array([yaws[i] for i in order]),
        np.array([extents[i] for i in order]),
        elevation=np.array([heights[i] for i in order]),
    )
    sites = []
    for number in parsed.children(groups.sites):
        (x, _, z), _ = parsed.pose(number)
        sites.append(Site(parsed.nodes[number].name, x, z))
    templates = []
    for number in parsed.children(groups.templates):
        category = parsed.nodes[number].name
        templates.append(Template(category, parsed.pose(number)[1], parsed.size(number, category, sizes)))
    if room is None and parsed.mesh_size is not None:
        room = (parsed.mesh_size, parsed.mesh_size)
    return Scene(
        Path(path).stem,
        room,
        layout,
        tuple(sites),
        parsed.camera_path(groups.path),
        templates=tuple(templates),
    )


class _Parsed:
    """The documents of a file: transforms by number, and what scripts say."""

    def __init__(self, text: str, source: str) -> None:
        self.source = source
        self.nodes: dict[str, _Node] = {}
        self.mesh_size: float | None = None
        heads = list(_DOCUMENT.finditer(text))
        ends = [*[head.start() for head in heads[1:]], len(text)][: len(heads)]
        bodies = {h[2]: (h[1], bool(h[3]), text[h.end() : e]) for h, e in zip(heads, ends, strict=True)}
        names = {k: _value(body, "m_Name") for k, (kind, _, body) in bodies.items() if kind == _GAME_OBJECT}
        self._of_object: dict[str, str] = {}
        self._paths: dict[str, FloatArray] = {}
        self._closed: dict[str, bool] = {}
        prefab_of = {}
        for number, (kind, stripped, body) in bodies.items():
            if kind == _TRANSFORM and stripped:
                prefab_of[_link(body, "m_PrefabInstance")] = number
            elif kind == _TRANSFORM:
                owner = _link(body, "m_GameObject")
                self._of_object[owner] = number
                self.nodes[number] = _Node(
                    names.get(owner, ""),
                    _link(body, "m_Father"),
                    _vector(body, "m_LocalPosition"),
                    _vector(body, "m_LocalRotation"),
                    _vector(body, "m_LocalScale"),
                )
        for number, (kind, _, body) in bodies.items():
            if kind == _PREFAB:
                self._add_prefab(prefab_of.get(number, number), body)
        for kind, _, body in bodies.values():
            owner = self._of_object.get(_link(body, "m_GameObject"), "")
            if kind == _BOX and owner in self.nodes:
                self.nodes[owner].box = _vector(body, "m_Size")
            elif kind == _SCRIPT:
                self._read_script(body, owner)

    def _add_prefab(self, number: str, body: str) -> None:
        """The root of a prefab's instance: what the file changes of it."""
        parent = _link(body, "m_TransformParent")
        node = _Node("", parent, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.ones(3))
        for _, guid, what, value in _CHANGE.findall(body):
            node.prefab = guid
            group, _, axis = what.partition(".")
            target = {
                "m_LocalPosition": node.position,
                "m_LocalRotation": node.rotation,
                "m_LocalScale": node.scale,
            }.get(group)
            if what == "m_Name":
                node.name = value.strip()
            elif target is not None and axis in tuple("xyzw"[: len(target)]):
                target["xyzw".index(axis)] = _number(value, what, self.source)
        self.nodes[number] = node

    def _read_script(self, body: str, owner: str) -> None:
        size = re.search(rf"^  meshSize: {_NUMBER}$", body, re.MULTILINE)
        if size is not None:
            self.mesh_size = _number(size[1], "meshSize", self.source)
        if "_bezierPath:" in body and owner:
            points = body.partition("points:")[2].partition("isClosed:")[0]
            found = [
                [_number(value, "points", self.source) for value in match[:3]]
                for match in _VECTOR.findall(points)
            ]
            self._paths[owner] = np.array(found).reshape(-1, 3)
            self._closed[owner] = "isClosed: 1" in body

    def children(self, parent: str, needed: bool = False) -> Sequence[str]:
        """The numbers of the transforms below the one of a name, in the order of the file."""
        above = {number for number, node in self.nodes.items() if node.name == parent}
        found = [number for number, node in self.nodes.items() if node.father in above]
        if needed and not found:
            tops = sorted({node.name for node in self.nodes.values() if node.father == "0"} - {""})
            expected = f"must be the name of an object with children, such as {', '.join(tops)}"
            raise SceneError("objects", expected, parent, self.source)
        return found

    def pose(self, number: str) -> tuple[FloatArray, float]:
        """(3,) where a transform is in the world, metres, and its heading, radians."""
        position, turn, _ = self._world(number)
        ahead = turn.apply([0.0, 0.0, 1.0])
        return position, float(np.arctan2(ahead[0], ahead[2]))

    def size(self, number: str, category: str, sizes: Mapping[str, Size]) -> Size:
        """Width, height and depth, metres."""
        node = self.nodes[number]
        for name in (node.prefab, category):
            if name is not None and name in sizes:
                return sizes[name]
        if node.box is None:
            expected = (
                f"must be in the table of sizes, under {node.prefab or category}: it has no box collider"
            )
            raise SceneError(f"objects[{node.name!r}].size_whd", expected, NEEDED, self.source)
        scale = self._world(number)[2]
        width, height, depth = (np.abs(node.box * scale)).tolist()
        return width, height, depth

    def camera_path(self, name: str) -> CameraPath | None:
        """The path that an object of a name has; None if there is none."""
        for number, points in self._paths.items():
            if self.nodes[number].name == name:
                position, turn, scale = self._world(number)
                placed = turn.apply(points * scale) + position
                return CameraPath(placed[:, [0, 2]], self._closed[number])
        return None

    def _world(self, number: str) -> tuple[FloatArray, Rotation, FloatArray]:
        """Where a transform is, how it is turned and how it is scaled, in the world."""
        position, turn, scale = np.zeros(3), Rotation.identity(), np.ones(3)
        seen: set[str] = set()
        while number in self.nodes:
            if number in seen:
                raise SceneError("m_Father", "must not lead back to itself", number, self.source)
            seen.add(number)
            node = self.nodes[number]
            if not node.rotation.any():
                raise SceneError(
                    "m_LocalRotation", "must be a quaternion", node.rotation.tolist(), self.source
                )
            # In a left-handed frame angles count the other way round: the formulas stay as they are.
            local = Rotation.from_quat(node.rotation)
            position = local.apply(position * node.scale) + node.position
            turn, scale = local * turn, scale * node.scale
            number = node.father
        return position, turn, scale


def _category_and_label(name: str, source: str) -> tuple[str, str]:
    for pattern in (r"(.+)_([^_]+)", r"(.+?) ?\(([^)]+)\)"):
        match = re.fullmatch(pattern, name)
        if match is not None:
            return match[1], match[2]
    raise SceneError("m_Name", "must be category_label or category (label)", name, source)


def _value(body: str, name: str) -> str:
    match = re.search(rf"^\s*{name}: ?(.*)$", body, re.MULTILINE)
    return "" if match is None else match[1].strip()


def _link(body: str, name: str) -> str:
    match = _LINK.match(_value(body, name))
    return "" if match is None else match[1]


def _vector(body: str, name: str) -> FloatArray:
    match = _VECTOR.match(_value(body, name))
    if match is None:
        raise SceneError(name, "must be {x: , y: , z: }", _value(body, name))
    return np.array([_number(value, name) for value in match.groups() if value is not None])


def _number(text: str, field: str, source: str | None = None) -> float:
    value = number_in(text)
    if value is None or not abs(value) <= LARGEST:
        expected = f"must be a number from -{written(LARGEST)} to {written(LARGEST)}"
        raise SceneError(field, expected, text, source)
    return value


def load_sizes(path: str | os.PathLike[str]) -> dict[str, Size]:
    """A table of sizes, CSV with the columns name, w, h, d: of prefabs (by `guid`) or categories, metres.

    Raises:
        SceneError: a column is missing, or a side is no positive number of metres.
    """
    rows = csv.DictReader(io.StringIO(read_text(path, SceneError, "a table of sizes")))
    missing = [name for name in ("name", "w", "h", "d") if name not in (rows.fieldnames or ())]
    if missing:
        raise SceneError("columns", "must be name, w, h, d", ", ".join(rows.fieldnames or ()), str(path))
    found = {}
    for line, row in enumerate(rows, 2):
        width, height, depth = (_side(row[name], f"line {line}, {name}", str(path)) for name in "whd")
        found[row["name"]] = (width, height, depth)
    return found


def _side(text: str | None, field: str, source: str) -> float:
    value = number_in(text or "")
    if value is None or not SIDE.allow(value):
        raise SceneError(field, SIDE.expected, text, source)
    return value
