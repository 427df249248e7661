"""A game that a pointer plays: what it is told, what it tells, and that it plays again to the same bytes."""

import json
from pathlib import Path

import numpy as np
import pytest

from farm_ar.agents.cases import Case
from farm_ar.agents.certificates import lower_bound
from farm_ar.envs import first_difference
from farm_ar.errors import OptionError
from farm_ar.game_logic.farm_game import Phase
from farm_ar.reid import SpatialReid, reid_factory
from farm_ar.showcases import ScriptRecorder, load_script
from farm_ar.web.game import GAZES, METHODS, Game
from farm_ar.web.messages import Handles
from farm_ar.web.pointer import STEPS_PER_SECOND, Pointer
from farm_ar.web.recordings import demonstrations, recorded_script, recorded_trace

OFFICE = str(Path(__file__).parents[2] / "examples" / "data" / "before.json")


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


def swap(game: Game) -> None:
    """Exchange two hutches."""
    layout = game.world.truth
    (ax, az), (bx, bz) = (layout.position[layout.index(name)] for name in ("magenta-hutch", "purple-hutch"))
    carry(game, "magenta-hutch", 0.6, 0.15)
    carry(game, "purple-hutch", ax, az)
    carry(game, "magenta-hutch", bx, bz)


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
    handle = game.handles.handle_of[k]
    (mine,) = [n for n, one in enumerate(news["detections"]) if one["object"] == handle]
    told = game.truth()
    assert told["labels"][mine] == "blue-coop"
    right = [one["label"] == true for one, true in zip(news["detections"], told["labels"], strict=True)]
    assert game.world.sightings[-1].accuracy == pytest.approx(np.mean(right))
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
    swap(game)
    game.pointer = Pointer()
    wait(game, 1.5)
    names, told = game.world.truth.labels, game.truth()
    assert {names[i] for i in told["wrong"]} >= {"magenta-hutch", "purple-hutch"}
    news = game.news()
    assert news is not None
    swapped = [one["label"] != true for one, true in zip(news["detections"], told["labels"], strict=True)]
    assert sum(swapped) >= 2


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
    for message in (game.hello(), game.state(), game.news(), game.truth()):
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


def test_only_a_visit_before_which_it_knew_where_everything_was_counts_as_fooling_it() -> None:
    game = Game(seed=0)
    swap(game)
    game.pointer = Pointer()
    wait(game, 1.5)
    assert game.truth()["fresh"]
    assert game.truth()["wrong"]
    assert game.state()["wrong"] == []  # is told who asks
    carry(game, "blue-coop", 0.6, 0.15)  # the hutches' labels are still wrong, and it costs little
    game.pointer = Pointer()
    wait(game, 1.5)
    told = game.truth()
    assert told["wrong"]
    assert not told["fresh"]
    game.play_freely()
    assert game.truth()["fresh"]


def test_what_was_moved_out_of_view_is_not_known_though_no_label_is_wrong() -> None:
    game = Game(seed=0, gaze="left")
    carry(game, "red-coop", 1.1, 0.1)
    game.pointer = Pointer()
    wait(game, 1.5)
    assert game.truth()["fresh"]
    assert "red-coop" not in game.truth()["labels"]
    carry(game, "blue-coop", 0.45, 0.3)
    game.pointer = Pointer()
    wait(game, 1.5)
    assert len(game.world.sightings) == 2
    assert not game.truth()["fresh"]


def test_a_scene_file_is_played_on_its_own_table() -> None:
    game = Game(seed=0, scene=OFFICE, mode="show")
    assert game.hello()["scene"] == "before"
    assert (game.hello()["width"], game.hello()["depth"]) == (5.0, 4.0)
    wait(game, 20.0)
    assert game.round.stage == "fooled"
    pair = game.round.told()["pair"]
    assert {game.world.truth.labels[i] for i in game.truth()["wrong"]} == set(pair)
    assert first_difference(json.loads(json.dumps(game.trace()))) is None
    assert Game().hello()["scene"] == "farm"


def test_where_no_two_look_alike_nothing_is_shown_and_play_is_free(tmp_path) -> None:
    rows = [
        {"label": name, "category": name, "x": x, "z": 0.4, "yaw_deg": 0, "size_whd": [0.1, 0.1, 0.1]}
        for name, x in (("one", 0.3), ("two", 0.6), ("shed", 0.9))
    ]
    rows[2]["fixed"] = True
    file = tmp_path / "different.json"
    file.write_text(json.dumps({"size_m": [1.2, 0.8], "objects": rows}))
    assert Game(scene=str(file), mode="show").round.mode == "free"
    with pytest.raises(OptionError, match="scene"):
        Game(scene="L1")


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
    told = game.state()
    assert told["visit_cm"] == 0
    assert told["effort_cm"] == pytest.approx(news["visit_cm"], abs=0.01)


def test_the_par_is_the_certified_bound_and_only_where_one_is_known() -> None:
    game = Game(seed=0)
    case = Case(game.world.scene.knowing(game.world.truth), game.world.camera)
    bound = lower_bound(case, SpatialReid(case.scene))
    exact = 100 * bound.total * np.hypot(1.2, 0.8)
    assert game.par_cm <= exact < game.par_cm + 0.1
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
    swap(game)
    assert game.par_cm is not None
    game.pointer = Pointer()
    wait(game, 1.5)
    assert game.world.tracker.belief.wrong.any()
    assert game.par_cm is None
    assert game.state()["wrong"] == []  # who plays is to ask


