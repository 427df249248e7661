import itertools
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import OptionError
from farm_ar.reid import SOLVERS, UNASSIGNED, k_best, solve_assignment
from farm_ar.reid.assignment import assign_most

FORBIDDEN = float("inf")


def outcome(cost: FloatArray, column: IntArray) -> tuple[int, float]:
    """How many rows stay empty, and what the others cost."""
    given_rows = column != UNASSIGNED
    columns = column[given_rows].tolist()
    assert len(set(columns)) == len(columns), "a column was given twice"
    return int(np.sum(~given_rows)), float(cost[given_rows, column[given_rows]].sum())


def brute_force(cost: FloatArray) -> tuple[tuple[int, float], set[tuple[int, ...]]]:
    """Fewest empty rows, then the least total; and all assignments that attain it."""
    n, m = cost.shape
    best, optima = (n + 1, 0.0), set()
    # Columns from m on stand for none.
    for columns in {tuple(j if j < m else UNASSIGNED for j in p) for p in permutations(range(m + n), n)}:
        column = np.array(columns)
        if np.isfinite(cost[column != UNASSIGNED, column[column != UNASSIGNED]]).all():
            found = outcome(cost, column)
            if found[0] < best[0] or (found[0] == best[0] and found[1] < best[1] - 1e-9):
                best, optima = found, {columns}
            elif found[0] == best[0] and found[1] <= best[1] + 1e-9:
                optima.add(columns)
    return best, optima


def compiled(cost: FloatArray) -> IntArray:
    n, m = cost.shape
    column = np.empty(n, dtype=np.int64)
    assign_most(cost, column, np.empty(n), np.empty(m + n))
    return column


@st.composite
def cost_matrices(draw: st.DrawFn) -> FloatArray:
    """Up to 4 x 5 costs, most of them with ties, some forbidden."""
    n, m = draw(st.integers(1, 4)), draw(st.integers(1, 5))
    entry = st.one_of(st.integers(0, 3).map(float), st.floats(0, 5).map(lambda x: round(x, 3)))
    if draw(st.booleans()):
        entry = st.one_of(entry, st.just(FORBIDDEN))
    row = st.lists(entry, min_size=m, max_size=m)
    return np.array(draw(st.lists(row, min_size=n, max_size=n)))


@given(cost_matrices())
def test_every_solver_finds_the_optimum(cost: FloatArray) -> None:
    (empty, total), _ = brute_force(cost)
    for name, found in {name: solve_assignment(cost, name) for name in SOLVERS}.items():
        assert outcome(cost, found) == (empty, pytest.approx(total, abs=1e-9)), name
    assert outcome(cost, compiled(cost)) == (empty, pytest.approx(total, abs=1e-9))


