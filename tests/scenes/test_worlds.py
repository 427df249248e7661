"""One world written in any frame, units, origin and form of pose is read as the same, against SciPy."""

import json
from dataclasses import dataclass
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from farm_ar.errors import InputError, SceneError, SnapshotError
from farm_ar.reid import SpatialReid
from farm_ar.scenes import (
    UNITS,
    World,
    from_poses,
    scene_from_dict,
    snapshot_from_dict,
    snapshot_to_dict,
)
from farm_ar.scenes.json_files import SCENE, SNAPSHOT, scene_to_dict
from farm_ar.scenes.worlds import DECIMALS

METRES = {"m": 1, "cm": 0.01, "mm": 0.001, "km": 1000, "in": 0.0254, "ft": 0.3048, "yd": 0.9144}
LEVEL = {"unity": "xz", "openxr": "xz", "ros": "xy"}
UP = {"unity": "y", "openxr": "y", "ros": "z"}
FORMS = ["yaw_deg", "yaw_rad", "quaternion", "matrix"]


def axes(frame: str, vector: Any) -> np.ndarray:
    """A vector, given by how far it goes right, up and forward, in the axes of a frame."""
    right, up, forward = vector
    return np.array(
        {"unity": (right, up, forward), "openxr": (right, up, -forward), "ros": (forward, -right, up)}[frame]
    )


def body(frame: str) -> np.ndarray:
    """Right, up and forward of each of a body's own three axes."""
    return np.array(
        {
            "unity": [(1, 0, 0), (0, 1, 0), (0, 0, 1)],
            "openxr": [(1, 0, 0), (0, 1, 0), (0, 0, -1)],
            "ros": [(0, 0, 1), (-1, 0, 0), (0, 1, 0)],
        }[frame]
    )


@dataclass(frozen=True)
class Writer:
    """Writes what stands in a world of metres and right, up, forward as some other software would."""

    frame: str
    units: str
    form: str
    origin: tuple[float, float, float]
    turn: float

    def local(self, place: Any) -> np.ndarray:
        """A place as seen from the origin, turned by its heading: clockwise from above."""
        x, y, z = np.subtract(place, self.origin)
        sine, cosine = np.sin(self.turn), np.cos(self.turn)
        return np.array([cosine * x - sine * z, y, sine * x + cosine * z])

    def point(self, place: Any) -> np.ndarray:
        return axes(self.frame, self.local(place)) / METRES[self.units]

    def level(self, x: float, z: float) -> list[float]:
        point = dict(zip("xyz", self.point((x, self.origin[1], z)), strict=True))
        return [point[axis] for axis in LEVEL[self.frame]]

    def pose(self, place: Any, yaw: float, tilt: tuple[float, float] = (0.0, 0.0)) -> dict[str, Any]:
        """A pose: its yaw clockwise from above; how far it looks up and leans to its right, radians."""
        yaw = yaw - self.turn
        ahead = np.array([np.sin(yaw), 0, np.cos(yaw)])
        right = np.array([np.cos(yaw), 0, -np.sin(yaw)])
        forward = np.cos(tilt[0]) * ahead + np.sin(tilt[0]) * np.array([0, 1, 0])
        up = np.cos(tilt[0]) * np.array([0, 1, 0]) - np.sin(tilt[0]) * ahead
        right, up = (
            np.cos(tilt[1]) * right - np.sin(tilt[1]) * up,
            np.cos(tilt[1]) * up + np.sin(tilt[1]) * right,
        )
        columns = [axes(self.frame, a * right + b * up + c * forward) for a, b, c in body(self.frame)]
        turn = Rotation.from_matrix(np.stack(columns, axis=1))
        point = self.point(place)
        entry = dict(zip("xyz", point.tolist(), strict=True))
        if self.form == "matrix":
            matrix = np.eye(4)
            matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), point
            return {"matrix": matrix.tolist()}
        if self.form == "quaternion":
            return entry | {"quaternion": turn.as_quat().tolist()}
        order = "ZYX" if self.frame == "ros" else "YXZ"
        yaw_deg = turn.as_euler(order, degrees=True)[0]
        return (
            entry | {"yaw_deg": yaw_deg}
            if self.form == "yaw_deg"
            else entry | {"yaw_rad": np.deg2rad(yaw_deg)}
        )

    def top(self) -> dict[str, Any]:
        origin = dict(zip("xyz", axes(self.frame, self.origin) / METRES[self.units], strict=True))
        sign = 1 if self.frame == "unity" else -1
        top = {"frame": self.frame, "units": self.units, "origin": origin | {"yaw_rad": sign * self.turn}}
        if not self.turn:
            top["origin"] = list(origin.values())
        return top if self.turn or any(self.origin) else {"frame": self.frame, "units": self.units}


