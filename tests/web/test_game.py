"""A game that a pointer plays: what it is told, what it tells, and that it plays again to the same bytes."""

import json

import numpy as np
import pytest

from farm_ar.agents.cases import Case
from farm_ar.agents.certificates import lower_bound
from farm_ar.envs import first_difference
from farm_ar.errors import OptionError
from farm_ar.game_logic.farm_game import Phase
from farm_ar.reid import SpatialReid, reid_factory
from farm_ar.showcases import ScriptRecorder, load_script
from farm_ar.web.game import METHODS, Game
from farm_ar.web.pointer import STEPS_PER_SECOND, Pointer
from farm_ar.web.recordings import demonstrations, recorded_script


def wait(game: Game, seconds: float) -> None:
    for _ in range(round(seconds * STEPS_PER_SECOND)):
        game.step()


def carry(game: Game, label: str, x: float, z: float, turn: float = 0.0) -> None:
    """What a player does who drags a building and takes the hand away."""
    layout = game.world.truth
    start = layout.position[layout.index(label)]
    game.pointer = Pointer(*start)
    wait(game, 1.5)
    game.pointer = Pointer(*start, grip=True)
    wait(game, 0.1)
    game.pointer = Pointer(x, z, grip=True, turn=turn)
    wait(game, 1.5)
    game.pointer = Pointer(x, z)
    wait(game, 0.1)


def test_a_dragged_building_is_where_it_was_dragged_and_the_headset_looks_when_the_hand_has_left() -> None:
    game = Game(seed=3)
    carry(game, "blue-coop", 0.6, 0.15, turn=0.5)
    assert game.world.phase is Phase.HAND
    assert game.news() is None
    game.pointer = Pointer()
    wait(game, 1.5)
    assert game.world.phase is Phase.PLAY
    news = game.news()
    assert news is not None
    assert game.news() is None
    k = game.world.truth.index("blue-coop")
    np.testing.assert_allclose(game.world.truth.position[k], [0.6, 0.15], atol=2e-3)
    (mine,) = [one for one in news["detections"] if one["object"] == k]
    assert mine["right"] == (mine["label"] == "blue-coop")
    assert news["accuracy"] == pytest.approx(np.mean([one["right"] for one in news["detections"]]))
    assert news["visit_cm"] == pytest.approx(game.state()["effort_cm"])


def test_animals_stand_still_while_the_hand_is_in_view() -> None:
    game = Game(seed=1)
    game.pointer = Pointer(0.6, 0.3)
    wait(game, 1.0)
    before = game.world.flock.position
    wait(game, 0.5)
    np.testing.assert_array_equal(game.world.flock.position, before)
    game.pointer = Pointer()
    wait(game, 1.5)
    assert game.world.flock.position.shape != before.shape or (game.world.flock.position != before).any()


def test_swapping_two_look_alikes_in_one_visit_fools_it() -> None:
    game = Game(seed=0)
    layout = game.world.truth
    (ax, az), (bx, bz) = (layout.position[layout.index(name)] for name in ("magenta-hutch", "purple-hutch"))
    carry(game, "magenta-hutch", 0.6, 0.15)
    carry(game, "purple-hutch", ax, az)
    carry(game, "magenta-hutch", bx, bz)
    game.pointer = Pointer()
    wait(game, 1.5)
    news = game.news()
    assert news is not None
    assert news["wrong_labels"] >= 2


def test_a_game_plays_again_to_the_same_bytes() -> None:
    game = Game(seed=5, reid="distance", gaze="left")
    carry(game, "red-coop", 0.5, 0.2)
    game.pointer = Pointer()
    wait(game, 1.5)
    trace = json.loads(json.dumps(game.trace()))
    assert len(trace["actions"]) == game.steps
    assert first_difference(trace) is None


@pytest.mark.parametrize("reid", METHODS)
def test_what_is_told_is_json_that_browsers_read(reid: str) -> None:
    game = Game(reid=reid)
    game.pointer = Pointer(0.6, 0.3)
    wait(game, 1.2)
    game.pointer = Pointer()
    wait(game, 1.2)
    for message in (game.hello(), game.state(), game.news()):
        json.dumps(message, allow_nan=False)
    assert len(json.dumps(game.state(), separators=(",", ":"))) < 4000


@pytest.mark.parametrize(
    ("message", "field"),
    [
        ({"x": "a", "z": 0, "turn": 0}, "x"),
        ({"x": float("nan"), "z": 0}, "x"),
        ({"x": 0, "z": 1e300}, "z"),
        ({"x": 0, "z": True}, "z"),
        ({"x": 0, "z": 0, "grip": 1}, "grip"),
        ({"x": 0, "z": 0, "turn": float("inf")}, "turn"),
        ({"x": 0, "z": 0, "turn": [1]}, "turn"),
    ],
)
def test_a_wrong_pointer_is_refused_by_name(message, field) -> None:
    with pytest.raises(OptionError, match=field):
        Pointer.told(message)


