import numpy as np
import pytest

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError
from farm_ar.game_logic.physics import gripper
from farm_ar.game_logic.physics.gripper import HAND_RADIUS, MAX_HAND_SPEED, MAX_TWIST, HandState
from farm_ar.game_logic.physics.state import TICK
from farm_ar.game_logic.physics.tabletop import HAND_ROOM, REACH, Tabletop
from farm_ar.geometry import wrap
from farm_ar.scenes import Layout
from farm_ar.scenes.builtin.farm import farm

SCENE = farm()
SHED = SCENE.layout.index("shed")
COOP = (0.10, 0.08, 0.09)
SIZE = (1.2, 0.8)


def row(*places: tuple[float, float], yaw: float = 0.0, fixed: tuple[bool, ...] | None = None) -> Tabletop:
    """Coops at these places on a table of 1.2 x 0.8 m."""
    n = len(places)
    labels = tuple(f"coop {i}" for i in range(n))
    flags = np.array(fixed) if fixed else np.zeros(n, dtype=bool)
    layout = Layout(
        labels, ("coop",) * n, np.array(places), np.full(n, yaw), np.array([COOP] * n), fixed=flags
    )
    return Tabletop(layout, SIZE)


def hand_of(table: Tabletop) -> HandState:
    assert table.hand is not None
    return table.hand


def gap_moved(table: Tabletop, before: FloatArray) -> float:
    """The farthest that any building has moved since, metres."""
    return float(np.linalg.norm(table.poses()[0] - before, axis=1).max())


def test_there_is_no_hand_until_it_is_brought() -> None:
    table = row((0.6, 0.4))
    assert table.hand is None
    assert not table.grip(0)
    table.bring_hand((0.2, -0.1))
    hand = hand_of(table)
    np.testing.assert_array_equal(hand.position, (0.2, -0.1))
    assert (hand.yaw, hand.gripped, hand.raised) == (0.0, None, True)
    table.remove_hand()
    assert table.hand is None


def test_a_hand_goes_down_where_there_is_room_and_hovers_where_there_is_none() -> None:
    table = row((0.6, 0.4))
    table.bring_hand((0.6, 0.4))
    table.tick()
    assert hand_of(table).raised
    np.testing.assert_array_equal(table.poses()[0], [[0.6, 0.4]])
    for _ in range(20):
        table.tick((0.0, 0.6))
        gap = hand_of(table).position[1] - (0.4 + 0.045)
        if gap < HAND_RADIUS:
            assert hand_of(table).raised
    assert not hand_of(table).raised
    np.testing.assert_array_equal(table.poses()[0], [[0.6, 0.4]])


def test_a_hand_that_stays_raised_touches_nothing() -> None:
    table = row((0.6, 0.4), (0.6, 0.52))
    table.bring_hand((0.6, 0.0), raised=True)
    table.tick((0.0, 1.0), count=40)
    assert hand_of(table).raised
    assert hand_of(table).position[1] == pytest.approx(40 / 60)
    np.testing.assert_array_equal(table.poses()[0], [[0.6, 0.4], [0.6, 0.52]])


def test_what_a_low_hand_bumps_into_is_pushed_ahead_of_it_and_the_rest_is_not() -> None:
    table = row((0.6, 0.3), (0.2, 0.3))
    table.bring_hand((0.6, 0.0))
    table.tick((0.0, 0.6), count=30)
    hand, (position, _) = hand_of(table), table.poses()
    assert hand.position[1] == pytest.approx(0.3, abs=0.02)
    assert position[0, 1] - hand.position[1] >= 0.045 + HAND_RADIUS - 0.003
    assert position[0, 0] == pytest.approx(0.6, abs=1e-6)
    np.testing.assert_array_equal(position[1], (0.2, 0.3))


@pytest.mark.parametrize(
    ("velocity", "speed"), [((100.0, 0.0), MAX_HAND_SPEED), ((0.9, 1.2), 1.5), ((0.3, 0.4), 0.5)]
)
@pytest.mark.parametrize("raised", [True, False])
def test_no_hand_is_moved_faster_than_allowed(
    velocity: tuple[float, float], speed: float, raised: bool
) -> None:
    table = row((1.1, 0.7))
    table.bring_hand((0.2, 0.1), raised=raised)
    table.tick((0.0, 0.0))
    assert hand_of(table).raised is raised
    table.tick(velocity, count=2)
    before = hand_of(table).position
    table.tick(velocity, count=6)
    moved = np.linalg.norm(hand_of(table).position - before)
    assert moved == pytest.approx(speed * 6 * TICK, rel=1e-3)
    assert np.linalg.norm(hand_of(table).velocity) == pytest.approx(speed, rel=1e-3)


