import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.integrate import quad
from scipy.interpolate import BPoly

from farm_ar.arrays import FloatArray
from farm_ar.geometry import (
    arc_length_table,
    bezier_point,
    bezier_tangent,
    chain,
    direction,
    equally_spaced,
    heading,
    move_end,
    polyline_length,
    sample_chain,
    split_bezier,
)

controls = arrays(np.float64, (4, 2), elements=st.floats(-5, 5))
polylines = st.integers(2, 12).flatmap(lambda n: arrays(np.float64, (n, 2), elements=st.floats(-5, 5)))
parameters = st.floats(0, 1)
ends = arrays(np.float64, 2, elements=st.floats(-5, 5))

# The usual cubic for a quarter of the unit circle; its radius is right to 2.8e-4.
QUARTER_CIRCLE = np.array([[0.0, 1.0], [0.5522847498, 1.0], [1.0, 0.5522847498], [1.0, 0.0]])
UNIT_SQUARE = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]])
ALONG = np.linspace(0, 1, 11)


@given(controls, parameters)
def test_points_and_tangents_agree_with_scipy(control: FloatArray, t: float) -> None:
    curve = BPoly(control[:, None], [0, 1])
    np.testing.assert_allclose(bezier_point(control, t), curve(t), atol=1e-12)
    np.testing.assert_allclose(bezier_tangent(control, t), curve.derivative()(t), atol=1e-11)


@given(controls)
def test_a_segment_begins_and_ends_exactly_at_its_anchors(control: FloatArray) -> None:
    np.testing.assert_array_equal(bezier_point(control, np.array([0.0, 1.0])), control[[0, 3]])


def test_one_segment_takes_many_parameters_and_many_segments_one_each() -> None:
    control = np.stack([QUARTER_CIRCLE, QUARTER_CIRCLE + 1])
    assert bezier_point(QUARTER_CIRCLE, np.zeros((3, 5))).shape == (3, 5, 2)
    np.testing.assert_allclose(bezier_point(control, np.array([0.0, 1.0])), [[0, 1], [2, 1]])


@given(controls, parameters)
def test_the_parts_of_a_cut_segment_are_the_segment(control: FloatArray, t: float) -> None:
    before, after = split_bezier(control, t)
    np.testing.assert_array_equal(before[0], control[0])
    np.testing.assert_array_equal(before[3], after[0])
    np.testing.assert_array_equal(after[3], control[3])
    np.testing.assert_allclose(bezier_point(before, ALONG), bezier_point(control, t * ALONG), atol=1e-12)
    np.testing.assert_allclose(
        bezier_point(after, ALONG), bezier_point(control, t + (1 - t) * ALONG), atol=1e-12
    )


def test_segments_of_a_batch_are_cut_each_at_its_place() -> None:
    control = np.stack([QUARTER_CIRCLE, 2 * QUARTER_CIRCLE])
    before, after = split_bezier(control, np.array([0.25, 0.75]))
    np.testing.assert_allclose(before[1], split_bezier(control[1], 0.75)[0])
    np.testing.assert_allclose(after[0], split_bezier(control[0], 0.25)[1])
    fan, _ = split_bezier(QUARTER_CIRCLE, np.array([0.1, 0.2, 0.3]))
    assert fan.shape == (3, 4, 2)


@given(controls, ends)
def test_moving_the_end_leaves_the_start_and_its_direction(control: FloatArray, end: FloatArray) -> None:
    moved = move_end(control, end)
    np.testing.assert_array_equal(moved[:2], control[:2])
    np.testing.assert_array_equal(moved[3], end)
    np.testing.assert_allclose(moved[3] - moved[2], control[3] - control[2], atol=1e-12)


def test_one_segment_is_led_to_many_ends() -> None:
    moved = move_end(QUARTER_CIRCLE, np.array([[1.0, 1.0], [2.0, 0.0]]))
    assert moved.shape == (2, 4, 2)
    np.testing.assert_allclose(moved[1], [[0, 1], [0.5522847498, 1], [2, 0.5522847498], [2, 0]])


def test_segments_of_a_chain_share_their_anchors() -> None:
    points = np.arange(14.0).reshape(7, 2)
    np.testing.assert_array_equal(chain(points), [points[:4], points[3:]])


@pytest.mark.parametrize("count", [0, 1, 3, 5, 6, 8])
def test_a_chain_of_a_wrong_number_of_points_is_refused(count: int) -> None:
    with pytest.raises(ValueError, match=f"4, 7, 10, ... points, got {count}"):
        chain(np.zeros((count, 2)))


def test_a_chain_may_be_one_segment() -> None:
    np.testing.assert_array_equal(chain(QUARTER_CIRCLE), [QUARTER_CIRCLE])
    np.testing.assert_allclose(sample_chain(QUARTER_CIRCLE, per_segment=1), QUARTER_CIRCLE[[0, 3]])


def test_a_sampled_chain_goes_through_every_anchor_once() -> None:
    points = np.vstack([QUARTER_CIRCLE, [[1.0, -0.5522847498], [0.5522847498, -1.0], [0.0, -1.0]]])
    sampled = sample_chain(points, per_segment=10)
    assert sampled.shape == (21, 2)
    np.testing.assert_allclose(sampled[[0, 10, 20]], points[[0, 3, 6]])
    np.testing.assert_allclose(np.hypot(*sampled.T), 1, atol=3e-4)
    assert np.all(np.diff(sampled[:, 1]) < 0)


