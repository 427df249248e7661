"""An adversary of the paper's method: it imitates a planner, then learns on its own (half a minute in all).

With a file's name, such as `python examples/train_adversary.py adversary.zip`, the policy is kept.
"""

import sys

import gymnasium as gym
import numpy as np

from farm_ar.agents.policies import AnalyticPolicy

try:
    import torch
    from sb3_contrib import MaskablePPO
    from stable_baselines3.common.env_util import make_vec_env
except ImportError as missing:
    print(f"This example learns with Stable-Baselines3, and {missing.name} is not installed.")
    print("Install the extra `train`, in the project's folder: pip install '.[train]'")
    print("Nothing was trained.")
    sys.exit()

ENV = "farm_ar:FarmToTable-v0"
ARGUMENTS = {"jitter": "easy", "play_seconds": 0.0}  # the animals do not matter here
DEMONSTRATIONS, STEPS, EPISODES = 400, 12_288, 100


def imitate(model: MaskablePPO, episodes: int) -> None:
    """Learn the planner's actions by maximum likelihood, as a warm start."""
    env = gym.make(ENV, **ARGUMENTS).unwrapped
    planner, observations, masks, actions = AnalyticPolicy(), [], [], []
    for seed in range(1_000_000, 1_000_000 + episodes):
        observation, _ = env.reset(seed=seed)
        over = False
        while not over:
            observations.append(observation)
            masks.append(env.action_masks())
            actions.append(planner.act(env))
            observation, _, over, _, _ = env.step(actions[-1])
    parts = {name: torch.as_tensor(np.stack([o[name] for o in observations])) for name in observation}
    mask, action = np.stack(masks), torch.as_tensor(np.stack(actions))
    optimizer = torch.optim.Adam(model.policy.parameters(), lr=1e-3)
    rng = np.random.default_rng(0)
    for _ in range(20):
        for rows in np.array_split(rng.permutation(len(actions)), len(actions) // 128):
            batch = {name: values[rows] for name, values in parts.items()}
            loss = -model.policy.get_distribution(batch, mask[rows]).log_prob(action[rows]).mean()
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()


def mean_return(model: MaskablePPO | None) -> str:
    """Mean return and standard error over held-out episodes; without a model, of random actions."""
    env = gym.make(ENV, **ARGUMENTS)
    env.action_space.seed(0)
    returns = []
    for seed in range(2_000_000, 2_000_000 + EPISODES):
        observation, _ = env.reset(seed=seed)
        total, over = 0.0, False
        while not over:
            mask = env.unwrapped.action_masks()
            if model is None:
                parts = np.split(mask.astype(np.int8), np.cumsum(env.action_space.nvec)[:-1])
                action = env.action_space.sample(mask=tuple(parts))
            else:
                action, _ = model.predict(observation, action_masks=mask, deterministic=True)
            observation, reward, over, _, _ = env.step(action)
            total += reward
        returns.append(total)
    return f"{np.mean(returns):5.2f} ± {np.std(returns, ddof=1) / np.sqrt(EPISODES):.2f}"


torch.set_num_threads(1)
envs = make_vec_env(ENV, n_envs=8, seed=1, env_kwargs=ARGUMENTS)
model = MaskablePPO(
    "MultiInputPolicy",
    envs,
    n_steps=64,
    batch_size=128,
    n_epochs=8,
    learning_rate=1e-3,
    gamma=0.98,
    policy_kwargs={"net_arch": [256, 256]},
    seed=1,
)
print(f"Mean return of {EPISODES} held-out episodes: wrong labels less a quarter of the effort.")
print(f"{'random actions':34} {mean_return(None)}")
imitate(model, DEMONSTRATIONS)
print(f"{f'after imitating {DEMONSTRATIONS} episodes':34} {mean_return(model)}")
model.learn(STEPS)
print(f"{f'after {STEPS} steps of PPO':34} {mean_return(model)}")
if len(sys.argv) > 1:
    model.save(sys.argv[1])
    print(f"Wrote {sys.argv[1]}")
