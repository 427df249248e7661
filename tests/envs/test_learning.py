"""The usual learners run on the environments: smoke tests, of a few steps each."""

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="pip install '.[train]'")
pytest.importorskip("sb3_contrib", reason="pip install '.[train]'")

import torch
from sb3_contrib import MaskablePPO
from stable_baselines3 import PPO, SAC

torch.set_num_threads(1)

DISCRETE = [("FarmToTable-v0", {}), ("FarmToTable-v0", {"action": "slot"})]
CONTINUOUS = [
    ("FarmToTable-v0", {"action": "continuous"}),
    ("FarmToTableHand-v0", {}),
    ("FarmToTableLayout-v0", {"reward": "margin"}),
    ("SceneLayout-v0", {}),
]
PIXELS = [("FarmToTable-v0", {"observation": "pixels"})]


def name_of(value):
    return "-".join(map(str, value.values())) or "default" if isinstance(value, dict) else value


@pytest.mark.parametrize(("name", "arguments"), DISCRETE + CONTINUOUS + PIXELS, ids=name_of)
def test_ppo_learns_on_all(name, arguments):
    env = gym.make(name, **arguments)
    policy = "CnnPolicy" if "observation" in arguments else "MultiInputPolicy"
    model = PPO(policy, env, n_steps=8, batch_size=8, n_epochs=1, seed=0)
    before = [values.clone() for values in model.policy.parameters()]
    model.learn(16)
    assert model.num_timesteps == 16
    assert any(not torch.equal(a, b) for a, b in zip(before, model.policy.parameters(), strict=True))
    observation, _ = env.reset(seed=0)
    action, _ = model.predict(observation, deterministic=True)
    assert env.action_space.contains(action)


@pytest.mark.parametrize(("name", "arguments"), DISCRETE, ids=name_of)
def test_maskable_ppo_chooses_only_what_the_mask_allows(name, arguments):
    env = gym.make(name, **arguments)
    model = MaskablePPO("MultiInputPolicy", env, n_steps=16, batch_size=16, n_epochs=1, seed=0)
    model.learn(32)
    for seed in range(20):
        observation, _ = env.reset(seed=seed)
        masks = env.unwrapped.action_masks()
        action, _ = model.predict(observation, action_masks=masks)
        starts = np.concatenate([[0], np.cumsum(env.action_space.nvec)[:-1]])
        assert masks[starts + action].all()


@pytest.mark.parametrize(("name", "arguments"), CONTINUOUS, ids=name_of)
def test_sac_learns_on_the_continuous_ones(name, arguments):
    env = gym.make(name, **arguments)
    model = SAC(
        "MultiInputPolicy", env, learning_starts=8, batch_size=8, buffer_size=64, train_freq=8, seed=0
    )
    model.learn(24)
    assert model._n_updates > 0
    observation, _ = env.reset(seed=0)
    action, _ = model.predict(observation)
    assert env.action_space.contains(action)
