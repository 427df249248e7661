"""Trained players: those of a run, and those that come with farm-ar."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from farm_ar.agents import load_adversary
from farm_ar.agents.policies import RandomPolicy
from farm_ar.agents.policies.trained import (
    load_policy,
    load_weights,
    policy_and_env,
    save_weights,
    shipped,
)
from farm_ar.agents.training import evaluation
from farm_ar.agents.training.evaluation import Comparison, Played, best_found, compare, held_out, play
from farm_ar.agents.training.run_folder import RunError, RunFolder
from farm_ar.agents.training.training import train
from farm_ar.envs import FarmToTableEnv
from farm_ar.errors import OptionError


@pytest.mark.parametrize("name", shipped())
def test_an_adversary_that_comes_with_farm_ar_fools_the_rule_more_than_chance_does(name):
    player, env = policy_and_env(name)
    seeds = held_out(25)
    trained = play(env, player, seeds)
    by_chance = play(env, RandomPolicy(np.random.default_rng(0)), seeds)
    assert trained.returns.mean() > by_chance.returns.mean() + 0.5
    assert trained.wrong_labels.mean() > 1


def test_the_same_episodes_are_played_the_same():
    env = FarmToTableEnv(animals_a_second=0.0)
    first = play(env, load_adversary("farm-displacement"), held_out(3))
    again = play(env, load_adversary("farm-displacement"), held_out(3))
    assert first.returns.tolist() == again.returns.tolist()


def test_what_has_other_actions_or_is_not_there_is_refused():
    player = load_adversary("farm-displacement")
    slots = FarmToTableEnv(action="continuous")
    slots.reset(seed=0)
    with pytest.raises(OptionError, match="env: must have the actions"):
        player.act(slots)
    with pytest.raises(OptionError, match="adversary: must be one of"):
        load_adversary("farm-cleverest")


def test_weights_are_numbers_and_say_what_they_are(tiny, tmp_path):
    run = tiny(n_timesteps=32)
    train(run, tmp_path / "run")
    player = load_policy(tmp_path / "run", "last")
    about = {"env_kwargs": run.recipe.env_kwargs, "policy_kwargs": run.recipe.policy_kwargs}
    save_weights(player, tmp_path / "small.npz", about)
    again = load_weights(tmp_path / "small.npz")
    env = FarmToTableEnv(**run.recipe.env_kwargs)
    for seed in range(3):
        env.reset(seed=seed)
        assert again.act(env).tolist() == player.act(env).tolist()
    with np.load(tmp_path / "small.npz", allow_pickle=False) as file:
        assert all(file[name].dtype != object for name in file)


def test_normalized_observations_are_normalized_for_the_player_too(tiny, tmp_path):
    run = tiny("ppo", n_timesteps=32, normalize={"norm_obs": True, "norm_reward": True})
    train(run, tmp_path)
    player, env = policy_and_env(str(tmp_path), "last")
    env.reset(seed=0)
    shown = env.observe()
    policy = player.policy
    action, _ = policy.predict(player._normalization.normalize_obs(shown), deterministic=True)
    assert player.act(env).tolist() == action.tolist()
    assert not np.allclose(player._normalization.normalize_obs(shown)["budget"], shown["budget"])


def played(*returns):
    values = np.array(returns, dtype=np.float64)
    return Played(values, values, values)


def test_the_best_found_is_the_best_of_each_episode():
    assert best_found([played(1, 5), played(2, 3)]).tolist() == [2, 5]


def test_a_comparison_scores_each_group_between_chance_and_the_best():
    groups = {"trained": [played(1, 3), played(3, 5)], "random": [played(0, 0)]}
    found = Comparison(groups, np.array([4.0, 4.0]))
    assert found.scores()["trained"].value == pytest.approx(0.75)
    assert found.scores()["random"].value == 0
    (trained, _) = found.rows()
    assert (trained["return"], trained["runs"]) == (3.0, 2)


def test_several_runs_are_compared_as_one(tiny, tmp_path, monkeypatch):
    run = tiny(n_timesteps=32)
    train(run, tmp_path / "run")
    monkeypatch.setattr(evaluation, "TRIES", 2)
    found = compare([str(tmp_path / "run")] * 2, ["analytic", "constant"], 3, "last")
    assert len(found.played["trained"]) == 2
    assert list(found.played) == ["trained", "analytic", "constant", "random"]
    with pytest.raises(OptionError, match="beside: must be one of"):
        compare([str(tmp_path / "run")], ["clever"], 3)


def test_runs_of_other_environments_are_not_compared_as_one():
    with pytest.raises(OptionError, match="same arguments as farm-slot, not another action"):
        compare(["farm-slot", "farm-displacement"], [], 2)


def test_a_player_who_cannot_play_there_is_named():
    with pytest.raises(OptionError, match=r"beside: must be policies that can act here \(sign: "):
        compare(["farm-slot"], ["analytic"], 2, arguments={"sign": -1})


@pytest.fixture
def of_a_module(tiny, tmp_path, monkeypatch):
    """The folder of a run whose environment is that of a module, which leaves a file where it is imported."""
    RunFolder(tmp_path / "run").describe(replace(tiny(), env="somebodys_module:Theirs-v0"))
    (tmp_path / "run" / "best" / "000000001").mkdir(parents=True)
    (tmp_path / "somebodys_module.py").write_text("open('imported', 'w').close()\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path / "run"


@pytest.mark.parametrize("use", ["load", "compare", "resume"])
def test_the_module_that_a_run_names_is_imported_only_if_it_is_trusted(of_a_module, use):
    def made(trust):
        if use == "load":
            load_policy(of_a_module, trust=trust)
        elif use == "compare":
            compare([str(of_a_module)], [], 2, trust=trust)
        else:
            train(RunFolder(of_a_module).read(), of_a_module, resume=True, trust=trust)

    imported = of_a_module.with_name("imported")
    with pytest.raises(RunError, match=r"env: must be trusted \(--trust\)"):
        made(trust=False)
    assert not imported.exists()
    with pytest.raises(OptionError, match="env: must be one that can be made"):  # it registers nothing
        made(trust=True)
    assert imported.exists()
    sys.modules.pop("somebodys_module")


def test_a_run_of_an_environment_that_is_not_there_is_refused(of_a_module):
    RunFolder(of_a_module).describe(replace(RunFolder(of_a_module).read(), env="Nowhere-v0"))
    with pytest.raises(OptionError, match="env: must be one that can be made"):
        load_policy(of_a_module)


def test_of_the_usual_policies_only_those_that_can_act_stand_beside():
    assert list(compare(["farm-slot"], None, 2, arguments={"sign": -1}).played) == [
        "trained",
        "greedy",
        "random",
    ]
    assert list(compare(["farm-slot"], None, 2).played) == ["trained", "analytic", "greedy", "random"]
