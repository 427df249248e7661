import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from farm_ar.arrays import FloatArray
from farm_ar.geometry import direction, wrap
from farm_ar.reid.registration import (
    RigidMotion,
    add_pair,
    concentration_of,
    register,
    solve_motion,
    turned,
    volume,
)

SEEDS = st.integers(0, 2**32 - 1)


def a_motion(rng: np.random.Generator) -> RigidMotion:
    return RigidMotion(rng.uniform(-3, 3, 2), rng.uniform(-1, 1, 2), np.array(rng.uniform(-3, 3)))


def kabsch(source: FloatArray, target: FloatArray, weight: FloatArray) -> tuple[float, FloatArray]:
    """Turn and shift about the origin by the singular value decomposition (Kabsch 1976)."""
    weight = weight[:, None] / weight.sum()
    middle, end = (weight * source).sum(axis=0), (weight * target).sum(axis=0)
    u, _, vt = np.linalg.svd((weight * (source - middle)).T @ (target - end))
    matrix = vt.T @ np.diag([1.0, np.linalg.det(vt.T @ u.T)]) @ u.T
    return np.arctan2(matrix[0, 1], matrix[0, 0]), end - matrix @ middle


def test_a_quarter_turn_takes_what_is_ahead_to_the_right() -> None:
    assert_allclose(turned(np.array([0.0, 2.0]), np.array(np.pi / 2)), [2.0, 0.0], atol=1e-15)


