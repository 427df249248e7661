"""Scene files: JSON in degrees and metres, read into a `Scene` and written back."""

from __future__ import annotations

import json
import os
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.errors import SceneError
from farm_ar.scenes.camera import PAPER_FIELD_OF_VIEW, CameraPath, FieldOfView
from farm_ar.scenes.fields import Fields, degrees, read_json, write_text
from farm_ar.scenes.layout import Layout
from farm_ar.scenes.scene import Scene, Site, Template, Weights


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """Read a scene file.

    Raises:
        SceneError: it cannot be read, or a value in it cannot be used; names the file and the field.
    """
    file = Path(path)
    return scene_from_dict(read_json(file, SceneError), source=file.name, default_name=file.stem)


def save_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene file, whole or not at all."""
    write_text(path, json.dumps(scene_to_dict(scene), indent=1) + "\n")


def scene_schema() -> dict[str, Any]:
    """The JSON Schema of scene files."""
    file = files("farm_ar.scenes").joinpath("scene.schema.json")
    schema: dict[str, Any] = json.loads(file.read_text("utf-8"))
    return schema


def scene_from_dict(data: object, source: str | None = None, default_name: str = "scene") -> Scene:
    """A scene from the contents of a scene file.

    Args:
        data: the parsed JSON.
        source: name of the file, for errors.
        default_name: the scene's name where the file gives none.

    Raises:
        SceneError: a value cannot be used; names the field.
    """
    fields = Fields(data, SceneError, source)
    fov, camera_speed = (
        _camera(fields.child("camera")) if fields.has("camera") else (PAPER_FIELD_OF_VIEW, 1.0)
    )
    layout = _layout(fields)
    try:
        scene = Scene(
            name=fields.text("name", default_name),
            size=fields.sides("size_m", 2),  # type: ignore[arg-type]  # two of them
            layout=layout,
            sites=tuple(_site(item) for item in fields.children("sites", [])),
            camera_path=_camera_path(fields.child("camera_path")) if fields.has("camera_path") else None,
            fov=fov,
            camera_speed=camera_speed,
            weights=_weights(fields.child("weights")) if fields.has("weights") else None,
            templates=tuple(_template(item, layout) for item in fields.children("templates", [])),
            symmetry=_symmetry(fields.child("symmetry_deg"), layout) if fields.has("symmetry_deg") else {},
        )
    except SceneError as problem:  # from a constructor, which does not know the file
        raise SceneError(problem.field, problem.expected, problem.got, source) from None
    fields.finish()
    return scene


def scene_to_dict(scene: Scene) -> dict[str, Any]:
    """The contents of a scene file that `scene_from_dict` reads back to the same scene.

    Templates and symmetries of categories that no object has are left out.
    """
    layout, fov = scene.layout, scene.fov
    objects = []
    for i, label in enumerate(layout.labels):
        entry = {
            "label": label,
            "category": layout.category[i],
            "x": float(layout.position[i, 0]),
            "z": float(layout.position[i, 1]),
            "yaw_deg": degrees(layout.yaw[i]),
            "y": float(layout.elevation[i]),
            "size_whd": layout.size[i].tolist(),
        }
        objects.append(entry | ({"fixed": True} if layout.fixed[i] else {}))
    data: dict[str, Any] = {
        "name": scene.name,
        "size_m": list(scene.size),
        "sites": [{"name": site.name, "x": site.x, "z": site.z} for site in scene.sites],
        "objects": objects,
        "templates": [
            {"category": t.category, "yaw_deg": degrees(t.yaw), "size_whd": list(t.size)}
            for t in scene.templates
            if t.category in layout.categories
        ],
        "camera": {**fov_to_dict(fov), "speed_m_s": scene.camera_speed},
    }
    if scene.camera_path is not None:
        path = scene.camera_path
        data["camera_path"] = {"closed": path.closed, "bezier_points": path.points.tolist()}
    if scene.weights is not None:
        data["weights"] = {"translation": scene.weights.translation, "rotation": scene.weights.rotation}
    symmetry = {name: degrees(period) for name, period in scene.symmetry.items() if name in layout.categories}
    if symmetry:
        data["symmetry_deg"] = symmetry
    return data


def fov_to_dict(fov: FieldOfView) -> dict[str, float]:
    """The fields of a camera entry that say what it sees."""
    data = {
        "fov_left_deg": degrees(fov.left),
        "fov_right_deg": degrees(fov.right),
        "range_m": fov.range_m,
    }
    if fov.up is not None and fov.down is not None:
        data |= {"fov_up_deg": degrees(fov.up), "fov_down_deg": degrees(fov.down)}
    return data


def fov_from_fields(fields: Fields) -> FieldOfView:
    """What a camera sees, from a camera entry; the paper's values where it is silent."""
    default = fov_to_dict(PAPER_FIELD_OF_VIEW)
    left, right = (
        fields.number(name, default[name], limits=(0, 180)) for name in ("fov_left_deg", "fov_right_deg")
    )
    range_m = fields.positive("range_m", default["range_m"])
    up = down = None
    if fields.has("fov_up_deg") or fields.has("fov_down_deg"):
        up = _radians(fields.number("fov_up_deg", limits=(0, 90)))
        down = _radians(fields.number("fov_down_deg", limits=(0, 90)))
    return FieldOfView(_radians(left), _radians(right), range_m, up, down)