@given(st.integers(0, 2**32 - 1), st.sampled_from([(8, 29), (12, 12), (14, 9), (1, 40), (40, 1)]))
def test_large_problems_have_one_optimum_for_all_solvers(seed: int, shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(seed)
    cost = rng.uniform(0, 3, shape)
    cost[rng.random(shape) < rng.uniform(0, 0.9)] = FORBIDDEN
    expected = outcome(cost, solve_assignment(cost, "lsap"))
    assert outcome(cost, compiled(cost)) == (expected[0], pytest.approx(expected[1]))
    if seed % 10 == 0:
        found = outcome(cost, solve_assignment(cost, "mip"))
        assert found == (expected[0], pytest.approx(expected[1]))


@pytest.mark.parametrize("surplus", [False, True])
@pytest.mark.parametrize("gated", [False, True])
def test_no_solver_stops_near_the_optimum(surplus: bool, gated: bool) -> None:
    rng = np.random.default_rng(6 + 2 * surplus + gated)
    for _ in range(60):
        n, m = sorted((rng.integers(6, 16), rng.integers(7, 17)), reverse=surplus)
        cost = rng.uniform(0, 3, (n, m))
        if gated:
            cost[rng.integers(0, 3, n)[:, None] != rng.integers(0, 3, m)] = FORBIDDEN
        empty, total = outcome(cost, solve_assignment(cost, "lsap"))
        for found in (solve_assignment(cost, "mip"), compiled(cost)):
            assert outcome(cost, found) == (empty, pytest.approx(total, abs=1e-9))


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_small_problem_by_hand(solver: str) -> None:
    # Two rows want column 0: giving it to the first costs 1 + 2 + 1 in all, to the second 6 + 1 + 1.
    cost = np.array([[1.0, 6.0, 9.0, 9.0], [1.0, 2.0, 9.0, 9.0], [9.0, 9.0, 9.0, 1.0]])
    assert solve_assignment(cost, solver).tolist() == [0, 1, 3]


@pytest.mark.parametrize("solver", SOLVERS)
def test_rows_in_excess_stay_empty_where_that_costs_least(solver: str) -> None:
    cost = np.array([[5.0, 4.0], [1.0, 9.0], [2.0, 1.0]])
    assert solve_assignment(cost, solver).tolist() == [UNASSIGNED, 0, 1]


@pytest.mark.parametrize("solver", SOLVERS)
def test_what_is_forbidden_is_not_given_however_dear_the_rest(solver: str) -> None:
    cost = np.array([[0.0, 1e6], [0.0, FORBIDDEN]])
    assert solve_assignment(cost, solver).tolist() == [1, 0]
    assert compiled(cost).tolist() == [1, 0]


@pytest.mark.parametrize("solver", SOLVERS)
def test_rows_without_any_column_stay_empty_and_leave_the_others_alone(solver: str) -> None:
    cost = np.array([[FORBIDDEN] * 3, [2.0, 1.0, 3.0], [FORBIDDEN] * 3])
    assert solve_assignment(cost, solver).tolist() == [UNASSIGNED, 1, UNASSIGNED]
    nothing = np.full((2, 3), FORBIDDEN)
    assert solve_assignment(nothing, solver).tolist() == [UNASSIGNED] * 2
    assert compiled(nothing).tolist() == [UNASSIGNED] * 2


@pytest.mark.parametrize("solver", SOLVERS)
def test_as_few_rows_stay_empty_as_possible_even_if_that_is_dearer(solver: str) -> None:
    # Cheapest single choice is row 0, column 0; but row 1 can have nothing else.
    cost = np.array([[0.0, 100.0], [50.0, FORBIDDEN]])
    assert solve_assignment(cost, solver).tolist() == [1, 0]
    assert compiled(cost).tolist() == [1, 0]
    # A fourth label costs more than three times the dearest label does alone.
    chain = np.array(
        [
            [0.0, 9.0, FORBIDDEN, FORBIDDEN],
            [FORBIDDEN, 0.0, 9.0, FORBIDDEN],
            [FORBIDDEN, FORBIDDEN, 0.0, 9.0],
            [9.0, FORBIDDEN, FORBIDDEN, FORBIDDEN],
        ]
    )
    assert solve_assignment(chain, solver).tolist() == [1, 2, 3, 0]
    assert compiled(chain).tolist() == [1, 2, 3, 0]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("shape", [(0, 3), (3, 0), (0, 0)])
def test_nothing_to_assign_gives_nothing(solver: str, shape: tuple[int, int]) -> None:
    assert solve_assignment(np.zeros(shape), solver).tolist() == [UNASSIGNED] * shape[0]
    assert compiled(np.zeros(shape)).tolist() == [UNASSIGNED] * shape[0]


def test_an_unknown_solver_is_refused_with_those_known() -> None:
    with pytest.raises(OptionError, match=r"^solver: must be one of lsap, mip, got 'simplex'$"):
        solve_assignment(np.ones((1, 1)), "simplex")


def test_the_costs_are_not_changed() -> None:
    cost = np.array([[1.0, FORBIDDEN], [FORBIDDEN, FORBIDDEN]])
    before = cost.copy()
    for solver in SOLVERS:
        solve_assignment(cost, solver, np.random.default_rng(0))
    compiled(cost)
    np.testing.assert_array_equal(cost, before)


@pytest.mark.parametrize("shape", [(2, 3), (3, 2), (3, 3)])
def test_ties_broken_at_random_reach_every_optimum(shape: tuple[int, int], rng: np.random.Generator) -> None:
    for _ in range(10):
        cost = rng.integers(0, 2, shape).astype(float)
        _, optima = brute_force(cost)
        draws = [tuple(solve_assignment(cost, rng=rng).tolist()) for _ in range(60 * len(optima))]
        assert set(draws) == optima


def test_ties_are_broken_evenly_among_equals(rng: np.random.Generator) -> None:
    first = [solve_assignment(np.ones((1, 4)), rng=rng)[0] for _ in range(2000)]
    assert np.bincount(first) / 2000 == pytest.approx([0.25] * 4, abs=0.05)


def test_the_same_seed_breaks_ties_in_the_same_way() -> None:
    def draws(seed: int) -> list[list[int]]:
        rng = np.random.default_rng(seed)
        return [solve_assignment(np.ones((3, 5)), rng=rng).tolist() for _ in range(20)]

    assert draws(7) == draws(7)
    assert draws(7) != draws(8)


@given(st.integers(0, 2**32 - 1), st.sampled_from(["lsap", "lsap", "lsap", "mip"]))
def test_a_generator_changes_nothing_where_there_are_no_ties(seed: int, solver: str) -> None:
    rng = np.random.default_rng(seed)
    cost = rng.uniform(0, 1, rng.integers(1, 7, 2))
    expected = solve_assignment(cost)
    assert solve_assignment(cost, solver, rng).tolist() == expected.tolist()


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
