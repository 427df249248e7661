"""Scripts: what they say, and what is refused."""

import re

import numpy as np
import pytest

from farm_ar.scenes import builtin_scene, save_scene
from farm_ar.showcases import ScriptError, builtin_scripts, load_script

MOVE = '[[visits]]\n[[visits.moves]]\nbuilding = "blue-coop"\n'


def written(tmp_path, text):
    path = tmp_path / "play.toml"
    path.write_text(text)
    return path


def test_the_demonstrations_of_the_paper_come_with_the_package():
    assert list(builtin_scripts()) == ["demonstration-1", "demonstration-2"]
    first, second = (load_script(name) for name in builtin_scripts())
    assert (first.gaze, second.gaze) == ("S1", "S4")
    moved = {move.building for visit in first.visits for move in visit.moves}
    assert moved == {"blue-coop", "cyan-hutch", "magenta-hutch", "yellow-coop"}


def test_a_move_goes_to_a_place_or_by_a_way(tmp_path):
    text = MOVE + "to = [0.5, 0.2]\nturn_deg = 90\n" + MOVE.removeprefix("[[visits]]\n") + "by = [0.1, 0]\n"
    script = load_script(written(tmp_path, text))
    first, second = script.visits[0].moves
    layout = script.scene.layout
    here = layout.position[layout.index("blue-coop")]
    np.testing.assert_allclose(here + first.displacement(layout), (0.5, 0.2))
    np.testing.assert_allclose(second.displacement(layout), (0.1, 0.0))
    assert first.turn == pytest.approx(np.pi / 2)


def test_a_move_may_only_turn(tmp_path):
    script = load_script(written(tmp_path, MOVE + "turn_deg = 30\n"))
    move = script.visits[0].moves[0]
    np.testing.assert_array_equal(move.displacement(script.scene.layout), (0, 0))


def test_what_a_script_leaves_out_has_a_default(tmp_path):
    script = load_script(written(tmp_path, "visits = []\n"))
    assert (script.title, script.scene.name, script.gaze, script.seed) == ("play", "farm", "sweep", 0)


def test_a_script_may_name_a_scene_file_beside_it(tmp_path):
    save_scene(builtin_scene("farm"), tmp_path / "mine.json")
    assert load_script(written(tmp_path, 'scene = "mine.json"\nvisits = []\n')).scene.name == "farm"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("visits = [", "file: must be TOML"),
        ('scene = "lab"\nvisits = []', 'scene: must be "farm" or a scene file with a fixed object'),
        ('gaze = "S9"\nvisits = []', "gaze: must be one of sweep, S1, S2, S3, S4, got 'S9'"),
        ('fov = "wide"\nvisits = []', "fov: must be one of"),
        ("visits = 3", "visits: must be a list, got 3"),
        ("", "visits: must be a list"),
        ("seed = -1\nvisits = []", "seed: must be a whole number from 0 to 9223372036854775807"),
        ("title = 4\nvisits = []", "title: must be a non-empty string, got 4"),
        ("visitz = []\nvisits = []", "visitz: must not be there"),
        ("[[visits]]\nplay_s = -1\nmoves = []", "visits[0].play_s: must be a number from 0 to 3600"),
        (MOVE.replace("blue-coop", "shed") + "to = [1, 1]", "visits[0].moves[0].building: must be one of"),
        (MOVE, "visits[0].moves[0].to: must be given, or by, but not both"),
        (MOVE + "to = [1, 1]\nby = [0, 0]", "visits[0].moves[0].to: must be given, or by, but not both"),
        (MOVE + "to = [1]", "visits[0].moves[0].to: must be [x, z] in metres, from -1e6 to 1e6, got [1]"),
        (MOVE + "by = [nan, 0]", "visits[0].moves[0].by: must be [x, z] in metres"),
        (
            MOVE + 'by = [0.1, 0]\nturn_deg = "a"',
            "visits[0].moves[0].turn_deg: must be a number from -3.6e8 to 3.6e8",
        ),
        (MOVE + "by = [0.1, 0]\nfast = true", "visits[0].moves[0].fast: must not be there"),
    ],
)
def test_a_script_that_cannot_be_used_gets_one_clear_error(tmp_path, text, message):
    with pytest.raises(ScriptError, match=re.escape(f"play.toml: {message}")):
        load_script(written(tmp_path, text))


def test_a_script_that_is_not_there_is_refused_with_those_that_come_with_the_package(tmp_path):
    with pytest.raises(ScriptError, match="one of demonstration-1, demonstration-2, got 'nowhere'"):
        load_script("nowhere")
