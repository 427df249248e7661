import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from farm_ar.arrays import FloatArray
from farm_ar.reid.registration import register
from farm_ar.reid.registration_kernels import add_pair, concentration_of, solve_motion, volume


def pairs(seed: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    before = rng.uniform(-2, 2, (5, 2))
    after = before + np.array([0.3, -0.1]) + rng.normal(0, 0.05, (5, 2))
    return before, after, rng.uniform(50, 200, 5), rng.normal(0.1, 0.1, 5), rng.uniform(5, 20, 5)


def sums_of(seed: int, pivot: FloatArray, plain: bool) -> FloatArray:
    add, sums = (add_pair.py_func if plain else add_pair), np.zeros(7)
    for x, y, precision, turn, concentration in zip(*pairs(seed), strict=True):
        add(x, y, pivot, turn, precision, concentration, sums)
    return sums


@pytest.mark.parametrize("plain", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_sums_over_pairs_give_the_motion_that_registration_gives(seed: int, plain: bool) -> None:
    pivot, motion = np.array([0.5, -1.0]), np.empty(3)
    solve = solve_motion.py_func if plain else solve_motion
    information = solve(sums_of(seed, pivot, plain), 4.0, 9.0, motion)
    before, after, precision, turn, concentration = pairs(seed)
    expected = register(before, after, precision, pivot, turn, concentration, 4.0, 9.0)
    assert_allclose(motion, [*expected.motion.shift, expected.motion.turn], atol=1e-12)
    assert_allclose(information, [expected.shift_information, expected.turn_information])


@pytest.mark.parametrize("plain", [False, True])
def test_a_volume_is_the_integral_over_motions_by_the_best_ones_height(plain: bool) -> None:
    pivot, motion = np.zeros(2), np.empty(3)
    sums = sums_of(1, pivot, plain)
    shift_precision, turn_concentration = 4.0, 30.0
    solve_motion(sums, shift_precision, turn_concentration, motion)
    before, after, precision, turn, concentration = pairs(1)

    def log_fit(x: FloatArray, z: FloatArray, angle: FloatArray) -> FloatArray:
        sine, cosine = np.sin(angle)[..., None], np.cos(angle)[..., None]
        dx = cosine * before[:, 0] + sine * before[:, 1] + x[..., None] - after[:, 0]
        dz = cosine * before[:, 1] - sine * before[:, 0] + z[..., None] - after[:, 1]
        off = precision * (dx**2 + dz**2) / 2 + concentration * (1 - np.cos(turn - angle[..., None]))
        return -off.sum(axis=-1)

    steps = np.linspace(-0.4, 0.4, 81)
    x, z, angle = np.meshgrid(motion[0] + steps, motion[1] + steps, motion[2] + steps, indexing="ij")
    log_prior = -shift_precision * (x**2 + z**2) / 2 + math.log(shift_precision / (2 * math.pi))
    log_prior += turn_concentration * (np.cos(angle) - 1) + 0.5 * math.log(turn_concentration / (2 * math.pi))
    best = log_fit(motion[:1], motion[1:2], motion[2:])[0]
    integral = np.exp(log_fit(x, z, angle) + log_prior - best).sum() * (steps[1] - steps[0]) ** 3
    found = (volume.py_func if plain else volume)(sums, shift_precision, turn_concentration, motion)
    assert_allclose(found, math.log(integral), atol=0.02)


@pytest.mark.parametrize("sd", [0.1, 0.5, 1.0])
def test_a_concentration_makes_the_mean_vector_as_long(sd: float) -> None:
    angle = np.linspace(-np.pi, np.pi, 20001)
    for function in (concentration_of, concentration_of.py_func):
        density = np.exp(function(sd) * (np.cos(angle) - 1))
        length = (density * np.cos(angle)).sum() / density.sum()
        assert_allclose(length, math.exp(-(sd**2) / 2), atol=0.02)
