"""Random numbers in kernels: NumPy's generator PCG64, each environment with a stream of its own.

The same draws from the same state give the bits that `numpy.random.Generator` gives (tested against it), so
that an environment in a batch begins and goes on like one by itself. A generator's state is read into a
record, and can be made a generator again.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba.extending import intrinsic
from numba.np.random import _constants as ziggurat

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.structs import Struct, Structs, new_structs

U64 = np.uint64

_intrinsic: Any = intrinsic

# O'Neill (2014): a linear congruence of 128 bits, of which 64 are given out (XSL-RR).
_FACTOR_HIGH, _FACTOR_LOW = U64(0x2360ED051FC65DA4), U64(0x4385DF649FCCF645)
_0, _1, _8, _9, _11, _32, _58, _63, _64 = (U64(k) for k in (0, 1, 8, 9, 11, 32, 58, 63, 64))
_BYTE, _BITS_32, _BITS_52 = U64(0xFF), U64(0xFFFFFFFF), U64(0x000FFFFFFFFFFFFF)
_TO_UNIT = 1.0 / 9007199254740992.0

# Marsaglia and Tsang (2000): tables of the ziggurat, as NumPy has them.
_KI, _WI, _FI = ziggurat.ki_double, ziggurat.wi_double, ziggurat.fi_double
_TAIL, _TAIL_INVERSE = float(ziggurat.ziggurat_nor_r), float(ziggurat.ziggurat_nor_inv_r)


class Stream(Struct):
    """The state of one PCG64."""

    high: np.uint64
    low: np.uint64
    step_high: np.uint64
    step_low: np.uint64
    kept: bool
    """Whether half of a number is left over."""
    half: np.uint64


def read_generator(generator: np.random.Generator, stream: Stream) -> None:
    """Fill in the stream that goes on where a generator of PCG64 stands."""
    state: Any = generator.bit_generator.state
    own, step = state["state"]["state"], state["state"]["inc"]
    stream.high, stream.low = U64(own >> 64), U64(own & 0xFFFFFFFFFFFFFFFF)
    stream.step_high, stream.step_low = U64(step >> 64), U64(step & 0xFFFFFFFFFFFFFFFF)
    stream.kept, stream.half = bool(state["has_uint32"]), U64(state["uinteger"])


def as_generator(stream: Stream) -> np.random.Generator:
    """A generator that goes on where a stream stands."""
    bits: Any = np.random.PCG64(0)
    own = {
        "state": int(stream.high) << 64 | int(stream.low),
        "inc": int(stream.step_high) << 64 | int(stream.step_low),
    }
    bits.state = {
        "bit_generator": "PCG64",
        "state": own,
        "has_uint32": int(stream.kept),
        "uinteger": int(stream.half),
    }
    return np.random.Generator(bits)


def streams_of(generators: list[np.random.Generator]) -> Structs[Stream]:
    """(B,) streams that go on where generators stand."""
    made = new_structs(Stream, len(generators))
    for k, generator in enumerate(generators):
        read_generator(generator, made[k])
    return made


@_intrinsic  # type: ignore[untyped-decorator]
def _upper_product(typing: Any, a: Any, b: Any) -> Any:
    """The upper 64 bits of the product of two whole numbers of 64 bits."""
    word: Any = numba.types.uint64

    def build(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        double = ir.IntType(128)
        first, second = (builder.zext(value, double) for value in values)
        shifted = builder.lshr(builder.mul(first, second), ir.Constant(double, 64))
        return builder.trunc(shifted, ir.IntType(64))

    return word(word, word), build


@compiled
def following(high: np.uint64, low: np.uint64, stream: Stream) -> tuple[np.uint64, np.uint64]:
    """The state after one of a stream, upper and lower half."""
    product = low * _FACTOR_LOW
    high = _upper_product(low, _FACTOR_LOW) + high * _FACTOR_LOW + low * _FACTOR_HIGH + stream.step_high
    low = product + stream.step_low
    if low < product:
        high = high + _1
    return high, low


@compiled
def given_out(high: np.uint64, low: np.uint64) -> np.uint64:
    """The 64 bits that a state gives."""
    mixed, turn = high ^ low, high >> _58
    word: np.uint64 = (mixed >> turn) | (mixed << ((_64 - turn) & _63))
    return word


@compiled
def next_word(stream: Stream) -> np.uint64:
    """The next 64 bits."""
    stream.high, stream.low = following(stream.high, stream.low, stream)
    return given_out(stream.high, stream.low)


@compiled
def next_half(stream: Stream) -> np.uint64:
    """The next 32 bits: the lower ones of a word, then the upper ones."""
    if stream.kept:
        stream.kept = False
        return stream.half
    word = next_word(stream)
    stream.kept, stream.half = True, word >> _32
    return word & _BITS_32


@compiled
def uniform(stream: Stream) -> float:
    """`Generator.random()`."""
    share: float = np.float64(next_word(stream) >> _11) * _TO_UNIT
    return share


@compiled
def normal(stream: Stream) -> float:
    """`Generator.normal()`."""
    return normal_of(next_word(stream), stream)


@compiled
def normal_of(word: np.uint64, stream: Stream) -> float:
    """The normal number that begins with a word of a stream; now and then it takes more of them."""
    while True:
        row = np.int64(word & _BYTE)
        magnitude = (word >> _9) & _BITS_52
        x: float = np.float64(magnitude) * _WI[row]
        if (word >> _8) & _1 != _0:
            x = -x
        if magnitude < _KI[row]:
            return x
        if row == 0:
            while True:
                across = -_TAIL_INVERSE * np.log1p(-uniform(stream))
                down = -np.log1p(-uniform(stream))
                if down + down > across * across:
                    x = _TAIL + across
                    return -x if (magnitude >> _8) & _1 != _0 else x
        elif (_FI[row - 1] - _FI[row]) * uniform(stream) + _FI[row] < np.exp(-0.5 * x * x):
            return x
        word = next_word(stream)


@compiled
def draw_normals(stream: Stream, numbers: FloatArray, count: int) -> None:
    """Draw `Generator.normal(size=(K, count, 3))` and fill in what has room of each row, (K, T, 3).

    The stream's state is not read and written for each: that is half of the time.
    """
    high, low, kept = stream.high, stream.low, 3 * numbers.shape[1]
    for k in range(numbers.shape[0]):
        for t in range(3 * count):
            high, low = following(high, low, stream)
            word = given_out(high, low)
            row = np.int64(word & _BYTE)
            magnitude = (word >> _9) & _BITS_52
            if magnitude >= _KI[row]:
                stream.high, stream.low = high, low
                number = normal_of(word, stream)
                high, low = stream.high, stream.low
                if t < kept:
                    numbers[k, t // 3, t % 3] = number
            elif t < kept:
                number = np.float64(magnitude) * _WI[row]
                numbers[k, t // 3, t % 3] = -number if (word >> _8) & _1 != _0 else number
    stream.high, stream.low = high, low


@compiled
def below(stream: Stream, count: int) -> int:
    """`Generator.integers(count)`, for counts of less than 32 bits (Lemire 2019)."""
    if count <= 1:
        return 0
    bound = U64(count)
    product = next_half(stream) * bound
    rest = product & _BITS_32
    if rest < bound:
        least = (_BITS_32 - (bound - _1)) % bound
        while rest < least:
            product = next_half(stream) * bound
            rest = product & _BITS_32
    return int(np.int64(product >> _32))


@compiled
def shuffle(stream: Stream, values: IntArray) -> None:
    """`Generator.shuffle`, in place; `permutation` is that of a copy."""
    mask = _1
    while mask < U64(len(values)):
        mask = mask << _1
    for i in range(len(values) - 1, 0, -1):
        while (mask >> _1) > U64(i):
            mask = mask >> _1
        j = next_half(stream) & (mask - _1)
        while j > U64(i):
            j = next_half(stream) & (mask - _1)
        k = np.int64(j)
        values[i], values[k] = values[k], values[i]


@compiled
def fill_uniform(stream: Stream, numbers: FloatArray) -> None:
    """`Generator.random` of the shape of an array (N,)."""
    for k in range(len(numbers)):
        numbers[k] = uniform(stream)


@compiled
def fill_normal(stream: Stream, numbers: FloatArray) -> None:
    """`Generator.normal` of the shape of an array (N,)."""
    for k in range(len(numbers)):
        numbers[k] = normal(stream)
