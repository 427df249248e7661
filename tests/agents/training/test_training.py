"""Training: what it leaves, and going on after a kill."""

import dataclasses
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import torch
import yaml
from sb3_contrib import MaskablePPO
from stable_baselines3.common.vec_env import DummyVecEnv

from farm_ar.agents.policies.trained import load_policy
from farm_ar.agents.training.checkpoints import pickles_in
from farm_ar.agents.training.demonstrated_env import DemonstratedEnv
from farm_ar.agents.training.recipes import ALGORITHMS
from farm_ar.agents.training.run_folder import LOCK, RunError, RunFolder, read_table
from farm_ar.agents.training.training import train
from farm_ar.envs.batched.sb3 import BatchedVecEnv
from farm_ar.errors import InputError, OptionError


def with_recipe(run, **values):
    return dataclasses.replace(run, recipe=dataclasses.replace(run.recipe, **values))


def weights(model):
    return torch.cat([values.detach().flatten() for values in model.policy.parameters()])


def test_a_run_leaves_all_that_is_needed_to_repeat_it(tiny, tmp_path):
    run = tiny()
    model = train(run, tmp_path / "run")
    folder = RunFolder(tmp_path / "run")
    assert [path.name for path in folder.kept("checkpoints")] == ["000000064", "000000096"]
    assert len(folder.kept("best")) == 1
    assert list((tmp_path / "run" / "tensorboard").iterdir())
    assert [row["steps"] for row in read_table(tmp_path / "run" / "training.csv")] == [32, 64, 96]
    assert [row["steps"] for row in read_table(tmp_path / "run" / "evaluations.csv")] == [64]
    described = json.loads((tmp_path / "run" / "run.json").read_text())
    assert {"commands", "seed", "algo", "env", "versions", "python", "farm-ar"} <= set(described)
    sections = yaml.safe_load((tmp_path / "run" / "hyperparameters.yml").read_text())
    assert sections["FarmToTable-v0"]["n_steps"] == 16
    again = train(folder.read(), tmp_path / "again")
    assert torch.equal(weights(model), weights(again))
    loaded = ALGORITHMS["maskable-ppo"].load(folder.newest("checkpoints") / "model.zip")
    assert torch.equal(weights(model), weights(loaded))


@pytest.mark.parametrize(("terminal", "shown"), [("1", "32/32"), ("", "32 of 32 steps, return ")])
def test_processes_and_what_is_shown_change_nothing(tiny, tmp_path, capsys, monkeypatch, terminal, shown):
    monkeypatch.delenv("TTY_COMPATIBLE", raising=False)
    monkeypatch.setenv("FORCE_COLOR", terminal)
    monkeypatch.setenv("TERM", "xterm")
    run = tiny(n_timesteps=32)
    alone = train(run, tmp_path / "alone")
    beside = train(dataclasses.replace(run, processes=True), tmp_path / "beside", progress=True)
    assert torch.equal(weights(alone), weights(beside))
    assert shown in capsys.readouterr().err


def test_steps_that_are_no_whole_rollouts_are_rounded_up_and_a_line_says_so(
    tiny, tmp_path, capsys, monkeypatch
):
    monkeypatch.setenv("FORCE_COLOR", "")
    assert train(tiny(n_timesteps=40), tmp_path, progress=True).num_timesteps == 64
    told = capsys.readouterr().err
    assert "Training for 64 steps\n40 steps are rounded up to 64, which are whole rollouts\n" in told
    assert "64 of 64 steps" in told
    assert train(tiny(), tmp_path, resume=True, steps=96, progress=True).num_timesteps == 96
    told = capsys.readouterr().err
    assert "rounded" not in told
    assert "96 of 96 steps" in told


def test_another_seed_learns_something_else(tiny, tmp_path):
    run = tiny(n_timesteps=32)
    first = train(run, tmp_path / "first")
    second = train(dataclasses.replace(run, seed=1), tmp_path / "second")
    assert not torch.equal(weights(first), weights(second))


