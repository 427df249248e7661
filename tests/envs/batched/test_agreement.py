"""Environments in a batch are, bit for bit, what each would be by itself."""

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import settings

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.batched import BatchedVectorEnv
from farm_ar.scenes import BUILTIN, Camera, Layout, Scene, builtin_scene

STEPS = 100 * settings().max_examples
"""Steps of single environments that are compared: 5000, or 100 000 of all tests."""

GAMES = {
    "control": [
        ("move", "displacement"),
        ("move", "slot"),
        ("move", "continuous"),
        ("layout", "offsets"),
        ("move", "discrete"),
        ("layout", "discrete"),
    ],
    "knowledge": ["white-box", "black-box"],
    "observation": ["state", "state", "flat"],
    "reward": ["identity", "margin", "clutter", "miscount", "endpoint", "shaped"],
    "sign": [1, -1],
    "effort_weight": [0.0, 0.25, 3.0],
    "reid": ["spatial", "distance"],
    "budget": [None, None, 0.05, 0.5],
    "budget_m": [0.6, 0.2],
    "visits": [1, 1, 2, 3, None],
    "moves": [1, 3, 6],
    "animals_a_second": [10.0, 0.0, 3.0, 90.0],
    "jitter": ["none", "easy", "default", "hard"],
    "play_seconds": [0.0, 0.0, 0.7, 5.0, 20.0],
    "head_noise_deg": [0.0, 4.0],
    "fov": ["photo", "display"],
    "gaze": ["random", "still"],
}
"""What is chosen at random with the game."""

PLAIN = {
    "game": [False],
    "control": [("layout", "offsets"), ("layout", "discrete")],
    "reward": ["identity", "margin", "clutter", "endpoint", "shaped"],
}
"""The same without it."""


def strewn(rng, count, size=(1.2, 0.8), names=("coop", "hutch", "shed")):
    """A scene of boxes anywhere, overlapping ones too, at any heading; the last one is fixed."""
    kinds = [names[k] for k in rng.integers(len(names), size=count)]
    layout = Layout(
        labels=tuple(f"{kind} {k}" for k, kind in enumerate(kinds)),
        category=tuple(kinds),
        position=rng.random((count, 2)) * size,
        yaw=rng.uniform(-9, 9, size=count),
        size=rng.uniform(0.03, 0.2, size=(count, 3)) * size[0],
        fixed=np.arange(count) == count - 1,
    )
    return Scene("strewn", size, layout)


def chosen(rng, game):
    """Arguments of an environment at random."""
    options = GAMES if game else GAMES | PLAIN
    found = {name: values[rng.integers(len(values))] for name, values in options.items()}
    found["control"], found["action"] = found["control"]
    if not game:
        del found["play_seconds"], found["animals_a_second"]
        names = [name for name in BUILTIN if len(builtin_scene(name).layout) < 40]
        found["scene"] = names[rng.integers(len(names))]
    if rng.random() < 0.3:
        size = [(1.2, 0.8), (7.0, 11.0), (0.3, 0.3)][rng.integers(3)]
        found["scene"] = strewn(rng, int(rng.integers(3, 16)), size)
    return found | {"carry": "lift"}


def same(name, batched, alone, where):
    """See that two values have the same bits, but for the sign of zero."""
    assert np.array_equal(np.asarray(batched), np.asarray(alone), equal_nan=True), (
        where,
        name,
        batched,
        alone,
    )


def sampled(rng, space, count):
    """Actions at random; every second of an offset or a turn is nothing now and then."""
    space.seed(int(rng.integers(2**31)))
    actions = np.array([space.sample() for _ in range(count)])
    if actions.dtype == np.float32 and rng.random() < 0.3:
        actions[rng.random(actions.shape) < 0.5] = 0.0
        actions *= np.float32(rng.choice([0.2, 1.0, 5.0]))
    return actions


def play(arguments, steps, count, rng):
    """Play environments in a batch and by themselves, and compare all that they give."""
    batch = BatchedVectorEnv(count, **arguments)
    alone = [FarmToTableEnv(**arguments) for _ in range(count)]
    seed = int(rng.integers(2**32))
    observed, infos = batch.reset(seed=seed)
    results = [(*env.reset(seed=seed + k), 0.0, False, False) for k, env in enumerate(alone)]
    reward, over, truncated = np.zeros(count), np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    for step in range(steps + 1):
        for k, (seen, info, paid, ended, cut) in enumerate(results):
            where = (arguments, seed, step, k)
            if isinstance(seen, dict):
                assert set(seen) == set(observed)
                for name in seen:
                    same(name, observed[name][k], seen[name], where)
            else:
                same("observation", observed[k], seen, where)
            assert {name for name in infos if not name.startswith("_")} == set(info)
            for name in info:
                same(name, infos[name][k], info[name], where)
            same("reward", reward[k], paid, where)
            assert (ended, cut) == (over[k], truncated[k]), where
        if step < steps:
            actions = sampled(rng, batch.single_action_space, count)
            was = over
            observed, reward, over, truncated, infos = batch.step(actions)
            for k, env in enumerate(alone):
                if was[k]:
                    results[k] = (*env.reset(), 0.0, False, False)
                else:
                    seen, *rest, info = env.step(actions[k])
                    results[k] = (seen, info, *rest)
    states = [stream.bit_generator.state for stream in batch.np_random]
    assert states == [env.np_random.bit_generator.state for env in alone]


