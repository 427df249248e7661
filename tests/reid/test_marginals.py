from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.arrays import FloatArray
from farm_ar.reid import association_marginals, marginals

SEEDS = st.integers(0, 2**32 - 1)


def by_all_ways(weight: FloatArray, none: FloatArray) -> tuple[FloatArray, float]:
    """Marginals and evidence as they are defined: a sum over every way of giving labels out."""
    n, m = weight.shape
    shares, total = np.zeros((n, m + 1)), 0.0
    for way in itertools.product(range(m + 1), repeat=n):
        given_out = [j for j in way if j < m]
        if len(set(given_out)) == len(given_out):
            value = float(np.prod([none[i] if j == m else weight[i, j] for i, j in enumerate(way)]))
            total += value
            shares[np.arange(n), way] += value
    return shares / total, total


def problem(seed: int, n: int, m: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    weight = rng.exponential(1.0, (n, m)) * (rng.random((n, m)) < 0.7)
    return weight, rng.uniform(0.01, 0.5, n)


@settings(max_examples=40 * settings().max_examples // 50, deadline=None)
@given(seed=SEEDS, n=st.integers(1, 4), m=st.integers(1, 5))
def test_exact_marginals_are_those_of_a_sum_over_all_ways(seed, n, m):
    weight, none = problem(seed, n, m)
    expected, total = by_all_ways(weight, none)
    probability, log_evidence, exact = association_marginals(weight, none)
    np.testing.assert_allclose(probability, expected, atol=1e-12)
    assert log_evidence == pytest.approx(np.log(total))
    assert exact


@settings(max_examples=40 * settings().max_examples // 50, deadline=None)
@given(seed=SEEDS, n=st.integers(2, 4), m=st.integers(7, 9))
def test_belief_propagation_comes_near_and_is_exact_without_cycles(seed, n, m):
    weight, none = problem(seed, n, m)
    expected, total, _ = association_marginals(weight, none)
    near, log_evidence, exact = association_marginals(weight, none, most_exact=0)
    assert not exact
    assert np.abs(near - expected).max() < 0.2
    assert abs(log_evidence - total) < 0.6
    chain = np.where(np.abs(np.arange(m) - np.arange(n)[:, None] - 0.5) < 1, weight, 0.0)  # two labels each
    expected, total, _ = association_marginals(chain, none)
    found, log_evidence, _ = association_marginals(chain, none, most_exact=0)
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert log_evidence == pytest.approx(total, abs=1e-6)


def test_detections_that_share_no_label_are_summed_apart():
    first, second = problem(1, 3, 4), problem(2, 3, 4)
    none = np.append(first[1], second[1])
    weight = np.zeros((6, 8))
    weight[:3, :4], weight[3:, 4:] = first[0], second[0]
    probability, log_evidence, exact = association_marginals(weight, none, most_exact=3)
    assert exact
    for rows, columns, (part, none) in ((slice(3), slice(4), first), (slice(3, 6), slice(4, 8), second)):
        expected, _ = by_all_ways(part, none)
        np.testing.assert_allclose(probability[rows, columns], expected[:, :4], atol=1e-12)
    assert log_evidence == pytest.approx(sum(np.log(by_all_ways(*part)[1]) for part in (first, second)))


def test_no_detections_and_no_way():
    probability, log_evidence, exact = association_marginals(np.zeros((0, 3)), np.zeros(0))
    assert probability.shape == (0, 4)
    assert (log_evidence, exact) == (0.0, True)
    probability, log_evidence, _ = association_marginals(np.zeros((2, 1)), np.zeros(2))
    assert log_evidence == -np.inf
    assert probability[:, -1].tolist() == [1.0, 1.0]
    probability, log_evidence, _ = association_marginals(np.ones((2, 1)), np.zeros(2))  # one label for two
    assert log_evidence == -np.inf


def test_in_plain_python_the_kernels_say_the_same(monkeypatch):
    problems = [problem(seed, 4, 5) for seed in range(4)]
    problems.append((np.diag([1e200, 1e-200]), np.array([0.0, 1e-220])))  # rows of very different scale
    problems.append((np.zeros((1, 2)), np.zeros(1)))
    compiled = [association_marginals(*one, most_exact=most) for one in problems for most in (12, 0)]
    for name, value in vars(marginals).copy().items():
        if hasattr(value, "py_func"):
            monkeypatch.setattr(marginals, name, value.py_func)
    plain = [association_marginals(*one, most_exact=most) for one in problems for most in (12, 0)]
    for (first, log_first, _), (second, log_second, _) in zip(compiled, plain, strict=True):
        np.testing.assert_allclose(first, second, atol=1e-12)
        assert log_first == pytest.approx(log_second)
