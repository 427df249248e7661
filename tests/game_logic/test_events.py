"""Events: what changes of real things, and what that does in the game."""

import numpy as np
import pytest

from farm_ar.game_logic.events import Event, EventLayer, Parts, events_between
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.game_logic.headset import field_of_view, look_at
from farm_ar.scenes import builtin_scene
from farm_ar.showcases import ScriptError, ScriptRecorder, load_script
from farm_ar.showcases.script import parse_script

FARM = builtin_scene("farm")
SHED = FARM.layout.index("shed")
ORANGE, GREEN = FARM.layout.index("orange-coop"), FARM.layout.index("green-coop")
CAMERA = look_at(np.array([0.6, -0.3]), np.array([0.6, 0.4]), field_of_view("photo"))


def game_of(animals_a_second):
    return FarmGame(FARM, CAMERA, np.random.default_rng(0), animals_a_second=animals_a_second)


def test_opening_the_gate_lets_animals_out_and_closing_it_keeps_them_in():
    game = game_of(0.0)
    game.open_gates = {SHED: 0.0}
    layer = EventLayer(game)
    game.play(3.0)
    assert len(game.flock) == 0
    game.open_gates = {SHED: 1.0}
    assert layer.look() == [Event("gate opened", SHED)]
    assert layer.look() == []  # it has not changed since
    game.play(2.0)
    assert len(game.flock) == pytest.approx(20, abs=1)  # ten a second, and none in a burst
    door = FARM.layout.position[SHED]
    assert np.linalg.norm(game.flock.position - door, axis=1).max() < 0.4
    game.open_gates = {SHED: 0.0}
    layer.look()
    game.play(20.0)
    assert len(game.flock) == 0
    assert game.counters.counted.sum() == pytest.approx(20, abs=1)
    assert game.miscounts == 0


def test_without_stairs_a_coop_s_chickens_go_to_another_and_count_there():
    game = game_of(10.0)
    layer = EventLayer(game)
    game.play(5.0)
    before = game.counters.counted.copy()
    game.missing = {ORANGE: ("stairs",)}
    assert layer.look() == [Event("stairs removed", ORANGE)]
    game.play(20.0)
    gained = game.counters.counted - before
    assert gained[ORANGE] == 0
    usual = gained[FARM.layout.index("blue-coop")]
    assert gained[GREEN] > 1.7 * usual
    assert game.miscounts == 0
    game.missing = {ORANGE: ()}
    assert layer.look() == [Event("stairs put back", ORANGE)]
    there = game.counters.counted[ORANGE]
    game.play(20.0)
    assert game.counters.counted[ORANGE] > there + 10
    assert game.miscounts == 0


def test_an_effect_of_one_s_own_takes_the_place_of_ours():
    game, seen = game_of(10.0), []
    layer = EventLayer(game, effects={"gate opened": lambda game, index: seen.append(index)})
    game.open_gates = {SHED: 1.0}
    layer.look()
    assert seen == [SHED]


def test_events_are_changes_only():
    parts = Parts().with_gate(SHED, 0.4).with_stairs(ORANGE, False)
    assert events_between(parts, parts.with_gate(SHED, 0.1)) == []  # closed both times
    back = parts.with_stairs(ORANGE, True)
    assert events_between(parts, back) == [Event("stairs put back", ORANGE)]


def test_the_script_plays_both_events():
    film = ScriptRecorder(load_script("characters"), make_pictures=None).play()
    assert [(row["event"], row["of"]) for row in film.events] == [
        ("gate opened", "shed"),
        ("stairs removed", "orange-coop"),
    ]
    end = {row["label"].partition(" (")[0]: row for row in film.counters if row["after"] == "end"}
    assert end["Orange Chicken Coop"]["counted"] < end["Green Chicken Coop"]["counted"]
    assert all(row["misplaced"] == row["stranded"] == 0 for row in end.values())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ('part = "roof"\nof = "shed"\nto = "off"', "part"),
        ('part = "gate"\nof = "red-coop"\nto = "open"', r"changes\[0\].of"),
        ('part = "stairs"\nof = "cyan-hutch"\nto = "off"', r"changes\[0\].of"),
        ('part = "stairs"\nof = "red-coop"\nto = "open"', r"changes\[0\].to"),
    ],
)
def test_a_wrong_change_in_a_script_is_named(change, said, tmp_path):
    text = f"[[visits]]\nmoves = []\n\n[[visits.changes]]\n{change}\n"
    with pytest.raises(ScriptError, match=said):
        parse_script(text, tmp_path, "mine.toml")
