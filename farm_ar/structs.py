"""Records of named numbers that compiled kernels read and change, in Python as in machine code."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Generic, TypeVar, get_args, get_origin, get_type_hints, overload

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray

_WORD = 8
"""Every field begins at a multiple of so many bytes, so that it can be read at once."""


class Struct:
    """Base of records: a subclass declares fields by annotations and is never made itself.

    A field is a `float`, an `int`, a `bool`, another struct, or `Annotated[FloatArray, shape]`. `new_structs`
    makes them, as a NumPy structured array; an item of that, and a struct within a struct, is no copy.
    """


S = TypeVar("S", bound=Struct)


class Structs(Generic[S]):
    """How arrays of structs are typed; at run time they are NumPy arrays of `struct_dtype`."""

    shape: tuple[int, ...]

    @overload
    def __getitem__(self, index: str) -> npt.NDArray[Any]: ...
    @overload
    def __getitem__(self, index: int | tuple[int, ...]) -> S: ...
    @overload
    def __getitem__(self, index: slice | npt.NDArray[Any]) -> Structs[S]: ...
    def __getitem__(self, index: Any) -> Any:
        """A field of all, one struct, or some."""
        raise NotImplementedError

    def __setitem__(self, index: Any, value: Any) -> None:
        """Fill in a field of all, one struct, or some."""
        raise NotImplementedError

    def __len__(self) -> int:
        """How many there are along the first dimension."""
        raise NotImplementedError

    def copy(self) -> Structs[S]:
        """The same once more."""
        raise NotImplementedError

    def item(self) -> tuple[Any, ...]:
        """The fields of the only one, as Python's own values."""
        raise NotImplementedError


@cache
def struct_dtype(struct: type[Struct]) -> np.dtype[Any]:
    """The dtype of arrays of a struct, with attributes for items in Python as kernels have them.

    Args:
        struct: whose fields follow one another as they are declared.

    Raises:
        TypeError: a field has the name of something that every NumPy scalar has.
    """
    hints = get_type_hints(struct, include_extras=True)
    taken = [name for name in hints if hasattr(np.record, name)]
    if taken:
        raise TypeError(f"{struct.__name__} cannot have a field called {taken[0]}: NumPy has one")
    formats = [_format(hint) for hint in hints.values()]
    sizes = [-(-np.dtype(one).itemsize // _WORD) * _WORD for one in formats]
    offsets = np.cumsum([0, *sizes]).tolist()
    layout = {"names": list(hints), "formats": formats, "offsets": offsets[:-1], "itemsize": offsets[-1]}
    return np.dtype((np.record, np.dtype(layout, align=True)))  # type: ignore[call-overload]


def new_structs(struct: type[S], shape: int | tuple[int, ...]) -> Structs[S]:
    """An array of structs whose fields are all 0."""
    made: Structs[S] = np.zeros(shape, struct_dtype(struct))  # type: ignore[assignment, arg-type]
    return made


def words_of(structs: Structs[S]) -> FloatArray:
    """(..., W) the same memory as floats, W for each struct; fields that are no floats are meaningless."""
    array: Any = np.asarray(structs)
    words: FloatArray = array.view(np.float64).reshape(*array.shape, array.dtype.itemsize // _WORD)
    return words


def _format(hint: Any) -> Any:
    if get_origin(hint) is Annotated:
        return (np.float64, get_args(hint)[1])
    return struct_dtype(hint) if issubclass(hint, Struct) else np.dtype(hint)
