import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.arrays import FloatArray
from farm_ar.reid import UNASSIGNED, solve_assignment
from farm_ar.reid.margins import margins, margins_of_assigned


def total(cost: FloatArray) -> float:
    """Least total; infinite where not every row can have a column."""
    column = solve_assignment(cost)
    if (column == UNASSIGNED).any():
        return np.inf
    return float(cost[np.arange(len(cost)), column].sum())


def margins_by_solving_again(cost: FloatArray, column: np.ndarray) -> list[float]:
    """T4 as it is defined: forbid each row's column in turn and solve anew."""
    result = []
    for i, j in enumerate(column):
        forbidden = cost.copy()
        forbidden[i, j] = np.inf
        result.append(total(forbidden) - total(cost))
    return result


@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(1, 6),
    free=st.integers(0, 4),
    banned=st.sampled_from([0.0, 0.3]),
    ties=st.booleans(),
)
def test_a_margin_is_the_rise_when_a_rows_column_is_forbidden(
    seed: int, rows: int, free: int, banned: float, ties: bool
) -> None:
    rng = np.random.default_rng(seed)
    cost = (
        rng.integers(0, 4, (rows, rows + free)).astype(float)
        if ties
        else rng.uniform(0, 3, (rows, rows + free))
    )
    cost[rng.random(cost.shape) < banned] = np.inf
    column = solve_assignment(cost)
    found = margins(cost, column)
    kept = column != UNASSIGNED
    assert np.isnan(found[~kept]).all()
    expected = margins_by_solving_again(cost[kept], column[kept])
    np.testing.assert_allclose(found[kept], expected, atol=1e-9)
    if kept.any():
        in_python = margins_of_assigned.py_func(np.ascontiguousarray(cost[kept]), column[kept])
        np.testing.assert_allclose(in_python, found[kept], atol=1e-12)


def test_a_margin_by_hand() -> None:
    # Row 0 would take column 2 for 2 more; row 1 would take it for 3 more, or swap with row 0 for 7 more.
    cost = np.array([[1.0, 4.0, 3.0], [6.0, 2.0, 5.0]])
    assert margins(cost, np.array([0, 1])).tolist() == pytest.approx([2.0, 3.0])


def test_a_row_without_another_column_has_an_infinite_margin() -> None:
    assert margins(np.array([[1.0]]), np.array([0])).tolist() == [np.inf]
    assert margins(np.array([[1.0, np.inf]]), np.array([0])).tolist() == [np.inf]


def test_rows_without_a_column_have_no_margin() -> None:
    assert np.isnan(margins(np.array([[np.inf, np.inf]]), np.array([UNASSIGNED]))).all()
    assert margins(np.zeros((0, 3)), np.zeros(0, dtype=np.int64)).shape == (0,)
