"""A hand that lifts: nothing else moves, and what it puts down comes to stand where there is room."""

from __future__ import annotations

import cv2
import gymnasium as gym
import numpy as np
import pytest

from farm_ar.envs import replay
from farm_ar.errors import OptionError
from farm_ar.game_logic.farm_game import FarmGame, Phase
from farm_ar.game_logic.headset import FIELDS_OF_VIEW, look_at
from farm_ar.game_logic.physics.limits import MotionLimit
from farm_ar.game_logic.physics.tabletop import Tabletop
from farm_ar.geometry import wrap
from farm_ar.scenes import builtin_scene

FARM = builtin_scene("farm")
VIEW = look_at(np.array([0.6, -0.3]), np.array([0.33, 0.45]), FIELDS_OF_VIEW["photo"])
N = len(FARM.layout)


def table() -> Tabletop:
    return Tabletop(FARM.layout, FARM.size, lifts=True)


def common_area(position, yaw, size, i, k) -> float:
    """The area that two footprints share, by OpenCV."""
    boxes = [
        (
            (float(position[j, 0]), float(position[j, 1])),
            (float(size[j, 0]), float(size[j, 2])),
            -np.rad2deg(yaw[j]),
        )
        for j in (i, k)
    ]
    kind, corners = cv2.rotatedRectangleIntersection(*boxes)
    return 0.0 if kind == cv2.INTERSECT_NONE else float(cv2.contourArea(cv2.convexHull(corners)))


def clashes(position, yaw, i) -> bool:
    shared = [common_area(position, yaw, FARM.layout.size, i, k) for k in range(N) if k != i]
    return max(shared) > 3e-8 or not inside(position, yaw, i)


def inside(position, yaw, i) -> bool:
    width, _, depth = FARM.layout.size[i]
    wide = (abs(np.cos(yaw[i])) * width + abs(np.sin(yaw[i])) * depth) / 2
    deep = (abs(np.sin(yaw[i])) * width + abs(np.cos(yaw[i])) * depth) / 2
    reach = np.array([wide, deep])
    return bool(np.all(position[i] >= reach - 1e-6) and np.all(position[i] <= FARM.size - reach + 1e-6))


def test_a_building_goes_over_the_others_to_exactly_where_there_is_room() -> None:
    rng = np.random.default_rng(3)
    taken, blocked = 0, 0
    for _ in range(60):
        tabletop = table()
        i = int(rng.choice(np.flatnonzero(FARM.layout.movable)))
        goal, yaw = rng.uniform((0.05, 0.05), np.array(FARM.size) - 0.05), float(rng.uniform(-np.pi, np.pi))
        carry = tabletop.carry(i, goal, yaw)
        position, headings = tabletop.poses()
        rest = np.arange(N) != i
        np.testing.assert_array_equal(position[rest], FARM.layout.position[rest])
        np.testing.assert_array_equal(headings[rest], wrap(FARM.layout.yaw)[rest])
        start, turn = FARM.layout.position[i], float(wrap(yaw - FARM.layout.yaw[i]))
        wanted, wanted_yaw = FARM.layout.position.copy(), FARM.layout.yaw.copy()
        wanted[i], wanted_yaw[i] = goal, yaw
        assert not clashes(position, headings, i)
        share = np.linalg.norm(position[i] - start) / np.linalg.norm(goal - start)
        np.testing.assert_allclose(position[i], start + share * (goal - start), atol=1e-9)
        assert abs(float(wrap(headings[i] - FARM.layout.yaw[i] - share * turn))) < 1e-9
        if clashes(wanted, wanted_yaw, i):
            blocked += 1
            # A little farther on there is none.
            farther = share + 4e-3
            wanted[i], wanted_yaw[i] = start + farther * (goal - start), FARM.layout.yaw[i] + farther * turn
            assert clashes(wanted, wanted_yaw, i)
            assert not carry.reached or share > 0.9
        else:
            taken += 1
            assert carry.reached
            assert carry.error_m < 1e-9
        moved = tabletop.moved
        assert moved.metres == pytest.approx(np.linalg.norm(position[i] - start), abs=1e-12)
        assert moved.radians == pytest.approx(share * abs(turn), abs=1e-9)
    assert taken > 10
    assert blocked > 10


def test_limits_are_kept_to_the_last_digit() -> None:
    for most in (
        MotionLimit(metres=0.05),
        MotionLimit(radians=0.2),
        MotionLimit(effort=0.05, diagonal=1.442),
        MotionLimit(effort=0.3, diagonal=1.442),
    ):
        tabletop = table()
        tabletop.carry(2, (0.6, 0.3), 1.0, most=most)
        moved = tabletop.moved
        assert 0 < moved.metres <= most.metres + 1e-12
        assert 0 < moved.radians <= most.radians + 1e-12
        assert moved.effort(most.diagonal) <= most.effort + 1e-12


