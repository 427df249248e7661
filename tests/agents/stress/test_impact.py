"""Failures that the hand has to carry out."""

import numpy as np
import pytest

from farm_ar.agents.attacks import Analytic, QueryOracle
from farm_ar.agents.stress.impact import ORDERS, orders_of, realizable_distance
from farm_ar.agents.stress.study import known_case
from farm_ar.reid import REIDENTIFIERS


def by_hand(case, reid, position, yaw):
    return realizable_distance(case, reid, position, yaw, np.random.default_rng(0))


def poses(case):
    return case.layout.position.copy(), case.layout.yaw.copy()


def failure_of(number):
    case = known_case("farm", number, "default", 0)
    oracle = QueryOracle(case, REIDENTIFIERS["spatial"](case.scene), 400, 1.0)
    Analytic()(oracle, np.random.default_rng(0))
    return case, oracle.reid, oracle.cheapest


def test_a_single_object_is_carried_over_at_little_more_than_the_least_distance():
    for number in range(8):
        case, reid, failure = failure_of(number)
        moved = np.any(failure.position != case.layout.position, axis=1) | (failure.yaw != case.layout.yaw)
        if moved.sum() == 1:
            break
    assert moved.sum() == 1
    distance = by_hand(case, reid, failure.position, failure.yaw)
    assert distance == pytest.approx(failure.distance, rel=0.05)


def test_what_is_out_of_view_cannot_be_gripped():
    case, reid, failure = failure_of(1)
    away = int(np.flatnonzero(~case.in_view & case.layout.movable)[0])
    position, yaw = failure.position.copy(), failure.yaw.copy()
    yaw[away] += 0.05
    assert by_hand(case, reid, position, yaw) is None


def test_a_visit_has_six_moves_and_a_budget():
    case, reid, _ = failure_of(1)
    position, yaw = poses(case)
    yaw[case.layout.movable] += 0.02
    assert by_hand(case, reid, position, yaw) is None  # ten of them
    # A turn of half a circle is twice the budget: the hand stops on the way.
    position, yaw = poses(case)
    seen = int(np.flatnonzero(case.in_view & case.layout.movable)[0])
    yaw[seen] += np.pi
    distance = by_hand(case, reid, position, yaw)
    assert distance is None or distance < 0.8


def test_what_breaks_nothing_is_no_failure_by_hand_either():
    case, reid, _ = failure_of(1)
    assert by_hand(case, reid, *poses(case)) is None


def test_few_objects_are_tried_in_every_order():
    rng = np.random.default_rng(0)
    assert orders_of([4], rng) == [(4,)]
    assert set(orders_of([4, 7, 1], rng)) == {
        (4, 7, 1),
        (4, 1, 7),
        (7, 4, 1),
        (7, 1, 4),
        (1, 4, 7),
        (1, 7, 4),
    }


def test_more_objects_are_tried_in_different_orders_drawn_at_random():
    drawn = [orders_of(range(6), np.random.default_rng(seed)) for seed in range(40)]
    assert all(len(set(orders)) == ORDERS and sorted(orders[0]) == list(range(6)) for orders in drawn)
    first = [order[0] for orders in drawn for order in orders]
    # Each of the six comes first in about a sixth of them; in lexicographic order it is always the same.
    assert min(np.bincount(first, minlength=6)) > len(first) / 6 / 2
    assert orders_of(range(6), np.random.default_rng(3)) == drawn[3]


def test_an_order_that_works_is_found():
    """One of three objects has to go first, as if it stood where another one is to be."""
    case, reid, _ = failure_of(1)
    tried = []

    def carried(case, reid, goal, heading, order):
        tried.append(tuple(order))
        return 0.5 if order[0] == moved[2] else None

    moved = np.flatnonzero(case.in_view & case.layout.movable)[:3]
    position, yaw = poses(case)
    yaw[moved] += 0.1
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("farm_ar.agents.stress.impact._carried", carried)
        assert by_hand(case, reid, position, yaw) == 0.5
    assert len(set(tried)) == 6
