"""What docs/frames.md says and its snippets make is right, in numbers that SciPy and trigonometry give."""

import json
import re
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from farm_ar.reid import SpatialReid
from farm_ar.scenes import scene_from_dict, snapshot_from_dict

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "frames.md").read_text(encoding="utf-8")
TURN = np.deg2rad(30)

# The pose of the page as each kind of software has it: (x, y, z), and the axis and angle of its rotation.
POSES = {
    "unity": ((1, 0.5, 2), Rotation.from_rotvec([0, TURN, 0])),
    "openxr": ((1, 0.5, -2), Rotation.from_rotvec([0, -TURN, 0])),
    "ros": ((2, -1, 0.5), Rotation.from_rotvec([0, 0, -TURN])),
}


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)


def rows_of_table(after: str) -> list[list[str]]:
    lines = PAGE.split(after, 1)[1].lstrip().splitlines()
    table = [line for line in lines[: lines.index("")] if line.startswith("|")]
    return [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in table[2:]]


def assert_the_pose(entry: dict[str, Any], frame: str) -> None:
    layout = scene_from_dict({"frame": frame, "objects": [{"label": "a", **entry}]}).layout
    assert layout.position[0] == pytest.approx([1, 2], abs=1e-5)
    assert layout.elevation[0] == pytest.approx(0.5)
    assert layout.yaw[0] == pytest.approx(TURN, abs=1e-5)


def numbers(frame: str) -> tuple[SimpleNamespace, SimpleNamespace, np.ndarray]:
    """Position, quaternion and matrix."""
    place, turn = POSES[frame]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), place
    x, y, z, w = turn.as_quat().tolist()
    return (
        SimpleNamespace(**dict(zip("xyz", place, strict=True))),
        SimpleNamespace(x=x, y=y, z=z, w=w),
        matrix,
    )


def test_the_poses_of_the_table_are_one_pose():
    rows = rows_of_table("The same pose, 0.5 m above the floor:")
    assert [row[0] for row in rows] == list(POSES)
    for frame, x, y, z, yaw_deg, quaternion in rows:
        place, turn = POSES[frame]
        assert [float(x), float(y), float(z)] == list(place)
        four = [float(one) for one in quaternion.split(",")]
        assert four == pytest.approx(turn.as_quat(), abs=1e-6)
        at = {"x": float(x), "y": float(y), "z": float(z)}
        assert_the_pose(at | {"yaw_deg": float(yaw_deg)}, frame)
        assert_the_pose(at | {"quaternion": four}, frame)


def test_what_is_converted_by_hand_is_what_the_reader_makes():
    rng = np.random.default_rng(0)
    for frame, place, quaternion in rows_of_table("become farm-ar's, in metres, as follows."):
        for _ in range(20):
            point, turn = rng.normal(size=3), Rotation.random(random_state=rng)
            named = dict(zip("xyzw", turn.as_quat(), strict=True))
            at = dict(zip("xyz", point, strict=True))
            ours = [signed(term, at) for term in place.split(",")]
            four = [signed(term, named) for term in quaternion.split(",")]
            forward = Rotation.from_quat(four).as_matrix()[:, 2]  # of a body in farm-ar's axes: z
            entry = {"label": "a", **at, "quaternion": list(named.values())}
            layout = scene_from_dict({"frame": frame, "objects": [entry]}).layout
            assert [*layout.position[0], layout.elevation[0]] == pytest.approx([ours[0], ours[2], ours[1]])
            assert layout.yaw[0] == pytest.approx(np.arctan2(forward[0], forward[2]))


def signed(term: str, values: dict[str, float]) -> float:
    term = term.strip()
    return -values[term[1:]] if term.startswith("-") else values[term]