def test_a_recorded_carry_shows_the_way_and_ends_alike() -> None:
    plain, filmed, seen = table(), table(), []
    goal = np.array([0.6, 0.3])
    plain.carry(2, goal, 1.0)
    filmed.carry(2, goal, 1.0, lambda now: seen.append(now.poses()[0][2].copy()))
    np.testing.assert_array_equal(plain.poses()[0], filmed.poses()[0])
    assert plain.ticks == filmed.ticks
    assert len({tuple(place) for place in seen}) > 10


def test_carries_at_once_leave_the_state_of_those_tick_by_tick(rng: np.random.Generator) -> None:
    at_once, by_ticks = table(), table()
    for _ in range(40):
        i, goal, yaw = int(rng.integers(10)), rng.uniform(-0.1, [1.3, 0.9]), float(rng.uniform(-4, 4))
        most = MotionLimit(metres=float(rng.uniform(0, 0.6)))
        one = at_once.carry(i, goal, yaw, most=most)
        assert by_ticks.carry(i, goal, yaw, lambda now: None, most=most) == one
    for name in ("width", "ticks", "still", "quiet", "metres", "radians", "changes", "hand"):
        assert at_once.space.states[name] == by_ticks.space.states[name]
    for name in ("x", "z", "angle"):
        np.testing.assert_array_equal(at_once.space.bodies[name], by_ticks.space.bodies[name])


def test_what_never_moves_is_not_lifted() -> None:
    tabletop = table()
    shed = int(np.flatnonzero(FARM.layout.fixed)[0])
    assert not tabletop.carry(shed, (0.5, 0.5), 0.0).gripped
    np.testing.assert_array_equal(tabletop.poses()[0], FARM.layout.position)


@pytest.mark.parametrize("name", ["FarmToTable-v0", "FarmToTableHand-v0", "FarmToTableLayout-v0"])
def test_an_episode_plays_again_to_the_same_bytes(name: str) -> None:
    env = gym.make(f"farm_ar:{name}", carry="lift").unwrapped
    env.reset(seed=4)
    env.action_space.seed(4)
    for _ in range(60):
        if env.step(env.action_space.sample())[2]:
            break
    assert replay(env.trace()) == env.state_hash()


def test_a_steered_hand_lifts_over_others_and_the_visit_ends() -> None:
    rng = np.random.default_rng(0)
    game = FarmGame(FARM, VIEW, rng, carry="lift")
    game.bring_hand()
    i = int(np.flatnonzero(FARM.layout.movable)[0])
    x, z = FARM.layout.position[i]
    before = game.tabletop.poses()[0].copy()

    def go(to, grip):
        sighting = None
        for _ in range(400):
            now = game.tabletop.hand.position
            way = np.asarray(to) - now
            _, sighting = game.tick(np.clip(way * 60, -1, 1), 0.0, grip)
            if sighting or np.linalg.norm(way) < 1e-6:
                break
        return sighting

    go((x, z), False)
    go((x, z + 0.02), True)
    assert game.tabletop.hand.gripped == i
    assert game.phase is Phase.HAND
    go((0.6, 0.35), True)
    game.tick(np.zeros(2), 0.0, False)
    assert game.tabletop.hand.gripped is None
    sighting = None
    go((0.6, -0.5), False)
    for _ in range(60):
        _, sighting = game.tick(np.zeros(2), 0.0, False)
        if sighting:
            break
    assert sighting is not None
    after, headings = game.tabletop.poses()
    rest = np.arange(N) != i
    np.testing.assert_array_equal(after[rest], before[rest])
    assert np.linalg.norm(after[i] - before[i]) > 0.05
    assert not clashes(after, headings, i)


def test_withdrawing_a_hand_that_holds_something_puts_it_down_within_the_budget() -> None:
    game = FarmGame(FARM, VIEW, np.random.default_rng(0), carry="lift")
    game.bring_hand()
    game.allow(MotionLimit(metres=0.03))
    i = int(np.flatnonzero(FARM.layout.movable)[0])
    tabletop = game.tabletop
    tabletop.bring_hand(FARM.layout.position[i])
    assert tabletop.grip(i)
    tabletop.tick((0.5, 0.5), count=30)
    game.withdraw_hand()
    assert tabletop.hand is None
    assert 0 < tabletop.moved.metres <= 0.03 + 1e-12
    assert not clashes(*tabletop.poses(), i)


def test_another_way_of_carrying_is_refused() -> None:
    with pytest.raises(OptionError, match="carry"):
        gym.make("farm_ar:FarmToTable-v0", carry="throw")


def test_what_the_headset_does_not_see_is_not_lifted() -> None:
    away = look_at(np.array([0.6, -0.3]), np.array([0.33, -2.0]), FIELDS_OF_VIEW["photo"])
    for camera, taken in ((VIEW, True), (away, False)):
        game = FarmGame(FARM, camera, np.random.default_rng(0), carry="lift")
        game.tabletop.bring_hand(FARM.layout.position[0])
        game.tick(np.zeros(2), 0.0, True)
        assert (game.tabletop.hand.gripped == 0) == taken
