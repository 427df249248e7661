"""Scene and snapshot files: JSON, read into records and written back in degrees and metres."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.arrays import RANGE, SPEED, FloatArray
from farm_ar.errors import SceneError, SnapshotError
from farm_ar.geometry import rotation_matrix
from farm_ar.scenes.camera import PAPER_FIELD_OF_VIEW, Camera, CameraPath, FieldOfView
from farm_ar.scenes.conversion import Reader, Values
from farm_ar.scenes.declarations import SCENE, SNAPSHOT, UP_AND_DOWN
from farm_ar.scenes.files import degrees, read_json, write_text
from farm_ar.scenes.kinds import radians
from farm_ar.scenes.layout import NO_CATEGORY, Layout
from farm_ar.scenes.scene import Scene, Site, Template, Weights
from farm_ar.scenes.snapshot import Detections, Snapshot
from farm_ar.scenes.uncertainty import Uncertainty

__all__ = ["SCENE", "SNAPSHOT"]


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
    reader = Reader(SCENE, data, source)
    values, objects = reader.values, reader.values["objects"]
    _check_names(reader)
    view, path, weights = values["camera"], values["camera_path"], values["weights"]
    poses = reader.poses(("objects",), objects)
    try:
        return Scene(
            name=values["name"] or default_name,
            layout=Layout(
                labels=tuple(one["label"] for one in objects),
                category=tuple(one["category"] or NO_CATEGORY for one in objects),
                fixed=np.array([one["fixed"] for one in objects], dtype=bool),
                position=poses.position,
                yaw=poses.yaw,
                elevation=poses.elevation,
                tilt=poses.tilt,
                size=reader.sizes(("objects",), objects),
            ),
            sites=[
                Site(site["name"], *reader.spot(("sites", i), site)) for i, site in enumerate(values["sites"])
            ],
            camera_path=path
            and CameraPath(
                reader.floor(("camera_path", "bezier_points"), path["bezier_points"]), path["closed"]
            ),
            fov=PAPER_FIELD_OF_VIEW if view is None else _field_of_view(reader, view),
            camera_speed=1.0 if view is None else _speed(reader, view),
            weights=weights and Weights(**weights),
            templates=[
                Template(
                    one["category"], float(reader.world.yaws(radians(one["yaw_deg"]))), tuple(size.tolist())
                )
                for one, size in zip(
                    values["templates"], reader.sizes(("templates",), values["templates"]), strict=True
                )
            ],
            symmetry={name: radians(angle) for name, angle in (values["symmetry_deg"] or {}).items()},
            bounds=reader.bounds(),
            world=reader.world,
        )
    except SceneError as problem:  # from a constructor, which does not know the file
        raise SceneError(problem.field, problem.expected, problem.got, source) from None


def _check_names(reader: Reader) -> None:
    """See that templates and symmetries are of categories of the objects."""
    values, objects = reader.values, reader.values["objects"]
    categories = {one["category"] for one in objects}
    for i, template in enumerate(values["templates"]):
        if template["category"] not in categories:
            place = ("templates", i, "category")
            raise reader.fail(place, "must be a category of the objects", template["category"])
    for name in values["symmetry_deg"] or {}:
        if name not in categories:
            expected = "must be named after a category of the objects"
            raise reader.fail(("symmetry_deg", name), expected, name)


def snapshot_from_dict(data: object, source: str | None = None) -> Snapshot:
    """A snapshot from the contents of a snapshot file.

    Raises:
        SnapshotError: a value cannot be used; names the field.
    """
    reader = Reader(SNAPSHOT, data, source)
    view, seen = reader.values["camera"], reader.values["detections"]
    ids = [one["id"] or str(i) for i, one in enumerate(seen)]
    for field, names in (("id", ids), ("track_id", [one["track_id"] for one in seen])):
        earlier: set[str] = set()
        for i, name in enumerate(names):
            if name in earlier:
                raise reader.fail(("detections", i, field), f"must not repeat an earlier {field}", name)
            earlier.update(() if name is None else (name,))
    eye = reader.pose(("camera",), view)
    in_space = view["quaternion"] is not None or view["matrix"] is not None
    poses = reader.poses(("detections",), seen)
    try:
        camera = Camera(
            position=eye.position,
            yaw=eye.yaw,
            fov=_field_of_view(reader, view),
            height=eye.elevation if reader.height_known(view) else None,
            pitch=eye.pitch if in_space else np.deg2rad(view["pitch_deg"]),
        )
        detections = Detections(
            category=tuple(one["category"] for one in seen),
            confidence=np.array([one["confidence"] for one in seen]),
            ids=tuple(ids),
            track_id=tuple(one["track_id"] for one in seen),
            position=poses.position,
            yaw=poses.yaw,
            elevation=poses.elevation,
            tilt=poses.tilt,
            size=reader.sizes(("detections",), seen),
            uncertainty=_uncertainty(reader, seen),
        )
        assumed = reader.left_out("camera", ("fov_left_deg",), ("fov_right_deg",), ("range_m", "range"))
        return Snapshot(camera, detections, reader.values["timestamp"], reader.world, assumed)
    except SnapshotError as problem:  # from a constructor, which does not know the file
        raise SnapshotError(problem.field, problem.expected, problem.got, source) from None


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
        _leave_out_unknown(entry)
        _write_tilt(entry, layout.yaw, layout.tilt, i)
        if layout.category[i] == NO_CATEGORY:
            del entry["category"]
        objects.append(entry | ({"fixed": True} if layout.fixed[i] else {}))
    data: dict[str, Any] = {
        "name": scene.name,
        **_bounds_to_dict(scene),
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
    detections = []
    for i in range(len(seen)):
        entry = {
            "id": seen.ids[i],
            "category": seen.category[i],
            "x": float(seen.position[i, 0]),
            "z": float(seen.position[i, 1]),
            "y": float(seen.elevation[i]),
            "yaw_deg": degrees(seen.yaw[i]),
            "size_whd": seen.size[i].tolist(),
            "confidence": float(seen.confidence[i]),
        }
        _leave_out_unknown(entry)
        _write_tilt(entry, seen.yaw, seen.tilt, i)
        if seen.uncertainty is not None:
            entry |= _uncertainty_to_dict(seen.uncertainty, i)
        detections.append(entry | ({} if seen.track_id[i] is None else {"track_id": seen.track_id[i]}))
    when = {} if snapshot.timestamp is None else {"timestamp": snapshot.timestamp}
    return {**when, "camera": view, "detections": detections}


def _leave_out_unknown(entry: dict[str, Any]) -> None:
    """Take the heading and the size out of an entry where they are not known."""
    if np.isnan(entry["yaw_deg"]):
        del entry["yaw_deg"]
    if np.isnan(entry["size_whd"]).any():
        del entry["size_whd"]


def _write_tilt(entry: dict[str, Any], yaw: FloatArray, tilt: FloatArray | None, i: int) -> None:
    """Write the rotation of what is tilted as a quaternion, in place of its heading."""
    if tilt is None or not tilt[i].any() or np.isnan(yaw[i]):
        return
    from scipy.spatial.transform import Rotation  # takes a while to load, and few need it

    del entry["yaw_deg"]
    entry["quaternion"] = Rotation.from_matrix(rotation_matrix(yaw[i], tilt[i])).as_quat().tolist()


def _uncertainty(reader: Reader, seen: Sequence[Values]) -> Uncertainty | None:
    """How far the poses of detections can be trusted; None where nothing is said of it."""
    if all(one["covariance"] is None and one["visible"] == 1.0 and not one["runner_up"] for one in seen):
        return None
    world, in_space = reader.world, [*reader.world.plane, 3 + reader.world.up]
    arrays = {name: np.array(value) for name, value in vars(Uncertainty.unknown(len(seen))).items()}
    for i, one in enumerate(seen):
        if one["covariance"] is not None:
            given = np.array(one["covariance"])
            given = given.reshape(6, 6)[np.ix_(in_space, in_space)] if given.size == 36 else given
            with np.errstate(over="ignore", invalid="ignore"):  # what overflows is refused below
                arrays["covariance"][i] = world.covariances(given)
        arrays["visible"][i] = one["visible"]
        if (other := one["runner_up"]) is not None:
            yaw = other["yaw_rad"] if other["yaw_rad"] is not None else radians(other["yaw_deg"])
            arrays["runner_up_yaw"][i] = world.yaws(yaw)
            arrays["runner_up_weight"][i] = other["probability"]
    try:
        return Uncertainty(**arrays)
    except SnapshotError as problem:
        name, place = re.fullmatch(r"uncertainty\.(\w+?)\[(\d+)\]", problem.field).groups()  # type: ignore[union-attr]
        field = "covariance" if name == "covariance" else "runner_up"
        got = np.asarray(seen[int(place)][field]).tolist()
        raise reader.fail(("detections", int(place), field), problem.expected, got) from None


def _uncertainty_to_dict(uncertainty: Uncertainty, i: int) -> dict[str, Any]:
    """The fields of a detection that say how far its pose can be trusted."""
    entry: dict[str, Any] = {"covariance": uncertainty.covariance[i].tolist()}
    if uncertainty.visible[i] < 1:
        entry["visible"] = float(uncertainty.visible[i])
    if not np.isnan(uncertainty.runner_up_yaw[i]):
        entry["runner_up"] = {
            "yaw_deg": degrees(uncertainty.runner_up_yaw[i]),
            "probability": float(uncertainty.runner_up_weight[i]),
        }
    return entry


def _bounds_to_dict(scene: Scene) -> dict[str, Any]:
    """The fields of a scene file that say its bounds."""
    if scene.room is not None:
        return {"size_m": list(scene.room)}
    return {} if scene.bounds is None else {"bounds": scene.bounds.corners.tolist()}


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


def _field_of_view(reader: Reader, view: Values) -> FieldOfView:
    """What a camera sees, from a camera entry."""
    left, right = radians(view["fov_left_deg"]), radians(view["fov_right_deg"])
    up, down = (None if view[name] is None else radians(view[name]) for name in UP_AND_DOWN)
    reach = view["range_m"]
    if view["range"] is not None:
        reach = reader.length(("camera", "range"), view["range"], RANGE)
    return FieldOfView(left, right, reach, up, down)


def _speed(reader: Reader, view: Values) -> float:
    if view["speed"] is not None:
        return reader.length(("camera", "speed"), view["speed"], SPEED)
    return float(view["speed_m_s"])
