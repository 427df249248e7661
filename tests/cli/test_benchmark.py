"""`farm-ar benchmark` and `convert` on the command line."""

import json
from pathlib import Path

import pytest

from farm_ar.benchmark.frozen import DIGEST

LINES = [f"{frame},{i},{frame + 9 * i},{i}" for frame in range(30) for i in range(3)]


@pytest.fixture
def tracks(tmp_path: Path) -> Path:
    path = tmp_path / "walk.csv"
    path.write_text("frame,id,x,y\n" + "\n".join(LINES) + "\n")
    return path


@pytest.fixture
def data(run, tracks: Path, tmp_path: Path) -> Path:
    line = run("convert", tracks, "--gap", 4, "--every", 4, "--out", tmp_path / "data").stdout
    assert line.startswith("Wrote 7 snapshots with 21 detections")
    return tmp_path / "data"


def test_converted_tracks_are_measured_and_written_as_page_and_json(run, data: Path, tmp_path: Path):
    out = run("benchmark", "squared-distance", "--data", data, "--out", tmp_path / "out").stdout
    assert "walk-4" in out
    written = json.loads((tmp_path / "out" / "benchmark.json").read_text())
    accuracy = {one["method"]: one["accuracy"] for one in written["scores"] if one["row"] == "walk-4"}
    assert accuracy == {"squared-distance": 1, "distance": 1, "nearest": 1}
    page = (tmp_path / "out" / "benchmark.html").read_text()
    assert "<svg" in page
    assert "squared-distance" in page
    assert "http" not in page.replace("http://www.w3.org", "")  # it loads nothing


def test_json_is_printed_and_nothing_else(run, data: Path, tmp_path: Path):
    out = run("benchmark", "nearest", "--data", data, "--out", tmp_path / "out", "--json").stdout
    assert json.loads(out) == json.loads((tmp_path / "out" / "benchmark.json").read_text())


def test_an_export_has_one_scene_and_one_snapshot_for_each_and_its_answers_are_scored(run, tmp_path: Path):
    asked = "sizes-5,carts-3s"
    line = run("benchmark", "--export", tmp_path / "files", "--rows", asked).stdout
    assert line.startswith("Wrote 80 snapshots of benchmark-1")
    index = json.loads((tmp_path / "files" / "suite.json").read_text())
    answers = {}
    for row in index["rows"]:
        for key in row["snapshots"]:
            scene = json.loads((tmp_path / "files" / f"{key}.scene.json").read_text())
            snapshot = json.loads((tmp_path / "files" / f"{key}.snapshot.json").read_text())
            labels = [
                min(scene["objects"], key=lambda o: (o["x"] - d["x"]) ** 2 + (o["z"] - d["z"]) ** 2)["label"]
                for d in snapshot["detections"]
            ]
            answers[key] = {"labels": labels, "confidence": [0.5] * len(labels)}
    mine = tmp_path / "mine.json"
    mine.write_text(json.dumps({"suite": "benchmark-1", "method": "mine", "answers": answers}))
    out = run("benchmark", "--score", mine, "--rows", asked, "--out", tmp_path / "out", "--json").stdout
    assert json.loads(out)["digest"] == index["digest"] == DIGEST  # that of all rows, whichever are asked for
    scores = {(one["method"], one["row"]): one for one in json.loads(out)["scores"]}
    for row in asked.split(","):
        assert scores["mine", row]["accuracy"] == scores["nearest", row]["accuracy"]
    assert scores["mine", "sizes-5"]["calibration_error"] == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["nobody"], "OptionError: method: must be one of"),
        (["nearest", "nearest"], "OptionError: method: must be given once each"),
        (["--rows", "nowhere"], "OptionError: --rows: must be one or several of paper-L1"),
        (["--data", "nowhere"], "OptionError: --data: must be a folder with suite.json and truth.json"),
        (["nearest", "--export", "files"], "OptionError: METHOD: must not be given with --export"),
        (["--score", "nowhere.json"], "OptionError: nowhere.json: file: must be a readable file"),
        (["--score", "a.json", "--quick"], "OptionError: --quick: must not be given with --score"),
    ],
)
def test_mistakes_are_one_line(mistake, tmp_path: Path, monkeypatch, options: list[str], line: str):
    monkeypatch.chdir(tmp_path)
    assert mistake("benchmark", *options).startswith(line)


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--form", "video"], "OptionError: --form: must be one of mot, table"),
        (["--columns", "u=x"], "OptionError: --columns: must be WHAT=COLUMN,... with WHAT of frame, id"),
        (["--form", "mot", "--columns", "x=x"], "OptionError: --columns: must not be given with --form mot"),
        (["--heading", "sideways"], "OptionError: --heading: must be one of given, motion"),
    ],
)
def test_mistakes_in_converting_are_one_line(mistake, tracks: Path, tmp_path: Path, options, line: str):
    assert mistake("convert", tracks, "--gap", 4, "--out", tmp_path / "o", *options).startswith(line)
