from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.arrays import FloatArray
from farm_ar.reid import dimension_cost, rotation_cost, total_cost, translation_cost
from farm_ar.scenes import Weights

side = st.floats(0.01, 10)
sizes = st.tuples(side, side, side)


def paper_dimension_cost(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """Eq. 6 as printed, for one pairing of the axes."""
    return float(np.prod([max(p, q) / min(p, q) for p, q in zip(a, b, strict=True)]))


def test_translation_cost_is_the_distance_by_the_diagonal() -> None:
    # Room 3 x 4 m, diagonal 5 m; distances 5, 3 and 4 m, then 0, 4 and 3.
    detected = np.array([[0.0, 0.0], [3.0, 4.0]])
    labels = np.array([[3.0, 4.0], [3.0, 0.0], [0.0, 4.0]])
    cost = translation_cost(detected, labels, 5.0)
    np.testing.assert_allclose(cost, [[1.0, 0.6, 0.8], [0.0, 0.8, 0.6]], atol=1e-15)


@pytest.mark.parametrize(
    ("turn_deg", "cost"),
    [
        (0, 0.0),
        (30, 0.2588190451),
        (90, 0.7071067812),
        (180, 1.0),
        (270, 0.7071067812),
        (340, 0.1736481777),
        (-30, 0.2588190451),
    ],
)
def test_rotation_cost_is_the_sine_of_half_the_turn(turn_deg: float, cost: float) -> None:
    detected, label = np.array([np.deg2rad(25.0 + turn_deg)]), np.array([np.deg2rad(25.0)])
    assert rotation_cost(detected, label)[0, 0] == pytest.approx(cost, abs=1e-9)


@given(st.floats(-10, 10), st.floats(-10, 10), st.integers(-3, 3))
def test_rotation_cost_needs_no_wrapping(detected: float, label: float, turns: int) -> None:
    cost = rotation_cost(np.array([detected]), np.array([label, label + 2 * np.pi * turns]))
    assert cost[0, 1] == pytest.approx(cost[0, 0], abs=1e-9)
    assert 0 <= cost[0, 0] <= 1


def test_dimension_cost_is_the_product_of_the_ratios_of_the_sides() -> None:
    # Sorted: (1, 2, 4) with (2, 3, 4), 2 x 1.5 x 1; and with (0.5, 2, 2), 2 x 1 x 2.
    cost = dimension_cost(np.array([[1.0, 2.0, 4.0]]), np.array([[3.0, 4.0, 2.0], [2.0, 0.5, 2.0]]))
    np.testing.assert_allclose(cost, [[3.0, 4.0]], rtol=1e-14)


@given(sizes, sizes)
def test_dimension_cost_is_the_least_over_all_pairings_of_the_axes(
    detected: tuple[float, float, float], label: tuple[float, float, float]
) -> None:
    cost = dimension_cost(np.array([detected]), np.array([label]))[0, 0]
    assert cost == pytest.approx(min(paper_dimension_cost(detected, axes) for axes in permutations(label)))
    assert cost >= 1


@given(sizes)
def test_dimension_cost_of_a_box_with_its_axes_swapped_is_exactly_1(size: tuple[float, float, float]) -> None:
    swapped = np.array(list(permutations(size)))
    np.testing.assert_array_equal(dimension_cost(np.array([size]), swapped), np.ones((1, 6)))


def test_total_cost_weighs_the_terms_and_multiplies_by_the_dimension_cost() -> None:
    # 1.5 (2 x 0.25 + 3 x 0.5) = 3
    quarter, half, factor = (np.array([[value]]) for value in (0.25, 0.5, 1.5))
    assert total_cost(quarter, half, factor, 2.0, 3.0)[0, 0] == pytest.approx(3.0)


def test_a_total_cost_of_an_unmoved_pose_is_0_for_any_size() -> None:
    nothing, factor = np.zeros((1, 1)), np.array([[8.0]])
    assert total_cost(nothing, nothing, factor, 2.0, 1.0)[0, 0] == 0


@pytest.mark.parametrize("side", [1.0, 5.0, 7.0, 15.0])
def test_a_metre_costs_the_same_in_square_rooms_of_any_size(side: float) -> None:
    # 0.36 side / (sqrt(2) side) = 0.2546 (section 4.1.1 with Eq. 4)
    weight = Weights.of_area(side * side).translation
    metre = translation_cost(np.zeros((1, 2)), np.array([[1.0, 0.0]]), side * np.sqrt(2))
    assert weight * metre[0, 0] == pytest.approx(0.2545584, abs=1e-7)


def test_costs_of_a_batch_are_those_of_each_of_its_problems(rng: np.random.Generator) -> None:
    position, label_position = rng.uniform(0, 5, (4, 2, 3, 2)), rng.uniform(0, 5, (2, 6, 2))
    yaw, label_yaw = rng.uniform(-4, 4, (4, 2, 3)), rng.uniform(-4, 4, (2, 6))
    size, label_size = rng.uniform(0.2, 1, (4, 2, 3, 3)), rng.uniform(0.2, 1, (2, 6, 3))

    def cost(b: tuple[int, ...], shared: tuple[int, ...]) -> FloatArray:
        translation = translation_cost(position[b], label_position[shared], 7.0)
        rotation = rotation_cost(yaw[b], label_yaw[shared])
        return total_cost(translation, rotation, dimension_cost(size[b], label_size[shared]), 1.8, 1.0)

    whole = cost((), ())
    assert whole.shape == (4, 2, 3, 6)
    for b in np.ndindex(4, 2):
        np.testing.assert_allclose(whole[b], cost(b, b[1:]), rtol=1e-14)
