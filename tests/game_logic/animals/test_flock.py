import pickle

import numpy as np
import pymunk
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import OptionError
from farm_ar.game_logic.animals.flock import Arrivals, Flock
from farm_ar.game_logic.animals.routes import door, running_curve
from farm_ar.geometry import arc_length_table, bezier_point, footprint_corners, to_pymunk
from farm_ar.scenes.builtin.farm import farm

FARM = farm().layout
SHED = FARM.index("shed")

SQUARE = np.array([[0.1, 0.1, 0.1]])
NO_BUILDINGS = (np.empty((0, 2)), np.empty(0), np.empty((0, 3)), np.empty(0, dtype=bool))

flocks_of_curves = st.integers(1, 6).flatmap(
    lambda n: arrays(np.float64, (n, 4, 2), elements=st.floats(-1, 1))
)
moments = st.one_of(st.floats(0, 0.1), st.floats(0, 4))
ends = arrays(np.float64, (6, 2), elements=st.floats(-1, 1))
changes = st.tuples(ends, arrays(np.bool_, 6))
events = st.lists(st.one_of(moments, changes), min_size=1, max_size=12)


def straight(start: tuple[float, float], end: tuple[float, float]) -> FloatArray:
    return np.linspace(start, end, 4)[None]


def to_everywhere(count: int) -> tuple[IntArray, FloatArray]:
    """Labels, and curves from the shed to where they stand on the farm."""
    rng = np.random.default_rng(count)
    goal = rng.integers(0, len(FARM) - 1, count)
    start = door(FARM.position[SHED], FARM.yaw[SHED], FARM.size[SHED])
    spread = rng.normal(0, 0.03, count)
    return goal, running_curve(start, FARM.yaw[SHED], FARM.position[goal], FARM.yaw[goal], spread)


def running(count: int, last: float = 0.5) -> Flock:
    """Animals on their way over the farm; some have yet to leave the shed, `last` is in how many seconds."""
    flock = Flock()
    flock.add(*to_everywhere(count), delay=np.linspace(last, -1.0, count))
    return flock


def play_on_farm(flock: Flock, seconds: float) -> Arrivals:
    return flock.play(seconds, FARM.position, FARM.yaw, FARM.size, FARM.movable)


def play_against_square(flock: Flock, seconds: float, at: tuple[float, float], yaw: float = 0.0) -> Arrivals:
    return flock.play(seconds, np.array([at]), np.array([yaw]), SQUARE, np.array([True]))


def state(flock: Flock) -> bytes:
    return b"".join(a.tobytes() for a in (flock.goal, flock.position, flock.heading, flock.curve))


def unpacked(arrivals: Arrivals) -> list[tuple[int, int, float]]:
    columns = (arrivals.goal.tolist(), arrivals.building.tolist(), arrivals.time.tolist())
    return list(zip(*columns, strict=True))


@given(flocks_of_curves, events)
def test_no_animal_ever_jumps(curve: FloatArray, happened: list[object]) -> None:
    flock = Flock(speed=0.25)
    flock.add(np.arange(len(curve)), curve)
    for event in happened:
        names, before = flock.goal, flock.position
        if isinstance(event, float):
            play_against_square(flock, event, (0.2, 0.1), 0.3)
            stayed = np.isin(names, flock.goal)
            step = np.linalg.norm(flock.position - before[stayed], axis=1)
            assert np.all(step <= 0.25 * event + 1e-12)
        else:
            flock.redirect(*event)
            np.testing.assert_allclose(flock.position, before, rtol=0, atol=1e-15)


def test_animals_run_at_constant_speed_along_their_curves(rng: np.random.Generator) -> None:
    flock = Flock(speed=0.25)
    curve = rng.uniform(-1, 1, (30, 4, 2))
    curve[0] = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]]  # through a cusp
    flock.add(np.arange(30), curve)
    left = arc_length_table(flock.curve, 4096)[:, -1]
    for seconds in (0.5, 1 / 60, 1.3):
        names = flock.goal
        flock.play(seconds, *NO_BUILDINGS)
        left = left[np.isin(names, flock.goal)] - 0.25 * seconds
        assert 0 in flock.goal
        np.testing.assert_allclose(arc_length_table(flock.curve, 4096)[:, -1], left, atol=1e-7)


