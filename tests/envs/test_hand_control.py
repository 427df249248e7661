"""Steering the hand: when a visit begins and ends, what it may do, and what stands still meanwhile."""

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.game_logic.farm_game import Phase
from farm_ar.reid import Identification

STILL = np.array([0, 0, 0, -1], dtype=np.float32)
CLOSED = np.array([0, 0, 0, 1], dtype=np.float32)
OUT = (0.6, -0.45)


@pytest.fixture
def make(straight_on):
    """Makes an environment in which the player looks straight on, and begins an episode."""

    def begin(**arguments):
        given = {"jitter": "none", "hand_seconds": 60.0, "budget": 9.0, "play_seconds": 0.0} | arguments
        env = FarmToTableEnv(control="hand", **given)
        env.reset(seed=0, options={"camera": straight_on})
        return env

    return begin


@pytest.fixture
def env(make):
    return make()


@pytest.fixture
def take(drive):
    """Grips a building from the player's side; gives its index and where it stands."""

    def grip(env, label="orange-coop"):
        index = env.world.scene.layout.index(label)
        place = env.world.truth.position[index]
        drive(env, (place[0], 0.0), grip=False)
        drive(env, place - [0, 0.15], grip=False, speed=0.5)
        drive(env, place - [0, 0.095], grip=False, speed=0.15)
        env.step(CLOSED)
        return index, env.world.truth.position[index]

    return grip


def phases(infos):
    return [info["phase"] for info in infos]


def hand_is_seen(env):
    return env.world.sees_hand()


def test_the_visit_begins_when_the_hand_comes_into_view(env, drive):
    infos = drive(env, (0.6, 0.2), grip=False)
    told = phases(infos)
    assert told[0] == Phase.PLAY
    assert told[-1] == Phase.HAND
    first = told.index(Phase.HAND)
    assert set(told[first:]) == {Phase.HAND}
    assert env.world.sightings == []


def test_it_ends_half_a_second_after_the_hand_has_left_empty(env, drive):
    drive(env, (0.6, 0.1), grip=False)
    drive(env, (0.6, -0.25), grip=False)
    assert hand_is_seen(env)
    # At 1.5 m/s it is out of view within the first tenth of a second; the visit ends in the sixth.
    env.step(np.array([0, -1, 0, -1], dtype=np.float32))
    assert not hand_is_seen(env)
    for _ in range(4):
        *_, over, _, _ = env.step(STILL)
        assert not over
    *_, over, _, info = env.step(STILL)
    assert (over, info["phase"], len(env.world.sightings)) == (True, Phase.PLAY, 1)


def test_a_hand_that_comes_back_within_half_a_second_is_still_on_its_visit(env, drive):
    drive(env, (0.6, 0.1), grip=False)
    for _ in range(3):
        drive(env, OUT, grip=False, most=4)
        assert not hand_is_seen(env)
        told = phases(drive(env, (0.6, 0.1), grip=False))
        assert set(told) == {Phase.HAND}
    assert env.world.sightings == []


def test_a_building_carried_out_of_view_is_still_in_the_visit(env, drive, take):
    index, place = take(env)
    assert env.world.tabletop.hand.gripped == index
    for goal in ((place[0], 0.05), (1.12, 0.05)):
        drive(env, goal, grip=True)
    assert not env.view.in_view[index]
    assert not hand_is_seen(env)
    for _ in range(20):
        *_, over, _, info = env.step(CLOSED)
        assert (over, info["phase"]) == (False, Phase.HAND)
    for _ in range(5):
        *_, over, _, _ = env.step(STILL)
    assert over
    assert len(env.world.sightings) == 1


def test_animals_are_frozen_while_the_hand_is_in_view_and_run_before(env, drive, take):
    before = env.world.flock.position
    env.step(STILL)
    assert not np.array_equal(before, env.world.flock.position)
    drive(env, (0.6, 0.0), grip=False)
    frozen, clock = env.world.flock.position, env.world.clock
    counted = env.world.counters.counted.copy()
    assert len(frozen) > 10
    _, place = take(env)
    drive(env, np.add(place, (0.05, -0.1)), grip=True)
    np.testing.assert_array_equal(env.world.flock.position, frozen)
    np.testing.assert_array_equal(env.world.counters.counted, counted)
    assert env.world.clock == clock


def test_what_the_hand_closes_on_is_carried_and_let_go(env, drive, take):
    index, place = take(env)
    start = env.world.tabletop.hand.position
    drive(env, np.add(start, (0.1, -0.08)), grip=True, speed=0.15)
    env.step(STILL)
    env.step(STILL)
    assert env.world.tabletop.hand.gripped is None
    np.testing.assert_allclose(env.world.truth.position[index] - place, [0.1, -0.08], atol=0.01)


def test_what_is_out_of_view_cannot_be_gripped(env, take):
    layout = env.world.scene.layout
    assert not env.view.in_view[layout.index("yellow-coop")]
    take(env, "yellow-coop")
    hand = env.world.tabletop.hand
    assert hand.gripped is None
    assert env.world.tabletop.find_building(hand.position) == layout.index("yellow-coop")