def test_the_snippet_for_unity_writes_the_pose():
    (code,) = blocks("csharp")
    place, turn, _ = numbers("unity")
    text = re.search(r'\$"(.*)"\);', code)[1]
    text = text.replace("{{", "<").replace("}}", ">").replace('\\"', '"')
    text = re.sub(r"\{(\w)\.(\w)\}", lambda m: repr(getattr({"p": place, "q": turn}[m[1]], m[2])), text)
    entry = json.loads(text.replace("{label}", "a").replace("<", "{").replace(">", "}"))
    assert_the_pose(entry, "unity")


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
@pytest.mark.parametrize("function", ["entry", "entryOfMatrix"])
def test_the_snippet_for_webxr_writes_the_pose(function):
    (code,) = blocks("js")
    place, turn, matrix = numbers("openxr")
    transform = {"position": vars(place), "orientation": vars(turn), "matrix": matrix.T.ravel().tolist()}
    frame = f"{{getPose: () => ({{transform: {json.dumps(transform)}}})}}"
    program = f"{code}\nconsole.log(JSON.stringify({function}('a', null, {frame}, null)))"
    out = subprocess.run(["node", "-e", program], capture_output=True, text=True, check=True).stdout
    assert_the_pose(json.loads(out), "openxr")


def test_the_snippet_for_arkit_turns_columns_into_rows():
    (code,) = blocks("swift")
    assert "(0..<4).map { row in (0..<4).map { column in transform[column][row] } }" in code
    transform = numbers("openxr")[2].T  # simd's subscript is the column
    rows = [[float(transform[column][row]) for column in range(4)] for row in range(4)]
    assert_the_pose({"matrix": rows}, "openxr")


def test_the_snippets_in_python_run_and_make_the_poses():
    ros, ours, camera = blocks("python")
    place, turn, _ = numbers("ros")
    names: dict[str, Any] = {}
    exec(ros, names)
    assert_the_pose(names["entry"]("a", SimpleNamespace(position=place, orientation=turn)), "ros")
    exec(ours, names)
    layout = names["scene"].layout
    assert layout.position == pytest.approx(np.array([(-0.5, 2), (1, 2)]))
    assert layout.yaw == pytest.approx([0, TURN], abs=1e-6)
    found = SpatialReid(names["scene"]).identify(names["snapshot"])
    assert found.labels == ("right chair", "left chair")
    assert names["snapshot"].camera.height == pytest.approx(1.6)
    exec(camera, names)
    down, side = np.deg2rad(-15), np.deg2rad(20)
    # 0.4 m to the right of the camera, 0.9 m below it and 2.5 m ahead, along its own tilted axes.
    level, height = 2.5 * np.cos(down) + 0.9 * np.sin(down), 1.6 + 2.5 * np.sin(down) - 0.9 * np.cos(down)
    wanted = [1 + level * np.sin(side) + 0.4 * np.cos(side), 0.5 + level * np.cos(side) - 0.4 * np.sin(side)]
    assert names["place"].position == pytest.approx(wanted)
    assert names["place"].height == pytest.approx(height)
    assert names["place"].yaw == pytest.approx(side)


def test_the_snapshots_of_the_page_on_files_are_one():
    page = (DOCS / "files.md").read_text(encoding="utf-8")
    found = [json.loads(one) for one in re.findall(r"```json\n(.*?)```", page, flags=re.DOTALL)]
    plain, other = (snapshot_from_dict(one) for one in found if "camera" in one)
    assert other.camera.position == pytest.approx(plain.camera.position)
    assert other.camera.yaw == pytest.approx(plain.camera.yaw, abs=1e-6)
    assert other.camera.fov.range_m == plain.camera.fov.range_m
    assert other.detections.position == pytest.approx(plain.detections.position)
    assert other.detections.yaw == pytest.approx(plain.detections.yaw, abs=1e-6)
    assert other.detections.size[0] == pytest.approx(plain.detections.size[0])
    assert (other.timestamp, other.detections.track_id) == (12.5, ("7", None))


def test_the_picture_is_what_its_script_draws(tmp_path):
    drawn = tmp_path / "docs" / "images" / "frames.svg"
    drawn.parent.mkdir(parents=True)
    script = (DOCS / "make_frames.py").read_text(encoding="utf-8")
    (tmp_path / "docs" / "make_frames.py").write_text(script, encoding="utf-8")
    names = {"__file__": str(tmp_path / "docs" / "make_frames.py"), "__name__": "page"}
    exec(script, names)
    names["main"]()
    assert drawn.read_bytes() == (DOCS / "images" / "frames.svg").read_bytes()
