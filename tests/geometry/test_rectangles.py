import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from matplotlib.path import Path
from scipy.optimize import linprog

from farm_ar.arrays import FloatArray
from farm_ar.geometry import (
    deepest_overlap,
    direction,
    footprint_corners,
    footprints_overlap,
    inside_footprint,
    rectangles,
    segment_hits_box,
    segment_hits_footprint,
    world_box,
)

coordinate = st.floats(-2, 2)
places = st.tuples(coordinate, coordinate).map(np.array)
points = st.tuples(coordinate, coordinate, coordinate).map(np.array)
yaws = st.floats(-7, 7)
length = st.floats(0.05, 3)
sizes = st.tuples(length, length, length).map(np.array)

QUARTER = np.pi / 2
CLEAR = 1e-6  # how far from touching a case must be for rounding not to decide it


def half_planes(position: FloatArray, yaw: float, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normals (4, 2) and bounds (4,) of a footprint's sides, from its corners alone."""
    corners = footprint_corners(position, yaw, size)
    side = np.roll(corners, -1, axis=0) - corners
    normals = np.stack([side[:, 1], -side[:, 0]], axis=1) / np.linalg.norm(side, axis=1, keepdims=True)
    return normals, np.sum(normals * corners, axis=1)


def greatest_clearance(coefficients: FloatArray, bounds: FloatArray, free: list[tuple]) -> float:
    """How far inside all half-planes one can get; negative where they have nothing in common."""
    variables = coefficients.shape[1]
    solution = linprog(
        np.r_[np.zeros(variables), -1.0],
        A_ub=np.c_[coefficients, np.ones(len(bounds))],
        b_ub=bounds,
        bounds=[*free, (None, 10)],
    )
    return float(-solution.fun)


def test_corners_of_an_object_facing_forward() -> None:
    corners = footprint_corners(np.array([1.0, 2.0]), 0.0, np.array([0.4, 9.0, 0.2]))
    np.testing.assert_allclose(corners, [[1.2, 2.1], [0.8, 2.1], [0.8, 1.9], [1.2, 1.9]])


def test_turning_right_takes_the_front_to_the_right() -> None:
    corners = footprint_corners(np.array([0.0, 0.0]), QUARTER, np.array([0.4, 9.0, 0.2]))
    # Facing +x, its right is -z: the front right corner is at (+depth / 2, -width / 2).
    np.testing.assert_allclose(corners, [[0.1, -0.2], [0.1, 0.2], [-0.1, 0.2], [-0.1, -0.2]])


@given(places, yaws, sizes)
def test_corners_go_counter_clockwise_round_the_area(
    position: FloatArray, yaw: float, size: FloatArray
) -> None:
    x, z = footprint_corners(position, yaw, size).T
    signed_area = (x @ np.roll(z, -1) - z @ np.roll(x, -1)) / 2
    assert signed_area == pytest.approx(size[0] * size[2])


@given(places, places, yaws, sizes)
def test_inside_agrees_with_matplotlib(
    point: FloatArray, position: FloatArray, yaw: float, size: FloatArray
) -> None:
    normals, bounds = half_planes(position, yaw, size)
    assume(np.all(np.abs(bounds - normals @ point) > CLEAR))
    polygon = Path(footprint_corners(position, yaw, size))
    assert inside_footprint(point, position, yaw, size) == polygon.contains_point(point)


def test_the_edge_is_inside() -> None:
    edge = np.array([[0.5, 0.0], [0.5, 0.25], [0.51, 0.0]])
    inside = inside_footprint(edge, np.zeros(2), 0.0, np.array([1.0, 1.0, 0.5]))
    np.testing.assert_array_equal(inside, [True, True, False])


@given(places, yaws, sizes, places, yaws, sizes)
def test_overlap_agrees_with_a_linear_programme(
    position: FloatArray,
    yaw: float,
    size: FloatArray,
    other_position: FloatArray,
    other_yaw: float,
    other_size: FloatArray,
) -> None:
    sides = [half_planes(position, yaw, size), half_planes(other_position, other_yaw, other_size)]
    normals, bounds = np.vstack([n for n, _ in sides]), np.hstack([b for _, b in sides])
    clearance = greatest_clearance(normals, bounds, [(None, None)] * 2)
    assume(abs(clearance) > CLEAR)
    overlap = footprints_overlap(position, yaw, size, other_position, other_yaw, other_size)
    assert overlap == (clearance > 0)
    assert overlap == footprints_overlap(other_position, other_yaw, other_size, position, yaw, size)


def test_corner_towards_corner_only_the_diagonal_axis_separates() -> None:
    square = np.array([1.0, 1.0, 1.0])
    turned = np.pi / 4  # reaches sqrt(1/2) along x and z
    near, apart = np.array([1.2, 0.0]), np.array([1.21, 0.0])
    assert footprints_overlap(np.zeros(2), 0.0, square, near, turned, square)
    assert not footprints_overlap(np.zeros(2), 0.0, square, apart, turned, square)
    # Their boxes along the world's axes overlap; the sides of the turned one are still between them.
    assert not footprints_overlap(np.zeros(2), 0.0, square, np.array([0.9, 0.9]), turned, square)


def test_standing_edge_to_edge_is_not_overlapping() -> None:
    position = np.array([[0.0, 0.0], [1.0, 0.0]])
    size = np.array([1.0, 1.0, 2.0])
    assert not footprints_overlap(position[0], 0.0, size, position[1], 0.0, size)


def test_all_pairs_of_a_layout_come_from_broadcasting() -> None:
    position = np.array([[0.0, 0.0], [0.5, 0.0], [3.0, 0.0]])
    yaw, size = np.zeros(3), np.ones((3, 3))
    pairs = footprints_overlap(position[:, None], yaw[:, None], size[:, None], position, yaw, size)
    np.testing.assert_array_equal(pairs, [[1, 1, 0], [1, 1, 0], [0, 0, 1]])


def shared_shadows(position: FloatArray, yaw: FloatArray, size: FloatArray) -> float:
    """The least that the shadows of two footprints share along any of their sides."""
    corners = footprint_corners(position, yaw, size)
    axes = np.concatenate([direction(yaw), direction(yaw + np.pi / 2)])
    low, high = (end(corners @ axes.T, axis=1) for end in (np.min, np.max))
    return float(np.min(high.min(axis=0) - low.max(axis=0)))


@given(sizes, sizes, yaws, yaws, places)
def test_an_overlap_is_as_deep_as_the_shadows_share(
    size: FloatArray, other_size: FloatArray, yaw: float, other_yaw: float, offset: FloatArray
) -> None:
    position, yaws = np.stack([np.zeros(2), offset]), np.array([yaw, other_yaw])
    both = np.stack([size, other_size])
    expected = max(shared_shadows(position, yaws, both), 0.0)
    for kernel in (deepest_overlap, deepest_overlap.py_func):  # type: ignore[attr-defined]
        assert kernel(position, yaws, both) == pytest.approx(expected, abs=1e-9)


@given(sizes, yaws, places)
def test_the_distance_of_a_point_is_that_of_the_nearest_of_many_points_inside(
    size: FloatArray, yaw: float, offset: FloatArray
) -> None:
    grid = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 101)] * 2), axis=-1).reshape(-1, 2)
    right, forward = direction(yaw + np.pi / 2), direction(yaw)
    inside = grid[:, :1] * size[0] * right + grid[:, 1:] * size[2] * forward
    nearest = np.linalg.norm(inside - offset, axis=1).min()
    away = rectangles.point_distance(offset[0], offset[1], -yaw, size[0] / 2, size[2] / 2)
    assert away <= nearest + 1e-12
    assert nearest - away <= 0.01 * float(np.hypot(size[0], size[2]))