def test_with_the_budget_spent_the_hand_touches_nothing_any_more(make, drive, take):
    env = make(budget=None, budget_m=0.05, budget_rad=9.0)
    index, place = take(env)
    drive(env, np.add(place, (0.1, -0.2)), grip=True, speed=0.3)
    after = env.world.truth.position
    assert env._budget.left[0] == 0
    hand = env.world.tabletop.hand
    assert (hand.gripped, hand.raised) == (None, True)
    # What it held slides on a little.
    assert 0.05 <= np.linalg.norm(after[index] - place) < 0.09
    for goal in ((0.2, 0.3), (0.9, 0.5), (0.4, 0.3), (0.2, 0.2)):
        for grip in (True, False):
            drive(env, goal, grip=grip)
    np.testing.assert_allclose(env.world.truth.position, after, atol=0.001)


def test_when_its_time_is_up_the_hand_is_withdrawn_and_the_snapshot_taken(make, drive):
    env = make(hand_seconds=1.0)
    count, over = len(drive(env, (0.6, 0.2), grip=False)), False
    while not over and count < 20:
        observation, *_, over, _, info = env.step(STILL)
        count += 1
    assert count == 10
    assert env.world.tabletop.hand is None
    assert (len(env.world.sightings), info["phase"]) == (1, Phase.PLAY)
    np.testing.assert_array_equal(observation["hand"], 0)


def test_the_snapshot_at_the_end_of_its_time_is_the_one_that_is_told_of(make, drive):
    def nothing(scene):
        class Nothing:
            def identify(self, snapshot):
                return Identification((None,) * len(snapshot.detections))

        return Nothing()

    env = make(hand_seconds=0.8, reid=nothing)
    drive(env, (0.6, 0.2), grip=False)
    over, info = False, {}
    for _ in range(8):
        if not over:
            *_, over, _, info = env.step(STILL)
    assert (over, info["accuracy"]) == (True, 0.0)


def test_a_visit_takes_no_longer_than_its_time():
    env = FarmToTableEnv(control="hand", hand_seconds=0.25, play_seconds=1.0)
    env.reset(seed=0)
    ends = [env.step(STILL)[2] for _ in range(3)]
    assert ends == [False, False, True]
    assert env.world.clock == pytest.approx(1.25)


def test_a_hand_that_never_came_makes_no_snapshot():
    env = FarmToTableEnv(control="hand", hand_seconds=0.5, play_seconds=2.0)
    env.reset(seed=0)
    rewards, over = [], False
    while not over and len(rewards) < 20:
        _, reward, over, _, info = env.step(STILL)
        rewards.append(reward)
    assert (len(rewards), sum(rewards), info["wrong_labels"]) == (5, 0.0, 0)
    assert env.world.sightings == []
    # Half a second while waiting, two seconds after.
    assert env.world.clock == pytest.approx(2.5)


def test_time_runs_in_tenths_of_a_second_and_the_rest_is_observed():
    env = FarmToTableEnv(control="hand", hand_seconds=2.0)
    env.reset(seed=0)
    for k in range(1, 5):
        observation, *_ = env.step(STILL)
        assert env.world.tabletop.ticks == 6 * k
        assert observation["budget"][2] == pytest.approx(1 - 0.1 * k / 2, abs=1e-6)


def test_full_speed_and_full_twist_are_what_they_say(env):
    start = env.world.tabletop.hand.position
    for _ in range(3):
        env.step(np.array([0.0, 1.0, 0.5, -1.0], dtype=np.float32))
    hand = env.world.tabletop.hand
    np.testing.assert_allclose(hand.position - start, [0, 0.45], atol=0.03)
    assert hand.yaw == pytest.approx(0.3 * np.pi / 2, abs=0.05)


def test_a_second_visit_begins_with_the_hand_back_at_the_side(make, drive):
    env = make(visits=2)
    drive(env, (0.7, 0.1), grip=False)
    drive(env, (0.7, -0.4), grip=False)
    first = env.world.camera
    for _ in range(10):
        observation, *_, over, _, info = env.step(STILL)
        if env.world.camera is not first:
            break
    assert (over, info["phase"], len(env.world.sightings)) == (False, Phase.PLAY, 1)
    np.testing.assert_allclose(env.world.tabletop.hand.position, [0.6, -0.5])
    np.testing.assert_allclose(observation["budget"], [1, 1, 1, 0.5])


def test_what_a_step_of_the_hand_has_read_of_the_table_is_what_is_read_anew(rng):
    env = FarmToTableEnv(control="hand", jitter="none", budget=1e9)
    env.reset(seed=0)
    turned, action = 0, np.zeros(4)
    for step in range(60):
        if step % 6 == 0:
            action = np.array(
                [rng.uniform(-0.6, 0.6), 1.0 if step < 12 else rng.uniform(-0.6, 0.6), 0.3, 1.0]
            )
        before = env.world.changes
        seen, _, over, _, _ = env.step(action.astype(np.float32))
        turned += env.world.changes != before
        env._features.meet(env.world.truth, env._order)
        for name, values in env.observe().items():
            np.testing.assert_array_equal(seen[name], values)
        if over:
            break
    assert turned >= 5
