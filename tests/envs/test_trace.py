"""Traces, hashes, pickles, and another process: the same again, bit by bit."""

import copy
import json
import pickle
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv, replay
from farm_ar.envs.rewards import clutter

IDS = ["FarmToTable-v0", "FarmToTableHand-v0", "FarmToTableLayout-v0", "SceneLayout-v0"]

PLAY = """
import gymnasium as gym, hashlib, json, sys
import farm_ar

def play(name):
    env = gym.make(name, **({"visits": 2, "play_seconds": 1.0} if "Hand" in name else {"visits": 3}))
    digest = hashlib.sha256()
    env.action_space.seed(11)
    for seed in (5, None):
        observation, info = env.reset(seed=seed)
        for _ in range(25):
            observation, reward, over, _, info = env.step(env.action_space.sample())
            for values in observation.values():
                digest.update(values.tobytes())
            digest.update(repr((reward, info)).encode())
            if over:
                break
    return digest.hexdigest(), env.unwrapped.state_hash()
"""


def played(names):
    scope = {}
    exec(PLAY, scope)
    return {name: list(scope["play"](name)) for name in names}


def test_another_process_gives_the_same_bytes():
    code = f"{PLAY}\nprint(json.dumps({{name: play(name) for name in {IDS!r}}}))"
    # Another seed of Python's hashing, so that no order of a set can matter.
    result = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONHASHSEED": "12345", "PATH": ""},
    )
    assert json.loads(result.stdout) == played(IDS)


def episode(steps=4, **arguments):
    env = FarmToTableEnv(**{"visits": 2, **arguments})
    env.reset(seed=9)
    env.action_space.seed(9)
    for _ in range(steps):
        env.step(env.action_space.sample())
    return env


@pytest.mark.parametrize("control", ["move", "hand", "layout"])
def test_a_trace_is_json_and_plays_again_to_its_hash(control):
    env = episode(2 if control == "layout" else 4, control=control)
    trace = json.loads(json.dumps(env.trace()))
    assert replay(trace) == trace["hash"] == env.state_hash()


def test_a_trace_holds_what_reset_was_given():
    env = FarmToTableEnv(jitter="hard")
    env.reset(seed=1)
    layout, camera = env.world.truth, env.world.camera
    env.reset(options={"layout": layout, "camera": camera})
    env.step(np.array([0, 0, 0, 0]))
    trace = json.loads(json.dumps(env.trace()))
    np.testing.assert_array_equal(trace["options"]["layout"]["position"], layout.position)
    assert replay(trace) == env.state_hash()


def test_a_trace_begins_where_its_episode_did_not_where_the_generator_was_seeded():
    env = episode(3)
    env.reset()
    env.step(np.array([1, 0, 0, 0]))
    assert replay(env.trace()) == env.state_hash()


@pytest.mark.parametrize("change", ["action", "generator", "layout"])
def test_a_changed_trace_plays_to_another_hash(change):
    env = FarmToTableEnv(jitter="easy")
    env.reset(seed=3)
    which = int(np.flatnonzero(env.action_masks()[:10])[0])
    env.step(np.array([which, 0, 3, 3]))
    trace = json.loads(json.dumps(env.trace()))
    if change == "action":
        trace["actions"][0][1] = 1
    elif change == "generator":
        trace["generator"]["state"]["state"] += 1
    else:
        layout = env.world.scene.layout
        trace["options"]["layout"] = {"position": layout.position.tolist(), "yaw": layout.yaw.tolist()}
    assert replay(trace) != trace["hash"]


def test_a_move_that_does_nothing_is_in_the_hash_too():
    env = FarmToTableEnv()
    env.reset(seed=0)
    before = env.state_hash()
    env.step(np.array([0, 3, 3, 3]))
    assert env.state_hash() != before


def test_looking_changes_nothing():
    def state(look):
        env = FarmToTableEnv(visits=2, render_mode="rgb_array" if look else None)
        env.reset(seed=4)
        env.action_space.seed(4)
        for _ in range(4):
            env.step(env.action_space.sample())
            if look:
                env.render()
                env.action_masks()
                env.trace()
                _ = clutter(env), env.ambiguity, env.world.render_state().animal_heading
        return env.state_hash()

    assert state(look=True) == state(look=False)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize("control", ["move", "hand"])
def test_a_copy_in_mid_episode_is_in_the_same_state_and_goes_its_own_way(duplicate, control):
    env = episode(control=control)
    twin = duplicate(env)
    assert twin.state_hash() == env.state_hash()
    assert twin.np_random_seed == env.np_random_seed == 9
    actions = [env.action_space.sample() for _ in range(3)]
    assert all(np.array_equal(action, twin.action_space.sample()) for action in actions)
    before = env.state_hash()
    for action in actions:
        twin.step(action)
    assert env.state_hash() == before
    for action in actions:
        env.step(action)
    assert twin.state_hash() == env.state_hash()


def test_a_copy_of_what_was_never_reset_has_the_same_generator():
    env = FarmToTableEnv()
    env.np_random.random(3)
    twin = pickle.loads(pickle.dumps(env))
    for one in (env, twin):
        one.reset()
    assert twin.state_hash() == env.state_hash()


def test_a_copy_of_a_finished_episode_is_finished():
    env = episode(2, control="layout", play_seconds=0.0)
    twin = pickle.loads(pickle.dumps(env))
    with pytest.raises(gym.error.ResetNeeded):
        twin.step(twin.action_space.sample())


def test_the_spec_of_a_registered_environment_survives_json_with_its_arguments():
    env = gym.make("FarmToTable-v0", jitter="hard", visits=2, budget=0.3, reid="nearest")
    spec = gym.envs.registration.EnvSpec.from_json(env.spec.to_json())
    assert spec == env.spec
    again = gym.make(spec)
    env.reset(seed=1)
    again.reset(seed=1)
    assert again.unwrapped.state_hash() == env.unwrapped.state_hash()


def test_the_order_in_which_options_are_named_does_not_matter():
    layout, camera = FarmToTableEnv()._scene.layout, {"position": [0.6, -0.3], "yaw": 0.0}
    hashes = []
    for names in (("layout", "camera"), ("camera", "layout")):
        env = FarmToTableEnv()
        given = {"layout": layout, "camera": camera}
        env.reset(seed=0, options={name: given[name] for name in names})
        hashes.append(env.state_hash())
    assert hashes[0] == hashes[1]


def test_what_reset_was_given_may_change_afterwards():
    env = FarmToTableEnv()
    layout = env._scene.layout
    given = {"position": layout.position.copy(), "yaw": layout.yaw.copy()}
    env.reset(seed=0, options={"layout": given})
    before, trace = env.state_hash(), env.trace()
    given["position"][:] = 0.4
    assert env.state_hash() == before
    assert env.trace() == trace
