from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numba.core.dispatcher import Dispatcher
from scipy.integrate import quad

from farm_ar.arrays import FloatArray
from farm_ar.game_logic.animals import arrival, curve_intersection, obstacle_avoidance
from farm_ar.game_logic.animals.curve_intersection import NOWHERE, Footprint
from farm_ar.geometry import arc_length, bezier_point, bezier_tangent, heading, inside_footprint, split_bezier

# Down to a picometre: squares of what is smaller by far underflow.
metres = st.floats(-2, 2).map(lambda value: round(value, 12))
controls = arrays(np.float64, (4, 2), elements=metres)
lines = arrays(np.float64, 4, elements=metres)
parameters = st.floats(0, 1)
yaws = st.floats(-7, 7)

MODULES = (arc_length, obstacle_avoidance, curve_intersection, arrival)
COMPILED = {
    name: kernel
    for module in MODULES
    for name, kernel in vars(module).items()
    if isinstance(kernel, Dispatcher)
}

# Stops at its middle and goes on at a right angle.
CUSP = np.array([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]])


@pytest.fixture(params=["compiled", "python"], autouse=True, scope="module")
def mode(request: pytest.FixtureRequest) -> Iterator[str]:
    """Every test sees the kernels as they are compiled, and as plain Python."""
    with pytest.MonkeyPatch.context() as patch:
        for module in MODULES:
            for name in COMPILED.keys() & vars(module).keys():
                if request.param == "python":
                    patch.setattr(module, name, COMPILED[name].py_func)
        yield request.param


