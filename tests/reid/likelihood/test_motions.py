from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from farm_ar.errors import OptionError
from farm_ar.reid import DetectionNoise, Motion, NoisePrior, Rates, motion_log_density
from farm_ar.reid.likelihood.densities import axis_density, normal_cdf
from farm_ar.reid.likelihood.motions import axis_log_density, heading_log_density

few = settings(max_examples=30 * settings().max_examples // 50, deadline=None)


def along(x: float, label: float, side: float | None, motion_sd: float, detection_sd: float) -> float:
    found = axis_log_density(np.array([x]), np.array([label]), side, motion_sd, detection_sd)
    return float(np.exp(found[0, 0]))


@pytest.mark.parametrize("label", [0.0, 0.3, 2.0, 3.95])
@pytest.mark.parametrize("motion_sd", [0.05, 0.5, 2.0])
@pytest.mark.parametrize("detection_sd", [0.02, 0.1])
def test_a_coordinate_in_a_room_with_walls_is_somewhere(label, motion_sd, detection_sd):
    x = np.linspace(-4 * detection_sd, 4 + 4 * detection_sd, 20001)
    density = np.exp(axis_log_density(x, np.array([label]), 4.0, motion_sd, detection_sd))[:, 0]
    assert np.trapezoid(density, x) == pytest.approx(1.0, abs=2e-3)


def test_against_a_wall_stands_what_would_have_gone_through_it():
    # The share that clipping puts on the wall, spread by the detection noise.
    expected = norm.cdf(-0.3, scale=0.5) * norm.pdf(0, scale=0.001)
    assert along(0.0, 0.3, 5.0, 0.5, 0.001) == pytest.approx(expected, rel=0.01)
    assert along(5.0, 4.7, 5.0, 0.5, 0.001) == pytest.approx(expected, rel=0.01)
    assert along(0.0, 0.3, None, 0.5, 0.001) == pytest.approx(norm.pdf(0.3, scale=0.5), rel=0.01)


@few
@given(period=st.sampled_from([2 * np.pi, np.pi, np.pi / 2]), sd=st.floats(0.02, 6.0))
def test_a_heading_is_somewhere_in_a_full_turn(period, sd):
    turns = np.linspace(-np.pi, np.pi, 20001)
    density = np.exp(heading_log_density(turns, period, sd))
    assert np.trapezoid(density, turns) == pytest.approx(1.0, abs=1e-6)


@few
@given(turn=st.floats(-7, 7), sd=st.floats(0.1, 3.0), period=st.sampled_from([2 * np.pi, np.pi]))
def test_a_heading_is_a_gaussian_wrapped_onto_its_period(turn, sd, period):
    wrapped = sum(norm.pdf(turn + k * period, scale=sd) for k in range(-60, 61)) * period / (2 * np.pi)
    found = float(heading_log_density(np.array(turn), period, sd))
    assert found == pytest.approx(np.log(wrapped), abs=1e-5)


def test_what_looks_the_same_however_turned_has_no_heading():
    assert heading_log_density(np.array([0.0, 2.0]), 0.0, 0.1).tolist() == pytest.approx(
        [-np.log(2 * np.pi)] * 2
    )


def test_a_mixture_is_the_weighted_sum_of_its_parts():
    rng = np.random.default_rng(0)
    poses = (
        rng.uniform(0, 4, (3, 2)),
        rng.uniform(-3, 3, 3),
        rng.uniform(0, 4, (5, 2)),
        rng.uniform(-3, 3, 5),
    )
    noise = DetectionNoise(0.01, 0.02)
    parts = Motion(1.0, 0.1, 0.2), Motion(1.0, 1.0, 2.0)
    first, second = (np.exp(motion_log_density(*poses, [part], noise, (4.0, 4.0))) for part in parts)
    mixed = motion_log_density(*poses, [Motion(0.7, 0.1, 0.2), Motion(0.3, 1.0, 2.0)], noise, (4.0, 4.0))
    np.testing.assert_allclose(np.exp(mixed), 0.7 * first + 0.3 * second, rtol=1e-9)


@pytest.mark.parametrize("plain", [False, True])
def test_the_compiled_coordinate_density_is_the_same(plain):
    compiled = axis_density
    density = compiled.py_func if plain else compiled
    assert normal_cdf.py_func(1.0) == pytest.approx(norm.cdf(1.0))
    for x in (0.0, 0.003, 1.3, 3.999, 4.0, 4.5):
        for label, motion_sd in ((0.2, 0.5), (1.2, 0.0), (3.9, 1.5)):
            expected = along(x, label, 4.0, motion_sd, 0.005)
            assert density(x, label, 4.0, motion_sd, 0.005) == pytest.approx(expected, rel=1e-9, abs=1e-300)
            endless = along(x, label, None, motion_sd, 0.005)
            assert density(x, label, np.inf, motion_sd, 0.005) == pytest.approx(endless, rel=1e-9, abs=1e-300)


def test_a_prior_shrinks_with_the_scene_and_sums_to_one():
    usual, small = NoisePrior().models(7.0), NoisePrior().models(1.4)
    assert sum(share for share, _ in usual) == pytest.approx(1.0)
    assert usual[0][1][0].translation_sd == pytest.approx(0.08)
    assert small[0][1][0].translation_sd == pytest.approx(0.08 * 0.2)
    assert small[0][1][0].rotation_sd == usual[0][1][0].rotation_sd
    assert len(NoisePrior(few_move_far=0.0).models(10.0)) == 30
    for _, motions in NoisePrior(few_move_far=1.0).models(10.0):
        assert sum(motion.share for motion in motions) == pytest.approx(1.0)
        assert motions[-1].translation_sd == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Motion(1.5, 0, 0), "share: must be from 0 to 1"),
        (lambda: Motion(1.0, -1, 0), "translation_sd: must be a number not below 0"),
        (lambda: DetectionNoise(0.0), "position_sd: must be a positive number"),
        (lambda: NoisePrior((2.0, 1.0)), "translation_m: must be two positive numbers"),
        (lambda: NoisePrior(levels=(0, 1)), "levels: must be two whole numbers"),
        (lambda: NoisePrior(few_move_far=2.0), "few_move_far: must be a probability"),
        (lambda: Rates(0.0), "probability: must be above 0"),
        (lambda: Rates(1.0, 1.0), "miss_rate: must be from 0 to below 1"),
        (lambda: Rates(1.0, 0.0, -1.0), "none_rate: must be a number not below 0"),
    ],
)
def test_wrong_values_are_refused(make, message):
    with pytest.raises(OptionError, match=message):
        make()
