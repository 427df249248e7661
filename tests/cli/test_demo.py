"""`farm-ar demo`: films from scripts."""

import re

import pytest
from typer.testing import CliRunner

from farm_ar.cli.output import progress
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


@pytest.mark.parametrize("second", ["more/push.toml", "push.toml", "demonstration-1"])
def test_two_scripts_whose_films_would_have_one_name_are_refused_before_anything_is_filmed(
    mistake, tmp_path, second
):
    (tmp_path / "more").mkdir()
    for path in ("push.toml", "more/push.toml", "demonstration-1.toml"):
        (tmp_path / path).write_text(SCRIPT)
    first = "demonstration-1.toml" if second == "demonstration-1" else "push.toml"
    line = mistake("demo", first, second, "--out", "films")
    assert line.startswith("OptionError: scripts: must have file names that differ before the ending")
    assert line.endswith(f"got ['{first}', '{second}']")
    assert not (tmp_path / "films").exists()


def test_while_it_films_it_says_so_on_the_error_output_only(tmp_path):
    (tmp_path / "push.toml").write_text(SCRIPT)
    result = CliRunner().invoke(
        app, ["demo", str(tmp_path / "push.toml"), "--out", str(tmp_path), "--no-gif"]
    )
    first, *later = result.stderr.splitlines()  # a busy machine has the time for more
    assert first == "Filming push ..."
    assert all(re.fullmatch(r"Filming push \(\d+%\)", line) for line in later)
    assert "Filming" not in result.stdout


def test_on_a_terminal_a_bar_grows_and_is_gone_at_the_end(monkeypatch, capsys):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    with progress("Filming \x1b[31mpush") as report:
        report("Making a GIF of [b]push", 0.5)
    seen = capsys.readouterr().err
    assert "Making a GIF of [b]push" in seen
    assert "50%" in seen
    assert "\x1b[31mpush" not in seen
    assert seen.endswith("\x1b[2K")
