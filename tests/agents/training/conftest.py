"""A training small enough to be run in a test."""

from collections.abc import Callable

import pytest

pytest.importorskip("stable_baselines3", reason="pip install '.[train]'")
pytest.importorskip("sb3_contrib", reason="pip install '.[train]'")

import torch

from farm_ar.agents.training.recipes import Recipe
from farm_ar.agents.training.run_folder import Run

torch.set_num_threads(1)

QUICK = {"play_seconds": 0.0, "animals_a_second": 0.0, "action": "slot"}


@pytest.fixture
def tiny() -> Callable[..., Run]:
    """Makes a run of 32 steps a rollout; the values given are the recipe's."""

    def make(algo: str = "maskable-ppo", env: str = "FarmToTable-v0", **values: object) -> Run:
        learner = {"n_steps": 16, "batch_size": 32, "n_epochs": 1}
        if algo == "sac":
            learner = {"learning_starts": 8, "batch_size": 8, "buffer_size": 64, "train_freq": 8}
        policy = "ObjectPolicy" if algo == "maskable-ppo" else "MultiInputPolicy"
        small = {"width": 16, "pair_width": 8, "rounds": 1} if policy == "ObjectPolicy" else {}
        given = {
            "n_timesteps": 96,
            "n_envs": 2,
            "policy": policy,
            "policy_kwargs": small,
            "env_kwargs": QUICK,
        }
        recipe = Recipe(**{**given, **values}, settings=learner)
        return Run(algo, env, 0, recipe, eval_every=64, eval_episodes=2)

    return make
