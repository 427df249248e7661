"""`farm-ar vision benchmark`: one table for any estimator."""

import json

import cv2
import numpy as np
import pytest

from farm_ar.vision.photos import read_image_camera

OWN = """
import json
import numpy as np
from farm_ar.scenes import Detections
from farm_ar.vision import PoseEstimates, PoseEstimator

class Knows(PoseEstimator):
    def estimate(self, image, camera, meshes):
        one = Detections(("coop",), np.array([[0.31, 0.2]]), np.array([0.5]), np.array([[0.1, 0.08, 0.09]]))
        nan = np.full(1, np.nan)
        return PoseEstimates(one, np.eye(3)[None] * 1e-4, np.ones(1), nan, nan)

class Nothing:
    pass
"""


@pytest.fixture
def frames(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "own_estimator.py").write_text(OWN)
    folder = tmp_path / "frames"
    folder.mkdir()
    for k in range(3):
        cv2.imwrite(str(folder / f"{k}.png"), np.zeros((36, 64, 3), np.uint8))
        thing = {"category": "coop", "x": 0.3, "z": 0.2, "yaw_deg": np.rad2deg(0.5), "visible": 1.0}
        other = thing | {"category": "hutch", "x": 0.6}
        data = {
            "image": f"{k}.png",
            "camera": {"x": 0.5, "y": 0.4, "z": -0.3, "yaw_deg": 0.0, "pitch_deg": -30.0},
            "intrinsics": {"fx": 50.0, "fy": 50.0, "cx": 31.5, "cy": 17.5, "width": 64, "height": 36},
            "objects": [one | {"touching": False} for one in (thing, other)],
        }
        (folder / f"{k}.json").write_text(json.dumps(data))
    return folder


def test_an_estimator_of_ones_own_is_judged(run, frames):
    asked = ("vision", "benchmark", "frames", "--estimator", "own_estimator:Knows")
    answer = json.loads(run(*asked, "--count", "2", "--json").stdout)
    row = answer["frames"]["at least 40%"]
    assert answer["frames"]["frames"] == 2
    assert (row["things"], row["missed"], answer["frames"]["false"]) == (4, 0.5, 0.0)
    assert row["away_cm"] == [pytest.approx(1.0), pytest.approx(1.0)]
    assert row["turned_deg"][1] == pytest.approx(0.0, abs=1e-9)
    shown = run(*asked).stdout
    assert "at least 40%" in shown
    assert "3 frames, own_estimator:Knows" in shown


def test_what_is_no_estimator_and_what_is_no_folder_of_frames_is_said_in_a_line(mistake, frames):
    assert "--estimator: must be one of network, or module:Class" in mistake(
        "vision", "benchmark", "frames", "--estimator", "none"
    )
    said = mistake("vision", "benchmark", "frames", "--estimator", "own_estimator:Nothing")
    assert "--estimator: must give something with estimate(image, camera, meshes)" in said
    assert "must be a folder with frames" in mistake(
        "vision", "benchmark", "elsewhere", "--estimator", "own_estimator:Knows"
    )
    assert "meshes: must be a folder with files" in mistake(
        "vision", "benchmark", "frames", "--estimator", "own_estimator:Knows", "--meshes", "frames"
    )


def test_frames_that_were_rendered_are_judged(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run("vision", "render", "--out", "rendered", "--count", "2", "--seed", "4")
    assert len(list((tmp_path / "rendered").glob("*.png"))) == 2
    answer = json.loads(run("vision", "benchmark", "rendered", "--json").stdout)["rendered"]
    assert answer["frames"] == 2
    things = [json.loads(file.read_text())["objects"] for file in (tmp_path / "rendered").glob("*.json")]
    seen = sum(one["visible"] >= 0.4 for several in things for one in several)
    truth = sorted((tmp_path / "rendered").glob("*.json"))[0]
    data = json.loads(truth.read_text())
    camera = read_image_camera(truth)  # a frame's truth is the camera file of its image
    assert camera.view.eye.tolist() == [data["camera"][axis] for axis in "xyz"]
    assert camera.view.intrinsics.fx == data["intrinsics"]["fx"]
    assert answer["at least 40%"]["things"] == seen


def test_a_network_is_not_trained_on_nothing_nor_written_to_another_ending(mistake, tmp_path):
    pytest.importorskip("onnx", reason="pip install '.[vision]'")
    empty = tmp_path / "empty"
    empty.mkdir()
    said = mistake("vision", "train", "--meshes", str(empty), "--out", "m.onnx")
    assert "meshes: must be a folder with files" in said
    assert "out: must end in .onnx" in mistake("vision", "train", "--out", str(tmp_path / "m.bin"))


def test_a_perception_that_there_is_not_is_refused(mistake):
    assert "--perception: must be one of oracle, pixels" in mistake("demo", "--perception", "nose")
