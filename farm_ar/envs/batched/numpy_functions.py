"""NumPy's own arctan2 for kernels: where processors have wide vectors it is not libm's to the last bit.

A camera's heading is computed with it, and traces hold what it gave. Its inner loop is called, which a ufunc
holds in fields that are part of NumPy's public C interface (`PyUFuncObject`); it needs no GIL.
"""

from __future__ import annotations

import ctypes

import llvmlite.binding  # type: ignore[import-untyped]
import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.game_logic.physics.chipmunk import BRIDGED, declare
from farm_ar.kernels import compiled

_SYMBOL = "farm_ar_numpy_arctan2"


class _Ufunc(ctypes.Structure):
    """The first fields of a `PyUFuncObject`."""

    _fields_ = (
        ("head", ctypes.c_char * object.__basicsize__),
        ("inputs", ctypes.c_int),
        ("outputs", ctypes.c_int),
        ("arguments", ctypes.c_int),
        ("identity", ctypes.c_int),
        ("loops", ctypes.POINTER(ctypes.c_void_p)),
        ("data", ctypes.POINTER(ctypes.c_void_p)),
    )


def _loop() -> tuple[int, int]:
    """Addresses of the loop over doubles and of what is passed to it."""
    ufunc, which = _Ufunc.from_address(id(np.arctan2)), np.arctan2.types.index("dd->d")
    if (ufunc.inputs, ufunc.outputs, ufunc.arguments) != (2, 1, 3):  # pragma: no cover - another NumPy
        raise ImportError("NumPy's ufuncs have another form than farm-ar knows")
    return int(ufunc.loops[which] or 0), int(ufunc.data[which] or 0)


def _call_loop(arguments: int, count: int, strides: int, data: int) -> None:
    """The loop; for compiled code only."""
    raise NotImplementedError


_LOOP, _DATA = _loop()
if BRIDGED:
    declare(_call_loop, _SYMBOL, ["pointer"] * 4, "void")
    llvmlite.binding.add_symbol(_SYMBOL, _LOOP)


def room_for_call() -> tuple[FloatArray, IntArray]:
    """(3,) numbers and (7,) addresses that `arctan2` works in; each thread has its own."""
    return np.zeros(3), np.array([0, 0, 0, 1, 8, 8, 8], dtype=np.int64)


@compiled
def arctan2(y: float, x: float, numbers: FloatArray, places: IntArray, data: int) -> float:
    """`np.arctan2` of two numbers, in what `room_for_call` gives and with `DATA`."""
    numbers[0], numbers[1] = y, x
    begin = numbers.ctypes.data
    places[0], places[1], places[2] = begin, begin + 8, begin + 16
    words = places.ctypes.data
    _call_loop(words, words + 24, words + 32, data)
    return float(numbers[2])


DATA = _DATA
