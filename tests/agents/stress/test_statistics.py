"""Numbers about many cases, against tables and by hand."""

import numpy as np
import pytest

from farm_ar.agents.stress.statistics import (
    broken_within,
    calibrate,
    clustered_share,
    median,
    share_of,
    summarise_reid,
)
from farm_ar.agents.stress.study import StressOptions, Study


@pytest.mark.parametrize(
    ("k", "n", "low", "high"),
    # Tables of Clopper and Pearson at 95%.
    [(0, 10, 0.0, 0.3085), (1, 10, 0.0025, 0.4450), (5, 10, 0.1871, 0.8129), (10, 10, 0.6915, 1.0)],
)
def test_intervals_are_those_of_clopper_and_pearson(k, n, low, high):
    found = share_of(k, n)
    assert found == pytest.approx((k / n, low, high), abs=1e-4)


def test_of_no_trials_everything_is_possible():
    assert np.isnan(share_of(0, 0).value)
    assert share_of(0, 0)[1:] == (0.0, 1.0)


def test_trials_of_one_case_that_are_alike_widen_the_interval():
    """Beta-binomial cases: the interval over cases holds the truth about as often as it says."""
    rng, truth = np.random.default_rng(0), 0.1
    held = np.zeros(2)
    for _ in range(200):
        k = rng.binomial(200, rng.beta(0.5, 4.5, 40))
        pooled, clustered = share_of(int(k.sum()), 8000), clustered_share(k, [200] * 40, rng)
        assert pooled.value == clustered.value
        held += [share.low <= truth <= share.high for share in (pooled, clustered)]
    assert held[0] < 0.5 * 200
    assert held[1] > 0.87 * 200


def test_cases_weigh_as_much_as_they_have_trials():
    found = clustered_share([0, 30], [10, 30], np.random.default_rng(0))
    assert found == pytest.approx((0.75, 0.0, 1.0))
    small = clustered_share([1] * 10 + [0] * 10, [1] * 10 + [999] * 10, np.random.default_rng(0))
    assert small.value == pytest.approx(0.001)
    assert 0 < small.low < small.value < small.high < 0.01


@pytest.mark.parametrize(("each", "ends"), [(0, (0.0, 0.3085)), (50, (0.6915, 1.0))])
def test_where_all_cases_agree_there_are_as_many_trials_as_cases(each, ends):
    found = clustered_share([each] * 10, [50] * 10, np.random.default_rng(0))
    assert found == pytest.approx((each / 50, *ends), abs=1e-4)


def test_a_median_counts_what_never_failed_as_infinite():
    assert median([0.3, 0.1, None]) == 0.3
    assert median([0.3, None, None]) == np.inf
    assert median([0.1, 0.3]) == pytest.approx(0.2)
    assert median([0.1, None]) == np.inf
    assert np.isnan(median([]))


def test_the_share_broken_within_a_distance():
    found = broken_within([0.1, 0.2, None, 0.2], np.array([0.0, 0.1, 0.2, 1.0]))
    assert found.tolist() == [0, 0.25, 0.75, 0.75]
    assert broken_within([], np.array([0.5])).tolist() == [0.0]


def test_calibration_compares_confidence_with_what_is_right():
    found = calibrate([(0.95, True), (0.95, False), (1.0, True), (0.05, False)])
    assert found.answers.tolist() == [1] + [0] * 8 + [3]
    assert found.right[9] == pytest.approx(2 / 3)
    # 3/4 (.9667 - .6667) + 1/4 (.05 - 0)
    assert found.error == pytest.approx(0.2375)
    assert np.isnan(calibrate([]).error)


def of_three_cases(least, worst):
    """A study in which all bounds are 0.2, of what two attacks found in each case (None: no failure)."""
    failure = {"miscounts": None, "confidence": [], "endpoint_error_m": 0.1, "misread": []}
    known = [
        {
            "reid": "spatial", "case": case, "wrong_untouched": 0, "theorem": "T", "bound": 0.2,
            "bound_t1": 0.1, "camera": [0.0, 0.0, 0.0], "noise_failures": 0, "noise_draws": 1,
            "confidence": [], "in_view": [True], "bound_by_object": [0.2],
        }
        for case in range(3)
    ]  # fmt: skip
    attacked = [
        {
            "reid": "spatial", "case": case, "attack": attack, "least": least[case],
            "cheapest": least[case] and failure, "transfer": least[case] and {"spatial": 1},
            "worst": worst[attack][case], "stuck": False, "asked": 9,
        }
        for attack in ("analytic", "halton")
        for case in range(3)
    ]  # fmt: skip
    options = StressOptions(attacks=("analytic", "halton"), cases=3)
    return summarise_reid(Study(options, known, attacked, []), "spatial", ["a"])


NO_WORST = {"analytic": [None] * 3, "halton": [None] * 3}


@pytest.mark.parametrize(
    ("least", "tightness"),
    [([0.3, 0.5, 0.4], 2.0), ([0.3, None, 0.4], 2.0), ([0.3, 0.5, None], 2.5), ([0.3, None, None], np.inf)],
)
def test_a_case_that_nothing_broke_is_infinitely_far_above_its_bound(least, tightness):
    assert of_three_cases(least, NO_WORST).best.tightness == pytest.approx(tightness)


def test_of_failures_with_as_many_wrong_labels_the_cheapest_is_the_worst():
    def failure(wrong, distance):
        return {"wrong": wrong, "effort": distance}

    worst = {
        "analytic": [failure(2, 0.9), failure(4, 0.9), None],
        "halton": [failure(2, 0.4), failure(2, 0.4), failure(2, 0.7)],
    }
    summary = of_three_cases([0.3, 0.3, 0.3], worst)
    assert summary.most_wrong == ((2, 0.4), (4, 0.9), (2, 0.7))
    assert (summary.most_wrong_labels, summary.most_wrong_distance) == (2.0, 0.7)