@given(SEEDS)
def test_headings_turn_like_the_points_they_face(seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion, yaw, point = a_motion(rng), rng.uniform(-3, 3, 4), rng.uniform(-3, 3, (4, 2))
    ahead = motion.position(point + direction(yaw)) - motion.position(point)
    assert_allclose(ahead, direction(motion.yaw(yaw)), atol=1e-12)


@given(SEEDS)
def test_an_inverse_undoes_a_motion_and_another_pivot_does_not_change_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion, point, yaw = a_motion(rng), rng.uniform(-3, 3, (5, 2)), rng.uniform(-3, 3, 5)
    assert_allclose(motion.inverse().position(motion.position(point)), point, atol=1e-12)
    assert_allclose(motion.inverse().yaw(motion.yaw(yaw)), yaw, atol=1e-12)
    assert_allclose(motion.about(rng.uniform(-3, 3, 2)).position(point), motion.position(point), atol=1e-12)


@given(SEEDS, st.integers(2, 9))
def test_positions_alone_give_what_a_singular_value_decomposition_gives(seed: int, pairs: int) -> None:
    rng = np.random.default_rng(seed)
    source = rng.uniform(-3, 3, (pairs, 2))
    target = a_motion(rng).position(source) + rng.normal(0, 0.1, (pairs, 2))
    weight = rng.uniform(0.1, 5, pairs)
    angle, shift = kabsch(source, target, weight)
    found = register(source, target, weight, rng.uniform(-3, 3, 2)).motion.about(np.zeros(2))
    assert_allclose(wrap(found.turn - angle), 0, atol=1e-8)
    assert_allclose(found.shift, shift, atol=1e-8)


def test_positions_alone_agree_with_scipy() -> None:
    rng = np.random.default_rng(0)
    source = rng.uniform(-3, 3, (6, 2))
    target = turned(source, np.array(0.7)) + rng.normal(0, 0.1, (6, 2))
    flat = np.zeros((6, 1))
    centred = [np.hstack([points - points.mean(axis=0), flat]) for points in (target, source)]
    rotation, _ = Rotation.align_vectors(*centred)
    found = register(source, target, np.ones(6), np.zeros(2)).motion.turn
    assert_allclose(found, -rotation.as_rotvec()[2], atol=1e-8)


@pytest.mark.parametrize("seed", range(5))
def test_headings_and_priors_give_what_a_search_gives_and_its_curvature(seed: int) -> None:
    rng = np.random.default_rng(seed)
    source, pivot = rng.uniform(-2, 2, (4, 2)), rng.uniform(-2, 2, 2)
    target = RigidMotion(pivot, np.array([0.1, -0.2]), np.array(0.4)).position(source)
    target += rng.normal(0, 0.1, target.shape)
    precision, concentration = rng.uniform(1, 9, 4), rng.uniform(1, 9, 4)
    turn = 0.4 + rng.normal(0, 0.3, 4)

    def loss(values: FloatArray) -> float:
        motion = RigidMotion(pivot, values[:2], values[2])
        squares = np.sum((motion.position(source) - target) ** 2, axis=-1)
        heading = concentration * (1 - np.cos(turn - motion.turn))
        prior = 3.0 * np.sum(values[:2] ** 2) / 2 + 5.0 * (1 - np.cos(values[2]))
        return float(np.sum(precision * squares / 2 + heading) + prior)

    found = register(source, target, precision, pivot, turn, concentration, 3.0, 5.0)
    searched = minimize(loss, np.array([0.1, -0.2, 0.4]), tol=1e-12)
    best = np.array([*found.motion.shift, found.motion.turn])
    assert_allclose(best, searched.x, atol=1e-5)

    def least(angle: float) -> float:
        return float(minimize(lambda shift: loss(np.array([*shift, angle])), best[:2], tol=1e-12).fun)

    step = 1e-2
    curvature = (least(best[2] + step) - 2 * least(best[2]) + least(best[2] - step)) / step**2
    assert_allclose(found.turn_information, curvature, rtol=1e-3)
    assert_allclose(found.shift_information, precision.sum() + 3.0)


def test_a_batch_gives_what_each_gives_alone() -> None:
    rng = np.random.default_rng(1)
    source, target = rng.normal(size=(2, 3, 4, 2)), rng.normal(size=(2, 3, 4, 2))
    precision, pivot = rng.uniform(1, 2, (2, 3, 4)), rng.normal(size=(2, 3, 2))
    many = register(source, target, precision, pivot)
    one = register(source[1, 2], target[1, 2], precision[1, 2], pivot[1, 2])
    assert_allclose(many.motion.turn[1, 2], one.motion.turn)
    assert_allclose(many.motion.shift[1, 2], one.motion.shift)
    assert_allclose(many.turn_information[1, 2], one.turn_information)


def test_nothing_to_go_by_but_a_prior_is_no_motion() -> None:
    nothing = np.zeros((0, 2))
    found = register(nothing, nothing, np.zeros(0), np.ones(2), shift_precision=4.0, turn_concentration=2.0)
    assert found.motion.shift.tolist() == [0.0, 0.0]
    assert found.motion.turn == 0.0
    assert (found.shift_information, found.turn_information) == (4.0, 2.0)


def test_one_pair_without_headings_shifts_and_does_not_turn() -> None:
    point, end = np.array([[1.0, 0.0]]), np.array([[2.0, 3.0]])
    found = register(point, end, np.ones(1), point[0]).motion
    assert found.turn == 0.0
    assert found.shift.tolist() == [1.0, 3.0]


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
    pivot = np.array([0.5, -1.0])
    motion, *information = solve_motion(sums_of(seed, pivot, plain), 4.0, 9.0)
    before, after, precision, turn, concentration = pairs(seed)
    expected = register(before, after, precision, pivot, turn, concentration, 4.0, 9.0)
    assert_allclose(motion, [*expected.motion.shift, expected.motion.turn], atol=1e-12)
    assert_allclose(information, [expected.shift_information, expected.turn_information])


def test_a_volume_is_the_integral_over_motions_by_the_best_ones_height() -> None:
    sums = sums_of(1, np.zeros(2), plain=False)
    shift_precision, turn_concentration = 4.0, 30.0
    motion, _, _ = solve_motion(sums, shift_precision, turn_concentration)
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
    found = volume(sums, shift_precision, turn_concentration, motion)
    assert_allclose(found, math.log(integral), atol=0.02)


@pytest.mark.parametrize("sd", [0.1, 0.5, 1.0])
def test_a_concentration_makes_the_mean_vector_as_long(sd: float) -> None:
    angle = np.linspace(-np.pi, np.pi, 20001)
    density = np.exp(concentration_of(np.array(sd)) * (np.cos(angle) - 1))
    length = (density * np.cos(angle)).sum() / density.sum()
    assert_allclose(length, math.exp(-(sd**2) / 2), atol=0.02)