def test_a_folder_with_a_run_is_not_written_over(tiny, tmp_path):
    run = tiny(n_timesteps=32)
    train(run, tmp_path)
    with pytest.raises(OptionError, match="run: must be a new folder, or go on with --resume"):
        train(run, tmp_path)
    assert train(run, tmp_path, resume=True).num_timesteps == 32


CHILD = """
import sys, torch
from pathlib import Path
from farm_ar.agents.training.run_folder import RunFolder
from farm_ar.agents.training.training import train
train(RunFolder(Path(sys.argv[1])).read(), Path(sys.argv[2]))
"""


def test_a_killed_run_goes_on_and_repeats_one_rollout_at_most(tiny, tmp_path):
    run = dataclasses.replace(tiny(n_timesteps=100_000), eval_every=10**9)
    RunFolder(tmp_path / "asked").describe(run)
    path = tmp_path / "run"
    command = [sys.executable, "-c", CHILD, str(tmp_path / "asked"), str(path)]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    until = time.monotonic() + 60
    while not RunFolder(path).kept("checkpoints") and time.monotonic() < until:
        time.sleep(0.02)
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    kept = int(RunFolder(path).newest("checkpoints").name)
    before = read_table(path / "training.csv")
    # The table is written before the checkpoint, so that it may be one rollout ahead; never more.
    assert kept <= before[-1]["steps"] <= kept + 32
    RunFolder(path).describe(
        dataclasses.replace(run, recipe=dataclasses.replace(run.recipe, n_timesteps=kept + 64))
    )
    model = train(run, path, resume=True)
    assert model.num_timesteps == kept + 64
    steps = [row["steps"] for row in read_table(path / "training.csv")]
    assert steps == [32 * k for k in range(1, kept // 32 + 3)]
    assert read_table(path / "training.csv")[: kept // 32] == before[: kept // 32]
    seconds = [row["seconds"] for row in read_table(path / "training.csv")]
    assert seconds == sorted(seconds)


def test_a_run_that_goes_on_sees_other_tables_than_those_it_began_with(tiny, tmp_path, monkeypatch):
    run, first = tiny(n_timesteps=32), []
    collect = MaskablePPO.collect_rollouts

    def watched(self, *rest, **named):
        first.append(self._last_obs["position"].copy())
        return collect(self, *rest, **named)

    monkeypatch.setattr(MaskablePPO, "collect_rollouts", watched)
    train(run, tmp_path)
    train(run, tmp_path, resume=True, steps=64)
    train(run, tmp_path, resume=True, steps=96)
    assert len({positions.tobytes() for positions in first}) == len(first) == 3


def test_the_best_model_is_the_best_of_what_a_run_remembers(tiny, tmp_path):
    run = dataclasses.replace(tiny(n_timesteps=64), eval_every=32)
    train(run, tmp_path)
    folder = RunFolder(tmp_path)
    # As after a kill: the evaluation at 64 steps has come, its checkpoint has not.
    shutil.rmtree(folder.newest("checkpoints"))
    folder.keep("best", 64, lambda at: (at / "model.zip").write_text("of a future that is no more"))
    train(run, tmp_path, resume=True)
    rows = read_table(tmp_path / "evaluations.csv")
    assert [row["steps"] for row in rows] == [32, 64]
    best = max(rows, key=lambda row: row["mean_return"])
    assert int(folder.newest("best").name) == best["steps"]
    assert ALGORITHMS["maskable-ppo"].load(folder.newest("best") / "model.zip")


def test_a_damaged_model_is_named_and_the_one_before_it_can_be_used(tiny, tmp_path):
    run = tiny(n_timesteps=64)
    train(run, tmp_path)
    folder = RunFolder(tmp_path)
    damaged = folder.newest("checkpoints")
    (damaged / "model.zip").write_bytes((damaged / "model.zip").read_bytes()[:1000])
    for use in (lambda: train(run, tmp_path, resume=True, steps=96), lambda: load_policy(tmp_path, "last")):
        with pytest.raises(RunError, match=f"{damaged.name}: model: must be as it was written"):
            use()
    shutil.rmtree(damaged)
    assert train(run, tmp_path, resume=True, steps=96).num_timesteps == 96


@pytest.mark.parametrize(
    ("algo", "values"),
    [
        ("sac", {"env_kwargs": {"action": "continuous", "animals_a_second": 0.0, "play_seconds": 0.0}}),
        ("ppo", {"normalize": {"norm_obs": True, "norm_reward": True}}),
    ],
)
def test_what_belongs_to_the_model_goes_on_with_it(tiny, tmp_path, algo, values):
    run = tiny(algo, n_timesteps=32, checkpoint_every=16, **values)
    train(run, tmp_path)
    model = train(run, tmp_path, resume=True, steps=64)
    assert model.num_timesteps == 64
    assert RunFolder(tmp_path).read() == with_recipe(run, n_timesteps=64)
    saved = RunFolder(tmp_path).newest("checkpoints")
    if algo == "sac":
        assert model.replay_buffer.size() * 2 == 64
        assert (saved / "replay_buffer.npz").exists()
    else:
        # Both halves of the training have been counted.
        assert model.get_vec_normalize_env().obs_rms["position"].count > 64
        assert (saved / "normalization.npz").exists()
        assert (RunFolder(tmp_path).newest("best") / "normalization.npz").exists()
    assert pickles_in(saved) == []


def test_after_the_batch_it_goes_on_in_the_environment_itself(tiny, tmp_path, monkeypatch):
    where = []
    learn = MaskablePPO.collect_rollouts

    def watched(self, env, *rest, **named):
        where.append((type(env), env.get_attr("config")[0].carry))
        return learn(self, env, *rest, **named)

    monkeypatch.setattr(MaskablePPO, "collect_rollouts", watched)
    run = tiny(n_timesteps=128, lift=64)
    model = train(run, tmp_path / "run")
    assert where == [(DemonstratedEnv, "lift")] * 2 + [(DummyVecEnv, "drag")] * 2
    assert model.num_timesteps == 128
    assert len(read_table(tmp_path / "run" / "training.csv")) == 4
    assert torch.equal(weights(model), weights(train(run, tmp_path / "again")))


def test_a_file_that_names_the_lifted_steps_as_before_is_read(tiny, tmp_path):
    run = tiny(n_timesteps=64, lift=32)
    folder = RunFolder(tmp_path)
    folder.describe(run)
    path = tmp_path / "hyperparameters.yml"
    path.write_text(path.read_text().replace("lift: 32", "rehearse: 32"))
    assert "rehearse" in path.read_text()
    assert folder.read() == run


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"normalize": {}}, "imitate, lift: must both be 0 with normalization"),
        ({"env": "FarmToTableHand-v0"}, "control: must be move or layout in a batch"),
        ({"env_kwargs": {"reid": "likelihood"}}, "reid: must be spatial or distance in a batch"),
    ],
)
def test_what_cannot_be_batched_is_seen_before(tiny, tmp_path, values, message):
    run = tiny(lift=64, **({"env_kwargs": {}} | values if "env" in values else values))
    run = dataclasses.replace(
        run, algo="ppo", recipe=dataclasses.replace(run.recipe, policy="MultiInputPolicy")
    )
    with pytest.raises(OptionError, match=message):
        train(run, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_mistakes_in_the_arguments_are_seen_before_anything_is_written(tiny, tmp_path):
    with pytest.raises(OptionError, match="env: must be one that can be made"):
        train(tiny(env="Farm-v0"), tmp_path / "run")
    with pytest.raises(OptionError, match="jitter"):
        train(tiny(env_kwargs={"jitter": "wild"}), tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("normalize", [None, {"norm_obs": True, "norm_reward": True}])
def test_what_can_be_batched_is_trained_in_a_batch_to_the_same_bits(tiny, tmp_path, monkeypatch, normalize):
    values = {"env_kwargs": {"carry": "lift", "play_seconds": 0.5}, "normalize": normalize}
    run = tiny("ppo", **values)
    made = []
    monkeypatch.setattr(BatchedVecEnv, "close", lambda self: made.append(self))
    batched = train(run, tmp_path / "batched")
    assert len(made) == 1
    monkeypatch.setattr("farm_ar.agents.training.training.can_be_batched", lambda *_: False)
    alone = train(run, tmp_path / "alone")
    assert len(made) == 1
    assert torch.equal(weights(batched), weights(alone))


ALGORITHMS_AND_VALUES = [
    ("maskable-ppo", {}),
    ("sac", {"env_kwargs": {"action": "continuous", "animals_a_second": 0.0, "play_seconds": 0.0}}),
    ("ppo", {"normalize": {"norm_obs": True, "norm_reward": True}}),
]


@pytest.mark.parametrize(("algo", "values"), ALGORITHMS_AND_VALUES)
def test_a_checkpoint_is_read_without_unpickling_anything(tiny, tmp_path, monkeypatch, algo, values):
    # 96 steps fill the memory of a learner that has one, and begin to write over it.
    run = tiny(algo, n_timesteps=96 if algo == "sac" else 32, checkpoint_every=16, **values)
    trained = train(run, tmp_path)

    def refuse(*_, **__):
        raise AssertionError("something was unpickled")

    for name in ("load", "loads", "Unpickler"):
        monkeypatch.setattr(f"pickle.{name}", refuse)
        monkeypatch.setattr(f"cloudpickle.{name}", refuse, raising=False)
    env = DummyVecEnv([lambda: gym.make(run.env, **run.recipe.env_kwargs)])
    observation = env.reset()
    player = load_policy(tmp_path, "last")
    expected = trained.predict(
        trained.get_vec_normalize_env().normalize_obs(observation) if algo == "ppo" else observation,
        deterministic=True,
    )[0]
    shown = player._normalization.normalize_obs(observation) if algo == "ppo" else observation
    assert np.array_equal(player.policy.predict(shown, deterministic=True)[0], expected)
    resumed = train(run, tmp_path, resume=True)
    assert torch.equal(weights(trained), weights(resumed))
    before, after = (model.policy.state_dict() for model in (trained, resumed))
    assert all(torch.equal(before[name], after[name]) for name in before)
    assert resumed._n_updates == trained._n_updates
    assert [dict(e, t=0) for e in resumed.ep_info_buffer] == [
        {"r": float(e["r"]), "l": e["l"], "t": 0} for e in trained.ep_info_buffer
    ]
    if algo == "sac":
        kept, before = resumed.replay_buffer, trained.replay_buffer
        assert (kept.full, kept.pos) == (before.full, before.pos) == (True, 16)
        assert np.array_equal(kept.rewards, before.rewards)
        assert resumed.log_ent_coef.item() == trained.log_ent_coef.item()


class Evil:
    """What a pickle may do when it is loaded."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


@pytest.mark.parametrize(("algo", "values"), ALGORITHMS_AND_VALUES[1:])
def test_a_pickle_of_an_older_folder_is_loaded_only_if_it_is_trusted(tiny, tmp_path, algo, values):
    run = tiny(algo, n_timesteps=32, checkpoint_every=16, **values)
    model = train(run, tmp_path / "run")
    saved = RunFolder(tmp_path / "run").newest("checkpoints")
    if algo == "sac":
        (saved / "replay_buffer.npz").unlink()
        model.save_replay_buffer(saved / "replay_buffer.pkl")
    else:
        (saved / "normalization.npz").unlink()
        model.get_vec_normalize_env().save(str(saved / "vecnormalize.pkl"))
    shutil.copytree(tmp_path / "run", tmp_path / "evil")
    with pytest.raises(RunError, match=r"must be trusted \(--trust\)"):
        train(run, tmp_path / "run", resume=True, steps=64)
    assert train(run, tmp_path / "run", resume=True, steps=64, trust=True).num_timesteps == 64
    (pickled,) = (tmp_path / "evil" / "checkpoints").glob("*/*.pkl")
    pickled.write_bytes(pickle.dumps(Evil(tmp_path / "touched")))
    with pytest.raises(RunError):
        train(run, tmp_path / "evil", resume=True, steps=64)
    assert not (tmp_path / "touched").exists()


LOCKED = """
import sys
from pathlib import Path
from farm_ar.agents.training.run_folder import RunFolder
with RunFolder(Path(sys.argv[1])).locked():
    print("mine", flush=True)
    sys.stdin.read()
"""


def test_two_processes_do_not_train_in_one_folder_and_a_kill_gives_it_free(tiny, tmp_path):
    run = tiny(n_timesteps=32)
    train(run, tmp_path)
    command = [sys.executable, "-c", LOCKED, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdout.readline() == b"mine\n"
        with pytest.raises(OptionError, match="must not be trained by another process at the same time"):
            train(run, tmp_path, resume=True, steps=64)
        os.kill(child.pid, signal.SIGKILL)
    assert train(run, tmp_path, resume=True, steps=64).num_timesteps == 64


def test_a_lock_that_cannot_be_used_is_named_and_is_nobody_elses_training(tmp_path):
    (tmp_path / "text").mkdir()
    (tmp_path / "text" / LOCK).write_text("not a database, but long enough to be read as one" * 50)
    (tmp_path / "folder" / LOCK).mkdir(parents=True)
    for name in ("text", "folder"):
        with (
            pytest.raises(OptionError, match="must be a lock that SQLite can hold"),
            RunFolder(tmp_path / name).locked(),
        ):
            pass


@pytest.mark.parametrize("name", ["model.zip", "state.json", "normalization.npz"])
@pytest.mark.parametrize("part", [0, 0.5, 0.98])
def test_a_truncated_checkpoint_is_named_in_one_line(tiny, tmp_path, name, part):
    run = tiny("ppo", n_timesteps=32, normalize={"norm_obs": True, "norm_reward": True})
    train(run, tmp_path)
    damaged = RunFolder(tmp_path).newest("checkpoints") / name
    content = damaged.read_bytes()
    damaged.write_bytes(content[: int(part * len(content))])
    with pytest.raises(RunError, match="model: must be as it was written") as problem:
        train(run, tmp_path, resume=True, steps=64)
    assert "\n" not in str(problem.value)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("run.json", "[]"), ("run.json", "{"), ("run.json", '{"algo": ["ppo"]}'), ("run.json", ""),
        ("run.json", '{"algo": "ppo", "env": 3, "seed": 0}'),
        ("hyperparameters.yml", ""), ("hyperparameters.yml", "a: [1"), ("hyperparameters.yml", "{}"),
        ("hyperparameters.yml", "FarmToTable-v0: {n_envs: many}"),
        ("hyperparameters.yml", "FarmToTable-v0: 3"),
        ("training.csv", "steps\n1,2,3\nx"), ("training.csv", "a,b\n1,2\n"),
        ("evaluations.csv", "steps,b\n32,\n"),
    ],
)  # fmt: skip
def test_a_damaged_run_folder_is_named_in_one_line(tiny, tmp_path, name, content):
    run = dataclasses.replace(tiny(n_timesteps=32), eval_every=32)
    train(run, tmp_path)
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError) as problem:
        train(run, tmp_path, resume=True, steps=96)
    assert "\n" not in str(problem.value)