PLAIN = Writer("unity", "m", "yaw_deg", (0.0, 0.0, 0.0), 0.0)
AWAY = st.sampled_from([0.0, 3.5, -1e5])
WRITERS = st.builds(
    Writer,
    st.sampled_from(list(LEVEL)),
    st.sampled_from(list(METRES)),
    st.sampled_from(FORMS),
    st.tuples(AWAY, st.sampled_from([0.0, -1.2]), AWAY),
    st.sampled_from([0.0, 0.7, -2.5]),
)


def things(seed: int, tilted: bool) -> list[tuple[Any, float, tuple[float, float], np.ndarray]]:
    rng = np.random.default_rng(seed)
    far = rng.choice([0.0, -1e5])
    tilt = rng.uniform(-0.3, 0.3, (6, 2)) if tilted else np.zeros((6, 2))
    place = rng.uniform(-4, 4, (6, 3)) + far * np.array([1, 0, 1])
    return [(place[i], rng.uniform(-3, 3), tuple(tilt[i]), rng.uniform(0.2, 2, 3)) for i in range(6)]


def both(write: Writer, seed: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """A scene and a snapshot of it as they are written; the snapshot's things have moved a little."""
    seen = things(seed, write.form in ("quaternion", "matrix"))
    metres = METRES[write.units]
    corner = seen[0][0]
    corners = [(-9, -9), (9, -8), (8, 9), (0, 2), (-9, 8)]
    objects = [
        write.pose(place, yaw, tilt)
        | {"label": f"chair {i}", "category": "chair", "size_whd": (size / metres).tolist()}
        for i, (place, yaw, tilt, size) in enumerate(seen)
    ]
    site = dict(zip(LEVEL[write.frame], write.level(*corner[[0, 2]]), strict=True))
    scene = write.top() | {
        "bounds": [write.level(corner[0] + x, corner[2] + z) for x, z in corners],
        "sites": [{"name": "S", **site}],
        "objects": objects,
        "camera": {"range": 5 / metres},
        "camera_path": {"bezier_points": [write.level(corner[0] + k, corner[2]) for k in range(4)]},
    }
    detections = [
        write.pose(place + 0.1, yaw + 0.1, tilt) | {"track_id": f"t{i}", "size_whd": (size / metres).tolist()}
        for i, (place, yaw, tilt, size) in reversed(list(enumerate(seen)))
    ]
    camera = write.pose(corner + 1, 0.5, (-0.2, 0.0) if write.form in ("quaternion", "matrix") else (0, 0))
    return scene, write.top() | {"camera": camera | {"range": 50 / metres}, "detections": detections}


@given(WRITERS, st.integers(0, 10**6))
def test_a_world_is_the_same_in_every_frame_unit_origin_and_form(write, seed):
    plain = Writer("unity", "m", write.form, (0.0, 0.0, 0.0), 0.0)
    near = 1e-9 * max(1.0, np.abs(write.origin).max() / 1e4)
    files, usual = both(write, seed), both(plain, seed)
    validator = jsonschema.Draft202012Validator
    validator(SCENE.schema()).validate(json.loads(json.dumps(files[0])))
    validator(SNAPSHOT.schema()).validate(json.loads(json.dumps(files[1])))
    scene, snapshot = scene_from_dict(files[0]), snapshot_from_dict(files[1])
    true_scene, true_snapshot = scene_from_dict(usual[0]), snapshot_from_dict(usual[1])
    for got, true in [(scene.layout, true_scene.layout), (snapshot.detections, true_snapshot.detections)]:
        assert got.position == pytest.approx(true.position, abs=near)
        assert got.elevation == pytest.approx(true.elevation, abs=near)
        assert np.cos(got.yaw - true.yaw) == pytest.approx(np.ones(6), abs=1e-15)
        assert np.sin(got.yaw - true.yaw) == pytest.approx(np.zeros(6), abs=1e-9)
        assert got.size == pytest.approx(true.size, rel=1e-12)
    for (place, yaw, _, _), got, turned in zip(
        things(seed, write.form in ("quaternion", "matrix")),
        scene.layout.position,
        scene.layout.yaw,
        strict=True,
    ):
        assert got == pytest.approx(place[[0, 2]], abs=near)
        assert np.sin(turned - yaw) == pytest.approx(0, abs=1e-9)
    assert scene.bounds.corners == pytest.approx(true_scene.bounds.corners, abs=near)
    assert scene.site_positions == pytest.approx(true_scene.site_positions, abs=near)
    assert scene.camera_path.points == pytest.approx(true_scene.camera_path.points, abs=near)
    assert scene.fov.range_m == pytest.approx(5)
    camera, true_camera = snapshot.camera, true_snapshot.camera
    assert camera.position == pytest.approx(true_camera.position, abs=near)
    assert camera.height == pytest.approx(true_camera.height, abs=near)
    in_space = write.form in ("quaternion", "matrix")
    assert camera.pitch == pytest.approx(-0.2 if in_space else 0.0, abs=1e-9)
    assert np.sin(camera.yaw - 0.5) == pytest.approx(0, abs=1e-9)
    assert snapshot.detections.track_id == ("t5", "t4", "t3", "t2", "t1", "t0")
    found, wanted = SpatialReid(scene).identify(snapshot), SpatialReid(true_scene).identify(true_snapshot)
    assert found.labels == wanted.labels
    assert found.cost == pytest.approx(wanted.cost, abs=1e-6 if near > 1e-9 else 1e-9)


@given(WRITERS, st.floats(0.5, 20), st.floats(0.5, 20), st.floats(-3, 3))
def test_a_rectangle_and_a_room_are_the_same_place_in_every_frame(write, width, depth, yaw):
    metres, sign = METRES[write.units], 1 if write.frame == "unity" else -1
    local = Writer(write.frame, write.units, "yaw_deg", (0.0, 0.0, 0.0), 0.0)
    rectangle = {
        "size": [width / metres, depth / metres],
        "origin": local.level(2, 1),
        "yaw_deg": np.rad2deg(sign * yaw),
    }
    file = {"frame": write.frame, "units": write.units, "bounds": rectangle, "objects": []}
    corners = scene_from_dict(file).bounds.corners
    right, ahead = np.array([np.cos(yaw), -np.sin(yaw)]), np.array([np.sin(yaw), np.cos(yaw)])
    wanted = np.array(
        [(2, 1) + a * width * right + b * depth * ahead for a, b in [(0, 0), (1, 0), (1, 1), (0, 1)]]
    )
    assert corners == pytest.approx(wanted, abs=1e-9)
    room = {
        "frame": write.frame,
        "units": write.units,
        "size": [width / metres, depth / metres],
        "objects": [],
    }
    assert scene_from_dict(room).room == pytest.approx((width, depth))


def test_units_are_those_that_are_documented():
    assert {name: times / over for name, (times, over) in UNITS.items()} == pytest.approx(METRES)
    assert scene_from_dict(
        {"units": "cm", "objects": [{"label": "a", "x": 35, "z": 7}]}
    ).layout.position.tolist() == [[0.35, 0.07]]


def snapshot_with(**pose: Any) -> dict[str, Any]:
    return {"camera": {"x": 0, "z": 0, "yaw_deg": 0}, "detections": [pose]}


S = np.sqrt(0.5)


@pytest.mark.parametrize(
    ("file", "message"),
    [
        (snapshot_with(x=1, z=1, quaternion=[0, 0, 0, 0]), "quaternion: must be a unit quat"),
        (snapshot_with(x=1, z=1, quaternion=[0, 0.5, 0, 0.5]), "quaternion: must be a unit quaternion"),
        (snapshot_with(x=1, z=1, quaternion=[0, np.nan, 0, 1]), r"quaternion: must be 4 numbers"),
        (snapshot_with(x=1, z=1, quaternion=[0, 1, 0]), r"quaternion: must be 4 numbers"),
        (snapshot_with(matrix=np.diag([1, 1, -1, 1]).tolist()), "matrix: must be a rotation, .* mirrors"),
        (snapshot_with(matrix=np.diag([2, 2, 2, 1]).tolist()), "matrix: must be rigid: a rotation and"),
        (snapshot_with(matrix=np.zeros((4, 4)).tolist()), r"matrix: must be 4 rows, the last of"),
        (
            snapshot_with(matrix=[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [5, 0, 2, 1]]),
            r"matrix: must be 4 rows, the last of them \[0, 0, 0, 1\] \(these are its columns\)",
        ),
        (snapshot_with(matrix=[[np.inf, 0, 0, 0]] * 4), "matrix: must be 4 rows of 4 numbers"),
        (snapshot_with(matrix=np.eye(3).tolist()), "matrix: must be 4 rows of 4 numbers"),
        (snapshot_with(x=1, z=np.nan), r"z: must be a number from -1e9 to 1e9"),
        (snapshot_with(x=1, z=2e6), r"x: must be finite, from -1e6 .* got \[1.0, 2000000.0, 0.0\]"),
        (snapshot_with(x=1, z=1, yaw_deg=1, yaw_rad=1), "yaw_rad: must not be there beside yaw_deg"),
        (snapshot_with(x=1, yaw_deg=1, matrix=np.eye(4).tolist()), "matrix: must not be there beside"),
        (snapshot_with(x=1), "z: must be a number"),
        (snapshot_with(x=1, y=1), "z: must be a number from -1e6 to 1e6, got nothing"),
        (snapshot_with(x=1, z=1, track_id=""), "track_id: must be a name or null"),
    ],
)  # fmt: skip
def test_a_broken_pose_is_refused_by_name(file, message):
    with pytest.raises(SnapshotError, match=r"^near.json: detections\[0\]." + message):
        snapshot_from_dict(file, source="near.json")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"frame": "opencv"}, r"frame: must be a world's frame .*: opencv is a camera's axes"),
        ({"frame": "webxr"}, r"frame: must be openxr, which is that frame's name here, got 'webxr'"),
        ({"frame": "ARKit"}, r"frame: must be openxr, which is that frame's name here, got 'ARKit'"),
        ({"frame": "ros2"}, r"frame: must be ros, which is that frame's name here, got 'ros2'"),
        ({"frame": "Unity"}, r"frame: must be unity, written like this, got 'Unity'"),
        ({"frame": "unreal"}, r"frame: must be one of .*: as unity, give Unreal's Y, Z, X as x, y, z"),
        ({"frame": "blender"}, r"frame: must be one of unity, openxr, ros, got 'blender'"),
        ({"units": "cm"}, r"size_m: must not be there beside units cm: .* as size, got \[5, 4\]"),
        ({"units": "furlong"}, r"units: must be one of m, cm, "),
        ({"size": [5, 4]}, r"size: must not be there beside size_m"),
        ({"bounds": [[0, 0], [1, 0], [0, 1]]}, r"bounds: must not be there beside size_m"),
        ({"origin": [1]}, r"origin: must be a point \[x, z\] or \[x, y, z\], or an object"),
        ({"frame": "ros"}, r"objects\[0\].y: must be a number from -1e6 to 1e6, got nothing"),
    ],
)  # fmt: skip
def test_a_world_that_cannot_be_is_refused(changes, message):
    file = {"size_m": [5, 4], "objects": [{"label": "a", "x": 1, "z": 2}], **changes}
    with pytest.raises(SceneError, match=message):
        scene_from_dict(file)