def test_what_is_left_of_a_curve_is_the_curve() -> None:
    flock = Flock()
    goal, whole = to_everywhere(30)
    flock.add(goal, whole)
    flock.play(0.3, *NO_BUILDINGS)
    assert len(flock) == 30
    rest = flock.curve
    np.testing.assert_array_equal(rest[:, 0], flock.position)
    np.testing.assert_allclose(rest[:, 3], whole[:, 3], atol=1e-15)
    fine = bezier_point(whole[:, None], np.linspace(0, 1, 20001))
    for part in np.linspace(0, 1, 7):
        gap = np.linalg.norm(fine - bezier_point(rest, part)[:, None], axis=-1).min(axis=1)
        assert gap.max() < 5e-5


def test_moving_an_end_to_where_it_is_changes_nothing() -> None:
    still, turned = running(40), running(40)
    for flock in (still, turned):
        play_on_farm(flock, 0.7)
    turned.redirect(FARM.position, np.ones(len(FARM), dtype=bool))
    a, b = play_on_farm(still, 10.0), play_on_farm(turned, 10.0)
    np.testing.assert_array_equal(a.goal, b.goal)
    np.testing.assert_array_equal(a.building, b.building)
    np.testing.assert_allclose(a.time, b.time, atol=1e-12)


def test_only_the_ends_to_changed_labels_move() -> None:
    flock = running(40)
    play_on_farm(flock, 0.7)
    position, yaw, curve = flock.position, flock.heading, flock.curve
    changed = np.arange(len(FARM)) < 4
    shift = np.array([0.1, -0.2])
    flock.redirect(FARM.position + shift, changed)
    moved = changed[flock.goal]
    assert 0 < moved.sum() < len(flock)
    np.testing.assert_array_equal(flock.position, position)
    np.testing.assert_allclose(flock.heading, yaw, atol=1e-9)
    np.testing.assert_array_equal(flock.curve[:, :2], curve[:, :2])
    np.testing.assert_allclose(flock.curve[moved, 2:], curve[moved, 2:] + shift, atol=1e-15)
    np.testing.assert_array_equal(flock.curve[~moved], curve[~moved])


def test_a_redirected_animal_arrives_at_the_new_end() -> None:
    flock = Flock(speed=0.5)
    flock.add([3], straight((0.0, 0.0), (0.0, 1.0)))
    flock.play(1.0, *NO_BUILDINGS)
    goal_end, changed = np.zeros((4, 2)), np.array([False, False, False, True])
    goal_end[3] = [0.4, 0.9]
    flock.redirect(goal_end, changed)
    assert unpacked(play_against_square(flock, 10.0, (0.4, 0.9)))[0][:2] == (3, 0)


@pytest.mark.parametrize(
    ("yaw", "time"), [(0.0, (1.0 - 0.05) / 0.25), (np.pi / 4, (1.0 - 0.05 * np.sqrt(2)) / 0.25)]
)
@pytest.mark.parametrize("middle", [(1 / 3, 2 / 3), (0.05, 0.1), (0.9, 0.2)])
def test_on_a_straight_line_the_time_of_arrival_is_known(
    middle: tuple[float, float], yaw: float, time: float
) -> None:
    """However unevenly the curve's parameter runs along it."""
    flock = Flock(speed=0.25)
    x = np.array([0.0, *middle, 1.0])
    flock.add([7], np.column_stack([x, np.full(4, 0.3)])[None])
    (arrival,) = unpacked(play_against_square(flock, 5.0, (1.0, 0.3), yaw))
    assert arrival == (7, 0, pytest.approx(time, abs=1e-12))
    assert len(flock) == 0


def test_where_nothing_stands_an_animal_arrives_nowhere() -> None:
    flock = Flock(speed=0.25)
    flock.add([2], straight((0.0, 0.0), (0.0, 0.5)))
    assert len(play_against_square(flock, 1.9, (0.5, 0.5))) == 0
    assert unpacked(play_against_square(flock, 0.2, (0.5, 0.5))) == [(2, -1, pytest.approx(0.1))]
    assert len(flock) == 0


