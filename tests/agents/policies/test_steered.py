"""A hand that is steered by a plan."""

import gymnasium as gym
import numpy as np
import pytest

from farm_ar.agents.policies import RandomPolicy, play_episodes
from farm_ar.agents.policies.steered import SteeredPolicy
from farm_ar.errors import OptionError

QUICK = {"play_seconds": 0.0, "animals_a_second": 0.0}


def test_a_plan_is_carried_out_by_a_steered_hand():
    env = gym.make("FarmToTableHandLift-v0", **QUICK)
    planned = play_episodes(env, SteeredPolicy(), range(8))
    random = play_episodes(env, RandomPolicy(np.random.default_rng(0)), range(8))
    assert np.mean([one.total for one in planned]) > 1
    assert np.mean([one.total for one in planned]) > np.mean([one.total for one in random]) + 1
    assert all(one.steps < 120 for one in planned)  # it goes when nothing is left to do


def test_a_plan_is_carried_out_with_a_few_choices_too():
    env = gym.make("FarmToTableHandLiftDiscrete-v0", **QUICK)
    planned = play_episodes(env, SteeredPolicy(), range(8))
    assert np.mean([one.total for one in planned]) > 0.5


def test_two_visits_are_planned_each_for_itself():
    env = gym.make("FarmToTableHandLift-v0", visits=2, **QUICK)
    env.reset(seed=1)
    policy, over, moved = SteeredPolicy(), False, [0.0]
    while not over:
        action = policy.act(env.unwrapped)
        assert env.action_space.contains(action)
        before = env.unwrapped._visits_left
        *_, over, _, info = env.step(action)
        moved[-1] += info["effort"]
        if env.unwrapped._visits_left < before and not over:
            moved.append(0.0)
    assert len(moved) == 2
    assert min(moved) > 0.1


@pytest.mark.parametrize(
    ("name", "arguments", "field"),
    [
        ("FarmToTable-v0", {}, "control"),
        ("FarmToTableHand-v0", {"sign": -1}, "sign"),
    ],
)
def test_what_it_cannot_steer_is_refused(name, arguments, field):
    env = gym.make(name, **arguments)
    env.reset(seed=0)
    with pytest.raises(OptionError, match=f"^{field}: must be"):
        SteeredPolicy().act(env.unwrapped)
