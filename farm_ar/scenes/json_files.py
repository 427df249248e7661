"""Scene and snapshot files: JSON in degrees and metres, read into records and written back."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.arrays import POSITION, RANGE, SHARE, SIDE, SPEED, WEIGHT, Limits
from farm_ar.errors import SceneError, SnapshotError
from farm_ar.scenes.camera import PAPER_FIELD_OF_VIEW, Camera, CameraPath, FieldOfView
from farm_ar.scenes.documents import (
    DEGREES,
    Document,
    Flag,
    Listing,
    Named,
    Number,
    Numbers,
    Object,
    OrNull,
    Text,
    radians,
)
from farm_ar.scenes.files import degrees, read_json, write_text
from farm_ar.scenes.layout import Layout
from farm_ar.scenes.scene import Scene, Site, Template, Weights
from farm_ar.scenes.snapshot import Detections, Snapshot

Values = Mapping[str, Any]

_HALF_TURN, _QUARTER, _TURN = (Limits(0.0, limit, "") for limit in (180.0, 90.0, 360.0))
_METRES, _YAW = Number(POSITION), Number(DEGREES)
_SIZE = Numbers(
    3,
    SIDE,
    "3 positive numbers in metres, from 1e-6 to 1e6",
    about="Width (x), height (y) and depth (z) before turning.",
)
_POINT = Numbers(2, POSITION, "[x, z] in metres, from -1e6 to 1e6")
_HEIGHT = Number(POSITION, default=0.0, about="Height of the pivot above the floor.")
_VIEW = {
    "fov_left_deg": Number(_HALF_TURN, default=degrees(PAPER_FIELD_OF_VIEW.left)),
    "fov_right_deg": Number(_HALF_TURN, default=degrees(PAPER_FIELD_OF_VIEW.right)),
    "range_m": Number(RANGE, default=PAPER_FIELD_OF_VIEW.range_m),
    "fov_up_deg": Number(_QUARTER, default=None),
    "fov_down_deg": Number(_QUARTER, default=None),
}
_UP_AND_DOWN = ("fov_up_deg", "fov_down_deg")

SCENE = Document(
    "scene",
    Object(
        {
            "name": Text(default=None, about="The file's name without its ending if left out."),
            "size_m": Numbers(
                2,
                SIDE,
                "2 positive numbers in metres, from 1e-6 to 1e6",
                about="Width and depth of the room.",
            ),
            "sites": Listing(
                Object({"name": Text(), "x": _METRES, "z": _METRES}),
                default=(),
                about="Centres of the Voronoi cells; none means that nothing is pruned.",
            ),
            "objects": Listing(
                Object(
                    {
                        "label": Text(about="Its identity, different for each object."),
                        "category": Text(about="What can be seen of it. Objects of one category look alike."),
                        "x": _METRES,
                        "z": _METRES,
                        "yaw_deg": _YAW,
                        "y": _HEIGHT,
                        "size_whd": _SIZE,
                        "fixed": Flag(default=False, about="Whether it never moves."),
                    }
                ),
                different="label",
                about="The labelled objects of the reference layout.",
            ),
            "templates": Listing(
                Object({"category": Text(), "yaw_deg": Number(DEGREES, default=0.0), "size_whd": _SIZE}),
                default=(),
                about="At most one example of each category, which detections are compared with when boxes "
                "are taken along the world's axes.",
            ),
            "camera_path": Object(
                {
                    "closed": Flag(default=False),
                    "bezier_points": Listing(
                        _POINT,
                        least=4,
                        words="a list of 4, 7, 10, ... [x, z] in metres",
                        about="Anchor, control, control, anchor, ... of cubic curves.",
                    ),
                    "polyline": Listing(
                        _POINT, default=None, about="The same curve sampled; not needed, not used."
                    ),
                },
                default=None,
            ),
            "camera": Object({**_VIEW, "speed_m_s": Number(SPEED, default=1.0)}, _UP_AND_DOWN, default=None),
            "weights": Object(
                {"translation": Number(WEIGHT), "rotation": Number(WEIGHT, default=1.0)},
                default=None,
                about="Of the translation and rotation costs; 0.36 times the square root of the area, and 1, "
                "if left out.",
            ),
            "symmetry_deg": Named(
                Number(_TURN),
                default=None,
                about="For categories that look the same when turned: by how much, 0 for those without any "
                "heading.",
            ),
        },
        notes=True,
        about="A room [0, w] x [0, d] and the labelled objects in it. Metres and degrees; x right, "
        "z forward, y up; yaw clockwise seen from above, 0 facing +z.",
    ),
    SceneError,
)
"""What a scene file holds."""

SNAPSHOT = Document(
    "snapshot",
    Object(
        {
            "camera": Object(
                {
                    "x": _METRES,
                    "z": _METRES,
                    "yaw_deg": _YAW,
                    "y": Number(POSITION, default=None, about="Height of the eye above the floor."),
                    "pitch_deg": Number(DEGREES, default=0.0, about="Upwards."),
                    **_VIEW,
                },
                _UP_AND_DOWN,
            ),
            "detections": Listing(
                Object(
                    {
                        "id": Text(
                            default=None, about="Different for each; its place in the list if left out."
                        ),
                        "category": OrNull(
                            Text(), "a category", default=None, about="null or left out: not known."
                        ),
                        "x": _METRES,
                        "z": _METRES,
                        "yaw_deg": _YAW,
                        "y": _HEIGHT,
                        "size_whd": _SIZE,
                        "confidence": Number(SHARE, default=1.0, about="How sure the detector is."),
                    }
                )
            ),
        },
        notes=True,
        about="One camera and what it detected, without identities. Metres and degrees; x right, z forward, "
        "y up; yaw clockwise seen from above, 0 facing +z.",
    ),
    SnapshotError,
)
"""What a snapshot file holds."""


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


def load_snapshot(path: str | os.PathLike[str]) -> Snapshot:
    """Read a snapshot file.

    Raises:
        SnapshotError: it cannot be read, or a value in it cannot be used; names the file and the field.
    """
    return snapshot_from_dict(read_json(path, SnapshotError), source=Path(path).name)


def save_snapshot(snapshot: Snapshot, path: str | os.PathLike[str]) -> None:
    """Write a snapshot file, whole or not at all."""
    write_text(path, json.dumps(snapshot_to_dict(snapshot), indent=1) + "\n")


def scene_schema() -> dict[str, Any]:
    """The JSON Schema of scene files."""
    return SCENE.schema()


def scene_from_dict(data: object, source: str | None = None, default_name: str = "scene") -> Scene:
    """A scene from the contents of a scene file.

    Args:
        data: the parsed JSON.
        source: name of the file, for errors.
        default_name: the scene's name where the file gives none.

    Raises:
        SceneError: a value cannot be used; names the field.
    """
    values = SCENE.read(data, source)
    objects = values["objects"]
    categories = {one["category"] for one in objects}
    for i, template in enumerate(values["templates"]):
        if template["category"] not in categories:
            place = ("templates", i, "category")
            raise SCENE.fail(place, "must be a category of the objects", template["category"], source)
    for name in values["symmetry_deg"] or {}:
        if name not in categories:
            place = ("symmetry_deg", name)  # type: ignore[assignment]
            raise SCENE.fail(place, "must be named after a category of the objects", name, source)
    view, path, weights = values["camera"], values["camera_path"], values["weights"]
    try:
        return Scene(
            name=values["name"] or default_name,
            size=values["size_m"],
            layout=Layout(
                labels=tuple(one["label"] for one in objects),
                category=tuple(one["category"] for one in objects),
                fixed=np.array([one["fixed"] for one in objects], dtype=bool),
                **_poses(objects),
            ),
            sites=tuple(Site(**site) for site in values["sites"]),
            camera_path=path and CameraPath(np.array(path["bezier_points"]), path["closed"]),
            fov=PAPER_FIELD_OF_VIEW if view is None else _field_of_view(view),
            camera_speed=1.0 if view is None else view["speed_m_s"],
            weights=weights and Weights(**weights),
            templates=tuple(
                Template(one["category"], radians(one["yaw_deg"]), one["size_whd"])
                for one in values["templates"]
            ),
            symmetry={name: radians(angle) for name, angle in (values["symmetry_deg"] or {}).items()},
        )
    except SceneError as problem:  # from a constructor, which does not know the file
        raise SceneError(problem.field, problem.expected, problem.got, source) from None


def snapshot_from_dict(data: object, source: str | None = None) -> Snapshot:
    """A snapshot from the contents of a snapshot file.

    Raises:
        SnapshotError: a value cannot be used; names the field.
    """
    values = SNAPSHOT.read(data, source)
    view, seen = values["camera"], values["detections"]
    ids = [one["id"] or str(i) for i, one in enumerate(seen)]
    earlier: set[str] = set()
    for i, name in enumerate(ids):
        if name in earlier:
            raise SNAPSHOT.fail(("detections", i, "id"), "must not repeat an earlier id", name, source)
        earlier.add(name)
    camera = Camera(
        position=np.array([view["x"], view["z"]]),
        yaw=np.deg2rad(view["yaw_deg"]),
        fov=_field_of_view(view),
        height=None if view["y"] is None else np.array(view["y"]),
        pitch=np.deg2rad(view["pitch_deg"]),
    )
    detections = Detections(
        category=tuple(one["category"] for one in seen),
        confidence=np.array([one["confidence"] for one in seen]),
        ids=tuple(ids),
        **_poses(seen),
    )
    return Snapshot(camera, detections)


def scene_to_dict(scene: Scene) -> dict[str, Any]:
    """The contents of a scene file that `scene_from_dict` reads back to the same scene.

    Templates and symmetries of categories that no object has are left out.
    """
    layout = scene.layout
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
        "camera": {**_view_to_dict(scene.fov), "speed_m_s": scene.camera_speed},
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


def snapshot_to_dict(snapshot: Snapshot) -> dict[str, Any]:
    """The contents of a snapshot file that `snapshot_from_dict` reads back to the same snapshot."""
    camera, seen = snapshot.camera, snapshot.detections
    view = {
        "x": float(camera.position[0]),
        "z": float(camera.position[1]),
        "yaw_deg": degrees(camera.yaw),
        "pitch_deg": degrees(camera.pitch),
        **_view_to_dict(camera.fov),
    }
    if camera.height is not None:
        view["y"] = float(camera.height)
    detections = [
        {
            "id": seen.ids[i],
            "category": seen.category[i],
            "x": float(seen.position[i, 0]),
            "z": float(seen.position[i, 1]),
            "y": float(seen.elevation[i]),
            "yaw_deg": degrees(seen.yaw[i]),
            "size_whd": seen.size[i].tolist(),
            "confidence": float(seen.confidence[i]),
        }
        for i in range(len(seen))
    ]
    return {"camera": view, "detections": detections}


def _view_to_dict(fov: FieldOfView) -> dict[str, float]:
    """The fields of a camera entry that say what it sees."""
    data = {
        "fov_left_deg": degrees(fov.left),
        "fov_right_deg": degrees(fov.right),
        "range_m": fov.range_m,
    }
    if fov.up is not None and fov.down is not None:
        data |= {"fov_up_deg": degrees(fov.up), "fov_down_deg": degrees(fov.down)}
    return data


def _field_of_view(view: Values) -> FieldOfView:
    """What a camera sees, from a camera entry."""
    left, right = radians(view["fov_left_deg"]), radians(view["fov_right_deg"])
    up, down = (None if view[name] is None else radians(view[name]) for name in _UP_AND_DOWN)
    return FieldOfView(left, right, view["range_m"], up, down)


def _poses(entries: list[Any]) -> dict[str, Any]:
    """Position, yaw, elevation and size of N objects of a file, as arrays."""
    place = np.reshape([(one["x"], one["z"], one["yaw_deg"], one["y"]) for one in entries], (-1, 4))
    return {
        "position": place[:, :2],
        "yaw": np.deg2rad(place[:, 2]),
        "elevation": place[:, 3],
        "size": np.array([one["size_whd"] for one in entries]),
    }
