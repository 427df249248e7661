"""The array types that flow through farm-ar, and how a record makes its own arrays safe to share."""

from dataclasses import fields
from types import MappingProxyType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


def read_only(
    values: npt.ArrayLike, dtype: type[np.generic], empty: tuple[int, ...] = (0,)
) -> npt.NDArray[Any]:
    """Copy of `values` as an array of `dtype` that nobody can write to.

    Args:
        values: what to copy.
        dtype: of the copy.
        empty: shape of the copy of an empty list, which does not tell how many columns its rows would have.
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
