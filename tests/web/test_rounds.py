"""Modes of the page: guessing before the headset, the same table the other way round, tidying up."""

import sys
import time
from pathlib import Path

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv, first_difference
from farm_ar.errors import OptionError
from farm_ar.web import adversary, rounds
from farm_ar.web.adversary import PLANNED, TRAINED, adversary_plan
from farm_ar.web.game import Game
from farm_ar.web.pointer import STEPS_PER_SECOND, Pointer

OFFICE = str(Path(__file__).parents[2] / "examples" / "data" / "before.json")


def until(game: Game, stage: str, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while game.round.stage != stage:
        assert time.monotonic() < end, game.round.stage
        game.step()
        time.sleep(1e-3)


def wait(game: Game, seconds: float) -> None:
    for _ in range(round(seconds * STEPS_PER_SECOND)):
        game.step()


def carry(game: Game, label: str, x: float, z: float, turn: float = 0.0) -> None:
    start = game.world.truth.position[game.world.truth.index(label)]
    for pointer, seconds in (
        (Pointer(*start), 1.5),
        (Pointer(*start, grip=True), 0.1),
        (Pointer(x, z, grip=True, turn=turn), 1.5),
        (Pointer(x, z, turn=turn), 0.1),
    ):
        game.pointer = pointer
        wait(game, seconds)


def news(game: Game) -> list[dict]:
    return list(iter(game.news, None))


@pytest.fixture(scope="module")
def rearranged() -> Game:
    game = Game(seed=3, mode="duel")
    wait(game, 0.5)
    game.obey({"do": "rearrange"})
    until(game, "guess")
    return game


def test_the_adversary_does_what_it_has_planned_and_the_headset_waits_for_the_guess(rearranged) -> None:
    before = Game(seed=3).world
    plan = adversary_plan(before.truth, before.camera, "spatial", 3)
    truth = rearranged.world.truth
    last = {one.thing: one for one in plan.carries}
    for i in range(len(truth)):
        x, z, yaw = (
            last[i][1:] if i in last else (*before.truth.position[i].tolist(), float(before.truth.yaw[i]))
        )
        np.testing.assert_allclose(truth.position[i], [x, z], atol=3e-3)
        assert abs(np.sin((truth.yaw[i] - yaw) / 2)) < 6e-3
    assert len(last) >= 2
    wait(rearranged, 3.0)
    assert rearranged.round.stage == "guess"
    assert rearranged.world.sightings == []
    told = rearranged.round.told()
    assert told["by"] == plan.by
    x, z = (truth.position[rearranged.handles.object_of[told["in_view"]]] - before.camera.position).T
    assert (np.diff(x / z) > 0).all()  # from left to right


@pytest.mark.parametrize(
    "labels",
    [None, [], {}, {"99": "red-coop"}, {"1": "no-coop"}, {"1": 3}, {"1": ["red-coop"]}, {"10": "shed"}],
)
def test_a_guess_that_is_none_is_refused(rearranged, labels) -> None:
    with pytest.raises(OptionError, match="labels"):
        rearranged.obey({"do": "guess", "labels": labels})
    assert rearranged.round.stage == "guess"


@pytest.mark.parametrize("asked", ["turn", "rearrange", "dance", 3, None])
def test_what_is_not_its_turn_is_refused(rearranged, asked) -> None:
    with pytest.raises(OptionError, match="stage guess"):
        rearranged.obey({"do": asked})


def test_guess_and_answers_are_scored_and_then_the_same_table_is_the_players() -> None:
    game = Game(seed=3, mode="duel")
    stood = game.world.truth
    game.obey({"do": "rearrange"})
    until(game, "guess")
    names = stood.labels
    numbers = game.round.told()["in_view"]
    seen = game.handles.object_of[numbers].tolist()
    poses = np.column_stack([game.world.truth.position, game.world.truth.yaw]).round(4).tolist()
    assert [game.state()["objects"][n] for n in numbers] == [poses[i] for i in seen]
    wrong = {seen[0]: names[seen[1]]}
    guess = {
        str(n): wrong.get(i, names[i]) for n, i in zip(numbers[:-1], seen, strict=False)
    }  # one not named
    game.obey({"do": "guess", "labels": guess})
    until(game, "answered")
    told = game.round.told()
    assert told["of"] == len(seen)
    assert told["yours"] == len(seen) - 2
    sighting = game.world.sightings[-1]
    answers = dict(zip(sighting.source.tolist(), sighting.identification.labels, strict=True))
    assert told["its"] == sum(answers[i] == names[i] for i in seen)
    assert told["adversary"]["wrong"] == game.world.tracker.belief.wrong_labels
    assert told["adversary"]["cm"] == pytest.approx(game.way_cm(stood), abs=0.01)
    assert first_difference(game.trace()) is None
    game.obey({"do": "turn"})
    np.testing.assert_array_equal(game.world.truth.position, stood.position)
    assert game.world.sightings == []
    carry(game, names[1], 0.6, 0.15)
    game.pointer = Pointer()
    until(game, "scored")
    assert game.round.told()["player"] == {
        "wrong": game.world.tracker.belief.wrong_labels,
        "cm": pytest.approx(game.way_cm(stood), abs=0.01),
    }
    assert [one["stage"] for one in news(game) if one["kind"] == "round"] == ["turn", "scored"]


def test_pages_are_told_every_stage_once_and_those_who_come_later_the_last() -> None:
    game = Game(seed=5, mode="guess")
    assert game.hello()["round"]["stage"] == "study"
    game.obey({"do": "rearrange"})
    until(game, "guess")
    number = game.round.told()["in_view"][0]
    true = game.world.truth.labels[game.handles.object_of[number]]
    game.obey({"do": "guess", "labels": {str(number): "shed" if true != "shed" else "red-coop"}})
    assert (game.round.stage, game.round.secret) == ("leaving", True)
    until(game, "answered")
    assert not game.round.secret
    stages = [one.get("stage", one["kind"]) for one in news(game)]
    assert stages == ["moving", "guess", "leaving", "snapshot", "answered"]
    assert game.hello()["round"] == game.round.told()
    assert game.round.told()["yours"] == 0
    with pytest.raises(OptionError, match="stage answered"):
        game.obey({"do": "turn"})


def test_where_things_are_is_not_told_while_they_are_rearranged_unseen() -> None:
    game = Game(seed=3, mode="guess")
    stood = [pose[:2] for pose in game.state()["objects"]]
    before = game.handles.object_of.copy()
    game.obey({"do": "rearrange"})
    end = time.monotonic() + 60.0
    while game.round.stage == "moving":
        assert game.round.secret
        told = game.state()
        assert ([pose[:2] for pose in told["objects"]], told["hand"]) == (stood, None)
        assert time.monotonic() < end
        game.step()
        time.sleep(1e-3)
    assert sorted(pose[:2] for pose in game.state()["objects"]) != sorted(stood)
    assert (game.handles.object_of != before).any()
    assert game.truth() == {"kind": "truth", "number": 0, "labels": [], "wrong": [], "fresh": True}


def test_an_adversary_that_cannot_plan_says_so_and_may_try_again(monkeypatch) -> None:
    def fails(*arguments):
        raise ValueError("no plan")

    monkeypatch.setattr(rounds, "adversary_plan", fails)
    game = Game(seed=3, mode="guess")
    monkeypatch.undo()
    game.obey({"do": "rearrange"})
    wait(game, 0.2)
    until(game, "study")
    said = news(game)
    assert [one.get("stage") for one in said] == ["moving", "study", None]
    assert "ValueError: no plan" in said[-1]["reason"]
    game.obey({"do": "rearrange"})
    until(game, "guess")


def test_without_the_packages_of_training_a_policy_that_plans_takes_its_place(monkeypatch) -> None:
    world = Game(seed=1).world
    assert adversary_plan(world.truth, world.camera, "spatial", 1).by == TRAINED
    monkeypatch.setitem(sys.modules, "farm_ar.agents.policies.trained", None)
    plan = adversary_plan(world.truth, world.camera, "spatial", 1)
    assert plan.by == PLANNED
    truth = world.truth
    metres = sum(
        np.hypot(one.x - truth.position[one.thing][0], one.z - truth.position[one.thing][1])
        for one in plan.carries
    )
    assert 0 < metres <= FarmToTableEnv().config.budget_m + 1e-6


def test_tidying_counts_how_far_things_are_from_where_they_were() -> None:
    game = Game(seed=4, mode="tidy")
    home = game.world.truth
    until(game, "tidy")
    truth = game.world.truth
    turn = np.abs(np.sin((truth.yaw - home.yaw) / 2)) * np.hypot(1.2, 0.8)
    each = 100 * (np.linalg.norm(truth.position - home.position, axis=1) + turn)
    start = game.round.told()["start_cm"]
    assert start == pytest.approx(each.sum(), abs=0.06)
    assert game.state()["left_cm"] == start
    wait(game, 3.0)
    assert game.world.sightings == []  # it waits for the player
    k = int(np.argmax(each))
    carry(game, home.labels[k], *home.position[k].tolist(), turn=float(home.yaw[k] - truth.yaw[k]))
    game.pointer = Pointer()
    until(game, "tidied")
    told = game.round.told()
    assert told["left_cm"] < start - 0.8 * each[k]
    assert told["cm"] == pytest.approx(each[k], abs=1.5)
    seen = [one for one in news(game) if one["kind"] == "snapshot"][-1]["detections"]
    shed = home.labels[int(np.flatnonzero(home.fixed)[0])]
    answers = zip((one["label"] for one in seen), game.truth()["labels"], strict=True)
    right = [given == true for given, true in answers if true != shed]
    assert (told["right"], told["of"]) == (sum(right), len(right))
    assert 5.0 < told["seconds"] < 10.0
    assert first_difference(game.trace()) is None


def test_in_another_scene_a_policy_that_plans_takes_the_trained_ones_place() -> None:
    game = Game(seed=1, mode="guess", scene=OFFICE)
    stood = game.world.truth
    game.obey({"do": "rearrange"})
    until(game, "guess")
    assert game.round.told()["by"] == PLANNED
    assert game.way_cm(stood) > 0


def test_a_mode_that_is_not_known_is_refused() -> None:
    with pytest.raises(OptionError, match="mode"):
        Game(mode="magic")


@pytest.mark.parametrize("level", [0, 6])
def test_what_an_adversary_turns_on_the_spot_is_turned_by_its_hand(monkeypatch, level) -> None:
    class Turns:
        def act(self, env):
            return np.array([0, 3, 3, level])

    def fake(scene, arguments, seed):
        return "turns", Turns(), FarmToTableEnv(scene=scene, **arguments | {"moves": 1})

    monkeypatch.setattr(adversary, "_adversary", fake)
    before = Game(seed=3).world
    plan = adversary_plan(before.truth, before.camera, "spatial", 3)
    (carry,) = plan.carries
    assert (carry.x, carry.z) == tuple(before.truth.position[carry.thing])
    assert np.sign(carry.yaw - before.truth.yaw[carry.thing]) == (1 if level else -1)
