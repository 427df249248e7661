"""The errors a user meets."""

import pickle

import pytest

from farm_ar.errors import LONGEST_VALUE, InputError, OptionError, SceneError, SnapshotError, known_name


def test_an_error_names_the_source_the_field_what_would_be_right_and_the_value():
    problem = SceneError(
        "objects[3].size_whd", "must be 3 positive numbers in metres", [0.1, 0, 0.12], "farm.json"
    )
    assert str(problem) == (
        "farm.json: objects[3].size_whd: must be 3 positive numbers in metres, got [0.1, 0, 0.12]"
    )


def test_an_error_without_a_source_begins_with_the_field():
    assert (
        str(OptionError("threshold", "must be from 0 to 1", 2.0)) == "threshold: must be from 0 to 1, got 2.0"
    )


def test_an_option_that_was_not_given_is_nothing_and_a_null_in_a_file_is_none():
    assert str(OptionError("--map", "must be given", None)) == "--map: must be given, got nothing"
    assert str(SceneError("y", "must be a number", None)) == "y: must be a number, got None"


def test_a_value_with_line_breaks_stays_on_one_line():
    assert "\n" not in str(InputError("name", "must be short", "a\nb"))


def test_a_long_value_is_cut():
    text = str(InputError("objects", "must be a list", {str(i): i for i in range(1000)}))
    assert text.endswith(" ...")
    assert len(text) < LONGEST_VALUE + 50


def test_a_value_that_just_fits_is_shown_whole():
    value = "x" * (LONGEST_VALUE - 2)
    assert str(InputError("name", "must be short", value)).endswith(repr(value))


@pytest.mark.parametrize("kind", [SceneError, SnapshotError, OptionError])
def test_an_error_is_a_value_error_and_survives_pickling(kind: type[InputError]):
    problem = pickle.loads(pickle.dumps(kind("x", "must be finite", 1, "a.json")))
    assert isinstance(problem, kind)
    assert isinstance(problem, ValueError)
    assert (problem.field, problem.expected, problem.got, problem.source) == (
        "x",
        "must be finite",
        1,
        "a.json",
    )


def test_a_known_name_is_returned_as_it_is():
    assert known_name("solver", "lsap", ("mip", "lsap")) == "lsap"


def test_an_unknown_name_is_refused_with_the_list_of_known_ones():
    with pytest.raises(OptionError) as problem:
        known_name("solver", "lspa", ("mip", "lsap"))
    assert str(problem.value) == "solver: must be one of lsap, mip, got 'lspa'"
