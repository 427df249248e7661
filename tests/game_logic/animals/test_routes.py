import numpy as np
import pytest

from farm_ar.arrays import FloatArray
from farm_ar.game_logic.animals.routes import (
    CLEARANCE_M,
    PATH_SPREAD_M,
    ROUTES,
    Routes,
    clear_curve,
    door,
    running_curve,
)
from farm_ar.geometry import bezier_point, bezier_tangent, heading, inside_footprint
from farm_ar.scenes.builtin.farm import TABLE, farm

FARM = farm().layout
SHED = FARM.index("shed")
GOALS = np.repeat(np.flatnonzero(FARM.movable), 5)
ALONG = np.linspace(0, 1, 400)


def farm_curves(spread: float = 0.0) -> FloatArray:
    start = door(FARM.position[SHED], FARM.yaw[SHED], FARM.size[SHED])
    spreads = spread * np.tile([-2, -1, 0, 1, 2], len(GOALS) // 5)
    return running_curve(start, FARM.yaw[SHED], FARM.position[GOALS], FARM.yaw[GOALS], spreads)


def cleared(curve: FloatArray) -> FloatArray:
    return clear_curve(curve, GOALS, FARM.position, FARM.yaw, FARM.size, FARM.movable, TABLE)


def gone_astray(curve: FloatArray) -> int:
    """How many curves lead through a building that is not their goal."""
    points = bezier_point(curve[:, None], ALONG)
    inside = inside_footprint(points[:, :, None], FARM.position, FARM.yaw, FARM.size).any(axis=1)
    inside[np.arange(len(GOALS)), GOALS] = False
    return int(inside[:, FARM.movable].any(axis=1).sum())


def test_the_door_is_in_the_middle_of_the_front() -> None:
    position, size = np.array([1.0, 2.0]), np.array([0.4, 0.1, 0.2])
    np.testing.assert_allclose(door(position, 0.0, size), [1.0, 2.1])
    np.testing.assert_allclose(door(position, np.pi / 2, size), [1.1, 2.0])


def test_the_doors_of_the_farm_face_the_sheds() -> None:
    doors = door(FARM.position, FARM.yaw, FARM.size)
    behind = FARM.position - (doors - FARM.position)
    away = np.linalg.norm(np.stack([doors, behind]) - doors[SHED], axis=-1)
    assert np.all(away[0, FARM.movable] < away[1, FARM.movable])
    assert doors[SHED, 1] < FARM.position[SHED, 1]


def test_a_curve_leaves_along_the_door_and_arrives_at_the_front() -> None:
    start, end, yaws = np.array([0.2, 0.1]), np.array([0.8, 0.6]), np.array([0.5, -2.0])
    curve = running_curve(start, yaws[0], end, yaws[1])
    np.testing.assert_array_equal(curve[[0, 3]], [start, end])
    assert heading(bezier_tangent(curve, 0.0)) == pytest.approx(yaws[0])
    assert np.cos(heading(bezier_tangent(curve, 1.0)) - yaws[1]) == pytest.approx(-1)


def test_curves_are_spread_to_the_right_of_the_way() -> None:
    start, end = np.array([0.2, 0.1]), np.array([0.2, 0.9])
    curve = running_curve(start, 0.0, end, 3.0, np.array([0.0, 0.05, -0.02]))
    assert curve.shape == (3, 4, 2)
    middle = bezier_point(curve, 0.5)
    np.testing.assert_allclose(middle - middle[0], [[0, 0], [0.05, 0], [-0.02, 0]], atol=1e-15)


@pytest.mark.parametrize("spread", [0.0, 0.03])
def test_on_the_farm_curves_must_be_bowed_out_and_then_all_lead_home(spread: float) -> None:
    curve = farm_curves(spread)
    assert gone_astray(curve) >= 5
    assert gone_astray(cleared(curve)) == 0


def test_cleared_curves_keep_their_distance_to_the_table_and_out_of_the_shed() -> None:
    curve = cleared(farm_curves(0.03))
    points = bezier_point(curve[:, None], ALONG)
    # No curve of this family has so much room on the way to the yellow coop.
    for margin, tight in ((CLEARANCE_M, [FARM.index("yellow-coop")]), (0.0, [])):
        sides = FARM.size + 2 * (margin - 1e-9) * FARM.movable[:, None] - 0.005 * FARM.fixed[:, None]
        inside = inside_footprint(points[:, :, None], FARM.position, FARM.yaw, sides)
        inside[np.arange(len(GOALS)), :, GOALS] = False
        assert set(GOALS[inside.any(axis=(1, 2))]) == set(tight)
    assert np.all((points >= 0) & (points <= TABLE))


def test_curves_that_are_clear_stay_and_all_keep_their_ends() -> None:
    curve = farm_curves()
    bowed = cleared(curve)
    np.testing.assert_array_equal(bowed[:, [0, 3]], curve[:, [0, 3]])
    np.testing.assert_array_equal(cleared(bowed), bowed)
    same = np.all(bowed == curve, axis=(1, 2))
    assert 5 <= same.sum() < len(curve)


@pytest.mark.parametrize(
    ("wall", "table_width", "way"),
    [
        ((0.35, 0.8), 1.2, (0.8, 1.2)),  # the shorter way round
        ((0.35, 0.8), 0.8, (0.0, 0.35)),  # the one on the table
        ((0.0, 0.8), 0.8, (0.8, 1.2)),  # the only one, off the table
        ((-1.0, 2.0), 1.2, None),
    ],
)
def test_a_curve_takes_the_least_bow_round_a_wall_and_keeps_to_the_table_if_it_can(
    wall: tuple[float, float], table_width: float, way: tuple[float, float] | None
) -> None:
    curve = np.linspace([0.6, 0.1], [0.6, 0.7], 4)[None]
    position, yaw = np.array([[np.mean(wall), 0.4], [0.6, 0.7]]), np.zeros(2)
    size = np.array([[wall[1] - wall[0], 0.1, 0.02], [0.1, 0.1, 0.1]])
    obstacles, table = np.ones(2, dtype=bool), (table_width, 0.8)
    bowed = clear_curve(curve, np.array([1]), position, yaw, size, obstacles, table)[0]
    if way is None:
        np.testing.assert_array_equal(bowed, curve[0])
    else:
        points = bezier_point(bowed, ALONG)
        at_wall = points[np.abs(points[:, 1] - 0.4) <= 0.01, 0]
        assert np.all((at_wall > way[0]) & (at_wall < way[1]))


def test_lanes_are_the_same_curves() -> None:
    rng = np.random.default_rng(3)
    goals = np.flatnonzero(FARM.movable)
    routes = Routes(goals, FARM.index("shed"), np.random.default_rng(3))
    routes.lead_to(FARM, (1.2, 0.8))
    spread = PATH_SPREAD_M * rng.normal(size=(len(goals), ROUTES))
    shed = FARM.index("shed")
    where = FARM.position[goals][:, None], FARM.yaw[goals][:, None]
    start = door(FARM.position[shed], FARM.yaw[shed], FARM.size[shed])
    curve = running_curve(start, FARM.yaw[shed], *where, spread).reshape(-1, 4, 2)
    every = np.repeat(goals, ROUTES)
    expected = clear_curve(curve, every, FARM.position, FARM.yaw, FARM.size, FARM.movable, (1.2, 0.8))
    np.testing.assert_allclose(routes.all["curve"].reshape(-1, 4, 2), expected, atol=1e-12)
    np.testing.assert_array_equal(routes.all["goal"], np.repeat(goals[:, None], ROUTES, axis=1))
