"""Names that look alike are found; names that differ visibly are not."""

import pytest

from farm_ar.reid.plausibility.look_alikes import alike, check_names, look_alike
from farm_ar.scenes import BUILTIN, builtin_scene

SAME = [
    ("chair 1", "chair  1"),
    ("chair 1", "chair 1 "),
    ("chair 1", "chair\u00a01"),
    ("chair 1", "Chair 1"),
    ("chair", "ch\u0430ir"),  # a Cyrillic a
    ("ADA", "\u0410D\u0410"),
    ("ada", "a\u200bda"),  # a blank of no width
    ("cafe\u0301", "caf\u00e9"),
    ("\uff41\uff42", "ab"),
    ("O2", "02"),
    ("chair l", "chair 1"),
    ("chair I", "chair 1"),
    ("omicron \u03bf", "omicron o"),
    ("a-b", "a\u2013b"),
]
DIFFERENT = [
    ("A1", "AL"),
    ("chair 1", "chair 2"),
    ("caf\u00e9", "cafe"),
    ("\u0915\u0941", "\u0915"),  # Devanagari: a vowel sign is no blank
    ("\u6905\u5b50 1", "\u6905\u5b50 2"),
    ("i", "l"),
    ("\u0436\u0443\u043a", "\u0436\u0430\u043a"),
]


@pytest.mark.parametrize(("one", "other"), SAME)
def test_names_that_look_alike_are_found(one, other):
    assert alike([one, "something else", other]) == [(one, other)]
    assert look_alike(one, ["something else", other]) == other


@pytest.mark.parametrize(("one", "other"), DIFFERENT)
def test_names_that_differ_visibly_are_not(one, other):
    assert alike([one, other]) == []
    assert look_alike(one, [other]) is None


def test_names_alike_in_several_ways_are_one_group():
    names = ["chair 1", "chair l", "Chair 1", "chair 2"]
    assert alike(names) == [("chair 1", "chair l", "Chair 1")]


def test_the_built_in_scenes_have_no_names_that_look_alike():
    assert [list(check_names(builtin_scene(name).layout)) for name in BUILTIN] == [[]] * len(BUILTIN)
