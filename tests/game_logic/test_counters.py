"""The score board, and the labels that show it."""

import numpy as np
import pytest

from farm_ar.game_logic.counters import NOTHING, Counters, label_text


def test_an_animal_in_its_own_building_raises_the_counter_of_its_label():
    counters = Counters.zero(3)
    counters.add(np.array([1, 1, 2]), np.array([1, 1, 2]))
    assert counters.counted.tolist() == [0, 2, 1]
    assert counters.miscounts == 0


def test_an_animal_in_another_building_is_counted_for_its_colour_and_noted_as_misplaced():
    counters = Counters.zero(3)
    counters.add(np.array([0]), np.array([2]))
    assert counters.counted.tolist() == [1, 0, 0]
    assert counters.misplaced.tolist() == [1, 0, 0]
    assert counters.miscounts == 1


def test_an_animal_that_arrives_where_nothing_stands_is_stranded_and_not_counted():
    counters = Counters.zero(2)
    counters.add(np.array([1, 1]), np.array([NOTHING, 1]))
    assert counters.counted.tolist() == [0, 1]
    assert counters.stranded.tolist() == [0, 1]
    assert counters.miscounts == 1


@pytest.mark.parametrize(
    ("label", "category", "text"),
    [
        ("yellow-coop", "coop", "Yellow Chicken Coop (22)"),
        ("cyan-hutch", "hutch", "Cyan Bunny Hutch (22)"),
        ("chair 7", "chair", "Chair 7 (22)"),
    ],
)
def test_a_label_reads_as_in_the_paper(label, category, text):
    assert label_text(label, category, 22) == text
