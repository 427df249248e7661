"""The compiled assignment, compiled and as plain Python: its duals prove that it is optimal."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from farm_ar.arrays import FloatArray
from farm_ar.reid import (
    assignment,
    dimension_cost,
    pruning,
    rotation_cost,
    solve_assignment,
    total_cost,
    translation_cost,
)
from farm_ar.reid.costs import sorted_log_sides

Assign = Callable[..., None]


def check_certificate(cost: FloatArray, assign: Assign) -> None:
    """Primal and dual feasible with one value: optimal, whatever any solver says."""
    n, m = cost.shape
    column, u, v = np.empty(n, dtype=np.int64), np.empty(n), np.empty(m)
    assign(cost, column, u, v)
    assert sorted(set(column.tolist())) == sorted(column.tolist())
    assert column.min() >= 0
    assert column.max() < m
    slack = cost - u[:, None] - v
    assert slack.min() >= -1e-9
    assert np.abs(slack[np.arange(n), column]).max() <= 1e-9
    assert v.max() <= 0
    free = np.setdiff1d(np.arange(m), column)
    assert np.all(v[free] == 0)
    assert u.sum() + v.sum() == pytest.approx(cost[np.arange(n), column].sum())


@st.composite
def costs(draw: st.DrawFn) -> FloatArray:
    n = draw(st.integers(1, 12))
    m = draw(st.integers(n, 30))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    if draw(st.booleans()):  # with ties
        return rng.integers(0, 4, (n, m)).astype(float)
    return rng.uniform(0, 3, (n, m)) * rng.uniform(0.1, 10, (n, 1))


@given(costs())
def test_the_duals_prove_the_assignment_optimal(cost: FloatArray) -> None:
    check_certificate(cost, assignment.assign)
    check_certificate(cost, assignment.assign.py_func)


def test_one_more_row_can_shift_all_others() -> None:
    # Each row has its own place and likes the next one nearly as well; the last row wants the first place.
    n = 30
    cost = np.full((n, n), 50.0)
    for i in range(n - 1):
        cost[i, i], cost[i, i + 1] = 0.0, 0.1
    cost[n - 1, 0] = 0.0
    for assign in (assignment.assign, assignment.assign.py_func):
        column = np.empty(n, dtype=np.int64)
        assign(cost, column, np.empty(n), np.empty(n))
        assert column.tolist() == [*range(1, n), 0]
        check_certificate(cost, assign)


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (6, 6)])
def test_equal_costs_can_be_assigned_in_any_way(shape: tuple[int, int]) -> None:
    check_certificate(np.full(shape, 2.5), assignment.assign)


@given(st.integers(0, 2**32 - 1))
def test_plain_python_and_compiled_code_leave_the_same_rows_empty(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, 6, 2)
    cost = rng.uniform(0, 1, (n, m))
    cost[rng.random((n, m)) < 0.4] = np.inf
    found = []
    for assign_most in (assignment.assign_most, assignment.assign_most.py_func):
        column = np.empty(n, dtype=np.int64)
        assign_most(cost, column, np.empty(n), np.empty(m + n))
        found.append(column.tolist())
    assert found[0] == found[1]


def test_a_cost_that_is_not_a_number_is_never_assigned() -> None:
    cost = np.array([[np.nan, 3.0], [0.0, np.nan], [np.nan, np.nan]])
    column = np.empty(3, dtype=np.int64)
    assignment.assign_most(cost, column, np.empty(3), np.empty(5))
    assert column.tolist() == [1, 0, -1]


@pytest.mark.parametrize(
    ("detected", "offered", "gate", "expected"),
    [
        ([2, 1, 0], [2, 1, 0], True, True),
        ([2, 1, 0], [1, 2, 0], True, False),
        ([2, 1, 0], [1, 2, 0], False, True),
        ([1, 1, 2], [2, 2, 0], True, True),
        ([1, 1, 3], [2, 2, 0], True, False),
        ([1, 1, 3], [2, 2, 0], False, False),
    ],
)
def test_enough_labels_of_each_category_and_in_all(
    detected: list[int], offered: list[int], gate: bool, expected: bool
) -> None:
    for enough in (pruning.enough, pruning.enough.py_func):
        assert bool(enough(np.array(detected), np.array(offered), gate)) is expected


def test_a_large_problem_agrees_with_scipy(rng: np.random.Generator) -> None:
    cost = rng.uniform(0, 1, (150, 400))
    column = np.empty(150, dtype=np.int64)
    assignment.assign(cost, column, np.empty(150), np.empty(400))
    np.testing.assert_array_equal(column, linear_sum_assignment(cost)[1])


@given(
    seed=st.integers(0, 2**32 - 1),
    gate=st.booleans(),
    sizes=st.booleans(),
    unknown=st.sampled_from([0.0, 0.3]),
    own_labels=st.booleans(),
)
def test_assess_is_what_the_equations_and_scipy_say(
    seed: int, gate: bool, sizes: bool, unknown: float, own_labels: bool
) -> None:
    rng = np.random.default_rng(seed)
    b, k, m = 3, int(rng.integers(1, 6)), int(rng.integers(1, 6))
    position, yaw = rng.uniform(0, 4, (b, k, 2)), rng.uniform(-9, 9, (b, k))
    home, facing = rng.uniform(0, 4, (b, m, 2)), rng.uniform(-9, 9, (b, m))
    if not own_labels:
        home[:], facing[:] = home[0], facing[0]
    seen_code = np.where(rng.random((b, k)) < unknown, -1, rng.integers(0, 2, (b, k)))
    code, present = rng.integers(0, 2, m), rng.random((b, k)) < 0.8
    seen_size, size = rng.uniform(0.1, 1, (k, 3)), rng.uniform(0.1, 1, (m, 3))
    found = assignment.assess(
        assignment.seen_at(position, yaw, seen_code, present, sorted_log_sides(seen_size) if sizes else None),
        assignment.known_at(
            home if own_labels else home[0],
            facing if own_labels else facing[0],
            code,
            sorted_log_sides(size) if sizes else None,
        ),
        assignment.CostModel(0.7 / 5.0, 1.3, sizes, gate),
        margins=True,
        costs=True,
    )
    cost = total_cost(
        translation_cost(position, home, 5.0),
        rotation_cost(yaw, facing),
        dimension_cost(seen_size, size) if sizes else np.ones((1, 1)),
        0.7,
        1.3,
    )
    if gate:
        cost[(seen_code[..., None] >= 0) & (seen_code[..., None] != code)] = np.inf
    np.testing.assert_allclose(found.costs, cost, rtol=1e-9, atol=1e-12)
    for one in range(b):
        rows = np.flatnonzero(present[one])
        assert (found.label[one, ~present[one]] == -1).all()
        column = solve_assignment(cost[one, rows])
        assert found.label[one, rows].tolist() == column.tolist()
        margin, other = assignment.margins_and_runners_up(cost[one, rows], column)
        np.testing.assert_allclose(found.margin[one, rows], margin, atol=1e-9)
        assert found.runner_up[one, rows].tolist() == other.tolist()


def test_the_cost_of_one_pose_is_that_of_the_equations() -> None:
    x, z, yaw, label = 1.0, 2.0, 0.4, np.array([2.0, 0.5])
    expected = 0.3 * np.hypot(1.0, 1.5) + 0.9 * np.sin(0.3)
    for cost in (assignment.pose_cost, assignment.pose_cost.py_func):
        assert cost(x, z, yaw, label, 1.0, 0.3, 0.9) == pytest.approx(expected)
