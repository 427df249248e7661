"""When visits and episodes begin and end, and what each of them finds."""

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.game_logic.farm_game import Phase

LEAVE = np.array([10, 3, 3, 3])
STAY = np.array([0, 3, 3, 3])


def steps_until_over(env, action):
    count, over = 0, False
    while not over:
        _, _, over, truncated, info = env.step(action)
        assert truncated is False
        count += 1
        assert count < 100
    return count, info


@pytest.mark.parametrize(("moves", "visits"), [(6, 1), (2, 3)])
def test_a_visit_has_so_many_moves_and_an_episode_so_many_visits(moves, visits):
    env = FarmToTableEnv(moves=moves, visits=visits)
    env.reset(seed=0)
    count, _ = steps_until_over(env, STAY)
    assert count == moves * visits
    assert len(env.world.sightings) == visits


def test_leaving_ends_the_visit_with_a_snapshot():
    env = FarmToTableEnv(visits=2)
    _, info = env.reset(seed=0)
    assert info["phase"] == Phase.HAND
    assert env.world.sightings == []
    observation, _, over, _, info = env.step(LEAVE)
    assert (over, len(env.world.sightings), info["phase"]) == (False, 1, Phase.HAND)
    np.testing.assert_array_equal(observation["budget"], np.float32([1, 1, 1, 0.5]))
    *_, over, _, info = env.step(LEAVE)
    assert (over, len(env.world.sightings), info["phase"]) == (True, 2, Phase.PLAY)


def test_a_whole_layout_is_a_visit_of_one_step():
    env = FarmToTableEnv(control="layout", visits=2)
    env.reset(seed=0)
    assert steps_until_over(env, np.zeros(30))[0] == 2


def test_the_camera_is_drawn_for_each_visit_observed_and_takes_the_snapshot():
    env = FarmToTableEnv(visits=3)
    observation, _ = env.reset(seed=0)
    promised = []
    for _ in range(3):
        promised.append((env.world.camera.position, observation["camera"]))
        observation, *_ = env.step(LEAVE)
    used = [sighting.snapshot.camera.position for sighting in env.world.sightings]
    for (place, seen), taken_at in zip(promised, used, strict=True):
        np.testing.assert_array_equal(place, taken_at)
        np.testing.assert_allclose(seen[:2], 2 * place / [1.2, 0.8] - 1, atol=1e-6)
    assert len({tuple(place) for place in used}) == 3


def test_a_head_that_does_not_keep_still_looks_elsewhere_when_the_snapshot_is_taken():
    def turns(degrees):
        env = FarmToTableEnv(head_noise_deg=degrees, control="layout", play_seconds=0.0)
        found = []
        for seed in range(60):
            env.reset(seed=seed)
            before = env.world.camera
            env.step(np.zeros(30))
            camera = env.world.sightings[0].snapshot.camera
            np.testing.assert_array_equal(camera.position, before.position)
            found.append(float(camera.yaw - before.yaw))
        return np.rad2deg(found)

    assert np.all(turns(0.0) == 0)
    assert 4 < turns(6.0).std() < 8


def test_a_steered_hand_has_a_head_that_does_not_keep_still_too(drive, straight_on):
    env = FarmToTableEnv(control="hand", head_noise_deg=6.0, hand_seconds=1.0)
    env.reset(seed=0, options={"camera": straight_on})
    drive(env, (0.6, 0.1), grip=False)
    for _ in range(8):
        if not env.world.sightings:
            env.step(np.zeros(4, dtype=np.float32))
    used = env.world.sightings[0].snapshot.camera
    assert 0.1 < np.rad2deg(abs(float(used.yaw - straight_on.yaw))) < 20


@pytest.mark.parametrize("seconds", [0.0, 5.0, 12.5])
def test_play_goes_on_for_so_long_within_the_step_that_ends_the_visit(seconds):
    env = FarmToTableEnv(play_seconds=seconds)
    env.reset(seed=0)
    env.step(STAY)
    assert env.world.clock == 0.0
    env.step(LEAVE)
    assert env.world.clock == pytest.approx(seconds)


def test_infos_tell_of_the_last_snapshot_and_of_all_animals_gone_astray():
    env = FarmToTableEnv(visits=2, play_seconds=20.0, jitter="none")
    _, info = env.reset(seed=0)
    always = {"accuracy", "wrong_labels", "paper_margin", "effort", "miscounts", "phase"}
    assert set(info) == always | {"reward/identity", "reward/effort", "action_mask"}
    assert (info["accuracy"], info["wrong_labels"], info["miscounts"]) == (1.0, 0, 0)
    env.step(LEAVE)
    *_, info = env.step(LEAVE)
    assert info["miscounts"] == env.world.counters.miscounts
    assert info["accuracy"] == env.world.sightings[-1].accuracy


def test_without_the_game_there_are_visits_too(plain, offsets):
    env = plain(visits=2)
    _, info = env.reset(seed=0)
    assert info["phase"] == Phase.HAND
    *_, over, _, info = env.step(offsets())
    assert (over, info["phase"]) == (False, Phase.HAND)
    *_, over, _, info = env.step(offsets())
    assert (over, info["phase"]) == (True, Phase.PLAY)