@pytest.mark.parametrize(
    ("twist", "turned"), [(1.0, 0.1), (99.0, 0.1 * MAX_TWIST), (-99.0, -0.1 * MAX_TWIST)]
)
def test_a_twist_turns_the_hand_and_what_it_holds_clockwise(twist: float, turned: float) -> None:
    table = row((0.6, 0.4))
    table.bring_hand((0.6, 0.4), raised=True)
    assert table.grip(0)
    table.tick(twist=twist, count=3)
    hand, yaw = hand_of(table).yaw, table.poses()[1][0]
    table.tick(twist=twist, count=6)
    assert hand_of(table).yaw - hand == pytest.approx(turned, rel=1e-3)
    assert table.poses()[1][0] - yaw == pytest.approx(turned, rel=1e-3)


@pytest.mark.parametrize(("velocity", "axis"), [((-1.5, 0.0), 0), ((0.0, -1.5), 1), ((0.0, 1.5), 1)])
def test_a_hand_stays_near_the_table(velocity: tuple[float, float], axis: int) -> None:
    table = row((1.1, 0.7))
    table.bring_hand((0.1, 0.1), raised=True)
    for _ in range(30):
        table.tick(velocity, count=6)
    sign = np.sign(velocity[axis])
    limit = -HAND_ROOM if sign < 0 else SIZE[axis] + HAND_ROOM
    assert hand_of(table).position[axis] == pytest.approx(limit)
    table.bring_hand((-3.0, 9.0))
    np.testing.assert_allclose(hand_of(table).position, (-HAND_ROOM, SIZE[1] + HAND_ROOM))


@pytest.mark.parametrize(("beyond", "gripped"), [(-0.03, True), (REACH - 1e-3, True), (REACH + 1e-3, False)])
def test_only_what_is_within_reach_is_gripped(beyond: float, gripped: bool) -> None:
    table = row((0.6, 0.4), yaw=np.pi / 2)  # turned: 5 cm of it lie on either side along z
    table.bring_hand((0.6, 0.4 - 0.05 - beyond), raised=True)
    assert table.grip(0) is gripped
    assert hand_of(table).gripped == (0 if gripped else None)


def test_a_full_hand_and_one_on_something_fixed_grip_nothing() -> None:
    table = row((0.6, 0.4), (0.6, 0.5), (0.3, 0.4), fixed=(False, False, True))
    table.bring_hand((0.6, 0.45), raised=True)
    assert table.grip(0)
    assert table.grip(0)
    assert not table.grip(1)
    assert hand_of(table).gripped == 0
    table.bring_hand((0.3, 0.4), raised=True)
    assert not table.grip(2)


def test_what_is_gripped_follows_the_hand_and_pushes_what_is_in_its_way() -> None:
    table = row((0.3, 0.4), (0.5, 0.4))
    table.bring_hand((0.3, 0.4), raised=True)
    table.grip(0)
    table.tick((0.6, 0.0), count=30)
    position, _ = table.poses()
    np.testing.assert_allclose(hand_of(table).position, position[0], atol=1e-9)
    assert position[0, 0] == pytest.approx(0.3 + 0.6 * 0.5, abs=0.02)
    assert position[1, 0] - position[0, 0] >= 0.0995
    assert position[1, 1] == pytest.approx(0.4, abs=0.01)


@pytest.mark.parametrize("velocity", [(0.0, 0.0), (0.0, 0.7)])
def test_letting_go_does_not_shove(velocity: tuple[float, float]) -> None:
    # Between two neighbours, and, moving, pressed against the far edge.
    table = row((0.6, 0.4), (0.49, 0.4), (0.71, 0.4))
    table.settle()
    table.bring_hand((0.6, 0.4), raised=True)
    table.grip(0)
    table.tick(velocity, count=60)
    table.tick((0.0, 0.0), count=12)
    before = table.poses()[0]
    table.release()
    assert hand_of(table).raised
    table.settle()
    assert gap_moved(table, before) < 1e-3


def test_a_building_squeezed_against_the_edge_neither_flies_nor_leaves() -> None:
    for offset in np.linspace(-0.04, 0.04, 9):
        table = row((0.6, 0.1), yaw=0.2)
        table.bring_hand((0.6 + offset, 0.35))
        before, fastest = table.poses()[0], 0.0
        for _ in range(90):
            table.tick((0.0, -1.5))
            now = table.poses()[0]
            fastest, before = max(fastest, float(np.linalg.norm(now - before)) / TICK), now
        assert 0.3 < fastest < 3.0
        table.remove_hand()
        table.settle()
        assert table.on_table(1e-3).all()
        assert table.overlap() == 0


def test_once_the_hand_is_gone_all_comes_to_rest_and_stays() -> None:
    table = Tabletop(SCENE.layout, SCENE.size)
    table.bring_hand((0.3, -0.1))
    table.tick((0.0, 1.5), count=24)
    table.remove_hand()
    assert not table.still
    assert table.settle() < 90
    assert table.still
    before = table.poses()[0]
    table.tick(count=300)
    np.testing.assert_array_equal(table.poses()[0], before)