@pytest.mark.parametrize("path", [("camera", "range_m"), ("camera", "speed_m_s"), ("bounds", "size_m")])
def test_a_key_in_metres_is_refused_beside_other_units(path):
    file = {"units": "mm", "objects": [], path[0]: {path[1]: [2, 2] if "size" in path[1] else 2}}
    with pytest.raises(SceneError, match=rf"{path[0]}\.{path[1]}: must not be there beside units mm"):
        scene_from_dict(file)
    assert scene_from_dict(file | {"units": "m"}) is not None


def test_what_a_file_leaves_out_is_not_known_and_written_back_so():
    scene = scene_from_dict({"objects": [{"label": "a", "x": -3, "z": 2}, {"label": "b", "x": 1, "z": 2}]})
    assert scene.bounds is None
    assert np.isnan(scene.layout.yaw).all()
    assert np.isnan(scene.layout.size).all()
    again = scene_from_dict(json.loads(json.dumps(scene_to_dict(scene))))
    assert np.isnan(again.layout.size).all()
    assert again.bounds is None
    assert "category" not in scene_to_dict(scene)["objects"][0]
    assert not again.layout.names_categories
    snapshot = snapshot_from_dict(snapshot_with(x=1, z=2, track_id="7") | {"timestamp": 12.5})
    back = snapshot_to_dict(snapshot)
    assert back["timestamp"] == 12.5
    assert back["detections"][0].keys() == {"id", "category", "x", "z", "y", "confidence", "track_id"}
    assert snapshot_from_dict(back).detections.track_id == ("7",)
    assert SpatialReid(scene).identify(snapshot).labels == ("b",)


