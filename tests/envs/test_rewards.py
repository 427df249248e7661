"""What a step is paid, worked out by hand on a table whose diagonal is 1 m."""

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.rewards import clutter

# To exchange the pair, both go 10 cm.
THERE, BACK = (0.1, 0.0), (-0.1, 0.0)
EFFORT = 0.2


def test_exchanging_a_pair_makes_two_labels_wrong_and_costs_a_quarter_of_the_effort(plain, offsets):
    env = plain()
    env.reset(seed=0)
    _, reward, *_, info = env.step(offsets(THERE, BACK))
    assert info["wrong_labels"] == 2
    assert info["accuracy"] == pytest.approx(1 / 3)
    assert info["effort"] == pytest.approx(EFFORT)
    assert reward == pytest.approx(2 - 0.25 * EFFORT)


def test_a_helper_is_paid_the_opposite_harm_but_effort_costs_it_the_same(plain, offsets):
    env = plain(sign=-1)
    env.reset(seed=0)
    assert env.step(offsets(THERE, BACK))[1] == pytest.approx(-2 - 0.25 * EFFORT)


def test_the_weight_of_the_effort_can_be_chosen(plain, offsets):
    env = plain(effort_weight=1.5)
    env.reset(seed=0)
    assert env.step(offsets(THERE, BACK))[1] == pytest.approx(2 - 1.5 * EFFORT)


def test_a_turn_costs_its_share_of_half_a_turn(plain):
    env = plain()
    env.reset(seed=0)
    _, reward, *_ = env.step(np.array([0, 0, 1, 0, 0, -1], dtype=np.float32))
    assert reward == pytest.approx(-0.25 * 2 * 45 / 180)


def test_wrong_labels_are_paid_once_and_paid_back_when_they_are_put_right(plain, offsets):
    env = plain(visits=3)
    env.reset(seed=0)
    rewards = [env.step(action)[1] for action in (offsets(THERE, BACK), offsets(), offsets(BACK, THERE))]
    assert rewards == pytest.approx([2 - 0.25 * EFFORT, 0.0, -2 - 0.25 * EFFORT])


def test_the_margin_reward_adds_half_of_the_rise_of_ambiguity(plain, offsets):
    # The left coop goes 3 cm to the right. Its margin, like the other's, is what exchanging both labels would
    # cost: 10 + 10 cm before; (7 + 10) - (3 + 0) cm after.
    before, after = ((2 - 2 * margin / 0.3) / 2 for margin in (0.2, 0.14))
    harm, effort = 0.5 * (after - before), 0.03
    for sign in (1, -1):
        env = plain(reward="margin", sign=sign)
        env.reset(seed=0)
        _, reward, *_, info = env.step(offsets((0.03, 0)))
        assert info["wrong_labels"] == 0
        assert reward == pytest.approx(sign * harm - 0.25 * effort)


def test_the_margin_reward_of_a_clean_exchange_is_that_of_its_wrong_labels(plain, offsets):
    env = plain(reward="margin")
    env.reset(seed=0)
    assert env.step(offsets(THERE, BACK))[1] == pytest.approx(2 - 0.25 * EFFORT)


@pytest.mark.parametrize("sign", [1, -1])
def test_the_shaped_reward_adds_how_far_each_label_has_come_to_being_wrong(plain, offsets, sign):
    # Half a label where the two cannot be told apart, less or more by its margin / .3 / 2: 20 cm before.
    for ways, margin, wrong, effort in [
        (((0.03, 0), (0, 0)), 0.14, 0, 0.03),
        ((THERE, BACK), -0.2, 2, EFFORT),
        (((0.08, 0), BACK), -0.16, 2, 0.18),
        (((-0.09, 0), (0.09, 0)), 0.2, 0, 0.18),  # 38 cm less 18
    ]:
        env = plain(reward="shaped", sign=sign)
        env.reset(seed=0)
        _, reward, *_, info = env.step(offsets(*ways))
        assert info["wrong_labels"] == wrong
        harm = wrong + 2 * (0.2 - margin) / 0.3 / 2
        assert reward == pytest.approx(sign * harm - 0.25 * effort)


