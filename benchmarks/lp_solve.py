"""The paper's own solver, lp_solve 5.5, on the paper's binary programme (Eqs. 8 and 9), through ctypes.

Debian and Ubuntu have it as `lp-solve` or `liblpsolve55-dev`; `AVAILABLE` says whether it was found.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import time
from pathlib import Path

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import MissingPackageError

_PLACES = ("/usr/lib/lp_solve/liblpsolve55.so", "/usr/local/lib/liblpsolve55.so")
_AT_MOST, _EQUAL, _ONLY_CRITICAL_MESSAGES, _OPTIMAL = 1, 3, 1, 0
_Int, _Flag, _Pointer = ctypes.c_int, ctypes.c_ubyte, ctypes.c_void_p
_SIGNATURES = {
    "make_lp": (_Pointer, (_Int, _Int)),
    "set_verbose": (None, (_Pointer, _Int)),
    "set_add_rowmode": (_Flag, (_Pointer, _Flag)),
    "set_obj_fnex": (_Flag, (_Pointer, _Int, _Pointer, _Pointer)),
    "add_constraintex": (_Flag, (_Pointer, _Int, _Pointer, _Pointer, _Int, ctypes.c_double)),
    "set_binary": (_Flag, (_Pointer, _Int, _Flag)),
    "solve": (_Int, (_Pointer,)),
    "get_variables": (_Flag, (_Pointer, _Pointer)),
    "delete_lp": (None, (_Pointer,)),
}


def _library() -> ctypes.CDLL | None:
    found = ctypes.util.find_library("lpsolve55")
    for place in (*_PLACES, *([found] if found else [])):
        if found == place or Path(place).exists():
            library = ctypes.CDLL(place)
            for name, (result, arguments) in _SIGNATURES.items():
                function = getattr(library, name)
                function.restype, function.argtypes = result, arguments
            return library
    return None


_LIBRARY = _library()
AVAILABLE = _LIBRARY is not None
"""Whether the library was found."""


def solve_lp_solve(cost: FloatArray, seconds_inside: list[float] | None = None) -> IntArray:
    """The (N,) column of each row of (N, M) finite costs, N <= M, by lp_solve's branch and bound.

    To `seconds_inside` is added how long lp_solve's own `solve` took, the building of the model left out.

    Raises:
        MissingPackageError: lp_solve is not installed.
    """
    lp = _LIBRARY
    if lp is None:
        raise MissingPackageError("lp_solve needs its library, on Debian: apt-get install liblpsolve55-dev")
    n, m = cost.shape
    variable = np.arange(1, n * m + 1, dtype=np.int32).reshape(n, m)
    per_column = np.ascontiguousarray(variable.T)
    ones = np.ones(max(n, m))
    objective = np.ascontiguousarray(cost)
    model = lp.make_lp(0, n * m)
    try:
        lp.set_verbose(model, _ONLY_CRITICAL_MESSAGES)
        lp.set_add_rowmode(model, 1)
        lp.set_obj_fnex(model, n * m, objective.ctypes.data, variable.ctypes.data)
        for i in range(n):
            lp.add_constraintex(model, m, ones.ctypes.data, variable[i].ctypes.data, _EQUAL, 1.0)
        for j in range(m):
            lp.add_constraintex(model, n, ones.ctypes.data, per_column[j].ctypes.data, _AT_MOST, 1.0)
        lp.set_add_rowmode(model, 0)
        for index in range(1, n * m + 1):
            lp.set_binary(model, index, 1)
        begin = time.perf_counter()
        status = lp.solve(model)
        if seconds_inside is not None:
            seconds_inside.append(time.perf_counter() - begin)
        if status != _OPTIMAL:
            raise RuntimeError(f"lp_solve ended with status {status}, not with the optimum")
        value = np.empty(n * m)
        lp.get_variables(model, value.ctypes.data)
    finally:
        lp.delete_lp(model)
    column: IntArray = value.reshape(n, m).argmax(axis=1)
    return column
