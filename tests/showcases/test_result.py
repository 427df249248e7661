"""Tables of showcases: intervals by resampling layouts, paired differences, and what the summaries count."""

import re

import numpy as np
import pytest

from farm_ar.showcases.characters import _summary as of_parts
from farm_ar.showcases.delivery.trials import _summary as of_deliveries
from farm_ar.showcases.result import interval, number, percent, points
from farm_ar.showcases.storytelling.trials import _summary as of_stories


def numbers(text):
    return [float(one) for one in re.findall(r"[-+]?\d+\.?\d*", text)]


def test_an_interval_is_as_wide_as_the_standard_error_says():
    values = np.random.default_rng(0).normal(5.0, 2.0, 400)
    middle, low, high = interval(values)
    assert middle == values.mean()
    assert high - low == pytest.approx(2 * 1.96 * values.std() / 20, rel=0.1)
    assert low < middle < high


def test_a_difference_is_paired_and_has_its_sign():
    """Layouts differ by far more than methods do: only pairs show it."""
    hard = np.random.default_rng(1).uniform(0, 0.8, 200)
    middle, low, high = numbers(points(hard + 0.1, hard))
    assert (middle, low, high) == (10.0, 10.0, 10.0)
    assert numbers(points(hard, hard + 0.1))[0] == -10.0
    assert numbers(percent([1, 0, 0, 0]))[0] == 25.0
    assert numbers(number([1.0, 2.0]))[0] == 1.5


def delivery(right, wrong, shortest=2.0, driven=3.0, sure=0.9, seconds=10.0):
    return {"right": right, "wrong": wrong, "shortest_m": shortest, "driven_m": driven, "sure": sure,
            "seconds": seconds}  # fmt: skip


def test_deliveries_are_summed_up_as_their_columns_say():
    paper = [delivery(0, 1), delivery(0, 1), delivery(1, 0), delivery(0, 1)]
    ours = [
        delivery(1, 0, driven=2.5),
        delivery(0, 1, sure=0.95, seconds=90.0),
        delivery(0, 0, driven=9.0, sure=0.3),
        delivery(0, 1, sure=0.5),
    ]
    row = of_deliveries("likelihood", ours, paper)
    first = {name: numbers(text)[0] for name, text in row.items() if name != "method"}
    assert first["wrong chair"] == 50.0
    assert first["right chair"] == first["nobody"] == first["wrong and sure"] == 25.0
    assert first["wrong less spatial's"] == -25.0
    assert first["SPL"] == pytest.approx(0.25 * 2.0 / 2.5)
    assert first["driven / shortest"] == 1.25, "of what was right only"
    assert first["seconds"] == 10
    assert of_deliveries("spatial", paper, paper)["wrong less spatial's"] == ""
    assert of_deliveries("naive", [delivery(1, 0, sure=float("nan"))] * 2, paper[:2])["wrong and sure"] == ""


def story(right, other, air=0, waits=0, metres=0.0, degrees=0.0):
    return {"right": right, "other": other, "air": air, "waits": waits, "metres": metres, "degrees": degrees}


def test_stories_are_summed_up_as_their_columns_say():
    paper = [story(0, 1), story(0, 1), story(1, 0, metres=0.01), story(0, 0, waits=1)]
    ours = [
        story(1, 0, metres=0.03, degrees=2.0),
        story(1, 0, metres=0.01, degrees=4.0),
        story(0, 0, air=1),
        story(0, 1),
    ]
    row = of_stories("likelihood", ours, paper)
    first = {name: numbers(text)[0] for name, text in row.items() if name != "method"}
    assert first["both on their own chairs"] == 50.0
    assert first["one on a stranger's"] == first["one in the air"] == 25.0
    assert first["waits"] == 0.0
    assert first["right less spatial's"] == 25.0
    metres, degrees = numbers(row["seat, 90th percentile"].replace("90th", ""))
    assert (metres, degrees) == (2.8, 3.8), "of seats on chairs of their own"


def test_parts_are_summed_up_by_views_and_errors_by_what_was_decided():
    one = {"right": 1, "wrong": 0, "undecided": 0}
    bad, none = one | {"right": 0, "wrong": 1}, one | {"right": 0, "undecided": 1}
    row = of_parts("stairs", "exact", [one, bad, none, none, one, none], 3)
    assert numbers(row["right"])[0] == pytest.approx(33.3)
    assert numbers(row["undecided"])[0] == 50.0
    assert row["wrong of those decided"] == "33.3%"
