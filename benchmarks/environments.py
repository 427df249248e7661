"""Steps a second of the environments, beside Gymnasium's own in the same run.

One core, state observations, through `gym.make`. Actions are recorded beforehand, so that only the
environments are timed:

    python benchmarks/environments.py [rounds] [--write]

`--write` puts the tables into docs/speed-environments.md. LunarLander needs: pip install '.[bench]'
"""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.scenes import Layout, Scene, builtin_scene

PAGE = Path(__file__).parents[1] / "docs" / "speed-environments.md"
YARDSTICK = "LunarLander-v3"
LONGEST = 600
"""Steps of an episode that are recorded at most."""

Act = Callable[[gym.Env[Any, Any]], Any]


def random_policy() -> Act:
    """Random actions of those that make sense."""
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
        width, depth = view.size
        if hand.gripped is not None:
            if len(goals) == 1:
                goals.extend([rng.uniform([0.17, 0.19], [0.83, 0.81]) * view.size] * 8)
            goal = goals.pop()
        else:
            seen = view.movable[view.in_view[view.movable]]
            places = np.vstack([view.truth.position[seen], [width / 2, depth / 2]])
            goal = places[np.argmin(np.linalg.norm(places - hand.position, axis=1))]
        velocity = np.clip((goal - hand.position) / 0.15, -1, 1)
        return np.array([*velocity, 0.0, 1.0], dtype=np.float32)

    return act


@dataclass
class Case:
    """An environment and what is done in it.

    Attributes:
        label: what it is called.
        name: its id.
        arguments: of `gym.make`.
        make_act: makes the policy.
        episodes: how many different ones are recorded.
        times: seconds of each episode's reset and of its steps, a list for each episode.
    """

    label: str
    name: str
    arguments: dict[str, Any]
    make_act: Callable[[], Act]
    episodes: int = 6
    times: list[list[tuple[float, float]]] = field(default_factory=list)

    def record(self) -> None:
        """Play the episodes, and keep what was done."""
        self.env, act = gym.make(self.name, **self.arguments), self.make_act()
        self.actions: list[list[Any]] = []
        for seed in range(self.episodes):
            self.env.reset(seed=seed)
            done: list[Any] = []
            over = False
            while not over and len(done) < LONGEST:
                done.append(act(self.env))
                _, _, terminated, truncated, _ = self.env.step(done[-1])
                over = terminated or truncated
            self.actions.append(done)
        self.times = [[] for _ in self.actions]

    def play(self, seed: int) -> None:
        """Play an episode again, and time it."""
        begin = time.process_time()
        self.env.reset(seed=seed)
        begun, step = time.process_time(), self.env.step
        for action in self.actions[seed]:
            step(action)
        self.times[seed].append((begun - begin, time.process_time() - begun))

    @property
    def step_s(self) -> tuple[float, float]:
        """Seconds a step, with the resets and without: of every episode its best time counts."""
        steps = sum(map(len, self.actions))
        resets = sum(min(reset for reset, _ in times) for times in self.times)
        played = sum(min(played for _, played in times) for times in self.times)
        return (resets + played) / steps, played / steps


def many(animals: int) -> dict[str, Any]:
    """Options with about so many animals on the table at once, and without an end soon."""
    return {"animals_a_second": animals / 4, "hand_seconds": LONGEST / 10, "budget": 1e9}


def crowded_farm(buildings: int) -> Scene:
    """The farm, its table and its buildings as often as it takes to have so many, 22 cm apart."""
    farm = builtin_scene("farm")
    rows = int(np.ceil(np.sqrt(buildings / 1.5)))
    columns = int(np.ceil(buildings / rows))
    x, z = np.meshgrid(np.arange(columns), np.arange(rows))
    place = 0.22 * (np.stack([x.ravel(), z.ravel()], axis=1)[:buildings] + 0.5)
    movable = np.flatnonzero(farm.layout.movable)
    like = movable[np.arange(buildings) % len(movable)]
    shed = farm.layout.index("shed")
    width, depth = 0.22 * columns, 0.22 * rows + 0.3
    layout = Layout(
        labels=(*(f"{farm.layout.labels[i]} {k}" for k, i in enumerate(like)), "shed"),
        category=(*(farm.layout.category[i] for i in like), "shed"),
        position=np.vstack([place, [[width / 2, depth - 0.1]]]),
        yaw=np.append(farm.layout.yaw[like], farm.layout.yaw[shed]),
        size=farm.layout.size[[*like, shed]],
        fixed=np.arange(buildings + 1) == buildings,
    )
    return Scene("crowded", (width, depth), layout)


def move(label: str, **arguments: Any) -> Case:
    """A case of whole moves by a random policy."""
    return Case(label, "FarmToTable-v0", arguments, random_policy, episodes=30)


def hand(label: str, policy: Callable[[], Act], animals: int = 40, **arguments: Any) -> Case:
    """A case of a steered hand."""
    return Case(label, "FarmToTableHand-v0", many(animals) | arguments, policy)


