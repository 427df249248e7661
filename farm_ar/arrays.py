"""The array types that flow through farm-ar, what values they may hold, and how a record keeps them safe."""

import math
import re
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Limits:
    """Which numbers a quantity may be where it enters, so that no product, norm or loop over turns overflows.

    Args:
        low: the least.
        high: the largest.
        expected: the same in words, for errors.
    """

    low: float
    high: float
    expected: str

    def allow(self, values: npt.ArrayLike) -> BoolArray:
        """Which of the values are numbers within the limits; NaN and infinity are not."""
        array = np.asarray(values, dtype=np.float64)
        return (array >= self.low) & (array <= self.high)


FINITE = Limits(-1.797e308, 1.797e308, "must be finite")
POSITION = Limits(-1e6, 1e6, "must be finite, from -1e6 to 1e6 metres")
ANGLE = Limits(-2e6 * math.pi, 2e6 * math.pi, "must be finite, at most 1e6 turns")
SIDE = Limits(1e-6, 1e6, "must be positive metres, from 1e-6 to 1e6")
RANGE = Limits(1e-6, 1e9, "must be positive metres, from 1e-6 to 1e9")
SPEED = Limits(1e-6, 1e6, "must be a positive number, from 1e-6 to 1e6 metres a second")
WEIGHT = Limits(0.0, 1e6, "must be a number not below 0, at most 1e6")
SECONDS = Limits(0.0, 3600.0, "must be a number of seconds from 0 to 3600")
TIME = Limits(-1e15, 1e15, "must be a finite number of seconds")
SHARE = Limits(0.0, 1.0, "must be from 0 to 1")

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_WHOLE = re.compile(r"[+-]?\d{1,30}", re.ASCII)


def number_in(text: str) -> float | None:
    """The number that a text says in digits, with a point; None for all else that Python would take.

    No underscores, no digits of other scripts, no names of infinity; too large a number is infinite.
    """
    return float(text) if _NUMBER.fullmatch(text.strip(" \t")) else None


def whole_in(text: str) -> int | None:
    """The whole number, of up to 30 digits, that a text says; None for all else."""
    return int(text) if _WHOLE.fullmatch(text.strip(" \t")) else None


def read_only(
    values: npt.ArrayLike, dtype: type[np.generic], empty: tuple[int, ...] = (0,)
) -> npt.NDArray[Any]:
    """Copy of `values` as an array of `dtype` that nobody can write to.

    Args:
        values: what to copy.
        dtype: of the copy.
        empty: shape of the copy of an empty list, which does not say how many columns its rows would have.
    """
    array = np.array(values, dtype=dtype, order="C")
    if array.shape == (0,):
        array = array.reshape(empty)
    array.setflags(write=False)
    return array


def first_wrong(right: BoolArray) -> tuple[int, ...] | None:
    """Index of the first entry that is not right; None where all are."""
    return None if right.all() else tuple(int(i) for i in np.argwhere(~right)[0])


class Record:
    """Base of the frozen dataclasses that hold read-only arrays: what is copied or unpickled is made anew.

    Left to itself, pickle would bring the arrays back writable, and cannot take a read-only mapping at all.
    """

    @classmethod
    def trusted(cls, **values: object) -> Self:
        """A record of values that were worked out, not given: nothing is checked, copied or filled in.

        Args:
            values: all fields, as the constructor would leave them; arrays become read-only.
        """
        for value in values.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        made = cls.__new__(cls)
        vars(made).update(values)
        return made

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        values = [getattr(self, field.name) for field in fields(self)]  # type: ignore[arg-type]
        return type(self), tuple(dict(v) if isinstance(v, MappingProxyType) else v for v in values)