def test_bounds_that_are_no_room_are_written_as_corners():
    file = {"bounds": [[0, 0], [4, 0], [0, 3]], "objects": []}
    assert scene_to_dict(scene_from_dict(file))["bounds"] == [[0, 0], [4, 0], [0, 3]]


def test_a_track_is_not_in_two_places_at_once():
    file = snapshot_with(x=1, z=1, track_id="a")
    file["detections"] = file["detections"] * 2
    with pytest.raises(
        InputError, match=r"detections\[1\].track_id: must not repeat an earlier track_id, got 'a'"
    ):
        snapshot_from_dict(file)


@given(WRITERS, st.integers(0, 10**6))
def test_arrays_of_poses_are_read_as_files_are(write, seed):
    if write.turn or any(write.origin):
        write = Writer(write.frame, write.units, write.form, (0.0, 0.0, 0.0), 0.0)
    file = both(write, seed)[0]
    objects = file["objects"]
    forms = {"matrix": [one.get("matrix") for one in objects]}
    if write.form != "matrix":
        place = [[one[axis] for axis in "xyz"] for one in objects]
        turns = [one[write.form] for one in objects]
        name, turns = ("yaw", np.deg2rad(turns)) if write.form == "yaw_deg" else (write.form, turns)
        forms = {"position": place, name.split("_")[0]: turns}
    sizes = [one["size_whd"] for one in objects]
    scene = from_poses(
        [one["label"] for one in objects],
        **forms,
        size=sizes,
        category="chair",
        bounds=file["bounds"],
        frame=write.frame,
        units=write.units,
    )
    true = scene_from_dict(file)
    for name in ("position", "yaw", "elevation", "size"):
        assert getattr(scene.layout, name) == pytest.approx(getattr(true.layout, name), abs=1e-9)
    assert scene.bounds.corners == pytest.approx(true.bounds.corners, abs=1e-9)
    assert scene.layout.category == true.layout.category


