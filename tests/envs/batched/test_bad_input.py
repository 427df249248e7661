"""What a batch is given that it cannot use, copies of it, threads, and its end."""

import copy
import pickle
import threading

import gymnasium as gym
import numpy as np
import pytest

from farm_ar.envs.batched.sb3 import BatchedVecEnv
from farm_ar.envs.batched.vector_env import BatchedVectorEnv
from farm_ar.errors import OptionError

QUICK = {"carry": "lift", "play_seconds": 0.0, "animals_a_second": 0.0}
DISCRETE = QUICK | {"action": "discrete", "observation": "flat"}


@pytest.fixture(scope="module")
def batch():
    made = BatchedVectorEnv(3, **DISCRETE)
    made.reset(seed=0)
    return made


@pytest.mark.parametrize("count", [0, -1, True, 1.5, "3", None, float("nan"), 10**9])
def test_there_is_a_whole_number_of_environments_in_reason(count):
    for make in (BatchedVectorEnv, BatchedVecEnv):
        with pytest.raises(OptionError, match="num_envs: must be a whole number from 1 to 1000000"):
            make(count, **DISCRETE)


def test_so_there_is_where_single_ones_take_its_place():
    for count in (0, -1, True):
        with pytest.raises(OptionError, match="num_envs"):
            gym.make_vec("farm_ar:FarmToTable-v0", num_envs=count)


@pytest.mark.parametrize(
    "seed", [-1, True, 1.5, "123", [1, 2], [1, 2, -1], [1.5, 2.5, 3.5], [True] * 3, {1, 2, 3}, np.array(5)]
)
def test_seeds_are_whole_numbers_and_a_wrong_one_changes_nothing(batch, seed):
    before = [rng.bit_generator.state for rng in batch.np_random]
    with pytest.raises(OptionError, match=r"seed(\[\d\])?: must be"):
        batch.reset(seed=seed)
    assert [rng.bit_generator.state for rng in batch.np_random] == before


@pytest.mark.parametrize("options", [5, "x", [], {"reset_mask": [[1], [2, 3]]}])
def test_options_are_a_mapping_and_a_mask_has_one_row(batch, options):
    with pytest.raises(OptionError, match="options"):
        batch.reset(options=options)


def test_actions_of_different_lengths_and_kinds_are_refused(batch):
    for actions in ([[0], [0, 1], [2]], [0.0, 1.0, 2.0]):
        with pytest.raises(gym.error.InvalidAction, match=r"numbers of shape \(3,\) and of an integer"):
            batch.step(actions)
    smooth = BatchedVectorEnv(1, **QUICK, action="continuous")
    smooth.reset(seed=0)
    with pytest.raises(gym.error.InvalidAction, match="must be in Box"):
        smooth.step(np.full((1, 5), np.longdouble("1e4000")))


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda batch: pickle.loads(pickle.dumps(batch))])
def test_a_copy_plays_on_alike_and_apart(copied):
    batch = BatchedVectorEnv(64, threads=2, **DISCRETE)  # so many have threads
    batch.reset(seed=3)
    other = copied(batch)
    for seed in range(12):
        rng = np.random.default_rng(seed)
        actions = np.array([rng.choice(np.flatnonzero(mask)) for mask in batch.action_masks()])
        expected, answered = batch.step(actions), other.step(actions)
        for one, another in zip(expected[:4], answered[:4], strict=True):
            assert np.array_equal(one, another)
    batch.close()
    other.close()


def test_two_threads_do_not_play_one_batch():
    batch = BatchedVectorEnv(1, **DISCRETE)
    batch.reset(seed=0)
    inside, go = threading.Event(), threading.Event()
    play = batch._play

    def slow(actions):
        inside.set()
        go.wait(10)
        return play(actions)

    batch._play = slow
    first = threading.Thread(target=batch.step, args=(np.array([0]),))
    first.start()
    inside.wait(10)
    with pytest.raises(RuntimeError, match="one thread at a time"):
        batch.step(np.array([0]))
    go.set()
    first.join()
    batch._play = play
    batch.step(np.array([0]))


def test_what_is_closed_is_not_played():
    batch = BatchedVectorEnv(1, **DISCRETE)
    batch.reset(seed=0)
    batch.close()
    for use in (batch.reset, lambda: batch.step(np.array([0]))):
        with pytest.raises(gym.error.ClosedEnvironmentError):
            use()


@pytest.mark.parametrize("nothing", [np.nan, np.inf])
def test_an_action_of_an_episode_that_begins_anew_is_not_looked_at(nothing):
    envs = BatchedVectorEnv(2, action="continuous", carry="lift", moves=1, play_seconds=0.0)
    envs.reset(seed=0, options=None)
    moves = np.zeros((2, 5), dtype=np.float32)
    assert envs.step(moves)[2].all()
    moves[:] = nothing
    seen, rewards, over, _, _ = envs.step(moves)
    assert not over.any()
    assert not rewards.any()
    assert np.isfinite(seen["position"]).all()
    with pytest.raises(gym.error.InvalidAction, match=r"^actions\[0\]: must be in Box"):
        envs.step(moves)
