"""The next best answers to a snapshot, for a user interface that lets its user choose."""

from __future__ import annotations

import numpy as np

from farm_ar.reid.base import Identification, Reidentifier, as_reidentifier
from farm_ar.reid.k_best import k_best
from farm_ar.scenes import Snapshot


def alternatives(reid: Reidentifier, snapshot: Snapshot, k: int) -> list[Identification]:
    """The k best answers, the best first; fewer where there are not so many different ones.

    Args:
        reid: the rule.
        snapshot: what was seen.
        k: how many.

    Raises:
        OptionError: k is below 1, or the rule has no costs.
        SnapshotError: a detection's category is not one of the scene's.
    """
    cost, names = as_reidentifier(reid).problem(snapshot)
    candidates = tuple(name for name in names if name is not None)
    answers = []
    for column, _ in k_best(cost, k):
        labels = tuple(None if j < 0 else names[j] for j in column.tolist())
        given = np.array([label is not None for label in labels], dtype=bool)
        costs = np.full(len(labels), np.nan)
        costs[given] = cost[given.nonzero()[0], column[given]]
        answers.append(Identification(labels, costs, candidates))
    return answers