def tables(curve: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(A, KNOTS) parameters and lengths of curves."""
    knot, travelled = np.empty((2, len(curve), arc_length.KNOTS))
    for a in range(len(curve)):
        arc_length.measure(curve[a], knot[a], travelled[a])
    return knot, travelled


def around(curve: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(curve, axis=0), axis=1).sum())


def one_box(width: float, depth: float, yaw: float) -> Footprint:
    sides = np.array([[width, 1.0, depth]])
    return curve_intersection.footprints(np.array([[0.1, -0.2]]), np.array([yaw]), sides, np.array([True]))[0]


@given(lines)
def test_the_length_of_a_curve_that_doubles_back_is_exact(line: FloatArray) -> None:
    """On a line the length is the sum of the ways between the turning points, which are cusps."""
    curve = np.column_stack([line * 0.6, line * 0.8])
    slope = [3 * (line[1] - line[0]), 6 * (line[2] - 2 * line[1] + line[0]), 3 * (line @ [-1, 3, -3, 1])]
    turns = np.roots(slope[::-1]).real
    stops = np.concatenate([[0.0], np.sort(turns[(turns > 0) & (turns < 1)]), [1.0]])
    exact = np.abs(np.diff(bezier_point(curve, stops) @ [0.6, 0.8])).sum()
    assert tables(curve[None])[1][0, -1] == pytest.approx(exact, abs=1e-12)


@given(controls, parameters)
def test_length_and_parameter_are_each_others_inverse(curve: FloatArray, part: float) -> None:
    p = arc_length.polynomial(curve)
    knot, travelled = (table[0] for table in tables(curve[None]))
    length = part * travelled[-1]
    t = arc_length.parameter_at(p, knot, travelled, length)
    assert 0 <= t <= 1
    assert arc_length.length_at(p, knot, travelled, t) == pytest.approx(
        length, abs=2e-14 * around(curve) + 1e-300
    )


@given(controls, parameters, parameters)
def test_no_chord_is_longer_than_its_arc(curve: FloatArray, begin: float, step: float) -> None:
    p = arc_length.polynomial(curve)
    knot, travelled = (table[0] for table in tables(curve[None]))
    start = begin * travelled[-1]
    stop = start + step * (travelled[-1] - start)
    ends = bezier_point(
        curve, np.array([arc_length.parameter_at(p, knot, travelled, s) for s in (start, stop)])
    )
    assert np.linalg.norm(ends[1] - ends[0]) <= stop - start + 1e-12


@pytest.mark.parametrize("gap", [1e-2, 1e-3, 1e-4, 1e-5])
def test_the_length_of_a_curve_that_nearly_stops_is_exact(gap: float) -> None:
    curve = CUSP - [[0.0, 0.0], [gap, 0.0], [0.0, 0.0], [0.0, 0.0]]
    finer = 0.5 / 4.0 ** np.arange(20)
    stops = np.concatenate([0.5 - finer, [0.5], 0.5 + finer[::-1]])

    def speed(t: float) -> float:
        return float(np.linalg.norm(bezier_tangent(curve, t)))

    exact = sum(quad(speed, begin, end, epsabs=1e-15)[0] for begin, end in pairwise(stops))
    assert tables(curve[None])[1][0, -1] == pytest.approx(exact, abs=1e-13)


def test_tables_rise_evenly_where_the_curve_is_even() -> None:
    straight = np.linspace([0.0, 0.0], [1.0, 0.0], 4)
    knot, travelled = tables(np.stack([straight, CUSP]))
    np.testing.assert_allclose(knot[0, :9], np.arange(9) / 8)
    np.testing.assert_allclose(travelled[0, :9], np.arange(9) / 8)
    assert np.all(knot[0, 9:] == 1)
    assert np.all(np.diff(knot) >= 0)


def test_the_parameter_of_an_animal_under_way_is_found() -> None:
    straight = np.linspace([0.0, 0.0], [1.0, 0.0], 4)
    parameter = np.empty(3)
    arc_length.locate(np.stack([straight] * 3), np.array([-1.0, 0.3, 2.0]), parameter)
    np.testing.assert_allclose(parameter, [0.0, 0.3, 1.0], atol=1e-15)


@given(controls, st.floats(0.01, 1), st.floats(0.01, 1), yaws, parameters, parameters)
def test_the_entry_is_the_first_point_inside(
    curve: FloatArray, width: float, depth: float, yaw: float, begin: float, end: float
) -> None:
    begin, end = min(begin, end), max(begin, end)
    t = curve_intersection.footprint_entry(
        arc_length.polynomial(curve), begin, end, one_box(width, depth, yaw)
    )
    before = np.linspace(begin, min(t, end), 400)
    sides, shrunk = np.array([width, 1.0, depth]), np.array([width, 1.0, depth]) - 2e-9
    centre = np.array([0.1, -0.2])
    inside = inside_footprint(bezier_point(curve, before), centre, yaw, shrunk)
    if t <= end:
        assert inside_footprint(bezier_point(curve, t), centre, yaw, sides + 2e-9)
        assert t == begin or not inside[:-1].any()
    else:
        assert t == 2
        assert not inside.any()


@pytest.mark.parametrize("overlap", [1e-9, 1e-5, -1e-9])
def test_even_the_slightest_clip_of_a_corner_is_an_entry(overlap: float) -> None:
    """A straight run past the corner (0.5, 0.5) of a square, across its diagonal, half way along."""
    corner = 0.5 - overlap
    curve = np.linspace([corner - 1.0, corner + 1.0], [corner + 1.0, corner - 1.0], 4)
    box = curve_intersection.footprints(np.zeros((1, 2)), np.zeros(1), np.ones((1, 3)), np.array([True]))[0]
    t = curve_intersection.footprint_entry(arc_length.polynomial(curve), 0.0, 1.0, box)
    assert t == (pytest.approx(0.5 - overlap / 2, abs=1e-12) if overlap > 0 else 2.0)


def test_a_building_before_the_goals_own_is_in_the_way_and_one_behind_it_is_not() -> None:
    curve = np.linspace([0.0, 0.0], [0.0, 1.0], 4)
    position, yaw = np.array([[0.0, 0.9], [0.0, 0.5], [0.0, 0.2], [0.4, 0.5]]), np.zeros(4)
    box = curve_intersection.footprints(
        position, yaw, np.full((4, 3), 0.1), np.array([True, True, False, True])
    )
    p = arc_length.polynomial(curve)
    for likely in (NOWHERE, 0, 1, 3):
        assert obstacle_avoidance.in_the_way(p, 0, box[0], box, likely) == 1
        assert obstacle_avoidance.in_the_way(p, 1, box[1], box, likely) == NOWHERE


@given(controls, parameters)
def test_what_is_cut_off_is_the_rest_of_the_curve(curve: FloatArray, t: float) -> None:
    rest, point, yaw = np.empty((1, 4, 2)), np.empty((1, 2)), np.empty(1)
    arrival.cut(curve[None], np.array([t]), rest)
    arrival.stand(curve[None], np.array([t]), point, yaw)
    np.testing.assert_allclose(rest[0], split_bezier(curve, t)[1], atol=1e-14)
    np.testing.assert_array_equal(rest[0, 0], point[0])


@given(controls, parameters)
def test_animals_face_along_the_tangent(curve: FloatArray, t: float) -> None:
    point, yaw = np.empty((1, 2)), np.empty(1)
    arrival.stand(curve[None], np.array([t]), point, yaw)
    tangent = bezier_tangent(curve, t)
    if np.linalg.norm(tangent) > 1e-6:
        assert np.cos(yaw[0] - heading(tangent)) == pytest.approx(1)


@pytest.mark.parametrize(
    ("curve", "t", "expected"),
    [
        (CUSP, 0.5, np.pi),  # up to the cusp along +z, away from it along -z
        ([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 0.0]], 0.0, np.pi / 2),
        ([[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], 0.0, -np.pi / 2),
        ([[0.3, 0.2]] * 4, 0.5, 0.0),
    ],
)
def test_an_animal_that_stands_still_for_a_moment_faces_where_it_goes_next(
    curve: FloatArray, t: float, expected: float
) -> None:
    point, yaw = np.empty((1, 2)), np.empty(1)
    arrival.stand(np.array([curve]), np.array([t]), point, yaw)
    assert yaw[0] == pytest.approx(expected)
