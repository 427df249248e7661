"""What a planner would do on many tables, and all of that which a learner has been shown."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray

SHOWN = 12
"""How many of a planner's best steps are shown."""

CANDIDATES = 2 * SHOWN
"""How many are looked at, as several may mean the same action."""

TOLERANCE = 0.005
"""Loss of a plan's gain at which its value falls by the factor e: below the effort of a useless move."""


class Demonstration(NamedTuple):
    """The choices of a planner on B tables.

    Args:
        actions: (B, K, D) those that it considers, the last to end the turn.
        worth: (B, K) value of each: 1 for the best, less for one whose best plan gains less.
    """

    actions: IntArray
    worth: FloatArray


def demonstration(actions: IntArray, gain: FloatArray, leave: int) -> Demonstration:
    """The demonstration of a planner's best steps: each action once, and the end of the turn, which gains 0.

    Args:
        actions: (B, C, D) what the steps mean, the best first.
        gain: (B, C) the gain of each; minus infinity for those that fill up the row.
        leave: the first number of the action that ends the turn.
    """
    count, _, parts = actions.shape
    leaves = np.zeros(parts, dtype=np.int64)
    leaves[0] = leave
    actions = np.where(gain[..., None] > -np.inf, actions, leaves)
    same = (actions[:, :, None] == actions[:, None]).all(axis=-1)
    gain = np.where(np.tril(same, -1).any(axis=-1), -np.inf, gain)  # it is there, and gains no less
    kept = np.argsort(-gain, axis=1, kind="stable")[:, :SHOWN]
    best = np.take_along_axis(actions, kept[..., None], axis=1)
    shown = np.concatenate([best, np.tile(leaves, (count, 1, 1))], axis=1)
    had = np.concatenate([np.take_along_axis(gain, kept, axis=1), np.zeros((count, 1))], axis=1)
    return Demonstration(shown, np.exp((had - had.max(axis=1, keepdims=True)) / TOLERANCE))


class Demonstrations:
    """Observations, and the choices of the planner, of all demonstrations so far.

    Every part is an array with one row for each step: the parts of the observation by their names, "masks",
    "actions" and "worth" (those that the planner considers), and "returns" of what the learner did.
    """

    def __init__(self) -> None:
        self._parts: dict[str, list[npt.NDArray[Any]]] = {}

    def __len__(self) -> int:
        return sum(len(part) for part in self._parts.get("returns", []))

    def add(self, moments: Mapping[str, npt.NDArray[Any]]) -> None:
        """Some moments more."""
        for name, values in moments.items():
            self._parts.setdefault(name, []).append(values)

    def draw(self, count: int, rng: np.random.Generator) -> dict[str, npt.NDArray[Any]]:
        """So many of the moments, at random."""
        for parts in self._parts.values():
            if len(parts) > 1:  # once for all draws until more is shown
                parts[:] = [np.concatenate(parts)]
        rows = rng.integers(len(self), size=count)
        return {name: parts[0][rows] for name, parts in self._parts.items()}

    def save(self, path: Path) -> None:
        """Write all of them."""
        np.savez(path, **{name: np.concatenate(parts) for name, parts in self._parts.items()})  # type: ignore[arg-type]

    def load(self, path: Path) -> None:
        """Read what `save` wrote, in place of what there is."""
        with np.load(path, allow_pickle=False) as file:
            self._parts = {name: [file[name]] for name in file}
