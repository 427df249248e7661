"""What Stable-Baselines3's PPO learns with its own defaults, without a recipe, beside the best known return.

    python benchmarks/plain_ppo.py                       # all ids, 300 thousand steps, five seeds: hours
    python benchmarks/plain_ppo.py --ids SceneLayout-v0 --steps 30000 --seeds 1
    python benchmarks/plain_ppo.py --density 12000       # how often random steps are paid, and nothing else
    farm-ar plot out/plain-ppo/SceneLayout-v0/* --out out/curves.svg

An id is learnt with `reward="shaped"` (`--reward` names another), and scored as it is: the share of the
way from the random policy's return (0) to the best known one (1), over `--episodes` test episodes after
training. Where a batch can be had (`--batch`, with `carry="lift"` in training) training takes place in
it. Each run leaves a folder that `farm-ar plot` reads, with the model in it.
"""

import argparse
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecEnv

from farm_ar.agents.training.recipes import Recipe
from farm_ar.agents.training.run_folder import Run, RunFolder, Table
from farm_ar.envs.batched.sb3 import BatchedVecEnv
from farm_ar.envs.references import TEST_SEEDS, best_known, reference_returns
from farm_ar.errors import OptionError

IDS = [
    *("FarmToTable-v0", "FarmToTableLayout-v0", "SceneLayout-v0", "FarmToTableHandLift-v0"),
    *("FarmToTableHand-v0", "FarmToTableDiscrete-v0", "FarmToTableLayoutDiscrete-v0"),
    "SceneLayoutDiscrete-v0",
]
SCORED = {"play_seconds": 0.0, "animals_a_second": 0.0}
"""What is left out as it changes no return."""

MODEL = "model.zip"
"""The learner, in its run's folder."""

ROLLOUT = 2048
"""Steps between updates, PPO's default, of all environments together."""


def training_envs(env_id: str, reward: str, batch: int, seed: int) -> VecEnv:
    """Where a learner learns: in a batch if it is asked for and can be had, else in one environment."""
    arguments = {"reward": reward} | ({} if "Scene" in env_id else SCORED)
    if batch:
        lifted = {} if "Scene" in env_id else {"carry": "lift"}
        try:
            envs = BatchedVecEnv.of(env_id, batch, **arguments, **lifted)
        except OptionError as problem:
            print(f"{env_id}: one environment in place of a batch ({problem})", flush=True)
        else:
            envs.seed(seed)
            return envs
    return make_vec_env(f"farm_ar:{env_id}", n_envs=1, seed=seed, env_kwargs=arguments)


def returns_of(model: PPO, env: gym.Env, episodes: int) -> list[float]:
    """The returns of the first test episodes."""
    returns = []
    for seed in TEST_SEEDS[:episodes]:
        observation, _ = env.reset(seed=seed)
        total, over = 0.0, False
        while not over:
            action, _ = model.predict(observation, deterministic=True)
            observation, reward, over, _, _ = env.step(action)
            total += float(reward)
        returns.append(total)
    return returns


def learn(env_id: str, seed: int, asked: argparse.Namespace) -> float:
    """Train, evaluate in between and at the end; the mean return at the end."""
    envs = training_envs(env_id, asked.reward, asked.batch, seed)
    flat = isinstance(envs.observation_space, gym.spaces.Box)
    policy = "MlpPolicy" if flat else "MultiInputPolicy"
    model = PPO(policy, envs, n_steps=ROLLOUT // envs.num_envs, seed=seed, device="cpu")
    folder = RunFolder(asked.out / env_id / f"seed-{seed}")
    folder.path.mkdir(parents=True, exist_ok=True)
    folder.describe(Run("ppo", env_id, seed, Recipe(asked.steps, envs.num_envs, policy)))
    table = Table(folder.path / "evaluations.csv", ("steps", "mean_return", "best_mean_return"), -1)
    scored = gym.make(env_id, **({} if "Scene" in env_id else SCORED))
    best, began = -np.inf, time.monotonic()
    for _ in range(asked.evaluations):
        model.learn(asked.steps // asked.evaluations, reset_num_timesteps=False)
        mean = float(np.mean(returns_of(model, scored, asked.episodes)))
        best = max(best, mean)
        table.add(steps=model.num_timesteps, mean_return=round(mean, 5), best_mean_return=round(best, 5))
        seconds = time.monotonic() - began
        print(f"{env_id} seed {seed}: {model.num_timesteps} steps, {mean:.3f}, {seconds:.0f} s", flush=True)
    envs.close()
    model.save(folder.path / MODEL)
    return mean


def density(env_id: str, reward: str, steps: int) -> tuple[float, float]:
    """The shares of random steps that are paid anything beside the cost of effort, and that cost effort."""
    arguments = {"reward": reward} | ({} if "Scene" in env_id else SCORED)
    env = gym.make(f"farm_ar:{env_id}", **arguments)
    env.action_space.seed(0)
    env.reset(seed=0)
    paid = moved = 0
    for _ in range(steps):
        *_, over, _, info = env.step(env.action_space.sample())
        terms = {name: info[name] for name in info if name.startswith("reward/")}
        moved += terms.pop("reward/effort") != 0
        paid += any(abs(value) > 1e-9 for value in terms.values())
        if over:
            env.reset()
    return paid / steps, moved / steps


def main() -> None:
    """Train on each id with each seed, and print a table."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=form)
    parser.add_argument("--ids", nargs="*", default=IDS, help="by default those of every action")
    parser.add_argument("--steps", type=int, default=300_000)
    parser.add_argument("--seeds", type=int, default=5, help="how many")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--reward", default="shaped", help="in training")
    parser.add_argument("--batch", type=int, default=32, help="environments at a time; 0 for a single one")
    parser.add_argument("--evaluations", type=int, default=6)
    parser.add_argument("--episodes", type=int, default=100, help="of each evaluation")
    parser.add_argument("--density", type=int, metavar="STEPS", help="say how often random steps are paid")
    parser.add_argument("--out", type=Path, default=Path("out/plain-ppo"))
    asked = parser.parse_args()
    torch.set_num_threads(1)
    if asked.density:
        for env_id in asked.ids:
            for reward in ("identity", asked.reward):
                paid, moved = density(env_id, reward, asked.density)
                print(f"{env_id:32} {reward:10} paid {paid:.2%}, cost effort {moved:.2%}", flush=True)
        return
    print(f"PPO's defaults, {asked.steps} steps, {asked.seeds} seeds, reward={asked.reward} in training")
    rows = []
    for env_id in asked.ids:
        seeds = range(asked.first_seed, asked.first_seed + asked.seeds)
        means = [learn(env_id, seed, asked) for seed in seeds]
        random, best = reference_returns(env_id)["random"].mean, best_known(env_id)
        score = (np.array(means) - random) / (best.mean - random)
        some = gym.spec(env_id).reward_threshold is not None
        shown = ", ".join(f"{value:.2f}" for value in score) if some else "no policy to compare with is known"
        rows.append(
            f"| {env_id} | {random:.2f} | {best.mean:.2f} ({best.policy}) | {np.mean(means):.2f} | {shown} |"
        )
    print("\n| id | random | best known | PPO, mean | score of each seed |\n|---|---|---|---|---|")
    print("\n".join(rows))


if __name__ == "__main__":
    main()
