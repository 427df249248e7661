"""Where the time of a training goes: environment, planner, choosing actions, learning.

    python benchmarks/training.py                       # a few minutes: two rollouts of each part
    python benchmarks/training.py --rollouts 1 --action displacement

A run like `farm-ar train RUN --arg action=slot` is made for a few rollouts of each of its parts (imitation,
PPO in a batch with a hand that lifts, PPO on the environment itself), and processor time is counted.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sb3_contrib import MaskablePPO
from stable_baselines3.common.vec_env import DummyVecEnv

from farm_ar.agents.training.demonstrated_env import DemonstratedEnv
from farm_ar.agents.training.imitation import ImitatingPPO
from farm_ar.agents.training.recipes import load_recipe
from farm_ar.agents.training.run_folder import Run
from farm_ar.agents.training.training import train
from farm_ar.envs.batched.sb3 import BatchedVecEnv

spent: dict[str, dict[str, float]] = {}
"""Seconds by part of the training and what they were spent on."""

part = "imitation"


def timed(home: Any, method: str, what: str) -> None:
    """Count the processor time that a method takes."""
    inner: Callable[..., Any] = getattr(home, method)

    def outer(self: Any, *arguments: Any, **named: Any) -> Any:
        began = time.process_time()
        try:
            return inner(self, *arguments, **named)
        finally:
            row = spent.setdefault(part, {})
            row[what] = row.get(what, 0.0) + time.process_time() - began

    setattr(home, method, outer)


def main() -> None:
    """Train for a while, and print a table."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=form)
    parser.add_argument("--action", choices=["slot", "displacement"], default="slot")
    parser.add_argument("--rollouts", type=int, default=2, help="of each part")
    asked = parser.parse_args()
    recipe = load_recipe("maskable-ppo", "FarmToTable-v0")
    steps = asked.rollouts * recipe.n_envs * recipe.settings["n_steps"]
    recipe = recipe.with_arguments({"action": asked.action}, 3 * steps, steps, steps)
    for home, method, what in (
        *((envs, "step_wait", "environment") for envs in (BatchedVecEnv, DummyVecEnv)),
        (DemonstratedEnv, "demonstrate", "planner"),
        (ImitatingPPO, "train", "learning"),
        (MaskablePPO, "collect_rollouts", "whole rollout"),
    ):
        timed(home, method, what)
    inner = ImitatingPPO.collect_rollouts

    def collect(self: Any, *arguments: Any, **named: Any) -> bool:
        global part
        part = ("imitation", "PPO, hand lifts", "PPO, physics")[min(self.num_timesteps // steps, 2)]
        return inner(self, *arguments, **named)

    ImitatingPPO.collect_rollouts = collect
    with tempfile.TemporaryDirectory() as folder:
        train(Run("maskable-ppo", "FarmToTable-v0", 0, recipe, eval_every=10**9), Path(folder) / "run")
    print(f"\n{asked.action}: processor seconds for {steps} steps of each part")
    print("| part | environment | planner | choosing | learning | environment of all |\n" + 6 * "|---" + "|")
    for name, row in spent.items():
        environment, planner = row["environment"], row.get("planner", 0.0)
        choosing = row["whole rollout"] - environment - planner
        whole = row["whole rollout"] + row["learning"]
        columns = (f"{value:.1f}" for value in (environment, planner, choosing, row["learning"]))
        print(f"| {name} | {' | '.join(columns)} | {environment / whole:.1%} |")


if __name__ == "__main__":
    main()
