"""`farm-ar demo`: films from scripts."""

from typer.testing import CliRunner

from farm_ar.cli.program import app

SCRIPT = """
title = "One push"
gaze = "S4"
ending_s = 0.1

[[visits]]
play_s = 0.1

[[visits.moves]]
building = "orange-coop"
by = [0.0, -0.04]
"""


def test_a_script_of_ones_own_is_filmed_and_its_snapshots_are_printed(tmp_path):
    (tmp_path / "push.toml").write_text(SCRIPT)
    out = tmp_path / "films"
    result = CliRunner().invoke(app, ["demo", str(tmp_path / "push.toml"), "--out", str(out), "--no-gif"])
    assert result.exit_code == 0, result.output
    assert "Right: 5 of 5 detections" in result.output
    assert "Orange Chicken Coop (" in result.output
    assert (out / "push.mp4").stat().st_size > 1000
    assert not (out / "push.gif").exists()


def test_a_script_that_is_not_there_is_one_line_and_exit_code_2(tmp_path):
    result = CliRunner().invoke(app, ["demo", "nowhere.toml", "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "script: must be a readable TOML file or one of" in result.output
    assert len(result.output.strip().splitlines()) == 1
