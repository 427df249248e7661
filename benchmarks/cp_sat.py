"""OR-Tools' CP-SAT on the paper's binary programme (Eqs. 8 and 9), on one thread like the other solvers."""

from __future__ import annotations

import numpy as np
from ortools.sat.python import cp_model

from farm_ar.arrays import FloatArray, IntArray


def solve_cp_sat(cost: FloatArray) -> IntArray:
    """The (N,) column of each row of (N, M) finite costs, N <= M."""
    n, m = cost.shape
    model = cp_model.CpModel()
    assigned = [[model.new_bool_var("") for _ in range(m)] for _ in range(n)]
    for row in assigned:
        model.add_exactly_one(row)
    for column in zip(*assigned, strict=True):
        model.add_at_most_one(column)
    variables = [variable for row in assigned for variable in row]
    model.minimize(cp_model.LinearExpr.weighted_sum(variables, cost.ravel().tolist()))
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    status = solver.solve(model)
    if status != cp_model.OPTIMAL:
        raise RuntimeError(f"CP-SAT ended with {solver.status_name(status)}, not with the optimum")
    value = np.array([[solver.value(variable) for variable in row] for row in assigned])
    answer: IntArray = value.argmax(axis=1)
    return answer