def test_an_animal_over_which_a_building_was_put_arrives_at_once() -> None:
    flock = Flock()
    ways = [straight((0.0, 0.0), (0.0, 1.0)), straight((1.0, 0.0), (1.0, 0.27))]
    flock.add([0, 1], np.concatenate(ways))
    assert len(play_against_square(flock, 1.0, (0.5, 0.5))) == 0
    assert unpacked(play_against_square(flock, 0.0, (1.03, 0.24))) == [(1, 0, 0.0)]
    np.testing.assert_array_equal(flock.goal, [0])
    np.testing.assert_allclose(flock.position, [[0.0, 0.25]], atol=1e-15)


def test_nobody_enters_what_is_no_obstacle() -> None:
    flock = Flock()
    flock.add([0], straight((0.0, 0.0), (0.0, 0.9)))
    places = np.array([[0.0, 0.9], [0.0, 0.9]])
    arrivals = flock.play(4.0, places, np.zeros(2), np.repeat(SQUARE, 2, axis=0), np.array([False, True]))
    assert unpacked(arrivals) == [(0, 1, pytest.approx(0.85 / 0.25))]


def test_an_animal_runs_past_a_building_that_is_not_at_the_end_of_its_way() -> None:
    flock = Flock()
    flock.add([0], straight((0.0, 0.0), (0.0, 0.9)))
    places = np.array([[0.0, 0.4], [0.0, 0.9]])
    arrivals = flock.play(4.0, places, np.zeros(2), np.repeat(SQUARE, 2, axis=0), np.array([True, True]))
    assert unpacked(arrivals) == [(0, 1, pytest.approx(0.85 / 0.25))]


def test_arrivals_are_in_order_of_time_and_those_of_one_moment_in_that_of_the_flock() -> None:
    flock = Flock(speed=0.5)
    lengths = [0.9, 0.4, 0.7, 0.4, 0.2]
    flock.add(np.arange(5), np.concatenate([straight((0.0, 0.0), (length, 0.0)) for length in lengths]))
    arrivals = flock.play(1.5, *NO_BUILDINGS)
    np.testing.assert_array_equal(arrivals.goal, [4, 1, 3, 2])
    np.testing.assert_allclose(arrivals.time, [0.4, 0.8, 0.8, 1.4])
    np.testing.assert_array_equal(flock.goal, [0])


def test_an_animal_with_a_delay_waits_where_no_building_takes_it_in() -> None:
    flock = Flock(speed=0.5)
    flock.add([4], straight((0.0, 0.0), (0.0, 1.0)), delay=2.0)
    assert len(play_against_square(flock, 1.5, (0.0, 0.0))) == 0
    flock.redirect(np.tile([0.02, 0.02], (5, 1)), np.ones(5, dtype=bool))
    np.testing.assert_array_equal(flock.position, [[0.0, 0.0]])
    assert unpacked(play_against_square(flock, 1.0, (0.0, 0.0))) == [(4, 0, 0.5)]


def test_an_animal_with_a_negative_delay_is_on_its_way_already() -> None:
    flock = Flock(speed=0.5)
    flock.add([4, 4], np.repeat(straight((0.0, 0.0), (0.0, 1.0)), 2, axis=0), delay=[-0.6, -3.0])
    np.testing.assert_allclose(flock.position, [[0.0, 0.3], [0.0, 1.0]])
    assert unpacked(flock.play(0.0, *NO_BUILDINGS)) == [(4, -1, 0.0)]
    assert unpacked(flock.play(2.0, *NO_BUILDINGS)) == [(4, -1, pytest.approx(1.4))]


def test_one_long_play_is_many_short_ones() -> None:
    at_once, ticked = running(60, last=6.0), running(60, last=6.0)
    long = play_on_farm(at_once, 5.0)
    short = [play_on_farm(ticked, 1 / 60) for _ in range(300)]
    assert 10 < len(long) < 60
    np.testing.assert_array_equal(long.goal, np.concatenate([part.goal for part in short]))
    np.testing.assert_array_equal(long.building, np.concatenate([part.building for part in short]))
    times = [part.time + i / 60 for i, part in enumerate(short)]
    np.testing.assert_allclose(long.time, np.concatenate(times), atol=1e-9)
    np.testing.assert_array_equal(at_once.goal, ticked.goal)
    np.testing.assert_allclose(at_once.position, ticked.position, atol=1e-12)