def test_lengths_grow_evenly_along_a_straight_segment() -> None:
    straight = np.linspace([0.0, 0.0], [3.0, 4.0], 4)
    np.testing.assert_allclose(arc_length_table(straight, samples=5), [0, 1, 2, 3, 4, 5])


def test_the_length_of_a_quarter_circle_is_half_pi() -> None:
    assert arc_length_table(QUARTER_CIRCLE)[-1] == pytest.approx(np.pi / 2, rel=2e-4)


def test_lengths_agree_with_adaptive_quadrature() -> None:
    control = np.array([[0.0, 0.0], [2.0, 1.0], [1.0, 3.0], [-1.0, 1.0]])
    table = arc_length_table(control, samples=16)
    for index in (4, 9, 16):
        expected, _ = quad(lambda t: float(np.hypot(*bezier_tangent(control, t))), 0, index / 16)
        assert table[index] == pytest.approx(expected, rel=1e-9)


def test_lengths_of_many_segments_are_a_row_each() -> None:
    table = arc_length_table(np.stack([QUARTER_CIRCLE, 3 * QUARTER_CIRCLE]), samples=8)
    assert table.shape == (2, 9)
    np.testing.assert_allclose(table[1], 3 * table[0])


def test_the_way_back_counts_towards_a_closed_polylines_length() -> None:
    assert polyline_length(UNIT_SQUARE) == pytest.approx(3)
    assert polyline_length(UNIT_SQUARE, closed=True) == pytest.approx(4)


def test_places_on_an_open_polyline_reach_both_ends() -> None:
    position, yaw = equally_spaced(UNIT_SQUARE, 4)
    np.testing.assert_allclose(position, UNIT_SQUARE, atol=1e-12)
    # Up, then right, then down; at a corner already the new direction, at the end still the last one.
    np.testing.assert_allclose(np.rad2deg(yaw), [0, 90, 180, 180])


@pytest.mark.parametrize("loop", [UNIT_SQUARE, np.vstack([UNIT_SQUARE, UNIT_SQUARE[:1]])])
def test_places_on_a_closed_polyline_go_all_round_and_do_not_repeat_the_first(loop: FloatArray) -> None:
    position, yaw = equally_spaced(loop, 8, closed=True)
    expected = [[0, 0], [0, 0.5], [0, 1], [0.5, 1], [1, 1], [1, 0.5], [1, 0], [0.5, 0]]
    np.testing.assert_allclose(position, expected, atol=1e-12)
    np.testing.assert_allclose(np.rad2deg(yaw), [0, 0, 90, 90, 180, 180, -90, -90])


def test_places_on_a_dense_circle_face_along_it() -> None:
    turn = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    position, yaw = equally_spaced(direction(turn), 12, closed=True)
    expected = np.arange(12) * np.pi / 6
    np.testing.assert_allclose(position, direction(expected), atol=1e-5)
    np.testing.assert_allclose(direction(yaw), direction(expected + np.pi / 2), atol=2e-3)


@given(polylines, st.integers(2, 30), st.booleans())
def test_places_are_on_the_polyline_at_equal_lengths(points: FloatArray, count: int, closed: bool) -> None:
    position, _ = equally_spaced(points, count, closed)
    path = np.vstack([points, points[:1]]) if closed else points
    length = np.hypot(*np.diff(path, axis=0).T)
    travelled = np.r_[0, np.cumsum(length)]
    steps = count if closed else count - 1
    for index, place in enumerate(position):
        along = travelled[-1] * index / steps
        expected = [np.interp(along, travelled, path[:, axis]) for axis in (0, 1)]
        np.testing.assert_allclose(place, expected, atol=1e-9)
    assert polyline_length(points, closed) == pytest.approx(travelled[-1])


@given(polylines, st.integers(1, 9), st.integers(0, 11), st.integers(1, 3))
def test_repeated_points_change_nothing(points: FloatArray, count: int, where: int, times: int) -> None:
    repeated = np.insert(points, [where % len(points)] * times, points[where % len(points)], axis=0)
    for plain, doubled in zip(equally_spaced(points, count), equally_spaced(repeated, count), strict=True):
        np.testing.assert_allclose(doubled, plain, atol=1e-9)


def test_a_closing_step_of_rounding_size_gives_no_heading() -> None:
    almost_closed = np.vstack([UNIT_SQUARE, [[1e-16, -1e-16]]])
    _, yaw = equally_spaced(almost_closed, 400, closed=True)
    assert set(np.rad2deg(yaw).round(6)) == {0, 90, 180, -90}


def test_one_place_is_the_start() -> None:
    position, yaw = equally_spaced(UNIT_SQUARE[1:], 1)
    np.testing.assert_array_equal(position, UNIT_SQUARE[1:2])
    np.testing.assert_allclose(yaw, heading(np.array([[1.0, 0.0]])))


@pytest.mark.parametrize("points", [[[1.0, 2.0]], [[1.0, 2.0], [1.0, 2.0]]])
@pytest.mark.parametrize("closed", [False, True])
def test_a_polyline_without_length_gives_its_point(points: list, closed: bool) -> None:
    position, yaw = equally_spaced(np.array(points), 3, closed)
    np.testing.assert_array_equal(position, [[1, 2]] * 3)
    np.testing.assert_array_equal(yaw, [0, 0, 0])
