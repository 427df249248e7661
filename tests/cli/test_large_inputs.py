"""Inputs with very many objects, or with one very far away, take neither minutes nor gigabytes."""

import json
import resource
import subprocess
import sys

import cv2
import pytest


@pytest.fixture
def room(tmp_path):
    """Writes a scene of n chairs and a snapshot of them all, and gives their names."""

    def room(n, stray=None):
        chairs = [
            {"category": "chair", "x": i % 60, "z": i // 60, "yaw_deg": 0, "size_whd": [0.4, 1, 0.4]}
            for i in range(n)
        ]
        objects = [one | {"label": f"chair {i}"} for i, one in enumerate(chairs)]
        objects[0]["z"] = 0 if stray is None else stray
        (tmp_path / "room.json").write_text(json.dumps({"size_m": [60, 60], "objects": objects}))
        camera = {"x": 30, "z": -1, "yaw_deg": 0, "fov_left_deg": 90, "fov_right_deg": 90, "range_m": 99}
        (tmp_path / "seen.json").write_text(json.dumps({"camera": camera, "detections": chairs}))
        return "room.json", "seen.json"

    return room


def test_a_stray_far_away_is_named_and_the_picture_stays_small(run, room, tmp_path):
    scene, _ = room(3, stray=16_000)
    lines = run("scenes", "show", scene, "--out", "a.png").stdout.splitlines()
    assert "Note: too far away for the picture: chair 0 (0, 16000)" in lines
    height, width = cv2.imread(str(tmp_path / "a.png")).shape[:2]
    assert max(height, width) < 3000


def test_very_many_objects_are_drawn_and_identified_in_a_moment(room, tmp_path):
    scene, snapshot = room(3000)
    program = "from farm_ar.cli import main; main()"
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    for arguments in (
        ["scenes", "show", scene, "--out", "a.png"],
        ["identify", "--scene", scene, "--snapshot", snapshot],
    ):
        command = [sys.executable, "-c", program, *arguments]
        result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
        assert "3000" in result.stdout
    # Processor time, not the clock's: some 8 s of it; without the limits it was minutes.
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before < 60


def test_margins_of_very_many_detections_are_left_out_and_it_is_said(run, room):
    scene, snapshot = room(1001)
    answer = json.loads(run("identify", "--scene", scene, "--snapshot", snapshot, "--json").stdout)
    assert answer["labels"] == [f"chair {i}" for i in range(1001)]
    assert answer["margins"] == [None] * 1001
    assert answer["warnings"] == ["margins and certificate are not worked out of more than 1000 detections"]


@pytest.mark.parametrize(("reid", "number"), [("likelihood", 1001), ("relational", 201)])
def test_what_would_take_gigabytes_is_refused(mistake, room, reid, number):
    scene, snapshot = room(number)
    line = mistake("identify", "--scene", scene, "--snapshot", snapshot, "--reid", reid)
    assert line.startswith("OptionError: --reid: must be spatial, distance or nearest where labels times")


def test_a_hundred_thousand_lines_are_validated(run, tmp_path):
    rows = "".join(f"chair {i},chair,{i % 100},{i // 1000},0,1,1,1\n" for i in range(100_000))
    (tmp_path / "many.csv").write_text(f"id,category,x,z,yaw_deg,w,h,d\n{rows}")
    said = run("scenes", "validate", "many.csv", "--room", "100,100").stdout
    assert said.startswith("many.csv: a valid scene: 100x100 m, 100000 objects of 1 category")
