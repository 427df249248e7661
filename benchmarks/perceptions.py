"""Trained adversaries against methods that perceive truly, with noise as measured, and from pixels.

    python benchmarks/perceptions.py [--episodes N] [--methods spatial likelihood adaptive]

The policies that come with farm-ar play the same held-out episodes against each method under each perception:
mean return, its standard error, and the share of labels right at the end. They were trained against `spatial`
with true poses; nothing is trained here. From pixels an episode takes about half a second.
"""

from __future__ import annotations

import argparse

import gymnasium as gym

from farm_ar.agents.policies import shipped
from farm_ar.agents.policies.trained import policy_and_env
from farm_ar.agents.training.evaluation import held_out, play

PERCEPTIONS = {
    "oracle": {"perception": "oracle"},
    "measured noise": {"perception": "oracle", "oracle_noise": "measured"},
    "pixels": {"perception": "pixels"},
}


def main() -> None:
    """Play, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--episodes", type=int, default=60)
    parser.add_argument("--methods", nargs="+", default=["spatial", "likelihood", "adaptive"])
    asked = parser.parse_args()
    gym.logger.min_level = gym.logger.ERROR
    print("| policy | method | perception | return | labels right |")
    print("|---|---|---|---:|---:|")
    for name in shipped():
        for method in asked.methods:
            for words, arguments in PERCEPTIONS.items():
                policy, env = policy_and_env(name, "best", {**arguments, "reid": method})
                played = play(env, policy, held_out(asked.episodes))
                movable = int(env.view.movable.sum())
                row = played.as_row()
                right = 1 - row["wrong_labels"] / movable
                said = f"{row['return']:.2f} ± {row['standard_error']:.2f}"
                print(f"| {name} | {method} | {words} | {said} | {right:.1%} |", flush=True)


if __name__ == "__main__":
    main()
