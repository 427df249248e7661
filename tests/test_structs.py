"""Structs: named fields that Python and kernels share."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import pytest

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled
from farm_ar.structs import Struct, Structs, new_structs, struct_dtype, words_of


class Point(Struct):
    x: float
    z: float


class Thing(Struct):
    fixed: bool
    at: Point
    curve: Annotated[FloatArray, (2, 2)]
    number: int


@compiled
def change(things: Structs[Thing], i: int) -> float:
    """Read and write every kind of field of one struct."""
    thing = things[i]
    thing.fixed = not thing.fixed
    thing.at.x += 1.5
    thing.curve[1, 0] = thing.at.x
    thing.number -= 1
    return thing.curve.sum()


@pytest.mark.parametrize("kernel", [change, change.py_func], ids=["compiled", "plain"])  # type: ignore[attr-defined]
def test_what_a_kernel_writes_into_an_item_stands_in_the_array_and_nowhere_else(kernel) -> None:
    things = new_structs(Thing, 3)
    assert kernel(things, 1) == 1.5
    assert things["fixed"].tolist() == [False, True, False]
    assert things["at"]["x"].tolist() == [0.0, 1.5, 0.0]
    assert things["number"].tolist() == [0, -1, 0]
    np.testing.assert_array_equal(things["curve"][1], [[0.0, 0.0], [1.5, 0.0]])
    assert not things["curve"][[0, 2]].any()
    assert (things[1].at.x, things[1].number, things[1].fixed) == (1.5, -1, True)


def test_fields_follow_one_another_at_whole_words() -> None:
    dtype = struct_dtype(Thing)
    assert dtype.names == ("fixed", "at", "curve", "number")
    assert [dtype.fields[name][1] for name in dtype.names] == [0, 8, 24, 56]
    assert dtype.itemsize == 64


@pytest.mark.parametrize("shape", [(2,), (0,), (2, 3)])
def test_words_are_the_same_memory(shape: tuple[int, ...]) -> None:
    points = new_structs(Point, shape)
    words = words_of(points)
    assert words.shape == (*shape, 2)
    words[...] = 7.0
    assert (points["x"] == 7.0).all()
    assert (points["z"] == 7.0).all()


def test_a_field_that_numpy_has_already_is_refused() -> None:
    class Wrong(Struct):
        diagonal: float

    with pytest.raises(TypeError, match="Wrong cannot have a field called diagonal"):
        new_structs(Wrong, 1)
