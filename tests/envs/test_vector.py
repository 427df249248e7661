"""Several environments at once, in one process and in several."""

import gymnasium as gym
import numpy as np
import pytest

IDS = ["FarmToTable-v0", "FarmToTableHand-v0", "FarmToTableLayout-v0", "SceneLayout-v0"]


def roll(envs, steps=8):
    envs.action_space.seed(3)
    results = [envs.reset(seed=7)]
    for _ in range(steps):
        results.append(envs.step(envs.action_space.sample()))
    envs.close()
    return results


def test_in_other_processes_the_same_comes_out_as_in_this_one():
    # Fork is not safe beside the threads of other libraries.
    there = roll(
        gym.make_vec(
            "farm_ar:FarmToTable-v0",
            num_envs=2,
            vectorization_mode="async",
            vector_kwargs={"context": "spawn"},
            visits=1,
            moves=3,
        )
    )
    here = roll(gym.make_vec("FarmToTable-v0", num_envs=2, vectorization_mode="sync", moves=3))
    for a, b in zip(here, there, strict=True):
        for name in a[0]:
            np.testing.assert_array_equal(a[0][name], b[0][name])
        for left, right in zip(a[1:-1], b[1:-1], strict=True):
            np.testing.assert_array_equal(left, right)
        for name in ("wrong_labels", "accuracy", "miscounts", "phase"):
            np.testing.assert_array_equal(a[-1][name], b[-1][name])


@pytest.mark.parametrize("name", IDS)
def test_each_of_several_is_what_it_would_be_alone(name):
    arguments = {"hand_seconds": 0.4} if "Hand" in name else {}
    envs = gym.make_vec(name, num_envs=3, vectorization_mode="sync", **arguments)
    batch = roll(envs, steps=5)
    assert batch[0][0]["position"].shape[0] == 3
    alone = gym.make(name, **arguments)
    observation, _ = alone.reset(seed=8)
    envs.action_space.seed(3)
    over = False
    for k in range(6):
        for key, values in observation.items():
            np.testing.assert_array_equal(batch[k][0][key][1], values)
        action = envs.action_space.sample()[1]
        if over:
            observation, _ = alone.reset()
            over = False
        else:
            observation, _, over, _, _ = alone.step(action)


def test_masks_can_be_asked_of_all_at_once():
    envs = gym.make_vec("FarmToTable-v0", num_envs=3, vectorization_mode="sync")
    envs.reset(seed=0)
    masks = np.array(envs.call("action_masks"))
    assert masks.shape == (3, 32)
    np.testing.assert_array_equal(masks, [env.unwrapped.action_masks() for env in envs.envs])