@given(sizes, yaws, places)
def test_the_world_box_is_as_wide_as_the_corners_spread(
    size: FloatArray, yaw: float, position: FloatArray
) -> None:
    spread = np.ptp(footprint_corners(position, yaw, size), axis=0)
    np.testing.assert_allclose(world_box(size, yaw), [spread[0], size[1], spread[1]], atol=1e-12)


def test_world_boxes_of_one_size_at_many_yaws() -> None:
    boxes = world_box(np.array([3.0, 2.0, 1.0]), np.array([0.0, QUARTER, np.pi, np.pi / 4]))
    diagonal = 4 / np.sqrt(2)
    np.testing.assert_allclose(boxes, [[3, 2, 1], [1, 2, 3], [3, 2, 1], [diagonal, 2, diagonal]])


@given(places, places, places, yaws, sizes)
def test_segments_and_footprints_agree_with_a_linear_programme(
    start: FloatArray, end: FloatArray, position: FloatArray, yaw: float, size: FloatArray
) -> None:
    normals, bounds = half_planes(position, yaw, size)
    clearance = greatest_clearance((normals @ (end - start))[:, None], bounds - normals @ start, [(0, 1)])
    assume(abs(clearance) > CLEAR)
    assert segment_hits_footprint(start, end, position, yaw, size) == (clearance > 0)


