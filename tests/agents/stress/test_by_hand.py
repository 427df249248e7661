"""Failures that the hand has to carry out."""

import numpy as np
import pytest

from farm_ar.agents.attacks import Trial, analytic
from farm_ar.agents.stress.by_hand import by_hand
from farm_ar.agents.stress.units import known_case
from farm_ar.envs.reids import REIDS


def poses(case):
    return case.layout.position.copy(), case.layout.yaw.copy()


def failure_of(number):
    case = known_case("farm", number, "default", 0)
    trial = Trial(case, REIDS["spatial"](case.scene), 400, 1.0)
    analytic(trial, np.random.default_rng(0))
    return case, trial.reid, trial.cheapest


def test_a_single_object_is_carried_over_at_little_more_than_the_least_effort():
    for number in range(8):
        case, reid, failure = failure_of(number)
        moved = np.any(failure.position != case.layout.position, axis=1) | (failure.yaw != case.layout.yaw)
        if moved.sum() == 1:
            break
    assert moved.sum() == 1
    effort = by_hand(case, reid, failure.position, failure.yaw)
    assert effort == pytest.approx(failure.effort, rel=0.05)


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
    effort = by_hand(case, reid, position, yaw)
    assert effort is None or effort < 0.8


def test_what_breaks_nothing_is_no_failure_by_hand_either():
    case, reid, _ = failure_of(1)
    assert by_hand(case, reid, *poses(case)) is None
