"""Plays test episodes of every id with known policies, and writes farm_ar/envs/reference_returns.json.

    python benchmarks/reference_returns.py                      # some minutes
    python benchmarks/reference_returns.py --ids SceneLayout-v0 --episodes 20 --out out/returns.json
    python benchmarks/reference_returns.py --ids FarmToTableLayout-v0 --policies ppo --models out/plain-ppo

An id's own arguments count, with animals and all. `exhaustive` tries every choice of an episode of one step
and takes the best; it is a bound for what learns, not a policy, as it plays an episode many times. `ppo` is
what `plain_ppo.py` left in ID/seed-0 of `--models`; without it the file's row of that name stays.
"""

import argparse
import json
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
from gymnasium import spaces

import farm_ar
from farm_ar.agents.policies import POLICIES, Policy, play_episode
from farm_ar.agents.policies.base import SHIPPED_ENV, shipped
from farm_ar.agents.policies.steered import SteeredPolicy
from farm_ar.envs.references import SAME_GAME, TEST_SEEDS
from farm_ar.envs.registration import NAMED

PAGE = Path(farm_ar.__file__).parent / "envs" / "reference_returns.json"
THRESHOLD = 0.8
"""Where an id's `reward_threshold` lies between the random policy's return (0) and the best known one (1)."""

LEAST = 0.1
"""By how much the best known policy has to beat the random one, for a threshold to mean anything."""

EXHAUSTED = 50
"""Test seeds of which every choice is tried."""


LEARNT = "ppo"
"""The policy that plain PPO came to."""


def played(env_id: str, name: str, episodes: int, models: Path | None) -> list[float]:
    """The returns of a policy in the first test episodes."""
    env = gym.make(env_id)
    if name == "exhaustive":
        return [best_choice(env, seed) for seed in TEST_SEEDS[: min(episodes, EXHAUSTED)]]
    if name == LEARNT or name in shipped():
        policy = learnt(env_id, name, models)
    else:
        policy = (SteeredPolicy if name == "steered" else POLICIES[name])(np.random.default_rng(0))
    return [play_episode(env, policy, seed).total for seed in TEST_SEEDS[:episodes]]


def learnt(env_id: str, name: str, models: Path | None) -> Policy:
    """A policy that comes with farm-ar, or the one that plain PPO left."""
    from stable_baselines3 import PPO

    from farm_ar.agents.policies.trained import TrainedPolicy, load_shipped

    if name in shipped():
        return load_shipped(name)
    return TrainedPolicy(PPO.load(model_of(env_id, models), device="cpu"))


def model_of(env_id: str, models: Path | None) -> Path | None:
    """Where plain PPO left what it learnt on an id, if it did."""
    path = None if models is None else models / env_id / "seed-0" / "model.zip"
    return path if path is not None and path.exists() else None


def best_choice(env: gym.Env, seed: int) -> float:
    """The best return of an episode of one step that any choice has."""
    _, info = env.reset(seed=seed)
    returns = []
    for choice in np.flatnonzero(info["action_mask"]):
        env.reset(seed=seed)
        _, reward, over, *_ = env.step(int(choice))
        assert over
        returns.append(reward)
    return max(returns)


def policies_of(env_id: str, models: Path | None) -> list[str]:
    """The policies that can play an id."""
    env = gym.make(env_id).unwrapped
    others = [LEARNT] if model_of(env_id, models) else []
    if env_id == SHIPPED_ENV:
        others += [name for name in shipped() if name.endswith(env.config.action)]
    if env.config.control == "hand":
        return ["random", "steered", *others]
    one_number = env.config.control == "layout" and isinstance(env.action_space, spaces.Discrete)
    return ["random", "greedy", "analytic", *(["exhaustive"] if one_number else []), *others]


def returns_of(env_id: str, asked: argparse.Namespace, known: dict) -> dict:
    """The section of an id; rows that are known and not played now stay."""
    rows, models, episodes = dict(known.get("returns", {})), asked.models, asked.episodes
    for name in policies_of(env_id, models):
        if asked.policies and name not in asked.policies:
            continue
        returns = np.array(played(env_id, name, episodes, models))
        error = returns.std(ddof=1) / np.sqrt(len(returns))
        rows[name] = {
            "mean": round(float(returns.mean()), 3),
            "standard_error": round(float(error), 3),
            "episodes": len(returns),
        }
        print(f"{env_id:32} {name:10} {returns.mean():6.3f} ± {error:.3f}", file=sys.stderr, flush=True)
    low, high = rows["random"]["mean"], max(row["mean"] for row in rows.values())
    threshold = round(low + THRESHOLD * (high - low), 2) if high - low > LEAST else None
    return {"reward_threshold": threshold, "returns": rows}


def main() -> None:
    """Play, and write."""
    made = [name for name, spec in gym.registry.items() if spec.entry_point == NAMED]
    ours = [name for name in made if not any(word in name for word in SAME_GAME)]
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=form)
    parser.add_argument("--ids", nargs="*", default=ours, help="by default all")
    parser.add_argument("--episodes", type=int, default=200, help="of each policy, by default 200")
    parser.add_argument("--out", type=Path, default=PAGE, help="the file; ids that it has already stay")
    parser.add_argument("--policies", nargs="*", help="these only; the file's other rows stay")
    parser.add_argument("--models", type=Path, help="the folder in which plain_ppo.py left what it learnt")
    asked = parser.parse_args()
    known = json.loads(asked.out.read_text(encoding="utf-8"))["ids"] if asked.out.exists() else {}
    for name in asked.ids:
        known[name] = returns_of(name, asked, known.get(name, {}))
    about = f"Made by python benchmarks/{Path(__file__).name}; means of returns over the first test seeds."
    text = json.dumps({"about": about, "ids": {name: known[name] for name in sorted(known)}}, indent=1)
    asked.out.write_text(text + "\n", encoding="utf-8")
    print(f"Wrote {asked.out}")


if __name__ == "__main__":
    main()