class Film:
    """What a renderer would see of a carry."""

    def __init__(self) -> None:
        self.hands: list[HandState | None] = []
        self.places: list[FloatArray] = []

    def __call__(self, table: Tabletop) -> None:
        self.hands.append(table.hand)
        self.places.append(table.poses()[0])


def test_a_carry_comes_from_the_players_side_goes_straight_and_leaves() -> None:
    table = row((0.6, 0.4), (0.6, 0.2), (0.6, 0.3))
    film = Film()
    outcome = table.carry(0, (0.9, 0.5), 0.6, film)
    assert outcome.gripped
    assert outcome.reached
    assert outcome.error_m < 1e-6
    assert outcome.error_rad < 1e-6
    assert outcome.ticks == len(film.hands) == table.ticks
    hands = [hand for hand in film.hands if hand is not None]
    assert hands[0].raised
    assert hands[0].position[1] < 0
    assert hands[-1].position[1] < -0.1
    assert table.hand is None
    holding = [k for k, hand in enumerate(film.hands) if hand is not None and hand.gripped == 0]
    path = np.array([film.places[k][0] for k in holding])
    way = np.array([0.3, 0.1]) / np.hypot(0.3, 0.1)
    off = (path - (0.6, 0.4)) @ np.array([-way[1], way[0]])
    assert np.abs(off).max() < 1e-3
    speeds = np.linalg.norm(np.diff(path, axis=0), axis=1) / TICK
    assert 0.6 < speeds.max() < 0.76
    # It reached over the two in front.
    np.testing.assert_array_equal(table.poses()[0][1:], [[0.6, 0.2], [0.6, 0.3]])


def test_a_carry_turns_the_shorter_way() -> None:
    table = row((0.6, 0.4), yaw=3.0)
    film: list[float] = []
    table.carry(0, (0.6, 0.4), -3.0, lambda table: film.append(float(table.poses()[1][0])))
    assert np.abs(film).min() > 2.99


def test_a_carry_pushes_what_is_in_its_way() -> None:
    table = row((0.3, 0.4), (0.5, 0.4))
    assert table.carry(0, (0.55, 0.4), 0.0).reached
    position, _ = table.poses()
    assert position[1, 0] > 0.65
    assert table.overlap() == 0


def test_a_carry_past_the_edge_ends_at_the_edge() -> None:
    table = row((0.6, 0.4))
    outcome = table.carry(0, (0.6, 0.9), 0.0)
    assert outcome.gripped
    assert not outcome.reached
    assert outcome.error_m == pytest.approx(0.9 - (0.8 - 0.045), abs=2e-3)
    assert table.on_table().all()


def test_what_is_fixed_is_not_carried() -> None:
    table = Tabletop(SCENE.layout, SCENE.size)
    outcome = table.carry(SHED, (0.6, 0.2), 0.0)
    assert not outcome.gripped
    assert not outcome.reached
    assert outcome.ticks == 0
    np.testing.assert_array_equal(table.poses()[0], SCENE.layout.position)


def test_a_hand_that_does_not_leave_goes_on_from_where_it_is() -> None:
    table = row((0.3, 0.4), (0.9, 0.4))
    table.carry(0, (0.3, 0.5), 0.0, leave=False)
    hand = hand_of(table)
    assert hand.raised
    assert hand.gripped is None
    np.testing.assert_allclose(hand.position, (0.3, 0.5), atol=1e-6)
    film = Film()
    assert table.carry(1, (0.9, 0.5), 0.0, film).reached
    assert film.hands[0] is not None
    np.testing.assert_allclose(film.hands[0].position, (0.3, 0.5), atol=0.02)
    assert table.hand is None


def test_a_carry_with_a_hand_that_holds_something_lets_go_of_that_first() -> None:
    table = row((0.3, 0.4), (0.9, 0.4))
    table.bring_hand((0.3, 0.4), raised=True)
    table.grip(0)
    assert table.carry(1, (0.9, 0.5), 0.0).reached
    np.testing.assert_allclose(table.poses()[0], [[0.3, 0.4], [0.9, 0.5]], atol=1e-6)


@pytest.mark.parametrize("angle", [0.3, -20.0, 1e9, -1e20, 1e300])
def test_the_heading_of_a_hand_that_has_turned_many_times_is_exact(angle: float) -> None:
    assert gripper.yaw_of(angle) == pytest.approx(float(wrap(-angle)), abs=1e-13)


@pytest.mark.parametrize(("place", "speed"), [((0.5, 0.4), 1e-9), ((1e300, 0.0), 1.0), ((np.nan, 0.0), 1.0)])
def test_a_way_that_never_ends_is_refused(place: tuple[float, float], speed: float) -> None:
    table = row((0.6, 0.4))
    table.bring_hand((0.2, -0.1))
    with pytest.raises(OptionError, match="position"):
        table.guide_hand(place, 0.0, speed)
