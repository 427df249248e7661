"""An adversary learns to make the headset mistake one building for another, for half a minute."""

import sys

import gymnasium as gym
import numpy as np

import farm_ar  # noqa: F401  # registers the environments

try:
    import torch
    from sb3_contrib import MaskablePPO
    from stable_baselines3.common.env_util import make_vec_env
except ImportError as missing:
    print(f"This example learns with Stable-Baselines3, and {missing.name} is not installed.")
    print("It comes with: pip install 'farm-ar[train]'")
    print("Nothing was trained.")
    sys.exit()

# Nobody looks at the animals here, so that no time is spent on them.
ARGUMENTS = {"action": "slot", "jitter": "easy", "play_seconds": 0.0}
STEPS, EPISODES = 4096, 80


def mean_return(model: MaskablePPO | None) -> float:
    """Mean return over the same episodes; without a model, of a player that chooses at random."""
    env = gym.make("FarmToTable-v0", **ARGUMENTS)
    env.action_space.seed(0)
    total = 0.0
    for seed in range(EPISODES):
        observation, _ = env.reset(seed=seed)
        over = False
        while not over:
            mask = env.unwrapped.action_masks()
            if model is None:
                parts = np.split(mask.astype(np.int8), np.cumsum(env.action_space.nvec)[:-1])
                action = env.action_space.sample(mask=tuple(parts))
            else:
                action, _ = model.predict(observation, action_masks=mask, deterministic=True)
            observation, reward, over, _, _ = env.step(action)
            total += reward
    return total / EPISODES


torch.set_num_threads(1)
envs = make_vec_env("FarmToTable-v0", n_envs=8, seed=1, env_kwargs=ARGUMENTS)
model = MaskablePPO(
    "MultiInputPolicy", envs, n_steps=64, batch_size=128, n_epochs=8, learning_rate=1e-3, gamma=0.98, seed=1
)
print("The return is the number of wrong labels, less a quarter of the effort.")
print(f"a random player              {mean_return(None):6.2f}")
print(f"the adversary, untrained     {mean_return(model):6.2f}")
model.learn(STEPS)
print(f"the adversary, {STEPS} steps  {mean_return(model):6.2f}")
