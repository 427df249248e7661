"""`farm-ar identify` on files in others' frames and units: what it prints is in theirs."""

import json

import numpy as np
import pytest

from farm_ar.reid import RigidMotion
from farm_ar.reid.alignment import moved
from farm_ar.scenes import Camera, FieldOfView, World, load_scene, load_snapshot, observe, save_snapshot

METRES = {"m": 1.0, "cm": 0.01, "ft": 0.3048}
NO_FRAME = "OptionError: --frame: must be one of map, unknown"
NO_ANCHOR = "OptionError: --anchor: must be"


def written(path, frame, units, to, origin=None):
    """A scene or snapshot file in another frame, units and origin; returns its values by name."""
    data = json.loads(path.read_text())
    world = World(frame, units, (0.0, 0.0, 0.0) if origin is None else origin)
    across, along = ("x", "z") if frame != "ros" else ("x", "y")
    for entry in [data.get("camera"), *data.get("objects", []), *data.get("detections", [])]:
        if entry is None or "x" not in entry:
            continue
        entry.pop("y", None)
        first, second = world.floor_of([entry.pop("x"), entry.pop("z")]).tolist()
        entry |= {across: first, along: second}
        entry["yaw_deg"] = float(np.rad2deg(world.yaws_of(np.deg2rad(entry["yaw_deg"]))))
        if "size_whd" in entry:
            entry["size_whd"] = [side / METRES[units] for side in entry["size_whd"]]
    for view in (data.get("camera") or {},):
        if units != "m" and "range_m" in view:
            view["range"] = view.pop("range_m") / METRES[units]
        view.pop("speed_m_s", None)
    if "objects" in data:
        data = {"objects": data["objects"]}
    data |= {"frame": frame, "units": units} | ({} if origin is None else {"origin": list(origin)})
    to.write_text(json.dumps(data))
    return data


@pytest.mark.parametrize(
    ("frame", "units", "origin"),
    [
        ("openxr", "m", None),
        ("ros", "cm", None),
        ("unity", "ft", (3.0, 0.0, -8.0)),
        ("ros", "m", (1.0, 2.0, 0.0)),
    ],
)
def test_poses_are_printed_as_the_file_gives_them(run, before, seen, tmp_path, frame, units, origin):
    plain = run("identify", "--scene", before, "--snapshot", seen).stdout
    written(before, frame, units, tmp_path / "map.json", origin)
    data = written(seen, frame, units, tmp_path / "now.json", origin)
    result = run("identify", "--scene", "map.json", "--snapshot", "now.json")
    assert result.exit_code == 0
    table = [row.split() for row in result.stdout.splitlines()]
    axes = ["x", "y" if frame == "ros" else "z"]
    names = [f"{axis} ({units})" if units != "m" else axis for axis in axes]
    assert all(name in result.stdout.splitlines()[1] for name in names)
    for row, one, other in zip(table[3:], data["detections"], plain.splitlines()[3:], strict=False):
        first = 2 if one.get("category") else 3
        values = [float(value) for value in row[first : first + 3]]
        expected = [one[axes[0]], one[axes[1]], one["yaw_deg"]]
        np.testing.assert_allclose(values[:2], expected[:2], atol=0.051 if units == "cm" else 0.0051)
        assert values[2] == pytest.approx(expected[2], abs=0.051)
        assert row[first + 3] == other.split()[first + 3]  # the label
    answer = json.loads(run("identify", "--scene", "map.json", "--snapshot", "now.json", "--json").stdout)
    assert answer["world"] == {"frame": frame, "units": units}


def test_warnings_tell_places_and_lengths_in_the_files_numbers(run, before, seen, tmp_path):
    written(before, "ros", "cm", tmp_path / "map.json")
    data = written(seen, "ros", "cm", tmp_path / "now.json")
    for one in data["detections"][:2]:
        one |= {"x": 321.0, "y": -250.0, "yaw_deg": 15.0}
    (tmp_path / "now.json").write_text(json.dumps(data))
    said = run("identify", "--scene", "map.json", "--snapshot", "now.json").stderr
    assert "have one pose, to the last digit (d1, d2, at (321, -250))" in said
    told = run("identify", "--scene", "map.json", "--snapshot", "now.json", "--explain", "d4").stdout
    assert " cm and turned 10°" in told
    data["camera"]["yaw_deg"] += 180
    (tmp_path / "now.json").write_text(json.dumps(data))
    said = run("identify", "--scene", "map.json", "--snapshot", "now.json").stderr
    assert "(counter-clockwise from above, 0 along +x; degrees in files" in said


def test_a_view_that_is_not_given_is_said_to_be_assumed(run, before, seen, tmp_path):
    data = json.loads(seen.read_text())
    for name in ("fov_left_deg", "fov_right_deg", "range_m"):
        data["camera"].pop(name, None)
    for one in data["detections"]:
        one["z"] += 3.5
    data["camera"]["z"] -= 0.5
    (tmp_path / "now.json").write_text(json.dumps(data))
    said = run("identify", "--scene", before, "--snapshot", "now.json").stderr
    assert "taken to be 35° to the left, 34° to the right, 3 m far as the file does not say" in said
    assert "give the camera fov_left_deg, fov_right_deg, range_m, and check its pose" in said


