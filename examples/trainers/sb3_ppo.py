"""Stable-Baselines3: PPO with its own defaults, in a batch of environments (half a minute).

With more steps, `python examples/trainers/sb3_ppo.py 300000`, it comes to more than the analytic policy.
"""

import sys

import gymnasium as gym
import numpy as np

from farm_ar.envs.references import TEST_SEEDS, reference_returns

try:
    import torch
    from stable_baselines3 import PPO

    from farm_ar.envs.batched.sb3 import BatchedVecEnv
except ImportError as missing:
    print(f"This example learns with Stable-Baselines3, and {missing.name} is not installed.")
    print("Install the extra `train`, in the project's folder: pip install '.[train]'")
    print("Nothing was trained.")
    sys.exit()

ENV = "FarmToTableLayout-v0"
QUICK = {"play_seconds": 0.0, "animals_a_second": 0.0}  # the animals change no return
STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 16_384


def mean_return(model: PPO, episodes: int = 30) -> float:
    """The mean return of test episodes, on the environment as it is: its own reward, physics and all."""
    env, returns = gym.make(f"farm_ar:{ENV}", **QUICK), []
    for seed in TEST_SEEDS[:episodes]:
        observation, _ = env.reset(seed=seed)
        total, over = 0.0, False
        while not over:
            action, _ = model.predict(observation, deterministic=True)
            observation, reward, over, _, _ = env.step(action)
            total += reward
        returns.append(total)
    return float(np.mean(returns))


torch.set_num_threads(1)
# `reward="shaped"` pays for what almost fools the headset, too; only a hand that lifts can be batched.
envs = BatchedVecEnv.of(ENV, 32, reward="shaped", carry="lift", **QUICK)
envs.seed(0)
model = PPO("MultiInputPolicy", envs, n_steps=64, seed=0)
print(f"{ENV}: mean return")
print(f"before     {mean_return(model):6.2f}")
model.learn(STEPS)
print(f"{STEPS} steps {mean_return(model):6.2f}")
for name, reference in reference_returns(ENV).items():
    print(f"{name:10} {reference.mean:6.2f}")
