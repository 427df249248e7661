"""A policy that chooses at random among the allowed actions, for ten episodes."""

import gymnasium as gym
import numpy as np

env = gym.make("farm_ar:FarmToTable-v0")
env.action_space.seed(0)
parts = np.cumsum(env.action_space.nvec)[:-1]

print("The return is the number of wrong labels, less a quarter of the effort.")
print(f"{'episode':>7} {'moves':>6} {'return':>7} {'wrong labels':>13} {'animals miscounted':>15}")
returns = []
for episode in range(10):
    env.reset(seed=episode)
    total, moves, over = 0.0, 0, False
    while not over:
        mask = env.unwrapped.action_masks().astype(np.int8)
        action = env.action_space.sample(mask=tuple(np.split(mask, parts)))
        _, reward, over, _, info = env.step(action)
        total, moves = total + reward, moves + 1
    returns.append(total)
    print(f"{episode:7} {moves:6} {total:7.2f} {info['wrong_labels']:13} {info['miscounts']:15}")
print(f"Mean return: {np.mean(returns):.2f}")
