from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.errors import OptionError
from farm_ar.reid import UNASSIGNED, k_best


def by_trying_all(cost: np.ndarray) -> list[float]:
    """The totals of all assignments that give as many rows as possible a column, least first."""
    n, m = cost.shape
    totals: dict[int, list[float]] = {}
    for way in itertools.product(range(m + 1), repeat=n):
        pairs = [(i, j) for i, j in enumerate(way) if j < m]
        columns = [j for _, j in pairs]
        if len(set(columns)) == len(columns) and all(np.isfinite(cost[pair]) for pair in pairs):
            totals.setdefault(len(pairs), []).append(sum(cost[pair] for pair in pairs))
    return sorted(totals[max(totals)])


@settings(max_examples=40 * settings().max_examples // 50, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 4),
    m=st.integers(1, 4),
    banned=st.sampled_from([0.0, 0.3]),
    k=st.integers(1, 12),
)
def test_the_k_best_are_those_that_trying_all_finds(seed, n, m, banned, k):
    rng = np.random.default_rng(seed)
    cost = rng.uniform(-1, 3, (n, m))
    cost[rng.random((n, m)) < banned] = np.inf
    found = k_best(cost, k)
    expected = by_trying_all(cost)[:k]
    np.testing.assert_allclose([one.total for one in found], expected, atol=1e-9)
    assert len({tuple(one.column) for one in found}) == len(found)
    for one in found:
        rows = np.flatnonzero(one.column != UNASSIGNED)
        assert cost[rows, one.column[rows]].sum() == pytest.approx(one.total)


def test_without_rows_there_is_one_assignment_and_k_must_be_positive():
    assert [one.total for one in k_best(np.zeros((0, 3)), 5)] == [0.0]
    with pytest.raises(OptionError, match="k: must be a whole number from 1 on, got 0"):
        k_best(np.zeros((1, 1)), 0)