CASES = [
    Case(YARDSTICK, YARDSTICK, {}, random_policy, episodes=20),
    Case("CartPole-v1", "CartPole-v1", {}, random_policy, episodes=20),
    move("FarmToTable-v0"),
    move("... slot, 3 visits", action="slot", visits=3),
    move("... black-box", knowledge="black-box"),
    move("... pixels", observation="pixels"),
    hand("FarmToTableHand-v0, idle, 300 animals", waiting_hand, 300),
    hand("... dragging, 300 animals", dragging_hand, 300),
    Case("... random", "FarmToTableHand-v0", {}, random_policy),
    Case("FarmToTableLayout-v0", "FarmToTableLayout-v0", {}, random_policy, episodes=20),
    Case("SceneLayout-v0", "SceneLayout-v0", {}, random_policy, episodes=20),
    Case("... H1, 52 objects", "SceneLayout-v0", {"scene": "H1"}, random_policy, episodes=10),
]

ANIMALS = (10, 100, 1000, 10_000)
BUILDINGS = (10, 50, 200)


def measure(cases: list[Case], rounds: int) -> list[Case]:
    """Record and time the cases, which take turns to share the machine's better and worse moments."""
    kept = []
    for case in cases:
        try:
            case.record()
        except gym.error.DependencyNotInstalled:
            print(f"({case.name} is left out: pip install '.[bench]')")
            continue
        kept.append(case)
    for _ in range(rounds):
        for seed in range(max(case.episodes for case in kept)):
            for case in kept:
                if seed < case.episodes:
                    case.play(seed)
    return kept


def table(cases: list[Case], others: list[Case]) -> str:
    """Steps a second of cases, and by those of others, resets included and without them."""
    lines = [
        "| | steps/s | without resets |" + "".join(f" by {one.label} | without resets |" for one in others)
    ]
    lines.append("|---|" + "---:|" * (2 + 2 * len(others)))
    for case in cases:
        cells = [f"{1 / seconds:.0f}" for seconds in case.step_s]
        for other in others:
            ratios = zip(other.step_s, case.step_s, strict=True)
            cells += [f"{theirs / ours:.3g}" for theirs, ours in ratios]
        lines.append(f"| {case.label} | {' | '.join(cells)} |")
    return "\n".join(lines)


def growth(kind: str, sizes: tuple[int, ...], make: Callable[[int], list[Case]], rounds: int) -> str:
    """Microseconds a step by size, a row for each."""
    rows = [measure(make(size), rounds) for size in sizes]
    lines = [f"| {kind} |" + "".join(f" {case.label} |" for case in rows[0])]
    lines.append("|---:|" + "---:|" * len(rows[0]))
    for size, row in zip(sizes, rows, strict=True):
        lines.append(f"| {size} |" + "".join(f" {1e6 * case.step_s[1]:.0f} |" for case in row))
    return "\n".join(lines)


def of_animals(animals: int) -> list[Case]:
    """Cases with so many animals on the table."""
    few = {"episodes": 2}
    cases = [
        hand("idle", waiting_hand, animals),
        hand("dragging", dragging_hand, animals),
        move("move", animals_a_second=animals / 4),
    ]
    for case in cases:
        case.episodes = few["episodes"]
    return cases


def of_buildings(buildings: int) -> list[Case]:
    """Cases with so many buildings on the table."""
    scene = crowded_farm(buildings)
    given = {"scene": scene, "jitter": "none"}
    cases = [
        hand("idle", waiting_hand, **given),
        hand("dragging", dragging_hand, **given),
        move("move", **given),
    ]
    for case in cases:
        case.episodes = 2
    return cases


def main() -> None:
    """Measure, print, and write if asked to."""
    numbers = [argument for argument in sys.argv[1:] if argument.isdigit()]
    rounds = int(numbers[0]) if numbers else 5
    load = os.getloadavg()[0]
    cases = measure(CASES, rounds)
    others = [case for case in cases if case.label == YARDSTICK] or cases[:1]
    parts = [
        table(cases, others),
        "## Growth with the animals on the table, microseconds a step",
        growth("animals", ANIMALS, of_animals, rounds),
        "## Growth with the buildings, microseconds a step",
        growth("buildings", BUILDINGS, of_buildings, rounds),
    ]
    machine = f"{platform.system()}, {os.cpu_count()} cores (load {load:.1f} when it began), "
    machine += f"Python {platform.python_version()}"
    text = "\n\n".join(parts)
    print(text)
    if "--write" in sys.argv:
        PAGE.write_text(PREFACE.format(machine=machine) + text + "\n", encoding="utf-8")


PREFACE = """# Speed of the environments

Made by `python benchmarks/environments.py --write` (LunarLander needs the extra `bench`), with {machine}:
processor time on one core, state observations, through `gym.make`. Episodes were recorded beforehand and are
replayed, so that the policies take no time; all cases take turns, and the best time of every episode
counts. The ratios carry over to other machines better than the numbers.

A step of `FarmToTable-v0` is a whole pick-and-place, with the hand's way there and back, and once an episode
five seconds of play; one of `FarmToTableHand-v0` is six ticks of physics, of the hand's visibility and of
the animals; one of `FarmToTableLayout-v0` is up to seven pick-and-places and five seconds of play. *Idle*:
the hand waits out of view. *Dragging*: it pulls one building after another through the others at up to
1.5 m/s.

"""


if __name__ == "__main__":
    main()
