"""A planner at the side of a batch shows what the analytic policy does, and leads as often as asked."""

import dataclasses

import numpy as np
import pytest
from sb3_contrib import MaskablePPO
from stable_baselines3.common.vec_env import DummyVecEnv

from farm_ar.agents.policies import AnalyticPolicy
from farm_ar.agents.training.demonstrated_env import DemonstratedEnv, lifted
from farm_ar.agents.training.object_policy import ObjectPolicy
from farm_ar.envs import FarmToTableEnv
from farm_ar.errors import OptionError
from farm_ar.scenes import builtin_scene

QUICK = {"play_seconds": 0.0, "animals_a_second": 0.0}


def made(count, seed=0, **arguments):
    """A batch that has begun, and what is seen in it."""
    envs = lifted("FarmToTable-v0", {**QUICK, **arguments}, count, seed, 1)
    return envs, envs.reset()


@pytest.mark.parametrize("action", ["slot", "displacement"])
@pytest.mark.parametrize(
    "arguments", [{}, {"visits": 2, "moves": 2}, {"budget": 0.8, "jitter": "hard"}], ids=str
)
def test_a_planner_shows_what_the_analytic_policy_does(action, arguments):
    """In single environments with the same seeds, move by move, also after moves that were not planned."""
    envs, _ = made(3, 5, action=action, **arguments)
    single = [FarmToTableEnv(action=action, carry="lift", **QUICK, **arguments) for _ in range(3)]
    for k, env in enumerate(single):
        env.reset(seed=5 + k)
    policy, rng, compared = AnalyticPolicy(beam=8), np.random.default_rng(0), 0
    for step in range(4):
        shown = envs.demonstrate(8)
        actions = np.array([policy.act(env) for env in single])
        for k in range(3):
            best = shown.actions[k][shown.worth[k] == 1.0]
            assert actions[k].tolist() in best.tolist(), (step, k)
            compared += 1
        if step == 1:
            actions[:, 1:] = rng.integers(0, 3, actions[:, 1:].shape)
        over = envs.step(actions)[2]
        for env, action_of_it, ended in zip(single, actions, over, strict=True):
            assert env.step(action_of_it)[2] == ended
        if over.any():
            break
    assert compared >= 6


def test_the_hand_lifts_and_poses_are_true_whatever_the_run_has():
    envs, seen = made(2, action="slot", oracle_noise="measured", perception="oracle", jitter="easy")
    config = envs.get_attr("config")[0]
    assert (config.carry, config.oracle_noise, config.jitter) == ("lift", "none", "easy")
    env = FarmToTableEnv(action="slot", oracle_noise="measured", jitter="easy", **QUICK)
    assert (envs.observation_space, envs.action_space) == (env.observation_space, env.action_space)
    assert np.array_equal(seen["position"][0], env.reset(seed=0)[0]["position"])


@pytest.mark.parametrize("action", ["slot", "displacement"])
def test_what_is_shown_twice_counts_once(action):
    envs, _ = made(64, action=action)
    shown = envs.demonstrate(8)
    several = 0
    for actions, worth in zip(shown.actions.tolist(), shown.worth, strict=True):
        counted = [tuple(action) for action, value in zip(actions, worth, strict=True) if value > 0]
        assert len(set(counted)) == len(counted)
        several += len(counted) > 1
    assert several > 32


def test_where_few_steps_are_possible_the_rest_is_to_leave():
    farm = builtin_scene("farm")
    kinds = farm.layout.category_code
    few = [i for i in range(len(kinds)) if farm.layout.fixed[i] or np.sum(kinds[:i] == kinds[i]) < 2]
    scene = dataclasses.replace(farm, layout=farm.layout.subset(few))
    envs, _ = made(16, action="slot", scene=scene)
    shown = envs.demonstrate(8)
    assert np.all(shown.actions < envs.action_space.nvec)
    padded = shown.actions[..., 0] == len(few) - 1
    assert padded.sum() >= 16
    assert np.all(shown.actions[padded][:, 1:] == 0)


def test_where_no_plan_is_worth_its_effort_it_leaves():
    envs, _ = made(2, action="slot", effort_weight=100.0)
    shown = envs.demonstrate(2)
    best = np.argmax(shown.worth, axis=1)
    assert shown.actions[[0, 1], best].tolist() == [[10, 0, 0]] * 2


@pytest.mark.parametrize("action", ["slot", "displacement"])
def test_the_planner_leads_as_often_as_it_is_asked(action):
    envs, _ = made(64, action=action)
    leave = np.zeros((64, len(envs.action_space.nvec)), dtype=np.int64)
    leave[:, 0] = 10
    # Who leaves after one move begins anew; the planner hardly ever does.
    for led, low, high in ((0.0, 64, 64), (0.5, 20, 44), (1.0, 0, 4)):
        envs.beam, envs.led = 2, led
        envs.seed(1)
        envs.reset()
        over = envs.step(leave)[2]
        assert low <= over.sum() <= high
    assert len(envs.shown) == 3
    assert np.all(leave[:, 0] == 10)


def test_without_a_planner_it_is_the_batch_and_a_learner_learns_in_it():
    envs, seen = made(4, action="slot")
    single = DummyVecEnv([lambda: FarmToTableEnv(action="slot", carry="lift", **QUICK)] * 4)
    single.seed(0)
    assert all(np.array_equal(seen[name], values) for name, values in single.reset().items())
    moves = np.tile([0, 1, 2], (4, 1))
    for ours, theirs in zip(envs.step(moves)[1:3], single.step(moves)[1:3], strict=True):
        assert np.array_equal(ours, theirs)
    assert envs.shown == []
    model = MaskablePPO(ObjectPolicy, envs, n_steps=8, batch_size=32, n_epochs=1, seed=0, device="cpu")
    model.learn(32)
    assert model.num_timesteps == 32
    assert len(model.ep_info_buffer) > 0


@pytest.mark.parametrize(
    ("env_id", "arguments", "message"),
    [
        ("FarmToTable-v0", {"reid": "likelihood"}, "reid: must be spatial or distance in a batch"),
        ("FarmToTable-v0", {"observation": "pixels"}, "observation: must be state or flat in a batch"),
        ("CartPole-v1", {}, "env: must be an id of farm-ar that has batches"),
    ],
)
def test_what_cannot_be_batched_is_named_with_what_leaves_it_out(env_id, arguments, message):
    with pytest.raises(OptionError, match=rf"{message} \(which --imitate 0 --lift 0 leave out\)"):
        lifted(env_id, arguments, 1, 0, 1)


def test_the_wrapper_is_what_learners_know_it_by():
    assert isinstance(made(1)[0], DemonstratedEnv)
