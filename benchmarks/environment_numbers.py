"""The numbers that the page on the environments gives of them, measured.

    python benchmarks/environment_numbers.py [episodes]

By default 2000 episodes, or layouts, of each kind; less than two minutes on one core.
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium as gym
import numpy as np

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.generator import StartingLayouts
from farm_ar.envs.rewards import clutter
from farm_ar.geometry import wrap
from farm_ar.scenes import builtin_scene
from farm_ar.testing.rollouts import random_action

LONGEST_HOLD = 7
"""Steps for which a random action of the hand is kept at most: one steered anew all the time gets nowhere."""


def over_budget(control: str, episodes: int) -> str:
    """How often random play ends a visit over its budget, and by how much."""
    env: FarmToTableEnv = FarmToTableEnv(control=control, play_seconds=0.0)
    rng, most = np.random.default_rng(0), env.config
    beyond = []
    env.action_space.seed(0)
    for seed in range(episodes):
        env.reset(seed=seed)
        over, left, action = False, 0, None
        while not over:
            if left == 0:
                action, left = (
                    random_action(env),
                    int(rng.integers(1, LONGEST_HOLD + 1)) if control == "hand" else 1,
                )
            left -= 1
            _, _, over, _, _ = env.step(action)
        moved = env.world.tabletop.moved  # type: ignore[attr-defined]  # of the game
        beyond.append((moved.metres - most.budget_m, moved.radians - most.budget_rad))
    excess = np.array(beyond)
    either = np.mean(np.any(excess > 0, axis=1))
    parts = [f"{control}: {either:.0%} of {episodes} visits end over the budget"]
    for name, unit, values in (("metres", "mm", 1000 * excess[:, 0]), ("radians", "rad", excess[:, 1])):
        some = values[values > 0]
        parts.append(
            f"in {name} {len(some) / episodes:.0%}, by {np.median(some):.3g} {unit} in the median, "
            f"at most {some.max():.3g}"
        )
    return "; ".join(parts)


def animals(rate: float, episodes: int) -> str:
    """How many animals are on the table at once, by how many leave the shed in a second."""
    env: FarmToTableEnv = FarmToTableEnv(animals_a_second=rate)
    counts: list[int] = []
    for seed in range(episodes):
        env.reset(seed=seed)
        world: Any = env.world
        counts.append(len(world.flock.goal))
        env.step(np.array([10, 0, 0, 0]))
        counts.append(len(world.flock.goal))
    mean = float(np.mean(counts))
    return f"{rate:g} animals a second: {mean:.1f} on the table at once ({mean / rate:.2f} times)"


def jitter(name: str, draws: int) -> str:
    """How far starting layouts stray, how far objects are apart, and how cluttered they are."""
    scene, rng = builtin_scene("farm"), np.random.default_rng(0)
    home, layouts = scene.layout, StartingLayouts(scene, name)
    some, shift, turn, apart = home.movable, [], [], []
    for _ in range(draws):
        layout = layouts.draw(rng)
        shift.append((layout.position - home.position)[some])
        turn.append(wrap(layout.yaw - home.yaw)[some])
        apart.append(np.linalg.norm(layout.position[:, None] - layout.position, axis=-1))
    least = min(float(d[~np.eye(len(d), dtype=bool)].min()) for d in apart)
    env: FarmToTableEnv = FarmToTableEnv(jitter=name)
    cluttered = []
    for seed in range(draws):
        env.reset(seed=seed)
        cluttered.append(clutter(env))
    error = np.std(cluttered) / np.sqrt(draws)
    farthest = np.abs(wrap(np.array(turn) + home.yaw[some])).max()
    return (
        f"{name}: SD {np.std(shift):.4f} m and {np.rad2deg(np.std(turn)):.2f} degrees, yaw at most "
        f"{np.rad2deg(farthest):.1f} degrees from 0, centres at least "
        f"{least:.3f} m apart, mean clutter {np.mean(cluttered):.4f} (standard error {error:.4f})"
    )


def in_view(name: str, episodes: int) -> str:
    """How many of the movable objects a drawn camera sees."""
    env: FarmToTableEnv = FarmToTableEnv(jitter=name)
    seen = []
    for seed in range(episodes):
        env.reset(seed=seed)
        seen.append(int(env.view.in_view[env.view.movable].sum()))
    return f"{name}: {np.mean(seen):.2f} of {len(env.view.movable)} movable objects in view"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("episodes", nargs="?", type=int, default=2000)
    count = parser.parse_args().episodes
    gym.logger.min_level = gym.logger.ERROR
    print("## Over the budget, random play")
    for control in ("move", "hand"):
        print(over_budget(control, count), flush=True)
    print("## Animals")
    for rate in (10.0, 100.0):
        print(animals(rate, max(count // 10, 1)), flush=True)
    print("## Starting layouts")
    for name in ("easy", "default", "hard"):
        print(jitter(name, count), flush=True)
    print("## In view")
    for name in ("none", "easy", "default", "hard"):
        print(in_view(name, max(count // 4, 1)), flush=True)


if __name__ == "__main__":
    main()