def test_the_camera_of_a_table_is_in_the_tables_frame_and_units(run, before, seen, tmp_path):
    scene = load_scene(before)
    world = World("ros", "cm")
    rows = ["id,category,x,y,yaw_deg,frame,units"]
    for i, label in enumerate(scene.layout.labels):
        x, y = world.floor_of(scene.layout.position[i]).tolist()
        yaw = float(np.rad2deg(world.yaws_of(scene.layout.yaw[i])))
        rows.append(f"{label},{scene.layout.category[i]},{x},{y},{yaw},ros,cm")
    (tmp_path / "now.csv").write_text("\n".join(rows))
    camera = load_snapshot(seen).camera
    x, y = world.floor_of(camera.position).tolist()
    yaw = float(np.rad2deg(world.yaws_of(camera.yaw)))
    view = f"{x},{y},{yaw},180,90"
    result = run("identify", "--scene", before, "--snapshot", "now.csv", "--camera", view)
    assert result.stderr == ""
    assert (
        "outside"
        in run("identify", "--scene", before, "--snapshot", "now.csv", "--camera", "0,9000,0,9,1").stderr
    )


@pytest.fixture
def elsewhere(before, tmp_path):
    """A snapshot of the example's place, hardly moved, as `now.json`, in a frame turned by 130°."""
    scene, rng = load_scene(before), np.random.default_rng(3)
    layout = scene.layout
    layout = layout.with_poses(layout.position + rng.normal(0, 0.01, (9, 2)), layout.yaw)
    seen, _ = observe(layout, Camera(np.array([2.5, -3.0]), 0.0, FieldOfView(1.2, 1.2, 20.0)))
    motion = RigidMotion(np.zeros(2), np.array([40.0, -7.0]), np.array(np.deg2rad(130.0)))
    save_snapshot(moved(seen, motion), tmp_path / "now.json")
    return motion


def test_an_anchor_is_one_pose_as_each_file_gives_it(run, before, tmp_path, elsewhere):
    written(before, "ros", "cm", tmp_path / "map.json")
    x, z = elsewhere.position(np.array([[1.0, 2.0]]))[0]
    anchor = f"{x},{z},{30 + 130}=200,-100,-30"  # the same pose in ros, in cm
    asked = ("identify", "--scene", "map.json", "--snapshot", "now.json", "--anchor", anchor)
    found = json.loads(run(*asked, "--json").stdout)["frame"]
    assert found["world"] == {"frame": "ros", "units": "cm"}
    x, z = elsewhere.inverse().position(np.zeros((1, 2)))[0]
    assert (found["x"], found["y"]) == pytest.approx((100 * z, -100 * x), abs=60.0)  # 40 m from the things
    assert found["yaw_deg"] == pytest.approx(130.0, abs=0.5)
    assert found["confidence"] > 0.95
    assert "cm, turned by 1" in run(*asked).stdout
    wrong = anchor.replace("=200,-100", "=200,-1e4")
    assert run(*asked).stderr == ""
    said = run(*asked[:-1], wrong).stderr
    assert said.startswith("Warning: the anchor is not believed: what stands where says that the frame is an")


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (
            ("--anchor", "1,2,3"),
            (
                f"{NO_ANCHOR} given as X,Z,YAW_DEG=X,Z,YAW_DEG, of the snapshot's file and of the scene's, "
                "got '1,2,3'"
            ),
        ),
        (
            ("--anchor", "1,2=1,2"),
            f"{NO_ANCHOR} x,z,yaw_deg, all of them numbers, got '1,2'",
        ),
        (
            ("--frame", "openxr"),
            f"{NO_FRAME}; the frame of a file's axes is a field of the file",
        ),
        (
            ("--frame", "webxr"),
            f"{NO_FRAME}; the frame of a file's axes is a field of the file",
        ),
        (("--frame", "mine"), f"{NO_FRAME}, got 'mine'"),
    ],
)
def test_a_wrong_frame_or_anchor_is_one_line(mistake, before, seen, options, line):
    assert mistake("identify", "--scene", before, "--snapshot", seen, *options).startswith(line)


def test_an_explanation_says_when_the_warnings_doubt_it(run, before, elsewhere):
    asked = ("identify", "--scene", before, "--snapshot", "now.json", "--explain", "0")
    doubted = run(*asked).stdout
    assert "If the snapshot were right as it is, which the warnings doubt: 0 is" in doubted
    assert "If the snapshot" not in run(*asked, "--frame", "unknown").stdout


def test_warnings_of_the_command_name_its_options(run, before, elsewhere):
    asked = ("identify", "--scene", before, "--snapshot", "now.json")
    said = run(*asked).stderr
    assert "use --frame unknown" in said
    assert "frame=" not in said
    assert any("use --frame unknown" in one for one in json.loads(run(*asked, "--json").stdout)["warnings"])