def test_the_shaped_reward_counts_what_is_in_view_only(plain, offsets, left_only):
    env = plain(reward="shaped", visits=2)
    env.reset(seed=0, options={"camera": left_only})
    # Of one detection two labels can be: 10 cm to the other, and 10 more after it has gone there.
    assert env.expected_wrong == pytest.approx((1 - 0.1 / 0.3) / 2)
    _, reward, *_ = env.step(offsets((0.04, 0)))
    assert reward == pytest.approx(0.5 * 0.08 / 0.3 - 0.25 * 0.04)


def test_the_endpoint_reward_is_the_rise_of_the_distance_between_belief_and_truth(plain, offsets):
    env = plain(reward="endpoint", visits=2)
    env.reset(seed=0)
    # Each label is believed where the other's coop is, 10 cm off; and so they are after both went 5 cm.
    assert env.step(offsets(THERE, BACK))[1] == pytest.approx(0.2 - 0.25 * EFFORT)
    assert env.step(offsets((0, 0.05), (0, 0.05)))[1] == pytest.approx(-0.25 * 0.1)


def test_what_the_headset_does_not_see_again_is_believed_where_it_was(plain, offsets, left_only):
    env = plain(reward="endpoint")
    env.reset(seed=0, options={"camera": left_only})
    _, reward, *_ = env.step(offsets((0.0, 0.1)))
    assert reward == pytest.approx(0.1 - 0.25 * 0.1)


def test_the_miscount_reward_counts_animals_that_arrive_where_nothing_stands(pair, left_only):
    def play(*actions, visits=1):
        env = FarmToTableEnv(
            scene=pair,
            reward="miscount",
            effort_weight=0.0,
            jitter="none",
            play_seconds=20.0,
            budget=9.0,
            animals_a_second=2.0,
            visits=visits,
        )
        env.reset(seed=3, options={"camera": left_only})
        rewards = [env.step(np.array(action))[1] for action in actions]
        return rewards, env.world.counters

    leave, away = (2, 3, 3, 3), (0, 0, 0, 3)
    (reward,), counters = play(leave)
    assert reward == counters.miscounts == 0
    assert counters.counted.sum() > 20
    rewards, counters = play(away, leave)
    # One animal of the colour a second runs to where its coop was.
    assert 15 <= counters.stranded[0] <= 25
    assert rewards == [0.0, counters.stranded[0]]
    assert counters.miscounts == counters.stranded[0]
    # Each is paid for once.
    rewards, counters = play(away, leave, leave, leave, visits=3)
    assert sum(rewards) == counters.miscounts


@pytest.mark.parametrize("reward", ["identity", "endpoint"])
def test_rewards_of_an_episode_add_up_to_its_harm_less_its_effort(reward):
    env = FarmToTableEnv(reward=reward, visits=3, moves=3)
    env.reset(seed=5)
    env.action_space.seed(5)
    total, effort, over = 0.0, 0.0, False
    for _ in range(9):
        if over:
            break
        _, paid, over, _, info = env.step(env.action_space.sample())
        total, effort = total + paid, effort + info["effort"]
    belief, diagonal = env.world.tracker.belief, float(np.hypot(1.2, 0.8))
    harm = {
        "identity": belief.wrong_labels,
        "endpoint": belief.endpoint_error(env.world.truth).sum() / diagonal,
    }
    assert effort > 0.1
    assert total == pytest.approx(harm[reward] - 0.25 * effort)


def test_a_helper_is_paid_for_making_the_table_clearer(plain, offsets):
    # To be taken for each other the pair would have to make up 10 + 10 cm before, 12.5 + 12.5 cm after.
    before, after = (2 * (1 - margin / 0.3) / 2 for margin in (0.2, 0.25))
    for sign in (1, -1):
        env = plain(reward="clutter", sign=sign)
        env.reset(seed=0)
        assert clutter(env) == pytest.approx(before)
        _, reward, *_, info = env.step(offsets((-0.025, 0)))
        assert info["wrong_labels"] == 0
        assert clutter(env) == pytest.approx(after)
        assert reward == pytest.approx(sign * 0.5 * (after - before) - 0.25 * 0.025)


def test_clutter_is_that_of_the_table_as_it_stands_not_as_it_is_believed(plain, offsets, left_only):
    env = plain(reward="clutter")
    env.reset(seed=0, options={"camera": left_only})
    env.step(offsets((0.0, 0.1)))
    # Out of view, the left coop is believed to be 10 cm from the other; it stands 10 cm farther back.
    assert clutter(env) == pytest.approx(2 * (1 - 2 * np.hypot(0.1, 0.1) / 0.3) / 2)
