"""Steps a second of the environments, beside Gymnasium's own in the same run.

One core, state observations, random actions of those that make sense, resets included:

    python benchmarks/environments.py [seconds for each]

LunarLander needs: pip install 'farm-ar[bench]'
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np

import farm_ar  # noqa: F401  # registers the environments

YARDSTICK = "CartPole-v1"
ROUNDS = 5

Act = Callable[[gym.Env[Any, Any]], Any]


def random_player() -> Act:
    """Random actions of those that make sense, drawn faster than Gymnasium's spaces draw them."""
    rng = np.random.default_rng(0)

    def act(env: gym.Env[Any, Any]) -> Any:
        space = env.action_space
        if isinstance(space, gym.spaces.Box):
            return rng.uniform(-1, 1, space.shape).astype(np.float32)
        if isinstance(space, gym.spaces.Discrete):
            return int(rng.integers(space.n))
        first = env.unwrapped.action_masks()[: space.nvec[0]].nonzero()[0]
        return np.array([first[rng.integers(len(first))], *rng.integers(space.nvec[1:])])

    return act


def waiting_hand() -> Act:
    """The hand waits out of view."""
    return lambda env: np.zeros(4, dtype=np.float32)


def dragging_hand() -> Act:
    """The hand goes for the nearest building in view and drags it about, to another place every 0.8 s."""
    rng, goals = np.random.default_rng(0), [np.zeros(2)]

    def act(env: gym.Env[Any, Any]) -> Any:
        view, hand = env.unwrapped.view, env.unwrapped.world.tabletop.hand
        if hand.gripped is not None:
            if len(goals) == 1:
                goals.extend([rng.uniform([0.2, 0.15], [1.0, 0.65])] * 8)
            goal = goals.pop()
        else:
            seen = view.movable[view.in_view[view.movable]]
            places = np.vstack([view.truth.position[seen], [0.6, 0.4]])
            goal = places[np.argmin(np.linalg.norm(places - hand.position, axis=1))]
        velocity = np.clip((goal - hand.position) / 0.15, -1, 1)
        return np.array([*velocity, 0.0, 1.0], dtype=np.float32)

    return act


MANY: dict[str, Any] = {"animals_a_second": 75.0}
"""About 300 animals on the table at once."""

CASES: list[tuple[str, str, dict[str, Any], Callable[[], Act]]] = [
    (YARDSTICK, YARDSTICK, {}, random_player),
    ("LunarLander-v3", "LunarLander-v3", {}, random_player),
    ("FarmToTable-v0", "FarmToTable-v0", {}, random_player),
    ("  slot, 3 visits", "FarmToTable-v0", {"action": "slot", "visits": 3}, random_player),
    ("  black-box", "FarmToTable-v0", {"knowledge": "black-box"}, random_player),
    ("  pixels", "FarmToTable-v0", {"observation": "pixels"}, random_player),
    ("FarmToTableHand-v0, idle", "FarmToTableHand-v0", {}, waiting_hand),
    ("  idle, 300 animals", "FarmToTableHand-v0", MANY, waiting_hand),
    ("  dragging", "FarmToTableHand-v0", {"budget": 1e9}, dragging_hand),
    ("  dragging, 300 animals", "FarmToTableHand-v0", MANY | {"budget": 1e9}, dragging_hand),
    ("  random", "FarmToTableHand-v0", {}, random_player),
    ("FarmToTableLayout-v0", "FarmToTableLayout-v0", {}, random_player),
    ("SceneLayout-v0", "SceneLayout-v0", {}, random_player),
    ("  H1, 52 objects", "SceneLayout-v0", {"scene": "H1"}, random_player),
]


def steps_a_second(env: gym.Env[Any, Any], act: Act, seconds: float) -> float:
    """Steps a second of processor time, resets included."""
    steps, begin = 0, time.process_time()
    env.reset()
    while (spent := time.process_time() - begin) < seconds:
        for _ in range(10):
            _, _, terminated, truncated, _ = env.step(act(env))
            steps += 1
            if terminated or truncated:
                env.reset()
    return steps / spent


def main() -> None:
    """Measure in rounds, so that all share the machine's better and worse moments, and print the medians."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 2.0
    running: dict[str, tuple[gym.Env[Any, Any], Act]] = {}
    for label, name, arguments, make_act in CASES:
        try:
            env = gym.make(name, **arguments)
        except gym.error.DependencyNotInstalled:
            print(f"({name} is left out: pip install 'farm-ar[bench]')")
            continue
        env.reset(seed=0)
        env.action_space.seed(0)
        running[label] = env, make_act()
    measured: dict[str, list[float]] = {label: [] for label in running}
    for _ in range(ROUNDS):
        for label, (env, act) in running.items():
            measured[label].append(steps_a_second(env, act, seconds / ROUNDS))
    medians = {label: float(np.median(values)) for label, values in measured.items()}
    others = [label for label in (YARDSTICK, "LunarLander-v3") if label in medians]
    print(f"{'':26}{'steps/s':>10}" + "".join(f"{'by ' + label:>22}" for label in others))
    for label, speed in medians.items():
        print(f"{label:26}{speed:10.0f}" + "".join(f"{speed / medians[other]:22.4f}" for other in others))


if __name__ == "__main__":
    main()
