"""The rewards, by name: each is a sum of named terms, and a term is the rise of a number over a step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from farm_ar.envs.features import MARGIN_SCALE
from farm_ar.reid.assignment import CostModel, assess, known_at, seen_at
from farm_ar.reid.costs import sorted_log_sides

if TYPE_CHECKING:
    from farm_ar.envs.env import FarmToTableEnv


@dataclass(frozen=True)
class Term:
    """A part of a reward: what is paid for each unit by which a number rises in a step.

    Args:
        measure: the number, of an environment as it stands.
        scale: weight of a unit of it, a wrong label being 1.
        foresight: whether it speaks of the snapshot to come. It is then measured before a step's snapshot is
            taken, and does not rise in a step in which the game itself takes one.
        needs_game: whether there has to be a game.
    """

    measure: Callable[[FarmToTableEnv], float]
    scale: float = 1.0
    foresight: bool = False
    needs_game: bool = False


def wrong_labels(env: FarmToTableEnv) -> float:
    """How many labels were last read from another object than their own."""
    return env.world.tracker.belief.wrong_labels


def ambiguity(env: FarmToTableEnv) -> float:
    """Half the sum over movable objects in view of 1 - margin / 0.3, of a snapshot taken now."""
    return env.ambiguity


def expected_wrong(env: FarmToTableEnv) -> float:
    """Sum over movable objects in view of (1 - signed margin / 0.3) / 2, of a snapshot taken now.

    It rises smoothly from 0 to 1 for each label while its object comes to be taken for another.
    """
    return env.expected_wrong


def clutter(env: FarmToTableEnv) -> float:
    """Half the sum over movable objects of 1 - margin / 0.3, were they in view and known to stand as they do.

    The lower it is, the farther anything has to be moved before the paper's method takes it for another.
    """
    truth, movable, scene = env.view.truth, env.view.movable, env.view.scene
    position, yaw, code = truth.position[movable], truth.yaw[movable], truth.category_code[movable]
    sides, weights = sorted_log_sides(truth.size[movable]), scene.cost_weights
    found = assess(
        seen_at(position[None], yaw[None], code, sides=sides),
        known_at(position, yaw, code, sides),
        CostModel(weights.translation / scene.diagonal, float(weights.rotation), compare_sizes=True),
        margins=True,
    )
    return float((1 - np.clip(found.margin / MARGIN_SCALE, 0.0, 1.0)).sum() / 2)


def miscounts(env: FarmToTableEnv) -> float:
    """Animals so far that did not get into the building of their colour."""
    return env.world.miscounts


def endpoint_error(env: FarmToTableEnv) -> float:
    """Sum over labels of the metres from believed to true place, as a share of the diagonal."""
    world = env.world
    return float(world.tracker.belief.endpoint_error(world.truth).sum()) / world.tracker.scene.diagonal


MARGIN_SHARE = 0.5
"""Weight of a unit of ambiguity, or of clutter, a wrong label being 1."""

REWARDS: dict[str, dict[str, Term]] = {
    "identity": {"identity": Term(wrong_labels)},
    "margin": {"identity": Term(wrong_labels), "margin": Term(ambiguity, MARGIN_SHARE, foresight=True)},
    "shaped": {"identity": Term(wrong_labels), "shaped": Term(expected_wrong, foresight=True)},
    "clutter": {"identity": Term(wrong_labels), "clutter": Term(clutter, MARGIN_SHARE)},
    "miscount": {"miscount": Term(miscounts, needs_game=True)},
    "endpoint": {"endpoint": Term(endpoint_error)},
}
"""The terms of each reward."""

EFFORT = "reward/effort"
"""The name of what effort costs, in what is logged."""


class Reward:
    """What a step is paid: its terms, less what its effort costs.

    Args:
        name: of the reward.
        sign: 1 where a rise is paid for, -1 where it costs.
        effort_weight: what a unit of effort costs.
    """

    def __init__(self, name: str, sign: int, effort_weight: float) -> None:
        terms = REWARDS[name]
        self._terms = [
            (f"reward/{name}", term.measure, sign * term.scale, term.foresight)
            for name, term in terms.items()
        ]
        self._looks_ahead = any(term.foresight for term in terms.values())
        self._effort_weight = effort_weight
        self._before: list[float] = []
        self._ahead: list[float] = []

    def begin(self, env: FarmToTableEnv) -> None:
        """A step begins."""
        self._before = self._ahead = [measure(env) for _, measure, _, _ in self._terms]

    def look_ahead(self, env: FarmToTableEnv) -> None:
        """The step's action has been executed, and its snapshot, if it has one, is yet to be taken."""
        if self._looks_ahead:
            self._ahead = [measure(env) if foresight else 0.0 for _, measure, _, foresight in self._terms]

    def paid(self, env: FarmToTableEnv, effort: float) -> dict[str, float]:
        """The terms of a step that is over, by their names in `info`; the reward is their sum."""
        paid = {}
        for k, (name, measure, scale, foresight) in enumerate(self._terms):
            before, now = self._before[k], self._ahead[k] if foresight else measure(env)
            paid[name] = scale * (now - before) if now != before else 0.0
        paid[EFFORT] = -self._effort_weight * effort if effort else 0.0
        return paid

    def nothing(self) -> dict[str, float]:
        """The terms before the first step."""
        return dict.fromkeys([*(name for name, *_ in self._terms), EFFORT], 0.0)