def test_arrays_that_leave_something_out_are_not_known():
    scene = from_poses(["a", "b"], [(100, 50), (0, 0)], frame="ros", units="cm", size=(10, 20, 30))
    assert scene.layout.position.tolist() == [[-0.5, 1], [0, 0]]
    assert scene.layout.size.tolist() == [[0.1, 0.2, 0.3]] * 2
    assert np.isnan(scene.layout.yaw).all()
    assert scene.bounds is None


@pytest.mark.parametrize(
    ("poses", "message"),
    [
        ({"position": [(0, 0)], "yaw": [0], "quaternion": [(0, 0, 0, 1)]}, "pose: must be matrices, or"),
        ({"position": [(0, 0)], "matrix": [np.eye(4)]}, "pose: must be matrices, or a position"),
        ({}, "pose: must be matrices, or a position"),
        ({"position": [(0, 0)], "quaternion": [(0, 0, 0, 2)]}, "quaternion: must be a unit quaternion"),
        ({"matrix": [np.diag([1, -1, 1, 1])]}, "matrix: must be a rotation"),
        ({"position": [0]}, r"position: must have shape \(..., 3\) or \(..., 2\)"),
        ({"position": [(0, np.nan, 0)]}, r"elevation\[0\]: must be finite"),
    ],
)
def test_arrays_that_are_no_poses_are_refused(poses, message):
    with pytest.raises(SceneError, match=message):
        from_poses(["a"], **poses)
    assert World("openxr").read([(1, 2, 3)]).elevation.tolist() == [2]


