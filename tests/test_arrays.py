"""Arrays that nobody can write to, and records that stay so."""

import copy
import pickle
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.arrays import FloatArray, Record, first_wrong, number_in, read_only, whole_in


@dataclass(frozen=True, eq=False)
class Shelf(Record):
    weight: FloatArray
    names: Mapping[str, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "weight", read_only(self.weight, np.float64))
        object.__setattr__(self, "names", MappingProxyType(dict(self.names)))


def test_a_read_only_copy_cannot_be_written_to_and_does_not_follow_its_source():
    source = np.array([1.0, 2.0])
    copied = read_only(source, np.float64)
    source[0] = 5.0
    np.testing.assert_array_equal(copied, [1.0, 2.0])
    with pytest.raises(ValueError, match="read-only"):
        copied[0] = 3.0


def test_a_read_only_copy_has_the_type_asked_for():
    assert read_only([1, 2], np.float64).dtype == np.float64
    assert read_only([0, 1], np.bool_).dtype == np.bool_


def test_only_an_empty_list_takes_the_shape_for_empty_lists():
    assert read_only([], np.float64, empty=(0, 3)).shape == (0, 3)
    assert read_only([], np.float64).shape == (0,)
    assert read_only(np.zeros((5, 0)), np.float64, empty=(0, 3)).shape == (5, 0)
    assert read_only([1.0], np.float64, empty=(0, 3)).shape == (1,)


def test_the_first_wrong_entry_is_found_in_any_number_of_dimensions():
    right = np.ones((2, 3), dtype=bool)
    assert first_wrong(right) is None
    right[1, 0] = right[1, 2] = False
    assert first_wrong(right) == (1, 0)
    assert first_wrong(np.array(False)) == ()
    assert first_wrong(np.zeros(0, dtype=bool)) is None


@pytest.mark.parametrize(
    "again", [copy.copy, copy.deepcopy, lambda record: pickle.loads(pickle.dumps(record))]
)
def test_a_copied_or_pickled_record_is_still_read_only(again: Callable[[Shelf], Shelf]):
    shelf = again(Shelf(np.array([1.0, 2.0]), {"top": 1}))
    np.testing.assert_array_equal(shelf.weight, [1.0, 2.0])
    assert not shelf.weight.flags.writeable
    assert shelf.names == {"top": 1}
    with pytest.raises(TypeError):
        shelf.names["top"] = 2


def test_a_trusted_record_is_not_checked_and_its_arrays_become_read_only():
    shelf = Shelf.trusted(weight=np.zeros(2), names={"top": 1})
    shelf.names["top"] = 2  # as it was given, where the constructor would have made it safe
    with pytest.raises(ValueError, match="read-only"):
        shelf.weight[0] = 1.0


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_in_text_is_what_python_wrote(number):
    assert number_in(repr(number)) == number
    assert number_in(f" {number!r}\t") == number


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "1_2",
        "1e1_0",
        "\u0661\u0662",
        "\uff11",
        "nan",
        "inf",
        "-Infinity",
        "0x10",
        "1,5",
        "1 2",
        "+",
        ".",
        "e5",
    ],
)
def test_what_only_python_takes_for_a_number_is_none(text):
    assert number_in(text) is None
    assert whole_in(text) is None


def test_whole_numbers_in_text_have_no_point():
    assert (whole_in("-7"), whole_in("+07 "), whole_in("7.0"), whole_in("1e3")) == (-7, 7, None, None)
    assert whole_in("9" * 30) == 10**30 - 1
    assert whole_in("9" * 5000) is None