def _radians(angle_deg: float) -> float:
    return float(np.deg2rad(angle_deg))


def _layout(fields: Fields) -> Layout:
    labels: list[str] = []
    category: list[str] = []
    poses: list[tuple[float, float, float, float]] = []
    size: list[tuple[float, ...]] = []
    fixed: list[bool] = []
    for item in fields.children("objects"):
        label = item.text("label")
        if label in labels:
            raise item.fail("label", "must not repeat an earlier label", label)
        labels.append(label)
        category.append(item.text("category"))
        poses.append((item.number("x"), item.number("z"), item.number("yaw_deg"), item.number("y", 0.0)))
        size.append(item.sides("size_whd", 3))
        fixed.append(item.flag("fixed"))
        item.finish()
    x, z, yaw_deg, elevation = np.reshape(poses, (-1, 4)).T
    return Layout(
        labels=tuple(labels),
        category=tuple(category),
        position=np.stack([x, z], axis=-1),
        yaw=np.deg2rad(yaw_deg),
        size=np.array(size),
        elevation=elevation,
        fixed=np.array(fixed, dtype=bool),
    )


def _site(item: Fields) -> Site:
    site = Site(item.text("name"), item.number("x"), item.number("z"))
    item.finish()
    return site


def _template(item: Fields, layout: Layout) -> Template:
    category = item.text("category")
    if category not in layout.categories:
        raise item.fail("category", "must be a category of the objects", category)
    yaw, size = _radians(item.number("yaw_deg", 0.0)), item.sides("size_whd", 3)
    item.finish()
    return Template(category, yaw, size)  # type: ignore[arg-type]  # three of them


def _camera_path(fields: Fields) -> CameraPath:
    points, closed = fields.points("bezier_points"), fields.flag("closed")
    if fields.has("polyline"):
        fields.points("polyline")
    fields.finish()
    return CameraPath(np.array(points), closed)


def _camera(fields: Fields) -> tuple[FieldOfView, float]:
    fov, speed = fov_from_fields(fields), fields.positive("speed_m_s", 1.0)
    fields.finish()
    return fov, speed


def _weights(fields: Fields) -> Weights:
    translation, rotation = fields.number("translation"), fields.number("rotation", 1.0)
    fields.finish()
    return Weights(translation, rotation)


def _symmetry(fields: Fields, layout: Layout) -> dict[str, float]:
    for category in fields.names():
        if category not in layout.categories:
            raise fields.fail(category, "must be named after a category of the objects", category)
    return {category: _radians(fields.number(category, limits=(0, 360))) for category in fields.names()}
