"""Solvers of the assignment by name (paper, Eqs. 8 and 9): one optimum; and the k best assignments."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import MissingPackageError, OptionError, known_name

UNASSIGNED = -1
"""The column of a row that gets none."""

Solver = Callable[[FloatArray], IntArray]
"""From (N, M) costs, infinite where a label is not allowed, to the (N,) column of each row or `UNASSIGNED`.

As many rows as possible get a column of their own; among such assignments the sum of the costs is smallest.
"""


def solve_assignment(
    cost: FloatArray, solver: str = "lsap", rng: np.random.Generator | None = None
) -> IntArray:
    """Give each detection a label of its own so that the costs sum to the least.

    Args:
        cost: (N, M) costs, infinite where a label is not allowed.
        solver: a name in `SOLVERS`.
        rng: with it, ties are broken at random rather than by position.

    Returns:
        (N,) label of each detection; `UNASSIGNED` where none is left for it.

    Raises:
        OptionError: the solver is not known.
    """
    solve = SOLVERS.get(solver) or SOLVERS[known_name("solver", solver, SOLVERS)]
    if not cost.size:
        return np.full(len(cost), UNASSIGNED, dtype=np.int64)
    if rng is None:
        return solve(cost)
    rows, columns = rng.permutation(cost.shape[0]), rng.permutation(cost.shape[1])
    found = solve(cost[np.ix_(rows, columns)])
    result = np.full(len(cost), UNASSIGNED, dtype=np.int64)
    result[rows] = np.where(found == UNASSIGNED, UNASSIGNED, columns[found])
    return result


def solve_lsap(cost: FloatArray) -> IntArray:
    """The linear sum assignment of SciPy, a shortest augmenting path method."""
    try:
        rows, columns = linear_sum_assignment(cost)
    except ValueError:  # not every row, or if they are fewer every column, can be given one that is allowed
        allowed = np.isfinite(cost)
        filled = np.where(allowed, cost, _prohibitive(cost[allowed], min(cost.shape)))
        rows, columns = linear_sum_assignment(filled)
        columns = np.where(allowed[rows, columns], columns, UNASSIGNED)
    if len(rows) == len(cost):
        return columns.astype(np.int64, copy=False)
    result = np.full(len(cost), UNASSIGNED, dtype=np.int64)
    result[rows] = columns
    return result


def solve_mip(cost: FloatArray) -> IntArray:
    """The paper's binary programme as written, by OR-Tools' SCIP.

    Where not every row can have a column, Eq. 8 has no solution; each row then may stay empty, at a cost
    above that of any assignment.

    Raises:
        MissingPackageError: OR-Tools is not installed, or comes without SCIP.
    """
    try:
        from ortools.linear_solver import pywraplp
    except ImportError as problem:  # pragma: no cover - it is a core dependency
        raise MissingPackageError("solver mip needs ortools: pip install ortools") from problem
    programme = pywraplp.Solver.CreateSolver("SCIP")
    if programme is None:  # pragma: no cover - the published wheels hold SCIP
        raise MissingPackageError("solver mip needs an ortools with SCIP: pip install ortools")
    n, m = cost.shape
    allowed = np.isfinite(cost)
    assigned = {(i, j): programme.BoolVar("") for i, j in np.argwhere(allowed).tolist()}
    objective = sum(float(cost[key]) * variable for key, variable in assigned.items())
    empty = []
    if n > m or not allowed.all():
        empty = [programme.BoolVar("") for _ in range(n)]
        objective += sum(_prohibitive(cost[allowed], min(n, m)) * variable for variable in empty)
    for i in range(n):
        row = [assigned[i, j] for j in range(m) if allowed[i, j]]
        programme.Add(sum(row) + (empty[i] if empty else 0) == 1)
    for j in range(m):
        programme.Add(sum(assigned[i, j] for i in range(n) if allowed[i, j]) <= 1)
    programme.Minimize(objective)
    exact = pywraplp.MPSolverParameters()
    exact.SetDoubleParam(pywraplp.MPSolverParameters.RELATIVE_MIP_GAP, 0.0)
    if programme.Solve(exact) != pywraplp.Solver.OPTIMAL:  # pragma: no cover - always feasible and bounded
        raise OptionError("cost", "must give a programme that SCIP solves", cost.tolist())
    result = np.full(n, UNASSIGNED, dtype=np.int64)
    for (i, j), variable in assigned.items():
        if variable.solution_value() > 0.5:
            result[i] = j
    return result


SOLVERS: dict[str, Solver] = {"lsap": solve_lsap, "mip": solve_mip}
"""The solvers by name."""


def _prohibitive(allowed_costs: FloatArray, most_assigned: int) -> float:
    """A cost so high that one more assignment always lowers the total, whatever the others then cost."""
    if not allowed_costs.size:
        return 1.0
    spread = float(allowed_costs.max() - allowed_costs.min())
    return float(allowed_costs.max()) + (most_assigned + 1) * (spread + 1.0)


class Assignment(NamedTuple):
    """One assignment: the column of each row, `UNASSIGNED` for none, and the sum of the costs."""

    column: IntArray
    total: float


class _Part(NamedTuple):
    """A part of all assignments and the best one in it; `turn` settles ties, so no arrays are compared."""

    total: float
    turn: int
    column: IntArray
    cost: FloatArray
    settled: int


def k_best(cost: FloatArray, k: int) -> list[Assignment]:
    """The k assignments of least total cost, the best first; fewer where there are not so many.

    Every one assigns as many rows as can be. Of the set of all assignments the best is taken out, and what is
    left is split by the first row that differs from it; so on with the part that holds the next best.

    Args:
        cost: (N, M) costs; what is not finite cannot be assigned.
        k: how many.

    Raises:
        OptionError: k is below 1.
    """
    if k < 1:
        raise OptionError("k", "must be a whole number from 1 on", k)
    n, m = cost.shape
    if n == 0:
        return [Assignment(np.zeros(0, dtype=np.int64), 0.0)]
    allowed = cost[np.isfinite(cost)]
    spread = float(np.ptp(allowed)) if allowed.size else 0.0
    prohibitive = (n + 1) * (spread + 1.0) + (float(np.abs(allowed).max()) if allowed.size else 0.0)
    # A row that gets no column gets one of its own, at a cost above that of any other assignment.
    own = np.where(np.eye(n, dtype=bool), prohibitive, np.inf)
    whole = np.hstack([np.where(np.isfinite(cost), cost, np.inf), own])
    count = 0
    waiting: list[_Part] = []
    _push(waiting, whole, 0, count)
    found: list[Assignment] = []
    most_assigned = -1
    while waiting and len(found) < k:
        best = heapq.heappop(waiting)
        assigned = best.column < m
        most_assigned = max(most_assigned, int(assigned.sum()))
        if assigned.sum() < most_assigned:
            break
        column = np.where(assigned, best.column, UNASSIGNED)
        total = float(cost[np.flatnonzero(assigned), column[assigned]].sum())
        found.append(Assignment(column, total))
        rest = best.cost.copy()
        for row in range(best.settled, n):
            part = rest.copy()
            part[row, best.column[row]] = np.inf
            count += 1
            _push(waiting, part, row, count)
            keep = rest[row, best.column[row]]
            rest[row] = np.inf
            rest[:, best.column[row]] = np.inf
            rest[row, best.column[row]] = keep
    return found


def _push(waiting: list[_Part], cost: FloatArray, settled: int, count: int) -> None:
    """Add a part, if there is any assignment in it."""
    try:
        rows, column = linear_sum_assignment(cost)
    except ValueError:
        return
    total = float(cost[rows, column].sum())
    heapq.heappush(waiting, _Part(total, count, column.astype(np.int64), cost, settled))
