import hashlib
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.arrays import FloatArray
from farm_ar.errors import SceneError
from farm_ar.game_logic.physics.tabletop import REACHED_RAD, MotionLimit, Tabletop
from farm_ar.geometry import deepest_overlap, footprint_corners, footprints_overlap, segment_hits_footprint
from farm_ar.scenes import Layout
from farm_ar.scenes.builtin.farm import farm

SCENE = farm()
EFFORT = settings().max_examples
COOP, HUTCH, SHED = (0.10, 0.08, 0.09), (0.09, 0.07, 0.07), (0.20, 0.14, 0.16)
ONE = Layout(("coop",), ("coop",), np.array([[0.3, 0.4]]), np.zeros(1), np.array([COOP]))
CELL = 0.14  # a coop fits into it however it is turned
WIDE, NARROW = (8, 5), (5, 4)
TOLERATED = 3e-4
FASTEST = 3.0
EDGE = 1e-3


def crowd(rng: np.random.Generator, cells: tuple[int, int], n: int) -> tuple[Layout, tuple[float, float]]:
    """A shed at the far edge and n coops and hutches, turned at random, on a table of so many cells."""
    columns, rows = cells
    middle = columns // 2
    taken = {(column, row) for column in (middle - 1, middle) for row in (rows - 2, rows - 1)}
    free = [(c, r) for c in range(columns) for r in range(rows) if (c, r) not in taken]
    chosen = rng.permutation(len(free))[:n]
    place = (np.array(free)[chosen] + 0.5) * CELL + rng.uniform(-0.002, 0.002, (n, 2))
    shed = [[middle * CELL, (rows - 1) * CELL]]
    size = np.array([COOP, HUTCH])[rng.integers(2, size=n)]
    layout = Layout(
        labels=("shed", *(f"b{i}" for i in range(n))),
        category=("shed", *(("building",) * n)),
        position=np.vstack([shed, place]),
        yaw=np.r_[0.3, rng.uniform(-np.pi, np.pi, n)],
        size=np.vstack([[SHED], size]),
        fixed=np.arange(n + 1) == 0,
    )
    return layout, (columns * CELL, rows * CELL)


def target(rng: np.random.Generator, table: Tabletop, index: int) -> tuple[FloatArray, float]:
    """Anywhere on the table, or in a fifth of all cases straight past its edge."""
    position, yaw = table.poses()
    goal = rng.uniform(0, 1, 2) * table.size
    if rng.random() < 0.2:
        axis = rng.integers(2)
        goal = position[index].copy()
        goal[axis] = rng.choice([-0.1, table.size[axis] + 0.1])
    return goal, float(yaw[index] + rng.uniform(-np.pi, np.pi))


class Watch:
    """Looks at every tick for what must never happen."""

    def __init__(self, table: Tabletop) -> None:
        self.position, _ = table.poses()
        self.fastest = 0.0
        self.passed_through = False

    def __call__(self, table: Tabletop) -> None:
        position, yaw = table.poses()
        moved = position - self.position
        self.fastest = max(self.fastest, float(np.linalg.norm(moved, axis=1).max()) * 60)
        # The way of every middle, as seen from every other building, must stay out of that building.
        start = self.position[:, None] - self.position + position
        end = np.broadcast_to(position[:, None], start.shape)
        hits = segment_hits_footprint(start, end, position, yaw, table.layout.size)
        self.passed_through |= bool((hits & ~np.eye(len(yaw), dtype=bool)).any())
        self.position = position


def at_rest(table: Tabletop, first: Layout) -> None:
    """What must hold whenever everything has come to rest."""
    assert table.still
    assert table.overlap() <= TOLERATED
    assert table.on_table(EDGE).all()
    position, yaw = table.poses()
    np.testing.assert_array_equal(position[first.fixed], first.position[first.fixed])
    np.testing.assert_array_equal(yaw[first.fixed], first.yaw[first.fixed])


@pytest.mark.parametrize("speed", [0.75, 1.5])
@pytest.mark.parametrize(("cells", "n"), [(WIDE, 10), (NARROW, 12)])
def test_after_a_drag_nothing_overlaps_and_nothing_is_off_the_table(
    cells: tuple[int, int], n: int, speed: float
) -> None:
    rng = np.random.default_rng(n)
    for _ in range(3 * EFFORT):
        layout, size = crowd(rng, cells, n)
        table = Tabletop(layout, size)
        for _ in range(6):
            index = int(rng.integers(1, n + 1))
            table.carry(index, *target(rng, table, index), speed=speed)
            at_rest(table, layout)


