"""NumPy's own sum and arctan2 for kernels.

Where processors have wide vectors its arctan2 is not libm's to the last bit. A camera's heading is computed
with it, and traces hold what it gave. Its inner loop is called, which a ufunc
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
_BLOCK, _DEEPEST = 128, 64


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


@compiled
def block_sum(values: FloatArray, first: int, n: int) -> float:
    """NumPy's sum of at most `_BLOCK` numbers: eight sums at a time."""
    total: float = 0.0
    if n < 8:
        for k in range(n):
            total += values[first + k]
        return total
    part, whole = np.empty(8), n - n % 8
    for k in range(8):
        part[k] = values[first + k]
    for i in range(8, whole, 8):
        for k in range(8):
            part[k] += values[first + i + k]
    total += ((part[0] + part[1]) + (part[2] + part[3])) + ((part[4] + part[5]) + (part[6] + part[7]))
    for i in range(whole, n):
        total += values[first + i]
    return total


@compiled
def numpy_sum(values: FloatArray) -> float:
    """`values.sum()` to the last bit: NumPy halves what is longer than a block."""
    ahead, depth = np.empty((_DEEPEST, 3), dtype=np.int64), np.empty(_DEEPEST, dtype=np.int64)
    total, waiting, held = np.empty(_DEEPEST), 1, 0
    ahead[0, 0], ahead[0, 1], ahead[0, 2] = 0, len(values), 0
    while waiting > 0:
        waiting -= 1
        first, n, deep = ahead[waiting, 0], ahead[waiting, 1], ahead[waiting, 2]
        if n > _BLOCK:
            half = n // 2
            half -= half % 8
            ahead[waiting, 0], ahead[waiting, 1], ahead[waiting, 2] = first + half, n - half, deep + 1
            ahead[waiting + 1, 0], ahead[waiting + 1, 1], ahead[waiting + 1, 2] = first, half, deep + 1
            waiting += 2
            continue
        found = block_sum(values, first, n)
        while held > 0 and depth[held - 1] == deep:  # its other half
            held -= 1
            found, deep = total[held] + found, deep - 1
        total[held], depth[held] = found, deep
        held += 1
    whole: float = total[0]
    return whole