@pytest.mark.parametrize("part", range(10))
def test_all_that_is_told_of_environments_with_options_at_random_is_the_same(part):
    rng = np.random.default_rng(part)
    for _ in range(STEPS // 1000):
        play(chosen(rng, game=rng.random() < 0.7), steps=50, count=2, rng=rng)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_infos_and_last_observations_are_those_of_gymnasiums_own(mode):
    arguments = {"carry": "lift", "moves": 2, "action": "slot", "play_seconds": 1.0}
    batch = gym.make_vec("FarmToTable-v0", num_envs=3, autoreset_mode=mode, **arguments)
    own = gym.vector.SyncVectorEnv([lambda: FarmToTableEnv(**arguments)] * 3, autoreset_mode=mode)
    assert batch.metadata["autoreset_mode"] == own.metadata["autoreset_mode"]
    assert (batch.observation_space, batch.action_space) == (own.observation_space, own.action_space)
    results = [(batch.reset(seed=4), own.reset(seed=4))]
    batch.action_space.seed(0)
    for _ in range(12):
        actions = batch.action_space.sample()
        results.append((batch.step(actions), own.step(actions)))
    for one, other in results:
        compare(one, other)
    assert any("final_obs" in one[-1] for one, _ in results) == (mode == "SameStep")


def compare(one, other):
    """See that nested results have the same types, shapes and values."""
    if isinstance(other, dict):
        assert set(one) == set(other)
        for name in other:
            compare(one[name], other[name])
    elif isinstance(other, tuple) or (isinstance(other, np.ndarray) and other.dtype == object):
        assert len(one) == len(other)
        for first, second in zip(one, other, strict=True):
            compare(first, second)
    elif other is None:
        assert one is None
    else:
        assert (one.dtype, one.shape) == (other.dtype, other.shape)
        np.testing.assert_array_equal(one, other)


def test_results_do_not_depend_on_the_number_of_threads():
    found = []
    for threads in (1, 3):
        batch = BatchedVectorEnv(200, threads=threads, control="move", carry="lift", play_seconds=0.5)
        batch.action_space.seed(1)
        results = [batch.reset(seed=1)]
        for _ in range(8):
            results.append(batch.step(batch.action_space.sample()))
        batch.close()
        found.append(results)
    for one, other in zip(*found, strict=True):
        compare(one, other)


def test_environments_that_are_over_begin_where_a_mask_says_so():
    batch = BatchedVectorEnv(3, "Disabled", control="layout", carry="lift", play_seconds=0.0)
    alone = FarmToTableEnv(control="layout", carry="lift", play_seconds=0.0)
    batch.reset(seed=[5, 6, 7])
    alone.reset(seed=6)
    actions = np.zeros((3, 30), dtype=np.float32)
    before, *_ = batch.step(actions)
    alone.step(actions[1])
    with pytest.raises(gym.error.ResetNeeded, match=r"environments \[0, 1, 2\] are over"):
        batch.step(actions)
    after, infos = batch.reset(options={"reset_mask": np.array([False, True, False])})
    seen, info = alone.reset()
    np.testing.assert_array_equal(after["position"][1], seen["position"])
    np.testing.assert_array_equal(after["position"][[0, 2]], before["position"][[0, 2]])
    assert infos["_effort"].tolist() == [False, True, False]
    assert infos["paper_margin"].tolist() == [0.0, info["paper_margin"], 0.0]


def test_layout_and_camera_can_be_given_for_all():
    farm = builtin_scene("farm")
    camera = Camera(np.array([0.5, -0.3]), np.array(0.1), height=np.array(0.45), pitch=np.array(-0.5))
    moved = {"position": farm.layout.position + np.array([0.01, 0.02]), "yaw": farm.layout.yaw + 0.1}
    options = {"layout": moved, "camera": camera}
    batch = BatchedVectorEnv(2, carry="lift", visits=2, play_seconds=1.0)
    alone = FarmToTableEnv(carry="lift", visits=2, play_seconds=1.0)
    observed, _ = batch.reset(seed=[3, 4], options=options)
    seen, _ = alone.reset(seed=4, options=options)
    for _ in range(14):
        for name in seen:
            np.testing.assert_array_equal(observed[name][1], seen[name])
        actions = batch.action_space.sample()
        observed, _, over, _, _ = batch.step(actions)
        seen, *_ = alone.step(actions[1])
        if over[1]:
            break


def test_begun_anew_a_batch_goes_on_like_each_by_itself():
    """With a layout, which is that of this episode only; without; with a seed, also where there was one."""
    arguments = {"control": "layout", "carry": "lift", "play_seconds": 0.0}
    batch, alone = BatchedVectorEnv(2, **arguments), FarmToTableEnv(**arguments)
    farm, rng = builtin_scene("farm"), np.random.default_rng(0)
    moved = {"position": farm.layout.position + 0.01, "yaw": farm.layout.yaw + 0.1}
    for seeds, options in (([5, 6], {}), (None, {"layout": moved}), (None, {}), ([None, 6], {})):
        observed, _ = batch.reset(seed=seeds, options=options)
        seen, _ = alone.reset(seed=seeds and seeds[1], options=options)
        for name in seen:
            np.testing.assert_array_equal(observed[name][1], seen[name])
        actions = sampled(rng, batch.single_action_space, 2)
        observed, reward, over, _, _ = batch.step(actions)
        seen, paid, ended, _, _ = alone.step(actions[1])
        assert (reward[1], over[1]) == (paid, ended) == (paid, True)
        if options:
            observed, _, over, _, _ = batch.step(actions)
            seen, _ = alone.reset()
            assert not over.any()
        for name in seen:
            np.testing.assert_array_equal(observed[name][1], seen[name])
    assert batch.np_random_seed == (5, 6)