def test_random_pointers_leave_no_broken_state() -> None:
    draw, game = np.random.default_rng(7), Game(seed=2)
    for _ in range(600):
        if draw.random() < 0.3:
            away, grip = draw.random() < 0.15, bool(draw.random() < 0.6)
            x, z = (None, None) if away else draw.uniform((-0.3, -0.6), (1.5, 1.1)).tolist()
            game.pointer = Pointer(x, z, grip, float(draw.normal(0, 3)))
        game.step()
    position, yaw = game.world.tabletop.poses()
    assert np.isfinite(position).all()
    assert np.isfinite(yaw).all()
    held = game.world.tabletop.hand.gripped
    rest = np.arange(len(position)) != held
    assert game.world.tabletop.on_table(1e-6)[rest].all()


def test_names_that_are_not_known_are_refused() -> None:
    for wrong in ({"reid": "magic"}, {"gaze": "down"}):
        with pytest.raises(OptionError, match=next(iter(wrong))):
            Game(**wrong)


def test_the_price_of_a_visit_is_the_ways_and_turns_of_what_it_moved() -> None:
    game = Game(seed=0)
    layout = game.world.truth
    k = layout.index("blue-coop")
    carry(game, "blue-coop", 0.6, 0.15, turn=0.5)
    game.pointer = Pointer()
    wait(game, 1.5)
    now = game.world.truth
    way = np.linalg.norm(now.position[k] - layout.position[k])
    turn = abs(np.sin((now.yaw[k] - layout.yaw[k]) / 2))
    news = game.news()
    assert news is not None
    assert news["visit_cm"] == pytest.approx(100 * (way + turn * np.hypot(1.2, 0.8)), abs=0.01)
    assert news["visit_cm"] > 20


def test_the_par_is_the_certified_bound_and_only_where_one_is_known() -> None:
    game = Game(seed=0)
    case = Case(game.world.scene.knowing(game.world.truth), game.world.camera)
    bound = lower_bound(case, SpatialReid(case.scene))
    assert game.par_cm == pytest.approx(100 * bound.total * np.hypot(1.2, 0.8), abs=0.051)
    assert Game(seed=0, reid="likelihood").par_cm is None
    carry(game, "blue-coop", 0.6, 0.15)
    game.pointer = Pointer()
    wait(game, 1.5)
    believed_right = not game.world.tracker.belief.wrong.any()
    assert (game.par_cm is not None) == believed_right


def test_a_second_method_is_asked_of_the_same_snapshot() -> None:
    game = Game(seed=0, beside="nearest")
    known = game.world.believed
    carry(game, "magenta-hutch", 0.6, 0.15)
    game.pointer = Pointer()
    wait(game, 1.5)
    news = game.news()
    assert news is not None
    sighting = game.world.sightings[-1]
    again = reid_factory("nearest")(game.world.scene.knowing(known)).identify(sighting.snapshot)
    assert news["beside"]["reid"] == "nearest"
    assert [one["label"] for one in news["beside"]["detections"]] == list(again.labels)


def test_a_hand_that_leaves_lets_go() -> None:
    game = Game(seed=0)
    start = game.world.truth.position[0]
    game.pointer = Pointer(*start)
    wait(game, 1.5)
    game.pointer = Pointer(*start, grip=True)
    wait(game, 0.2)
    assert game.world.tabletop.hand.gripped == 0
    game.pointer = Pointer(grip=True)
    wait(game, 0.1)
    assert game.world.tabletop.hand.gripped is None


def test_there_is_no_par_while_the_headset_is_fooled() -> None:
    game = Game(seed=0)
    layout = game.world.truth
    (ax, az), (bx, bz) = (layout.position[layout.index(name)] for name in ("magenta-hutch", "purple-hutch"))
    carry(game, "magenta-hutch", 0.6, 0.15)
    carry(game, "purple-hutch", ax, az)
    carry(game, "magenta-hutch", bx, bz)
    assert game.par_cm is not None
    game.pointer = Pointer()
    wait(game, 1.5)
    assert game.world.tracker.belief.wrong.any()
    assert game.par_cm is None


def test_a_demonstration_says_each_snapshot_once() -> None:
    name = next(iter(demonstrations()))
    recording = recorded_script(name)
    said = [frame["snapshot"] for frame in recording["frames"] if "snapshot" in frame]
    assert [one["number"] for one in said] == list(range(1, 1 + len(load_script(name).visits)))
    film = ScriptRecorder(load_script(name), make_pictures=None).play()
    assert sum(len(one["detections"]) for one in said) == len(film.detections)