def places(value: Any, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for key, item in inner for place in places(item, (*path, key)))]


def replaced(value: Any, path: tuple[str | int, ...], new: Any) -> Any:
    if not path:
        return new
    value = value.copy()
    value[path[0]] = replaced(value[path[0]], path[1:], new)
    return value


ODD = st.one_of(
    st.none(),
    st.booleans(),
    st.sampled_from(["", "m", "ros", "opencv", "1"]),
    st.floats(),
    st.integers(),
    st.lists(st.floats(-2, 2), max_size=5),
    st.lists(st.lists(st.floats(-2, 2), min_size=2, max_size=4), max_size=5),
    st.dictionaries(
        st.sampled_from(["x", "y", "z", "size", "size_m", "yaw_deg", "matrix"]), st.floats(), max_size=3
    ),
)


@given(WRITERS, st.booleans(), st.data(), ODD)
def test_whatever_stands_anywhere_is_read_or_refused_and_what_is_read_fits_the_schema(
    write, scene, data, odd
):
    file = both(write, 0)[0 if scene else 1]
    if scene:
        file["bounds"] = data.draw(
            st.sampled_from([file["bounds"], {"size": [4, 3], "origin": [1, 2], "yaw_deg": 20}])
        )
    changed = replaced(file, data.draw(st.sampled_from(places(file))), odd)
    read, document = (scene_from_dict, SCENE) if scene else (snapshot_from_dict, SNAPSHOT)
    wrong = None
    try:
        read(changed, "file.json")
    except InputError as problem:
        wrong = str(problem)
    if wrong is None:
        assert jsonschema.Draft202012Validator(document.schema()).is_valid(changed)
    else:
        assert wrong.startswith("file.json: ")
        assert "\n" not in wrong


@given(
    st.sampled_from(["unity", "openxr", "ros"]),
    st.sampled_from(list(METRES)),
    st.tuples(*3 * [st.floats(-50, 50)]),
    st.floats(-4, 4),
    st.tuples(*2 * [st.floats(-1000, 1000)]),
    st.floats(-7, 7),
)
def test_what_is_printed_is_what_the_file_gave(frame, units, origin, heading, place, yaw):
    world = World(frame, units, origin, heading)
    np.testing.assert_allclose(world.floor_of(world.floor(place)), place, rtol=1e-9, atol=1e-7)
    assert world.yaws_of(world.yaws(yaw)) == pytest.approx(yaw, abs=1e-12)
    assert World(frame, units).length(1.0) == f"{1 / METRES[units]:.{DECIMALS[units]}f} {units}"


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        (
            {"x": 1, "z": 1},
            r"yaw_deg: .* \(or give yaw_rad or quaternion in its place, or matrix in",
        ),
        (
            {"x": 1, "yaw_deg": 1},
            r"z: must be a number .* \(or give matrix in place of the pose\)",
        ),
        ({}, r"x: must be a number .* \(or give matrix in its place\)"),
    ],
)
def test_a_pose_that_lacks_something_is_refused_with_what_else_would_do(camera, message):
    with pytest.raises(SnapshotError, match=f"^camera.{message}"):
        snapshot_from_dict({"camera": camera, "detections": []})


def test_a_view_that_a_file_does_not_give_is_marked_as_assumed():
    camera = {"x": 0, "z": 0, "yaw_deg": 0}
    assumed = [
        snapshot_from_dict({"units": "cm", "camera": {**camera, **view}, "detections": []}).assumed
        for view in ({}, {"range": 300}, {"fov_left_deg": 35, "fov_right_deg": 34})
    ]
    assert assumed == [
        ("fov_left_deg", "fov_right_deg", "range_m"),
        ("fov_left_deg", "fov_right_deg"),
        ("range_m",),
    ]
