import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from farm_ar.arrays import FloatArray
from farm_ar.geometry import nearest_site, voronoi_cells

ROOM = (4.0, 3.0)


def sites(low: float, high: float) -> st.SearchStrategy[FloatArray]:
    return st.integers(1, 9).flatmap(
        lambda k: arrays(np.float64, (k, 2), elements=st.floats(low, high, width=32))
    )


# On a coarse lattice sites coincide, stand in line and on circles more often than not.
lattices = st.lists(st.tuples(st.integers(-3, 6), st.integers(-3, 6)), min_size=1, max_size=12).map(
    lambda rows: np.array(rows, dtype=float) / 2
)


def area(polygon: FloatArray) -> float:
    x, z = polygon.T
    return float(x @ np.roll(z, -1) - z @ np.roll(x, -1)) / 2


def depth_inside(polygon: FloatArray, points: FloatArray) -> FloatArray:
    """How far inside the convex counter-clockwise polygon (V, 2) each point (P, 2) is; negative outside."""
    if not len(polygon):
        return np.full(len(points), -np.inf)
    side = np.roll(polygon, -1, axis=0) - polygon
    offset = points[:, None] - polygon
    cross = side[:, 0] * offset[..., 1] - side[:, 1] * offset[..., 0]
    return (cross / np.hypot(*side.T)).min(axis=1)


def test_the_nearest_site_of_each_point() -> None:
    centres = np.array([[0.0, 0.0], [4.0, 0.0]])
    points = np.array([[[1.9, 5.0], [2.1, 5.0]], [[2.0, 1.0], [9.0, 9.0]]])
    np.testing.assert_array_equal(nearest_site(points, centres), [[0, 1], [0, 1]])
    assert nearest_site(points[0, 1], centres) == 1


def test_one_site_has_the_whole_room() -> None:
    (cell,) = voronoi_cells(np.array([[1.0, 1.0]]), ROOM)
    assert cell.shape == (4, 2)
    assert {tuple(corner) for corner in cell} == {(0, 0), (4, 0), (4, 3), (0, 3)}
    assert area(cell) == 12


def test_two_sites_share_the_room_along_their_bisector() -> None:
    left, right = voronoi_cells(np.array([[1.0, 1.0], [2.0, 2.0]]), ROOM)
    # The bisector x + z = 3 cuts off the triangle below it.
    assert area(left) == pytest.approx(4.5)
    assert area(right) == pytest.approx(7.5)
    np.testing.assert_allclose(np.sort(left, axis=0), [[0, 0], [0, 0], [3, 3]], atol=1e-12)


def test_sites_in_line_cut_the_room_in_strips() -> None:
    cells = voronoi_cells(np.array([[0.5, 1.0], [3.5, 1.0], [1.5, 1.0]]), ROOM)
    np.testing.assert_allclose([area(cell) for cell in cells], [3, 4.5, 4.5])


def test_a_site_outside_the_room_has_what_is_nearest_to_it() -> None:
    inside, behind, far = voronoi_cells(np.array([[2.0, 2.0], [2.0, -1.0], [2.0, 40.0]]), ROOM)
    assert area(inside) == pytest.approx(10)
    assert area(behind) == pytest.approx(2)
    assert far.shape == (0, 2)


def test_a_site_that_is_nearest_only_along_a_wall_has_no_cell() -> None:
    inside, mirrored = voronoi_cells(np.array([[2.0, 2.0], [2.0, -2.0]]), ROOM)
    assert area(inside) == pytest.approx(12)
    assert mirrored.shape == (0, 2)


def test_the_first_of_two_sites_that_coincide_has_the_cell() -> None:
    cells = voronoi_cells(np.array([[1.0, 1.0], [1.0, 1.0], [3.0, 1.0]]), ROOM)
    assert [area(cell) for cell in cells] == pytest.approx([6, 0, 6])


@given(st.one_of(lattices, sites(0, 3), sites(-20, 20)), st.integers(0, 2**32 - 1))
def test_cells_fill_the_room_and_hold_what_is_nearest_to_their_site(centres: FloatArray, seed: int) -> None:
    cells = voronoi_cells(centres, ROOM)
    assert len(cells) == len(centres)
    assert sum(area(cell) for cell in cells) == pytest.approx(12, rel=1e-9)
    points = np.random.default_rng(seed).uniform([0, 0], ROOM, (50, 2))
    away = np.hypot(*np.moveaxis(points[:, None] - centres, -1, 0))
    for cell, own in zip(cells, away.T, strict=True):
        in_cell = depth_inside(cell, points) > 1e-9
        assert np.all(own[in_cell] <= away.min(axis=1)[in_cell] + 1e-9)


@given(st.one_of(lattices, sites(0, 3), sites(-20, 20)))
def test_cells_stay_in_the_room_and_turn_left_at_every_corner(centres: FloatArray) -> None:
    for cell in voronoi_cells(centres, ROOM):
        assert np.all((cell >= 0) & (cell <= ROOM))
        side = np.roll(cell, -1, axis=0) - cell
        turn = np.cross(
            np.c_[side, np.zeros(len(side))], np.c_[np.roll(side, -1, axis=0), np.zeros(len(side))]
        )
        assert np.all(turn[:, 2] >= -1e-9)
        assert len(cell) == 0 or area(cell) > 0
