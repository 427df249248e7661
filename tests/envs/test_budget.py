"""What a visit may cost: it is scaled down to what is left, and pays for what was pushed too."""

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import Move
from farm_ar.envs.budget import EffortBudget, MotionBudget
from farm_ar.game_logic.headset import field_of_view, look_at
from farm_ar.game_logic.physics.limits import Motion

FORWARD = np.array([0.0, 1.0])


def test_metres_and_radians_are_scaled_each_on_its_own():
    budget = MotionBudget(0.3, 1.0)
    first, second = budget.fitted([Move(0, 0.4 * FORWARD, 0.5), Move(1, 0.2 * FORWARD, -0.25)])
    np.testing.assert_allclose([first.displacement, second.displacement], [0.2 * FORWARD, 0.1 * FORWARD])
    assert (first.turn, second.turn) == (0.5, -0.25)
    budget.spend(Motion(0.1, 0.9))
    np.testing.assert_allclose(budget.left, [2 / 3, 0.1])
    (move,) = budget.fitted([Move(0, 0.1 * FORWARD, 0.4)])
    np.testing.assert_allclose([*move.displacement, move.turn], [0, 0.1, 0.1])


def test_one_effort_for_both_scales_both_alike():
    # On a diagonal of 2 m, 0.6 m are 0.3; a quarter turn is a half.
    budget = EffortBudget(0.4, diagonal=2.0)
    (move,) = budget.fitted([Move(0, 0.6 * FORWARD, -np.pi / 2)])
    np.testing.assert_allclose([*move.displacement, move.turn], [0, 0.3, -np.pi / 4])
    budget.spend(Motion(0.2, np.pi / 10))
    np.testing.assert_allclose(budget.left, [0.5, 0.5])


def test_more_cannot_be_spent_than_there_is_and_then_nothing_moves():
    for budget in (MotionBudget(0.3, 1.0), EffortBudget(0.4, 2.0)):
        budget.spend(Motion(5.0, 5.0))
        np.testing.assert_array_equal(budget.left, [0, 0])
        (move,) = budget.fitted([Move(0, FORWARD, 1.0)])
        np.testing.assert_array_equal([*move.displacement, move.turn], [0, 0, 0])


def test_a_move_beyond_the_budget_goes_as_far_as_it_reaches(pair):
    env = FarmToTableEnv(scene=pair, jitter="none", budget_m=0.05, moves=3)
    observation, _ = env.reset(seed=1, options={"camera": looking_at(pair)})
    before = env.world.truth.position[0]
    # The left coop, towards the player as far as it goes.
    observation, *_, info = env.step(np.array([0, 3, 0, 3]))
    np.testing.assert_allclose(env.world.truth.position[0] - before, [0, -0.05], atol=0.002)
    assert observation["budget"][0] == pytest.approx(0.0, abs=0.03)
    assert info["effort"] == pytest.approx(0.05, abs=0.004)


def test_what_is_pushed_is_paid_for(pair):
    env = FarmToTableEnv(scene=pair, jitter="none", budget_m=0.4, moves=3)
    env.reset(seed=1, options={"camera": looking_at(pair)})
    before = env.world.truth
    # The left coop goes right, into the other one.
    observation, reward, *_, info = env.step(np.array([0, 5, 3, 3]))
    after = env.world.truth
    ways = np.linalg.norm(after.position - before.position, axis=1)
    turns = np.abs(after.yaw - before.yaw)
    assert ways[1] > 0.02
    effort = ways.sum() / 1.0 + turns[:2].sum() / np.pi
    # What counts is the way that each went, which is not quite straight.
    assert effort - 1e-9 <= info["effort"] < 1.03 * effort
    effort = info["effort"]
    assert reward == pytest.approx(-0.25 * effort)
    assert observation["budget"][0] == pytest.approx(1 - ways.sum() / 0.4, abs=0.02)


def test_what_is_pushed_leaves_less_for_the_moves_that_follow(pair):
    def end(offsets):
        env = FarmToTableEnv(scene=pair, control="layout", jitter="none", budget_m=0.2, play_seconds=0.0)
        env.reset(seed=1, options={"camera": looking_at(pair)})
        before = env.world.truth.position
        env.step(np.array(offsets))
        return env.world.truth.position - before

    alone = end([0, 0, 0, 0, -0.9, 0])
    np.testing.assert_allclose(alone[1], [0, -0.9 * 0.15 / np.hypot(1.2, 0.8)], atol=0.002)
    # The left one first pushes the right one: that way is paid, too, and the right one then comes less far.
    pushed = end([0.95, 0, 0, 0, -0.9, 0])
    assert pushed[1, 0] > 0.02
    assert abs(pushed[1, 1]) < 0.8 * abs(alone[1, 1])


def test_what_is_asked_out_of_view_takes_nothing_from_the_budget(plain, offsets, left_only):
    env = plain(budget=0.1)
    env.reset(seed=0, options={"camera": left_only})
    before = env.world.truth.position[0]
    env.step(offsets((0, 0.1), (0, 0.1)))
    np.testing.assert_allclose(env.world.truth.position[0] - before, [0, 0.1], atol=1e-6)


def test_a_second_visit_has_a_budget_of_its_own():
    env = FarmToTableEnv(visits=2, moves=1, jitter="none")
    env.reset(seed=0)
    which = int(np.flatnonzero(env.action_masks()[:10])[0])
    observation, *_ = env.step(np.array([which, 0, 3, 6]))
    np.testing.assert_allclose(observation["budget"], [1, 1, 1, 0.5])


def looking_at(scene):
    middle = np.array(scene.size) / 2
    return look_at(middle - [0, 1.2], middle, field_of_view("photo"))
