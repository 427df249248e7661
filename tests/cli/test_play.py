"""`farm-ar play`: a game by hand."""

import cv2
import pytest
from typer.testing import CliRunner

from farm_ar.cli.program import app
from farm_ar.showcases import load_script


@pytest.fixture
def play(tmp_path):
    def run(lines, *options):
        arguments = ["play", "--out", str(tmp_path), *map(str, options)]
        return CliRunner().invoke(app, arguments, input="\n".join(lines) + "\n")

    return run


def test_a_move_and_a_look_tell_what_the_snapshot_said_and_draw_it(play, tmp_path):
    result = play(["red-coop by 0.05 0", "look", "where", "end"], "--save", tmp_path / "mine.toml")
    assert result.exit_code == 0, result.output
    assert "Right: 7 of 7 detections. On the wrong building: none" in result.output
    assert "Animals that did not get into the building of their colour: 0" in result.output
    before, after = (line.split() for line in result.output.splitlines() if line.startswith("red-coop "))
    assert float(after[1]) == pytest.approx(float(before[1]) + 0.05, abs=0.002)
    pictures = [cv2.imread(str(tmp_path / f"play-{k}.png")) for k in range(2)]
    assert pictures[0].shape == pictures[1].shape == (480, 1068, 3)
    assert (pictures[0] != pictures[1]).any()
    (visit,) = load_script(tmp_path / "mine.toml").visits
    assert visit.moves[0].by == (0.05, 0.0)


def test_two_coops_in_each_others_place_are_taken_for_each_other(play):
    lines = [
        "blue-coop to 0.45 0.12",
        "yellow-coop to 0.42 0.345 turn -20",
        "blue-coop to 0.185 0.26 turn 20",
    ]
    result = play([*lines, "look"])
    assert "On the wrong building: yellow-coop, blue-coop" in result.output
    assert "Right: 7 of 7" not in result.output


def test_a_line_that_cannot_be_done_is_told_and_the_game_goes_on(play):
    result = play(["nonsense", "shed by 1 1", "help", "", "look"])
    assert result.exit_code == 0, result.output
    assert "move: must be BUILDING to X Z" in result.output
    assert "\nbuilding: must be one of yellow-coop" in result.output  # and nothing of a script before it
    assert result.output.count("the hand leaves: one snapshot is taken") == 2
    assert "Right: 7 of 7" in result.output


def test_any_re_identifier_can_be_played_against(play):
    lines = ["red-coop by 0.05 0", "look"]
    assert "Right: 0 of 7 detections" not in play(lines).output
    for name in ("last-known", "farm_ar.reid:LastKnownReid"):
        result = play(lines, "--reid", name)
        assert result.exit_code == 0, result.output
        assert "Right: 6 of 7 detections" in result.output
    assert "must be one of adaptive" in play(lines, "--reid", "guess").output


@pytest.mark.parametrize("word", ["end", "quit", "exit"])
def test_after_any_word_for_the_end_nothing_more_is_asked(play, word):
    result = play([word, "look"])
    assert result.exit_code == 0
    assert "Right:" not in result.output


def test_moves_that_were_not_looked_at_are_played_at_the_end(play):
    assert "Right: 7 of 7" in play(["red-coop by 0.05 0"]).output


def test_a_game_without_a_move_ends_at_once(play, tmp_path):
    result = play(["end"])
    assert result.exit_code == 0
    assert "Counters" not in result.output
    assert (tmp_path / "play-0.png").exists()


def test_on_a_terminal_it_asks_for_each_line(play, monkeypatch):
    monkeypatch.setattr("farm_ar.cli.play._at_a_terminal", lambda: True)
    assert "visit 1> " in play(["end"]).output


def test_without_a_terminal_it_says_why_there_is_no_page_unless_none_was_asked_for(play):
    assert (
        play(["end"]).stderr == "The moves come from the input, which is no terminal, so there is no page\n"
    )
    assert play(["end"], "--terminal").stderr == ""


@pytest.mark.parametrize("option", [["--port", "0"], ["--port", "8123"], ["--gallery", "here"], ["--lan"]])
def test_who_asks_for_the_page_gets_it_without_a_display_or_a_terminal(play, monkeypatch, option):
    asked = []
    monkeypatch.setattr(
        "farm_ar.cli.page.serve_page", lambda *values, **options: asked.append((values, options))
    )
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert play([], *option).exit_code == 0
    ((values, options),) = asked
    assert values == (0, "spatial", int(option[1]) if option[0] == "--port" else 0)
    assert (options["lan"], options["show"]) == (option[0] == "--lan", False)
    for other in (["--terminal"], ["--save", "moves.toml"], ["--gaze", "S1"]):
        result = play([], *option, *other)
        assert result.exit_code == 2
        assert result.stderr.startswith(f"OptionError: {other[0]}: must not be given with {option[0]}")
    assert len(asked) == 1


def test_without_a_display_it_says_how_to_serve_the_page_nevertheless(play, monkeypatch):
    monkeypatch.setattr("farm_ar.cli.play._at_a_terminal", lambda: True)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert "--port 8000" in play(["end"]).output


def test_with_a_display_the_page_gets_the_scene_and_what_only_typing_has_is_typed(play, monkeypatch):
    asked = []
    monkeypatch.setattr("farm_ar.cli.page.serve_page", lambda *values, **options: asked.append(options))
    monkeypatch.setattr("farm_ar.cli.play._at_a_terminal", lambda: True)
    monkeypatch.setattr("farm_ar.envs.window.has_packages", lambda: True)
    monkeypatch.setenv("DISPLAY", ":0")
    assert play([], "--scene", "mine.json").exit_code == 0
    assert play([], "--scene", "mine.json", "--port", "0").exit_code == 0
    assert [one["scene"] for one in asked] == ["mine.json", "mine.json"]
    assert "visit 1> " in play(["end"], "--gaze", "S4").output
    assert len(asked) == 2


def test_a_scene_without_a_shed_is_one_line_and_exit_code_2(play):
    result = play([], "--scene", "L1", "--gaze", "sweep")
    assert result.exit_code == 2
    assert "scene: must be" in result.output


def test_a_game_that_could_not_be_saved_does_not_begin(play, tmp_path):
    result = play(["end"], "--save", tmp_path)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == f"OptionError: --save: must be a file, not a folder, got '{tmp_path}'\n"
