"""Scores: 0 is a random player, 1 the best that is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from farm_ar.agents.training.evaluation import interquartile_mean, normalized, score
from farm_ar.errors import OptionError


@given(arrays(np.float64, st.integers(1, 12), elements=st.floats(-9, 9)))
def test_the_interquartile_mean_leaves_a_quarter_out_at_either_end(values):
    out = len(values) // 4
    middle = sorted(values.tolist())[out : len(values) - out]
    assert interquartile_mean(values) == pytest.approx(sum(middle) / len(middle), abs=1e-12)


def test_of_five_seeds_the_middle_three_count():
    assert interquartile_mean(np.array([9.0, 2.0, 1.0, 3.0, -50.0])) == 2.0


def test_random_is_0_and_the_best_is_1():
    random, best = np.array([0.0, 1.0]), np.array([2.0, 5.0])
    players = np.array([random, best, [1.0, 3.0]])
    assert normalized(players, random, best).tolist() == [0.0, 1.0, 0.5]


def test_a_best_that_is_no_better_than_random_is_refused():
    with pytest.raises(OptionError, match="best: must be better than random's"):
        normalized(np.ones(2), np.ones(2), np.ones(2))


def test_the_interval_holds_the_value_and_narrows_with_more_episodes(rng):
    def one(episodes):
        random, best = rng.normal(0, 1, episodes), rng.normal(4, 1, episodes)
        runs = rng.normal(2, 1, (5, episodes))
        return score(runs, random, best, np.random.default_rng(0))

    few, many = one(10), one(1000)
    assert few.low < few.value < few.high
    assert many.value == pytest.approx(0.5, abs=0.03)
    assert many.high - many.low < (few.high - few.low) / 3
    assert str(many).startswith("0.5")


def test_resamples_in_which_random_is_the_best_say_nothing():
    random, best = np.array([1.0, 0.0]), np.array([1.0, 2.0])
    found = score(np.array([[1.0, 1.0]]), random, best, np.random.default_rng(0))
    assert found.value == 0.5
    assert 0.5 <= found.low <= found.high <= 1.0


def test_random_and_best_are_resampled_with_the_runs(rng):
    """A policy that is the best in every episode has the score 1 in every resample, one like chance 0."""
    random, best = rng.normal(0, 3, 40), rng.normal(0, 3, 40) + 10
    for runs, value in ((best, 1.0), (random, 0.0), ((random + 3 * best) / 4, 0.75)):
        found = score(np.array([runs] * 3), random, best, np.random.default_rng(0))
        assert (found.value, found.low, found.high) == pytest.approx((value, value, value))


def test_the_same_seed_draws_the_same_interval(rng):
    runs, random, best = rng.normal(2, 1, (5, 20)), rng.normal(0, 1, 20), rng.normal(4, 1, 20)
    first = score(runs, random, best, np.random.default_rng(1))
    assert first == score(runs, random, best, np.random.default_rng(1))
