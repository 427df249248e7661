"""The game on a page without a server, against the game itself: the same pointers, the same outcome."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from farm_ar.geometry import wrap
from farm_ar.web.export import start_of
from farm_ar.web.game import Game
from farm_ar.web.pointer import STEPS_PER_SECOND, Pointer

RUNNER = Path(__file__).parent / "play_engine.mjs"

SEEDS = range(12) if settings().max_examples > 50 else range(3)


@pytest.fixture
def played(tmp_path: Path) -> Any:
    if shutil.which("node") is None:
        (pytest.fail if os.environ.get("FARM_AR_CLIENTS") == "all" else pytest.skip)("node is not installed")

    def play(seed: int, pointers: list[Pointer], mode: str = "free", among: int = 1) -> dict[str, Any]:
        starts = [start_of(seed)] if among == 1 else [start_of(k) for k in range(among)]
        told = [{"x": one.x, "z": one.z, "grip": one.grip, "turn": one.turn} for one in pointers]
        file = tmp_path / "pointers.json"
        file.write_text(
            json.dumps({"starts": starts, "seed": 0 if among == 1 else seed, "mode": mode, "pointers": told})
        )
        done = subprocess.run(["node", RUNNER, file], capture_output=True, text=True, check=True)
        outcome: dict[str, Any] = json.loads(done.stdout)
        return outcome

    return play


@pytest.mark.parametrize("seed", SEEDS)
def test_the_same_pointers_have_the_same_outcome_as_in_the_game_itself(played: Any, seed: int) -> None:
    draw, game, pointers = np.random.default_rng(seed), Game(seed), []
    pointer = Pointer()
    for _ in range(900):
        if draw.random() < 0.12:
            at = draw.uniform((-0.2, -0.3), (1.4, 1.0))
            if draw.random() < 0.7:
                at = game.world.truth.position[draw.integers(len(game.world.truth))]
            away = draw.random() < 0.3
            x, z = (None, None) if away else at.tolist()
            pointer = Pointer(x, z, bool(draw.random() < 0.6), float(draw.normal(0, 1)))
        pointers.append(pointer)
        game.pointer = pointer
    mine = played(seed, pointers)
    late = 0
    for pointer, step in zip(pointers, mine["steps"], strict=True):
        game.pointer = pointer
        game.step()
        position, yaw = game.world.tabletop.poses()
        hand = game.world.tabletop.hand
        np.testing.assert_allclose(np.array(step["objects"])[:, :2], position, atol=1e-6)
        assert abs(wrap(np.array(step["objects"])[:, 2] - yaw)).max() < 1e-6
        np.testing.assert_allclose(step["hand"][:2], hand.position, atol=1e-6)
        assert step["held"] == hand.gripped
        late += (
            step["phase"] != game.world.phase.text
        )  # it looks for points of the arm, the game for all of it
    assert late <= 9
    snapshots = [one for one in mine["told"] if one["kind"] == "snapshot"]
    news = [one for one in iter(game.news, None) if one["kind"] == "snapshot"]
    assert len(snapshots) == len(news) >= 2
    assert any(one["visit_cm"] > 5 for one in news)
    for theirs, ours in zip(snapshots, news, strict=True):
        assert [one["label"] for one in theirs["detections"]] == [one["label"] for one in ours["detections"]]
        assert theirs["visit_cm"] == pytest.approx(ours["visit_cm"], abs=0.011)
    truth = game.truth()
    assert mine["truth"] == truth
    believed = game.world.believed
    np.testing.assert_allclose(np.array(mine["believed"])[:, :2], believed.position, atol=1e-6)
    assert mine["last"]["effort_cm"] == pytest.approx(game.state()["effort_cm"], abs=0.1)
    assert mine["last"]["par_cm"] is None  # the page cannot prove any after a snapshot


def test_it_shows_first_how_the_headset_is_fooled(played: Any) -> None:
    shown = played(1, [Pointer()] * 8 * STEPS_PER_SECOND, "show")
    kinds = [(one["kind"], one.get("round", one).get("stage")) for one in shown["told"]]
    assert kinds == [("hello", "showing"), ("snapshot", None), ("round", "fooled")]
    names = [one["label"] for one in shown["told"][0]["objects"]]
    assert {names[i] for i in shown["truth"]["wrong"]} == set(shown["told"][0]["round"]["pair"])
    taken = played(1, [*[Pointer()] * 20, Pointer(0.6, 0.3, grip=True), *[Pointer()] * 20], "show")
    assert taken["told"][-1] == {"kind": "round", "mode": "free", "stage": "free"}
    assert taken["last"]["visit_cm"] == 0
    assert taken["last"]["par_cm"] == start_of(1)["state"]["par_cm"] is not None


@pytest.mark.parametrize(("seed", "start"), [(1, 1), (2, 0), (-1, 1), (-2, 0)])
def test_every_whole_seed_has_a_start(played: Any, seed: int, start: int) -> None:
    told = played(seed, [Pointer()], among=2)["told"][0]
    assert told["seed"] == start_of(start)["hello"]["seed"] == start
