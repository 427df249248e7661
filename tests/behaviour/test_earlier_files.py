"""Files that the first version made (those in `earlier/`) still open, replay and resume."""

import importlib
import json
import pickle
import shutil
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from farm_ar.agents.stress.study import describe_case
from farm_ar.cli import app
from farm_ar.envs import FarmToTableEnv, first_difference, load_trace, replay
from farm_ar.envs.trace import GAME_STATE, PLAIN_STATE
from farm_ar.moved import MOVED
from farm_ar.reid.answers import Assurance, Identification
from farm_ar.scenes import builtin_scene, load_scene, load_snapshot, snapshot_to_dict
from farm_ar.sweeps import Store, Sweep, grid, run_sweep

EARLIER = Path(__file__).with_name("earlier")
TRACES = sorted(EARLIER.glob("trace-*.json"))


def farm_ar(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments], prog_name="farm-ar")


@pytest.mark.parametrize("path", TRACES, ids=lambda path: path.stem)
def test_a_trace_replays_to_the_hash_of_every_step(path):
    trace = load_trace(path)
    assert first_difference(trace) is None
    assert replay(trace) == trace["hash"]


def test_there_are_traces_of_each_id():
    arguments = [load_trace(path)["arguments"] for path in TRACES]
    assert {(a["control"], a["game"]) for a in arguments} == {
        *(("move", True), ("hand", True), ("layout", True), ("layout", False))
    }


@pytest.mark.parametrize("path", [TRACES[0], TRACES[-1]], ids=lambda path: path.stem)
def test_every_value_of_the_declared_order_counts_and_so_does_the_generator(path):
    trace = load_trace(path)
    env = FarmToTableEnv(**trace["arguments"])
    assert replay(trace, env) == trace["hash"]
    state = env.world.state()
    assert set(state) == set(GAME_STATE if trace["arguments"]["game"] else PLAIN_STATE)
    hashes = {trace["hash"]}
    for name in state:
        values = np.array(state[name], dtype=np.float64).reshape(-1)
        if values.size:
            values[0] = values[0] + 1.0 if np.isfinite(values[0]) else 0.0
        changed = {**state, name: values if values.size else np.ones(1)}
        env.world.state = lambda changed=changed: changed
        hashes.add(env.state_hash())
    assert len(hashes) == 1 + len(state)
    del env.world.state
    assert env.state_hash() == trace["hash"]
    env.np_random.random()
    assert env.state_hash() != trace["hash"]


@pytest.mark.parametrize("scene", ["lab", "cafeteria"])
def test_a_scene_file_is_the_scene(scene):
    read, built = load_scene(EARLIER / f"scene-{scene}.json"), builtin_scene(scene)
    assert read.layout.labels == built.layout.labels
    np.testing.assert_allclose(read.layout.position, built.layout.position, atol=1e-12)


def test_a_snapshot_file_is_written_as_it_was_read():
    path = EARLIER / "snapshot-lab.json"
    assert snapshot_to_dict(load_snapshot(path)) == json.loads(path.read_text())


def test_a_saved_script_plays_as_it_did():
    result = farm_ar("play-script", EARLIER / "script.toml", "--json")
    assert json.loads(result.stdout) == json.loads((EARLIER / "script.json").read_text())


def test_failures_of_a_stress_test_replay_bit_for_bit():
    failures = json.loads((EARLIER / "stress.json").read_text())["failures"]
    assert {failure["reid"] for failure in failures} == {"spatial", "likelihood", "nearest"}
    for number in range(len(failures)):
        assert farm_ar("stress-replay", EARLIER / "stress.json", number).exit_code == 0


def test_a_run_folder_plays_and_goes_on(tmp_path):
    pytest.importorskip("sb3_contrib")
    from farm_ar.agents.policies.trained import policy_and_env

    run = tmp_path / "run"
    shutil.copytree(EARLIER / "run", run)
    for which in ("best", "last"):
        player, env = policy_and_env(str(run), which)
        env.reset(seed=0)
        assert env.action_space.contains(player.act(env))
    result = farm_ar("train", run, "--resume", "--steps", "24", "--no-progress")
    assert result.exit_code == 0, result.output
    assert (run / "checkpoints" / "000000024").is_dir()
    before = (EARLIER / "run" / "training.csv").read_text()
    assert (run / "training.csv").read_text().startswith(before)


def test_a_store_whose_version_is_by_hand_computes_nothing_again(tmp_path):
    store = shutil.copy(EARLIER / "by-hand.sqlite", tmp_path)
    calls = grid(scene=["farm"], jitter=["easy"], case=range(3), reid=["spatial"], draws=[5])
    seen = []
    results = run_sweep(Sweep("kept", describe_case, calls, [0], version="1"), store, watch=seen.append)
    assert (seen[0].before, seen[-1].done, len(results)) == (2, 1, 3)


def test_a_store_of_another_version_of_the_code_keeps_its_results_and_computes_anew(tmp_path):
    store = shutil.copy(EARLIER / "stress.sqlite", tmp_path)
    with Store(store) as opened:
        before = {name: opened.results(name).rows() for name in opened.sweeps()}
    assert set(before) == {"stress-cases-farm", "stress-attacks-farm"}
    calls = [dict(unit.parameters) for unit in _units(store, "stress-cases-farm")]
    seen = []
    again = run_sweep(Sweep("stress-cases-farm", describe_case, calls, [0]), store, watch=seen.append)
    assert (seen[0].before, seen[-1].done) == (0, 3)
    assert len(again.rows()) == len(before["stress-cases-farm"]) == 3
    with sqlite3.connect(store) as file:
        assert file.execute("SELECT count(*) FROM results").fetchone() == (9,)
    file.close()


def _units(store, name):
    with Store(store) as opened:
        return opened.results(name).units


def test_what_was_pickled_is_what_it_was():
    kept = pickle.loads((EARLIER / "some.pickle").read_bytes())
    assert kept["env"].state_hash() == kept["hash"]
    assert kept["identification"].labels == kept["labels"]
    assert len(kept["snapshot"].detections) == len(kept["labels"])
    assert kept["scene"].name == "lab"


@pytest.mark.parametrize("former", MOVED)
def test_a_former_module_is_the_one_of_today(former):
    today = importlib.import_module(MOVED[former])
    spec = today.__spec__
    assert importlib.import_module(former) is today
    assert today.__spec__ is spec
    assert spec.name == MOVED[former]


def test_nothing_of_farm_ar_uses_a_former_name():
    home = Path(__file__).parents[2]
    files = [*home.glob("farm_ar/**/*.py"), *home.glob("tests/**/*.py"), *home.glob("docs/*.md")]
    texts = {file: file.read_text(encoding="utf-8") for file in files if file.name != "moved.py"}
    assert [(str(file), former) for file, text in texts.items() for former in MOVED if former in text] == []


def test_answers_pickled_before_they_had_a_module_of_their_own_open():
    answer = Identification(("a",), assurance=Assurance(confidence=np.array([0.5])))
    today = pickle.dumps(answer, protocol=2)  # which has modules as plain lines
    before = today.replace(b"cfarm_ar.reid.answers\n", b"cfarm_ar.reid.base\n")
    assert before.count(b"cfarm_ar.reid.base\n") == 2
    assert pickle.loads(before).confidence == [0.5]
