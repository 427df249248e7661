"""Fixed reference returns of each id, the thresholds made of them, and seeds to train and to test with."""

import json
import runpy
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from farm_ar.agents.policies import GreedyPolicy, play_episode
from farm_ar.envs.references import TEST_SEEDS, TRAINING_SEEDS, best_known, reference_returns
from farm_ar.errors import OptionError

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "reference_returns.py"
LEARNING = SCRIPT.with_name("plain_ppo.py")
IDS = [name for name, spec in gym.registry.items() if spec.entry_point == "farm_ar.envs:make_farm_to_table"]


@pytest.mark.parametrize("name", IDS)
def test_every_id_has_returns_of_a_random_policy_and_a_threshold_on_the_way_to_the_best_known(name):
    returns = reference_returns(f"farm_ar:{name}")
    best = best_known(name)
    assert best.mean == max(one.mean for one in returns.values())
    threshold = gym.spec(name).reward_threshold
    if "Shaped" in name or best.mean - returns["random"].mean <= 0.1:
        assert threshold is None
    else:
        wanted = 0.2 * returns["random"].mean + 0.8 * best.mean
        assert threshold == pytest.approx(wanted, abs=0.006)


def test_what_shows_less_or_pays_otherwise_is_compared_with_the_id_itself():
    assert reference_returns("SceneLayoutBlackBox-v0") == reference_returns("SceneLayout-v0")
    assert reference_returns("FarmToTableShaped-v0") == reference_returns("FarmToTable-v0")
    with pytest.raises(OptionError, match="env_id"):
        reference_returns("CartPole-v1")


def test_no_seed_is_for_training_and_for_tests():
    assert not set(TRAINING_SEEDS[::1000]) & set(TEST_SEEDS[::1000])
    assert max(TRAINING_SEEDS) < min(TEST_SEEDS)


def test_the_script_writes_means_over_the_first_test_seeds(tmp_path, monkeypatch, capsys):
    name, path = "SceneLayoutDiscrete-v0", tmp_path / "returns.json"
    monkeypatch.setattr("sys.argv", [str(SCRIPT), "--ids", name, "--episodes", "4", "--out", str(path)])
    runpy.run_path(str(SCRIPT), run_name="__main__")
    found = json.loads(path.read_text(encoding="utf-8"))["ids"][name]["returns"]
    policy, env = GreedyPolicy(np.random.default_rng(0)), gym.make(name)
    returns = [play_episode(env, policy, seed).total for seed in range(10_000_000, 10_000_004)]
    assert found["greedy"]["mean"] == pytest.approx(np.mean(returns), abs=6e-4)
    assert found["greedy"]["standard_error"] == pytest.approx(np.std(returns, ddof=1) / 2, abs=6e-4)
    assert found["exhaustive"]["mean"] >= max(found[one]["mean"] for one in ("greedy", "analytic", "random"))


def test_what_plain_ppo_learns_is_among_the_reference_returns(tmp_path, monkeypatch, capsys):
    stable_baselines3 = pytest.importorskip("stable_baselines3", reason="pip install '.[train]'")
    name, models, path = "SceneLayout-v0", tmp_path / "models", tmp_path / "returns.json"
    asked = ["--steps", "2500", "--seeds", "1", "--evaluations", "1", "--episodes", "2"]
    learning = [str(LEARNING), "--ids", name, *asked, "--out", str(models)]
    monkeypatch.setattr("sys.argv", learning)
    runpy.run_path(str(LEARNING), run_name="__main__")
    assert f"{name} seed 0: 4096 steps" in capsys.readouterr().out
    arguments = ["--ids", name, "--episodes", "4", "--out", str(path)]
    for models_given in (["--models", str(models)], ["--policies", "random"]):  # then it stays in the file
        monkeypatch.setattr("sys.argv", [str(SCRIPT), *arguments, *models_given])
        runpy.run_path(str(SCRIPT), run_name="__main__")
        found = json.loads(path.read_text(encoding="utf-8"))["ids"][name]["returns"]
        model = stable_baselines3.PPO.load(models / name / "seed-0" / "model.zip", device="cpu")
        env, returns = gym.make(name), []
        for seed in range(10_000_000, 10_000_004):
            observation, _ = env.reset(seed=seed)
            returns.append(env.step(model.predict(observation, deterministic=True)[0])[1])
        assert found["ppo"]["mean"] == pytest.approx(np.mean(returns), abs=6e-4)
