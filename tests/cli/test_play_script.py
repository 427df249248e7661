"""`farm-ar play-script`: the tables of a game that nobody films."""

import json

import numpy as np
import pytest

from farm_ar.reid import Identification
from farm_ar.showcases import ScriptRecorder, film_script, load_script
from farm_ar.showcases import film as film_module

PUSH = """
title = "One push"
gaze = "S4"
seed = 3
ending_s = 0.5

[[visits]]
play_s = 0.5

[[visits.moves]]
building = "orange-coop"
by = [0.0, -0.04]
"""
MOVE = '[[visits]]\n[[visits.moves]]\nbuilding = "blue-coop"\n'
SEED = "seed: must be a whole number from 0 to 9223372036854775807"
OFF_THE_TABLE = "visits[0].moves[0].to: must lie on the table, x from 0 to 1.2 and z from 0 to 0.8 metres"


@pytest.fixture
def push(tmp_path):
    path = tmp_path / "push.toml"
    path.write_text(PUSH)
    return path


def test_the_tables_are_those_of_the_demo(run, push):
    filmed = run("demo", push, "--no-gif").stdout.strip().splitlines()
    assert filmed.pop().startswith("Wrote ")
    played = run("play-script", push)
    assert played.exit_code == 0
    assert played.stdout.splitlines() == filmed
    assert "Right: 5 of 5 detections" in filmed


def test_nothing_is_drawn_and_nothing_is_written(run, push, tmp_path, monkeypatch):
    def draw(*arguments):
        raise AssertionError("a picture was made")

    monkeypatch.setattr(film_module, "GameFrames", draw)
    assert run("play-script", push).exit_code == 0
    assert list(tmp_path.iterdir()) == [push]


def test_json_holds_the_title_and_the_rows_of_the_films_tables(run, push, tmp_path):
    film, _ = film_script(load_script(push), "push", tmp_path / "out", gif=False)
    played = json.loads(run("play-script", push, "--json").stdout)
    assert played == {"title": "One push", "snapshots": film.detections, "counters": film.counters}
    assert len(played["snapshots"]) == 5
    assert {row["after"] for row in played["counters"]} == {"1", "end"}


def test_one_that_comes_with_the_package_is_played_by_its_name(run):
    result = run("play-script", "demonstration-2")
    assert result.stdout.startswith("Gameplay Demonstration #2\n")
    assert "Right: 5 of 5 detections" in result.stdout


def test_a_detection_without_a_label_has_no_cost_in_the_table(push):
    class Blind:
        def __init__(self, scene):
            self.labels = scene.layout.labels

        def identify(self, snapshot):
            n = len(snapshot.detections)
            return Identification((None,) * n, np.full(n, np.nan), self.labels)

    film = ScriptRecorder(load_script(push), Blind, make_pictures=None).play()
    assert [(row["given"], row["cost"]) for row in film.detections] == [(None, None)] * 5
    json.dumps(film.detections, allow_nan=False)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("seed = 1.7\nvisits = []", f"{SEED}, got 1.7"),
        ("seed = -1\nvisits = []", f"{SEED}, got -1"),
        ("seed = true\nvisits = []", f"{SEED}, got True"),
        (
            MOVE + "to = [1.3, 0.4]",
            f"{OFF_THE_TABLE}, got [1.3, 0.4]",
        ),
        (
            MOVE + "to = [0.4, -0.01]",
            f"{OFF_THE_TABLE}, got [0.4, -0.01]",
        ),
    ],
)
def test_what_a_script_may_not_say_is_one_line(mistake, tmp_path, text, message):
    (tmp_path / "play.toml").write_text(text)
    assert mistake("play-script", "play.toml") == f"ScriptError: play.toml: {message}"


def test_a_seed_keeps_all_its_digits(tmp_path):
    (tmp_path / "play.toml").write_text(f"seed = {2**60 + 1}\nvisits = []")
    assert load_script(tmp_path / "play.toml").seed == 2**60 + 1


def test_a_building_may_go_to_the_corner_of_the_table(tmp_path):
    (tmp_path / "play.toml").write_text(MOVE + "to = [1.2, 0.8]")
    (visit,) = load_script(tmp_path / "play.toml").visits
    assert visit.moves[0].to == (1.2, 0.8)


def test_another_rule_may_identify(run, push):
    told = run("play-script", push, "--reid", "last-known")
    assert told.exit_code == 0
    assert "Right: 4 of 5 detections" in told.stdout
    assert "Right: 5 of 5 detections" in run("play-script", push, "--reid", "likelihood").stdout


@pytest.mark.parametrize("command", ["demo", "play-script"])
def test_a_rule_that_is_not_known_is_refused(run, push, command):
    told = run(command, push, "--reid", "guess")
    assert told.exit_code == 2
    assert "reid: must be one of" in told.stderr