def test_what_is_told_does_not_say_what_is_really_what_before_it_is_asked_for() -> None:
    game = Game(seed=4, rng=np.random.default_rng(1))
    carry(game, "blue-coop", 0.6, 0.15)
    truth, told = game.world.truth, game.state()
    poses = np.column_stack([truth.position, truth.yaw]).round(4)
    at = [poses.tolist().index(pose) for pose in told["objects"]]
    assert sorted(at) == list(range(len(truth)))
    assert sum(i != k for i, k in enumerate(at)) > 4
    assert [truth.category[i] for i in at] == list(truth.category)
    game.pointer = Pointer(*truth.position[truth.index("blue-coop")], grip=True)
    wait(game, 0.5)
    assert at[game.state()["hand"][3]] == truth.index("blue-coop")
    game.pointer = Pointer()
    wait(game, 1.5)
    news = game.news()
    assert news is not None
    assert set(news) == {"kind", "number", "detections", "visit_cm"}
    assert all(set(one) == {"object", "label", "confidence"} for one in news["detections"])
    assert game.state()["wrong"] == []
    sources = [at[one["object"]] for one in news["detections"]]
    assert sources == game.world.sightings[-1].source.tolist()
    assert game.truth()["labels"] == [truth.labels[i] for i in sources]


def test_handles_that_are_drawn_anew_tell_nothing_of_the_old_ones() -> None:
    layout, rng = Game(seed=0).world.truth, np.random.default_rng(5)
    kept = np.zeros(len(layout))
    for _ in range(2000):
        handles = Handles(layout, rng)
        before = handles.object_of.copy()
        handles.draw()
        np.testing.assert_array_equal(handles.object_of[handles.handle_of], np.arange(len(layout)))
        kept += handles.object_of == before
    alike = np.array([layout.category.count(one) for one in layout.category])
    np.testing.assert_allclose(kept / 2000, 1 / alike, atol=0.05)  # by chance one of those that look alike


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("gaze", GAZES)
def test_the_page_shows_in_its_first_seconds_how_the_headset_is_fooled(seed, gaze) -> None:
    game = Game(seed=seed, mode="show", gaze=gaze)
    before, hand = game.world.truth, game.world.tabletop
    for _ in range(8 * STEPS_PER_SECOND):
        was = hand.hand.position.copy()
        game.step()
        if hand.hand.gripped is not None:  # it goes as slowly as can be watched
            assert np.linalg.norm(hand.hand.position - was) <= 0.5 / STEPS_PER_SECOND + 1e-6
    assert game.round.stage == "fooled"
    pair = game.round.told()["pair"]
    assert {before.labels[i] for i in game.truth()["wrong"]} == set(pair)
    after = game.world.truth
    a, b = (before.index(label) for label in pair)
    np.testing.assert_allclose(after.position[[a, b]], before.position[[b, a]], atol=3e-3)
    assert before.category[a] == before.category[b]
    game.pointer = Pointer(0.6, 0.3, grip=True)
    game.step()
    assert game.round.mode == "free"
    np.testing.assert_allclose(game.world.truth.position, before.position, atol=1e-9)
    assert game.world.sightings == []


def test_who_will_not_be_shown_plays_at_once() -> None:
    game = Game(mode="show")
    wait(game, 1.0)
    with pytest.raises(OptionError, match="stage showing"):
        game.obey({"do": "guess"})
    game.obey({"do": "play"})
    assert game.round.mode == "free"
    assert game.news() == {"kind": "round", "mode": "free", "stage": "free"}
    game.pointer = Pointer(0.6, 0.3)
    wait(game, 1.0)
    assert first_difference(game.trace()) is None


def test_a_recording_of_a_game_goes_as_fast_as_the_game_did() -> None:
    game = Game(seed=3)
    carry(game, "blue-coop", 0.6, 0.15)
    game.pointer = Pointer()
    wait(game, 1.5)
    recording = recorded_trace(game.trace())
    frames = recording["frames"]
    assert abs(len(frames) / recording["rate"] - game.steps / STEPS_PER_SECOND) < 0.15
    k = game.world.truth.index("blue-coop")
    held = [one["hand"][3] == k for one in frames]
    assert sum(held) / recording["rate"] == pytest.approx(1.6, abs=0.15)
    np.testing.assert_allclose(frames[-1]["objects"][k][:2], [0.6, 0.15], atol=2e-3)
    assert [one["snapshot"]["number"] for one in frames if "snapshot" in one] == [1]
    assert "snapshot" not in frames[-1]


def test_a_demonstration_says_each_snapshot_once() -> None:
    name = next(iter(demonstrations()))
    recording = recorded_script(name)
    said = [frame["snapshot"] for frame in recording["frames"] if "snapshot" in frame]
    assert [one["number"] for one in said] == list(range(1, 1 + len(load_script(name).visits)))
    film = ScriptRecorder(load_script(name), make_pictures=None).play()
    assert sum(len(one["detections"]) for one in said) == len(film.detections)
