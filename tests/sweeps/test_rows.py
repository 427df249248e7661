"""What a unit may give, and that every number of it is kept exactly."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from farm_ar.errors import OptionError
from farm_ar.sweeps import Outcome, Sweep, run_sweep
from farm_ar.sweeps.unit import as_outcome, to_text

NUMBERS = hnp.arrays(
    st.sampled_from([np.float64, np.float32, np.float16, np.int64, np.uint8, np.uint64, np.bool_]),
    hnp.array_shapes(max_dims=3, max_side=4),
)


@given(NUMBERS)
def test_arrays_come_back_with_every_bit_of_their_numbers(array):
    again = np.array(json.loads(to_text(array, "rows")), dtype=array.dtype)
    np.testing.assert_array_equal(again, array)
    if array.dtype.kind == "f":
        number = ~np.isnan(array)
        assert np.array_equal(np.signbit(again[number]), np.signbit(array[number]))


def test_numpy_values_stand_for_numbers_lists_and_truths():
    first, second = run_sweep(Sweep("numpy", "sweep_functions:of_numpy", [{"values": np.arange(3)}])).rows()
    assert first == {
        "float": 0.1,
        "small": float(np.float32(0.1)),
        "whole": 2**62,
        "flag": True,
        "pair": [1, None],
        "none": None,
    }
    assert {name: type(value) for name, value in first.items()} == {
        "float": float,
        "small": float,
        "whole": int,
        "flag": bool,
        "pair": list,
        "none": type(None),
    }
    assert second["list"] == [0.0, 1 / 3, 2 / 3]
    assert math.isnan(second["nan"])
    assert second["infinite"] == -math.inf


def test_columns_keep_the_order_in_which_the_function_gave_them():
    assert to_text({"z": 1, "a": {"y": 2, "b": 3}}, "rows") == '{"z":1,"a":{"y":2,"b":3}}'


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (
            [{"a": [1, 2j]}],
            "rows[0].a[1]: must be a JSON value, or a NumPy one that JSON holds exactly",
        ),
        ([{"a": np.array([1j])}], "rows[0].a: must be a JSON value"),
        ([{"a": np.longdouble(1)}], "rows[0].a: must be a JSON value"),
        ([{"a": np.array([object()])}], "rows[0].a: must be a JSON value"),
        ([{"a": {3: 1}}], "rows[0].a: must have text for names, got 3"),
        ([{"a": b"bytes"}], "rows[0].a: must be a JSON value"),
    ],
)
def test_what_json_cannot_hold_exactly_is_refused_with_its_place(value, message):
    with pytest.raises(OptionError) as problem:
        to_text(value, "rows")
    assert str(problem.value).startswith(message)


@pytest.mark.parametrize("result", [None, "text", 1.0, [1, 2], [{"a": 1}, None]])
def test_what_is_no_row_is_no_outcome(result):
    with pytest.raises(OptionError, match="result: must be a row, a list of rows or an Outcome"):
        as_outcome(result)


def test_one_row_a_list_of_rows_and_an_outcome_are_outcomes():
    row = {"a": 1}
    assert as_outcome(row) == Outcome([row])
    assert as_outcome([row, row]) == Outcome([row, row])
    assert as_outcome(Outcome([row], [row])) == Outcome([row], [row])