@given(points, points, places, yaws, sizes, coordinate)
def test_segments_and_boxes_agree_with_a_linear_programme(
    start: FloatArray,
    end: FloatArray,
    position: FloatArray,
    yaw: float,
    size: FloatArray,
    elevation: float,
) -> None:
    normals, bounds = half_planes(position, yaw, size)
    normals = np.vstack([np.insert(normals, 1, 0.0, axis=1), [[0, 1, 0], [0, -1, 0]]])
    bounds = np.r_[bounds, elevation + size[1], -elevation]
    clearance = greatest_clearance((normals @ (end - start))[:, None], bounds - normals @ start, [(0, 1)])
    assume(abs(clearance) > CLEAR)
    assert segment_hits_box(start, end, position, yaw, size, elevation) == (clearance > 0)


@pytest.mark.parametrize(
    ("start", "end", "hit"),
    [
        ((-2, 0), (2, 0), True),  # straight through
        ((-2, 0), (-0.6, 0), False),  # stops short
        ((0.6, 0), (2, 0), False),  # begins behind
        ((-0.1, 0), (0.1, 0), True),  # wholly inside
        ((0, 0), (0, 0), True),  # a point inside
        ((0.6, 0), (0.6, 0), False),  # a point outside
        ((-2, 0.5), (2, 0.5), True),  # along a side
        ((-2, 0.6), (2, 0.6), False),  # parallel to a side
        ((-1.5, -0.5), (0, 1), True),  # through a corner
    ],
)
def test_segments_that_touch_a_square(start: tuple, end: tuple, hit: bool) -> None:
    ends = np.array(start, dtype=float), np.array(end, dtype=float)
    assert segment_hits_footprint(*ends, np.zeros(2), 0.0, np.ones(3)) == hit


def test_a_line_of_sight_over_a_box_misses_it() -> None:
    eye, position, size = np.array([0.0, 1.0, 0.0]), np.array([0.0, 2.0]), np.array([1.0, 0.6, 0.2])
    behind = np.array([[0.0, 0.0, 4.0], [0.0, 0.4, 4.0], [0.0, 0.4, 9.0], [0.0, 0.0, 1.5]])
    # At z = 2.1, its far side, the sight lines are at y .475, .685 and .86; the last one ends before the box.
    hits = segment_hits_box(eye, behind, position, 0.0, size, 0.0)
    np.testing.assert_array_equal(hits, [True, False, False, False])


def test_a_line_of_sight_under_a_raised_box_misses_it() -> None:
    start, end = np.array([0.0, 0.2, 0.0]), np.array([0.0, 0.2, 4.0])
    position, size = np.array([0.0, 2.0]), np.ones(3)
    hits = segment_hits_box(start, end, position, 0.0, size, np.array([0.0, 0.1, 0.3, -0.9]))
    np.testing.assert_array_equal(hits, [True, True, False, False])


def test_every_eye_against_every_box_comes_from_broadcasting() -> None:
    rng = np.random.default_rng(5)
    eyes, targets = rng.uniform(-2, 2, (2, 6, 1, 3))
    position, yaw = rng.uniform(-1, 1, (4, 2)), rng.uniform(-3, 3, 4)
    size, elevation = rng.uniform(0.2, 2, (4, 3)), rng.uniform(-1, 0, 4)
    hits = segment_hits_box(eyes, targets, position, yaw, size, elevation)
    boxes = list(zip(position, yaw, size, elevation, strict=True))
    one_by_one = [
        [segment_hits_box(eye[0], target[0], *box) for box in boxes]
        for eye, target in zip(eyes, targets, strict=True)
    ]
    assert hits.any()
    assert not hits.all()
    np.testing.assert_array_equal(hits, one_by_one)
