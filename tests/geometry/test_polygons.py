"""Polygons: area, what is inside, sides that cross, and the largest distance, against polar coordinates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.geometry import crossing_sides, diameter, in_polygon, polygon_area

SEEDS = st.integers(0, 2**32 - 1)


def star(rng: np.random.Generator, corners: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A polygon around 0, counter-clockwise, and its corners' angles and radii; gaps below half a turn."""
    angle = 2 * np.pi * (np.arange(corners) + rng.uniform(-0.3, 0.3, corners)) / corners
    radius = rng.uniform(0.2, 3.0, corners)
    return radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1), angle, radius


@given(SEEDS, st.integers(4, 12))
def test_the_area_is_that_of_the_triangles_about_the_middle(seed, corners):
    polygon, angle, radius = star(np.random.default_rng(seed), corners)
    gap = np.diff(angle, append=angle[0] + 2 * np.pi)
    wanted = (radius * np.roll(radius, -1) * np.sin(gap) / 2).sum()
    assert polygon_area(polygon) == pytest.approx(wanted)
    assert polygon_area(polygon[::-1] + 1e5) == pytest.approx(-wanted, rel=1e-6)


@given(SEEDS, st.integers(4, 12))
def test_a_point_is_inside_where_its_ray_meets_the_edge_farther_out(seed, corners):
    rng = np.random.default_rng(seed)
    polygon, _, _ = star(rng, corners)
    i, along, part = rng.integers(corners, size=50), rng.random(50), rng.uniform(0, 2, 50)
    edge = polygon[i] + along[:, None] * (np.roll(polygon, -1, axis=0) - polygon)[i]
    part = np.where(abs(part - 1) < 1e-6, 0.5, part)
    for corners_in_order in (polygon, polygon[::-1]):
        assert (in_polygon(part[:, None] * edge, corners_in_order) == (part < 1)).all()
        assert in_polygon(edge, corners_in_order).all()
        assert in_polygon(polygon, corners_in_order).all()


@given(SEEDS, st.integers(4, 12))
def test_a_star_is_simple_and_two_corners_exchanged_make_it_cross(seed, corners):
    polygon, _, _ = star(np.random.default_rng(seed), corners)
    assert crossing_sides(polygon) is None
    circle = polygon / np.linalg.norm(polygon, axis=1, keepdims=True)
    circle[[0, 1]] = circle[[1, 0]]
    assert crossing_sides(circle) is not None


@pytest.mark.parametrize(
    "corners",
    [
        [(0, 0), (2, 0), (1, 0)],
        [(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)],
        [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0.5), (0, 2)],
        [(1, 0), (1, 1), (0, 1), (0, 0), (2, 0)],
    ],
)
def test_sides_that_touch_or_run_back_are_found(corners):
    assert crossing_sides(np.array(corners, dtype=float)) is not None


@given(SEEDS, st.sampled_from([1, 2, 3, 50, 400]))
def test_the_diameter_is_the_largest_of_all_distances(seed, count):
    points = np.random.default_rng(seed).normal(size=(count, 2))
    wanted = np.linalg.norm(points[:, None] - points, axis=-1).max()
    assert diameter(points) == pytest.approx(wanted)
    assert diameter(np.tile(points[:1], (400, 1))) == 0
    line = np.linspace(0, 1, 400)[:, None] * points[0]
    assert diameter(line) == pytest.approx(np.linalg.norm(points[0]))