def test_the_watch_notices_what_passes_through() -> None:
    layout = Layout(
        ("a", "b"), ("coop",) * 2, np.array([[0.3, 0.3], [0.42, 0.3]]), np.zeros(2), np.array([COOP] * 2)
    )
    for end, through in [((0.54, 0.3), True), ((0.2, 0.3), False)]:
        watch = Watch(Tabletop(layout, (0.8, 0.6)))
        watch(Tabletop(layout.with_poses(np.array([end, (0.42, 0.3)]), layout.yaw), (0.8, 0.6)))
        assert watch.passed_through is through
        assert watch.fastest == pytest.approx(60 * abs(end[0] - 0.3))


@pytest.mark.parametrize(("cells", "n"), [(WIDE, 10), (NARROW, 12)])
def test_nothing_passes_through_anything_or_flies_at_the_fastest_drag(cells: tuple[int, int], n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(EFFORT // 4):
        layout, size = crowd(rng, cells, n)
        table = Tabletop(layout, size)
        watch = Watch(table)
        for _ in range(4):
            index = int(rng.integers(1, n + 1))
            table.carry(index, *target(rng, table, index), watch, speed=1.5)
        assert not watch.passed_through
        assert watch.fastest < FASTEST


@pytest.mark.parametrize(("cells", "n"), [(WIDE, 10), (NARROW, 12)])
def test_a_steered_hand_keeps_all_that_too(cells: tuple[int, int], n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(EFFORT // 5):
        layout, size = crowd(rng, cells, n)
        table = Tabletop(layout, size)
        watch = Watch(table)
        table.bring_hand((size[0] / 2, -0.1))
        for _ in range(12):
            # At a building and on towards the edge behind it.
            hand = table.hand
            assert hand is not None
            way = table.poses()[0][rng.integers(1, n + 1)] - hand.position
            velocity = rng.choice([0.4, 0.75, 1.5]) * way / (np.linalg.norm(way) + 1e-9)
            closed, twist = rng.random() < 0.5, rng.uniform(-np.pi, np.pi)
            for _ in range(int(rng.integers(6, 30))):
                found = table.find_building(table.hand.position)  # type: ignore[union-attr]
                if closed and found is not None:
                    table.grip(found)
                elif not closed:
                    table.release()
                table.tick(velocity, twist)
                watch(table)
        assert not watch.passed_through
        assert watch.fastest < FASTEST
        table.remove_hand()
        table.settle()
        at_rest(table, layout)


def test_drags_to_a_free_place_end_there() -> None:
    rng = np.random.default_rng(3)
    reached, errors, shed_clear = [], [], []
    index, others = 1, np.arange(11) != 1
    for _ in range(16 * EFFORT):
        layout, size = crowd(rng, WIDE, 10)
        goal, yaw = rng.uniform(0, 1, 2) * size, float(rng.uniform(-np.pi, np.pi))
        corners = footprint_corners(goal, yaw, layout.size[index])
        room = layout.size[index] + 0.008
        rest = layout.position[others], layout.yaw[others], layout.size[others]
        if np.any((corners < 0.003) | (corners > np.array(size) - 0.003)):
            continue
        if footprints_overlap(goal, yaw, room, *rest).any():
            continue
        outcome = Tabletop(layout, size).carry(index, goal, yaw)
        reached.append(outcome.reached)
        errors.append(outcome.error_m)
        wide_shed = layout.size[0] + np.hypot(*layout.size[index, [0, 2]])
        way = layout.position[index], goal
        shed_clear.append(
            not segment_hits_footprint(*way, layout.position[0], float(layout.yaw[0]), wide_shed)
        )
    assert len(reached) > 4 * EFFORT
    assert np.mean(reached) >= 0.85
    assert np.mean(np.array(reached)[shed_clear]) >= 0.92
    assert np.median(errors) < 1e-6


def trace(watched: bool = False) -> str:
    """Hash of every pose in a history with carries and a steered hand."""
    rng = np.random.default_rng(7)
    layout, size = crowd(rng, NARROW, 12)
    table, digest = Tabletop(layout, size), hashlib.sha256()

    def look(table: Tabletop) -> None:
        table.poses()

    for _ in range(8):
        index = int(rng.integers(1, 13))
        table.carry(index, *target(rng, table, index), look if watched else None)
        table.bring_hand((0.3, -0.1))
        table.tick((0.2, 1.2), 1.0, 12)
        table.remove_hand()
        for values in table.poses():
            digest.update(values.tobytes())
    return f"{digest.hexdigest()} {table.ticks}"


def test_the_same_calls_give_the_same_bytes() -> None:
    assert trace() == trace()


def test_watching_changes_nothing() -> None:
    assert trace() == trace(watched=True)


def test_the_same_calls_give_the_same_bytes_in_another_process() -> None:
    code = f"""
import importlib.util
spec = importlib.util.spec_from_file_location("test_tabletop_again", {__file__!r})
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
print(module.trace())
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == trace()


def test_a_new_tabletop_stands_exactly_as_the_layout_says() -> None:
    table = Tabletop(SCENE.layout, SCENE.size)
    position, yaw = table.poses()
    np.testing.assert_array_equal(position, SCENE.layout.position)
    same_way = np.exp(1j * yaw) - np.exp(1j * SCENE.layout.yaw)
    np.testing.assert_allclose(np.abs(same_way), 0, atol=1e-12)
    assert ((-np.pi <= yaw) & (yaw < np.pi)).all()
    table.settle()
    np.testing.assert_array_equal(table.poses()[0], SCENE.layout.position)


def test_the_layout_keeps_the_labels_and_has_the_poses_of_now() -> None:
    table = Tabletop(SCENE.layout, SCENE.size)
    table.carry(4, (0.6, 0.2), 0.5)
    position, yaw = table.poses()
    assert table.layout.labels == SCENE.layout.labels
    np.testing.assert_array_equal(table.layout.position, position)
    np.testing.assert_array_equal(table.layout.yaw, yaw)
    np.testing.assert_allclose(position[4], (0.6, 0.2), atol=1e-6)
    assert yaw[4] == pytest.approx(0.5, abs=1e-6)
    assert not position.flags.writeable


def test_yaws_stay_in_one_turn_however_often_a_building_is_turned() -> None:
    table = Tabletop(SCENE.layout, SCENE.size)
    for yaw in (2.0, -2.5, -0.5, 1.5, 3.0, -2.0):
        assert table.carry(4, (0.6, 0.2), yaw).reached
        assert table.poses()[1][4] == pytest.approx(yaw, abs=1e-6)


def test_a_batch_of_layouts_is_refused() -> None:
    layout = SCENE.layout
    batch = layout.with_poses(layout.position[None], layout.yaw[None])
    with pytest.raises(SceneError, match="layout: must be a single arrangement"):
        Tabletop(batch, SCENE.size)


def test_buildings_that_begin_inside_each_other_or_the_edge_are_pushed_apart() -> None:
    place = np.array([[0.3, 0.3], [0.34, 0.32], [0.02, 0.5]])
    layout = Layout(("a", "b", "c"), ("coop",) * 3, place, np.zeros(3), np.array([COOP] * 3))
    table = Tabletop(layout, (0.8, 0.6))
    assert table.overlap() > 0.04
    np.testing.assert_array_equal(table.on_table(), [True, True, False])
    table.settle()
    at_rest(table, layout)


def test_nothing_happens_on_a_table_at_rest() -> None:
    table = Tabletop(SCENE.layout, SCENE.size)
    assert 6 <= table.settle() < 20
    poses, ticks = table.poses(), table.ticks
    table.tick(count=100)
    assert table.ticks == ticks + 100
    assert table.poses() is poses


def test_on_table_counts_every_corner() -> None:
    # The half diagonal is 67.3 mm: turned by 45 degrees the last one reaches 2.2 mm over the edge.
    place = np.array([[0.05, 0.045], [0.049, 0.3], [0.7, 0.55], [0.065, 0.2]])
    yaw = np.array([0.0, 0.0, 0.0, np.pi / 4])
    layout = Layout(("a", "b", "c", "d"), ("coop",) * 4, place, yaw, np.array([COOP] * 4))
    table = Tabletop(layout, (0.8, 0.6))
    np.testing.assert_array_equal(table.on_table(), [True, False, True, False])
    np.testing.assert_array_equal(table.on_table(0.0015), [True, True, True, False])


coordinate = st.floats(0.05, 0.6)


@given(st.tuples(coordinate, coordinate), st.floats(0.0, 0.1))
def test_the_building_found_is_the_nearest_footprint_within_reach(
    point: tuple[float, float], reach: float
) -> None:
    layout = SCENE.layout
    table = Tabletop(layout, SCENE.size)
    right = np.stack([np.cos(layout.yaw), -np.sin(layout.yaw)], axis=1)
    forward = np.stack([np.sin(layout.yaw), np.cos(layout.yaw)], axis=1)
    offset = np.array(point) - layout.position
    local = np.stack([(offset * right).sum(1), (offset * forward).sum(1)], axis=1)
    outside = np.maximum(np.abs(local) - layout.size[:, [0, 2]] / 2, 0.0)
    away = np.where(layout.fixed, np.inf, np.linalg.norm(outside, axis=1))
    nearest = int(np.argmin(away))
    if abs(away[nearest] - reach) < 1e-9:
        return
    assert table.find_building(point, reach) == (nearest if away[nearest] < reach else None)


@pytest.mark.parametrize(("beyond", "found"), [(-0.02, 0), (0.0, 0), (0.0599, 0), (0.0601, None)])
def test_reach_is_counted_from_the_footprint(beyond: float, found: int | None) -> None:
    layout = Layout(("a",), ("coop",), np.array([[0.4, 0.3]]), np.zeros(1), np.array([COOP]))
    assert Tabletop(layout, (0.8, 0.6)).find_building((0.4 + 0.05 + beyond, 0.3)) == found


def test_the_fixed_shed_is_never_found() -> None:
    shed = SCENE.layout.index("shed")
    assert Tabletop(SCENE.layout, SCENE.size).find_building(SCENE.layout.position[shed]) != shed


@pytest.mark.parametrize(
    ("offset", "yaw", "depth"),
    [
        ((0.07, 0.0), 0.0, 0.03),  # widths of .10 each, side by side
        ((0.0, 0.08), 0.0, 0.01),  # depths of .09 each, one behind the other
        ((0.0, 0.0), 0.0, 0.09),
        ((0.095, 0.0), np.pi / 2, 0.0),  # turned, the second reaches .045 to the side
        ((0.085, 0.0), np.pi / 2, 0.01),
        ((0.3, 0.0), 0.0, 0.0),
    ],
)
def test_overlap_is_how_deep_two_footprints_reach_into_each_other(
    offset: tuple[float, float], yaw: float, depth: float
) -> None:
    place = np.array([[0.4, 0.3], np.add((0.4, 0.3), offset), [0.1, 0.5]])
    got = deepest_overlap(place, np.array([0.0, yaw, 0.4]), np.array([COOP] * 3))
    assert got == pytest.approx(depth, abs=1e-12)


@given(st.integers(0, 10_000))
def test_overlap_is_0_exactly_where_no_footprints_overlap(seed: int) -> None:
    rng = np.random.default_rng(seed)
    place, yaw = rng.uniform(0, 0.4, (4, 2)), rng.uniform(-np.pi, np.pi, 4)
    size = np.array([COOP, HUTCH, SHED, HUTCH])
    pairs = footprints_overlap(place[:, None], yaw[:, None], size[:, None], place, yaw, size)
    np.fill_diagonal(pairs, False)
    assert (deepest_overlap(place, yaw, size) > 0) == pairs.any()


@pytest.mark.parametrize("yaw", [3.5, -3.5, 0.3 + 4 * np.pi])
def test_a_heading_counts_as_reached_whatever_turns_it_is_given_with(yaw: float) -> None:
    table = Tabletop(ONE, (1.2, 0.8))
    carried = table.carry(0, (0.6, 0.4), yaw)
    assert carried.reached
    assert carried.error_rad < REACHED_RAD
    assert np.cos(table.poses()[1][0] - yaw) > np.cos(REACHED_RAD)


@pytest.mark.parametrize("most", [MotionLimit(radians=0.5), MotionLimit(metres=0.3)])
def test_a_limit_counts_from_when_it_was_set(most: MotionLimit) -> None:
    table = Tabletop(ONE, (1.2, 0.8))
    for step in range(1, 4):
        goal, yaw = (0.3 + 0.2 * step, 0.4), 0.3 * step
        assert table.carry(0, goal, yaw, most=most).reached
    assert not table.carry(0, (0.3, 0.4), 0.0, most=most).reached
