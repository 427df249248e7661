"""Learners of environments with one input and one number to choose."""

import gymnasium as gym
import pytest
from sb3_contrib import MaskablePPO
from stable_baselines3 import PPO

from farm_ar.agents.training.recipes import check_fit, policy_class
from farm_ar.errors import OptionError


@pytest.mark.parametrize(("name", "learner"), [("ppo", PPO), ("maskable-ppo", MaskablePPO)])
def test_the_policy_for_several_inputs_stands_for_that_for_one(name, learner):
    env = gym.make("SceneLayoutDiscrete-v0")
    check_fit(name, "MultiInputPolicy", env)
    model = learner(policy_class("MultiInputPolicy", env.observation_space), env, n_steps=8, batch_size=8)
    model.learn(8)
    assert env.action_space.contains(model.predict(env.reset(seed=0)[0])[0])


def test_several_inputs_and_pictures_keep_their_policies():
    state, pixels = (gym.make("SceneLayout-v0", observation=one) for one in ("state", "pixels"))
    assert policy_class("MultiInputPolicy", state.observation_space) == "MultiInputPolicy"
    assert policy_class("CnnPolicy", pixels.observation_space) == "CnnPolicy"


def test_a_policy_of_objects_refuses_choices_of_one_number():
    env = gym.make("FarmToTable-v0", action="discrete")
    with pytest.raises(OptionError, match="policy: must be another one, but for maskable-ppo"):
        check_fit("maskable-ppo", "ObjectPolicy", env)