def test_arrivals_are_where_pymunk_finds_a_building() -> None:
    space = pymunk.Space()
    index = {}
    for i in np.flatnonzero(FARM.movable):
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        position, angle = to_pymunk(FARM.position[i], FARM.yaw[i])
        body.position, body.angle = tuple(position), float(angle)
        shape = pymunk.Poly(body, [tuple(c) for c in footprint_corners(np.zeros(2), 0.0, FARM.size[i])])
        space.add(body, shape)
        index[shape] = int(i)

    def found(curve: FloatArray, seconds: float) -> list[int]:
        """The buildings in which an animal is that has run past all of them for so long."""
        flock = Flock()
        flock.add([0], curve[None])
        flock.play(seconds, *NO_BUILDINGS)
        return [
            index[hit.shape] for hit in space.point_query(tuple(flock.position[0]), 0.0, pymunk.ShapeFilter())
        ]

    passed = 0
    for goal, curve in zip(*to_everywhere(60), strict=True):
        flock = Flock()
        flock.add([goal], curve[None])
        ((_, building, time),) = unpacked(play_on_farm(flock, 60.0))
        assert building == goal
        assert found(curve, time + 1e-6) == [building]
        before = [found(curve, earlier) for earlier in np.linspace(0, time - 1e-6, 100)]
        assert not any(building in buildings for buildings in before)
        passed += any(before)
    assert passed > 5


def test_the_same_calls_give_the_same_bytes() -> None:
    flocks = [running(50), running(50), running(50)]
    play_on_farm(flocks[2], 0.4)
    flocks[2] = pickle.loads(pickle.dumps(flocks[2]))
    for flock in flocks[:2]:
        play_on_farm(flock, 0.4)
    arrivals = [play_on_farm(flock, 1.0) for flock in flocks]
    assert len(arrivals[0]) > 0
    for other, later in zip(flocks[1:], arrivals[1:], strict=True):
        assert state(other) == state(flocks[0])
        assert later.time.tobytes() == arrivals[0].time.tobytes()


def test_what_was_read_from_a_flock_does_not_change() -> None:
    flock = running(20)
    read = flock.goal, flock.position, flock.heading, flock.curve
    kept = [array.copy() for array in read]
    play_on_farm(flock, 1.0)
    flock.redirect(FARM.position + 0.1, np.ones(len(FARM), dtype=bool))
    for array, copy in zip(read, kept, strict=True):
        np.testing.assert_array_equal(array, copy)
    now = state(flock)
    for array in (flock.goal, flock.position, flock.heading, flock.curve):
        array[:] = 0
    assert state(flock) == now


def test_an_empty_flock_plays() -> None:
    flock = Flock()
    flock.redirect(FARM.position, np.ones(len(FARM), dtype=bool))
    arrivals = play_on_farm(flock, 5.0)
    assert (len(flock), len(arrivals)) == (0, 0)
    assert (flock.position.shape, flock.heading.shape, flock.curve.shape) == ((0, 2), (0,), (0, 4, 2))
    assert arrivals.goal.dtype == arrivals.building.dtype == np.int64


@pytest.mark.parametrize("speed", [0.0, -0.25, np.inf, np.nan])
def test_a_speed_that_is_none_is_refused(speed: float) -> None:
    with pytest.raises(OptionError, match="speed: must be a positive number"):
        Flock(speed)


def test_arrays_that_do_not_fit_are_refused() -> None:
    flock = running(3)
    curve = straight((0.0, 0.0), (1.0, 1.0))
    with pytest.raises(ValueError, match=r"goal and curve must be"):
        flock.add([0, 1], curve)
    with pytest.raises(ValueError, match="must be finite"):
        flock.add([0], curve * np.nan)
    with pytest.raises(ValueError, match="must be finite"):
        flock.add([0], curve, delay=np.inf)
    with pytest.raises(ValueError, match="goal_end and changed must be"):
        flock.redirect(np.zeros((3, 2)), np.ones(4, dtype=bool))
    with pytest.raises(IndexError):
        flock.redirect(np.zeros((1, 2)), np.ones(1, dtype=bool))
    with pytest.raises(ValueError, match="seconds must be"):
        play_on_farm(flock, -1.0)
    with pytest.raises(ValueError, match="position, yaw, size, obstacles must be"):
        flock.play(1.0, FARM.position[:3], FARM.yaw, FARM.size, FARM.movable)
    assert len(flock) == 3
