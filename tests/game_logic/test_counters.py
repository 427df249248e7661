"""The score board, and the labels that show it."""

import pytest

from farm_ar.game_logic.animals.arrival import Clock, count
from farm_ar.game_logic.animals.curve_intersection import NOWHERE
from farm_ar.game_logic.counters import Counters, label_text
from farm_ar.structs import new_structs


def after(n: int, *arrivals: tuple[int, int]) -> tuple[Counters, int]:
    """Counters of n labels, and how many went astray, after arrivals: of a label, in a building."""
    counters, clocks = Counters.zero(n), new_structs(Clock, 1)
    for label, into in arrivals:
        count(counters.counts, clocks[0], label, into)
    return counters, clocks["astray"].item()


def test_an_animal_in_its_own_building_raises_the_counter_of_its_label():
    counters, astray = after(3, (1, 1), (1, 1), (2, 2))
    assert counters.counted.tolist() == [0, 2, 1]
    assert counters.miscounts == astray == 0


def test_an_animal_in_another_building_is_counted_for_its_colour_and_noted_as_misplaced():
    counters, astray = after(3, (0, 2))
    assert counters.counted.tolist() == [1, 0, 0]
    assert counters.misplaced.tolist() == [1, 0, 0]
    assert counters.miscounts == astray == 1


def test_an_animal_that_arrives_where_nothing_stands_is_stranded_and_not_counted():
    counters, astray = after(2, (1, NOWHERE), (1, 1))
    assert counters.counted.tolist() == [0, 1]
    assert counters.stranded.tolist() == [0, 1]
    assert counters.miscounts == astray == 1


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
