"""What a policy is, playing episodes with one, and from moves to actions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import Move
from farm_ar.envs.controls import MoveControl
from farm_ar.errors import OptionError


class Policy(ABC):
    """Acts in an environment; it is made with a seeded generator if it needs one.

    A policy is a class in a file of its own, and is listed in `POLICIES` if it needs nothing else.
    """

    @abstractmethod
    def act(self, env: FarmToTableEnv) -> Any:
        """The next action, in the environment's action space.

        Raises:
            OptionError: it cannot act there.
        """


SHIPPED = "models"
"""The folder beside this file with the policies that come with farm-ar."""

SHIPPED_ENV = "FarmToTable-v0"
"""The environment that these act in."""


def shipped() -> list[str]:
    """Names of the policies that come with farm-ar."""
    home = files("farm_ar.agents.policies").joinpath(SHIPPED)
    return sorted(Path(file.name).stem for file in home.iterdir() if file.name.endswith(".npz"))


class Visit:
    """Notices when another visit has begun."""

    def __init__(self) -> None:
        self._known: tuple[object, ...] | None = None

    def is_new(self, env: FarmToTableEnv) -> bool:
        """Whether the environment is in another visit than when this was last asked."""
        now = (env.world, env.view.believed, env.view.camera)
        # By identity: a visit with equal poses is another one all the same.
        same = self._known is not None and all(a is b for a, b in zip(now, self._known, strict=True))
        self._known = now
        return not same


@dataclass(frozen=True)
class Episode:
    """What came of an episode.

    Args:
        total: sum of the rewards.
        wrong_labels: at its end.
        accuracy: of its last snapshot.
        effort: of all its steps, as the rewards count it.
        miscounts: animals that did not get into the building of their colour.
        steps: how many.
    """

    total: float
    wrong_labels: int
    accuracy: float
    effort: float
    miscounts: int
    steps: int


def play_episode(
    env: Any, policy: Policy, seed: int | None = None, options: Mapping[str, Any] | None = None
) -> Episode:
    """Play one episode.

    Args:
        env: a `FarmToTableEnv`, wrapped or not; the policy is shown what is inside.
        policy: that acts.
        seed: of the reset; None goes on with the environment's own generator.
        options: of the reset.
    """
    _, info = env.reset(seed=seed, options=options)
    total, effort, steps, over = 0.0, 0.0, 0, False
    while not over:
        _, reward, terminated, truncated, info = env.step(policy.act(env.unwrapped))
        total, effort, steps = total + float(reward), effort + info["effort"], steps + 1
        over = terminated or truncated
    return Episode(total, info["wrong_labels"], info["accuracy"], effort, info["miscounts"], steps)


def play_episodes(env: Any, policy: Policy, seeds: Iterable[int]) -> list[Episode]:
    """Play an episode for each of the seeds of a reset."""
    return [play_episode(env, policy, seed) for seed in seeds]


def action_of(env: FarmToTableEnv, moves: Sequence[Move]) -> Any:
    """The action that makes the first of the moves, or all where a visit is one action; without any, the end.

    Args:
        env: an environment in an episode.
        moves: what is meant to be done, of movable objects.

    Raises:
        OptionError: the hand is steered.
    """
    return _require_moves(env).action.encode(moves, env.view)


def possible(env: FarmToTableEnv, move: Move) -> Move:
    """The move that an action can ask for in place of the one wanted, whatever is left of the budget.

    Raises:
        OptionError: the hand is steered.
    """
    return _require_moves(env).action.possible(move, env.view)


def moves_left(env: FarmToTableEnv) -> int:
    """How many objects a policy can still move in the visit.

    Raises:
        OptionError: the hand is steered.
    """
    control = _require_moves(env)
    return control.moves_left if env.config.control == "move" else len(env.view.movable)


def _require_moves(env: FarmToTableEnv) -> MoveControl:
    if not isinstance(env.control, MoveControl):
        raise OptionError("control", "must be move or layout for a policy that plans", env.config.control)
    return env.control
