"""`farm-ar stress`, `farm-ar stress-replay` and `farm-ar design`."""

import json
import sys

import pytest

from farm_ar.cli import output
from farm_ar.cli.stress import attacks_asked_for
from farm_ar.drawing.palette import WRONG
from farm_ar.scenes import load_scene
from farm_ar.sweeps.unit import code_version, load_function

QUICK = ["stress", "--cases", "2", "--queries", "60", "--attack", "analytic"]


def test_a_stress_test_writes_its_files_and_prints_its_numbers(run, tmp_path, monkeypatch):
    monkeypatch.delenv("FARM_AR_QUIET")
    monkeypatch.setattr(output, "PATIENCE_S", 0.01)
    result = run(*QUICK, "--out", str(tmp_path))
    assert result.exit_code == 0
    assert "spatial" in result.stdout
    assert "writing the report ..." in result.stderr
    assert {"stress.html", "stress.json", "stress.csv"} <= {path.name for path in tmp_path.iterdir()}


def test_the_same_command_writes_the_same_bytes(run, tmp_path):
    for name in ("one", "two"):
        assert run(*QUICK, "--out", str(tmp_path / name)).exit_code == 0
    for file in ("stress.html", "stress.json", "stress.csv"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()


@pytest.mark.parametrize(("threshold", "code"), [("0.01", 0), ("5.0", 1)])
def test_a_median_below_the_threshold_fails(run, tmp_path, threshold, code):
    result = run(*QUICK, "--out", str(tmp_path), "--fail-under", threshold)
    assert result.exit_code == code
    assert ("perturbation below" in result.stdout) == (code == 1)


def test_a_failure_is_played_again(run, tmp_path):
    run(*QUICK, "--out", str(tmp_path))
    report, picture = tmp_path / "stress.json", tmp_path / "failure.svg"
    result = run("stress-replay", str(report), "0", "--plot", str(picture))
    assert result.exit_code == 0
    assert "bit for bit" in result.stdout
    assert "wrong" in result.stdout
    assert WRONG in picture.read_text()
    content = json.loads(report.read_text())
    content["failures"][0]["wrong"] += 1
    report.write_text(json.dumps(content))
    result = run("stress-replay", str(report), "0")
    assert result.exit_code == 1
    assert "not what the report says" in result.stdout


OWN_METHOD = """
from pathlib import Path
from farm_ar.reid import NearestReid

Path("touched").touch()

class Mine(NearestReid):
    pass
"""


def test_a_report_that_names_code_is_replayed_only_if_it_is_trusted(run, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "method_of_mine.py").write_text(OWN_METHOD)
    own = ["stress", "--cases", "1", "--queries", "60", "--attack", "analytic", "--out", "out"]
    run(*own, "--reid", "method_of_mine:Mine")
    (tmp_path / "touched").unlink()
    for cached in (load_function, code_version):
        cached.cache_clear()
    sys.modules.pop("method_of_mine", None)
    refused = run("stress-replay", "out/stress.json", "0")
    assert refused.exit_code == 2
    assert refused.stderr.count("\n") == 1
    assert "--trust: must be given to load out/stress.json" in refused.stderr
    assert not (tmp_path / "touched").exists()
    trusted = run("stress-replay", "out/stress.json", "0", "--trust")
    assert trusted.exit_code == 0
    assert "runs the module of method_of_mine:Mine" in trusted.stderr
    assert (tmp_path / "touched").exists()


def test_an_unknown_attack_is_one_line_and_code_2(run, tmp_path):
    result = run("stress", "--attack", "luck", "--out", str(tmp_path / "new"))
    assert result.exit_code == 2
    assert "attack: must be one of" in result.stderr
    assert not (tmp_path / "new").exists()


def test_a_player_belongs_to_the_attack_of_players(run, tmp_path):
    assert attacks_asked_for("halton,learned", "runs/mine") == ("halton", "learned:runs/mine")
    assert "learned" not in attacks_asked_for("all", None)
    result = run("stress", "--player", "farm-slot", "--out", str(tmp_path / "new"))
    assert result.exit_code == 2
    assert "--policy: must come with --attack learned" in result.stderr


def test_the_table_is_explained(run, tmp_path):
    result = run(*QUICK, "--out", str(tmp_path))
    for column in ("D", "in metres", "certified", "/ certified", "failed", "queries/s"):
        assert f"\n{column}: " in result.stdout


def test_a_design_is_drawn_and_saved(run, tmp_path):
    picture, scene = tmp_path / "design.png", tmp_path / "design.json"
    result = run("design", "--objects", "coop=3,hutch=2", "--plot", str(picture), "--save", str(scene))
    assert result.exit_code == 0
    assert "certified radius" in result.stdout
    assert picture.exists()
    assert load_scene(scene).layout.labels == ("coop-1", "coop-2", "coop-3", "hutch-1", "hutch-2", "shed")


@pytest.mark.parametrize("objects", ["coop", "coop=many", "coop=1,coop=2", ""])
def test_objects_in_another_form_are_refused(run, objects):
    result = run("design", "--objects", objects)
    assert result.exit_code == 2
    assert "--objects: must be KIND=N" in result.stderr
