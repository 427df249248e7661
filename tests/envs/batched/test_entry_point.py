"""`gymnasium.make_vec` gives a batch, or single environments and a warning."""

import gymnasium as gym
import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.batched import BatchedVectorEnv, NotBatchedWarning, entry_point
from farm_ar.errors import OptionError
from farm_ar.reid import SpatialReid

BATCHED = {
    "FarmToTable-v0": {"carry": "lift"},
    "FarmToTableLayout-v0": {"carry": "lift"},
    "SceneLayout-v0": {},
}


@pytest.mark.parametrize("name", BATCHED)
def test_ids_give_a_batch_of_what_they_give_alone(name):
    envs = gym.make_vec(f"farm_ar:{name}", num_envs=5, **BATCHED[name])
    assert isinstance(envs, BatchedVectorEnv)
    alone = gym.make(name, **BATCHED[name])
    seen, _ = envs.reset(seed=1)
    single, _ = alone.reset(seed=3)
    np.testing.assert_array_equal(seen["position"][2], single["position"])
    assert seen["position"] in envs.observation_space["position"]
    assert envs.spec.id == name
    assert gym.make_vec(envs.spec).num_envs == 5


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        ("FarmToTable-v0", {}, r"^carry must be lift in a batch, got 'drag'"),
        ("FarmToTable-v0", {"carry": "lift", "reid": "likelihood"}, r"^reid must be spatial or distance"),
        ("FarmToTable-v0", {"carry": "lift", "reid": SpatialReid}, r"^reid must be spatial or distance"),
        ("FarmToTable-v0", {"carry": "lift", "observation": "headset"}, r"^observation must be state"),
        ("FarmToTable-v0", {"carry": "lift", "update": "live"}, r"^update must be pause"),
        ("FarmToTable-v0", {"carry": "lift", "oracle_noise": "measured"}, r"^oracle_noise must be none"),
        ("FarmToTableHand-v0", {"carry": "lift"}, r"^control must be move or layout"),
    ],
)
def test_what_cannot_be_batched_is_played_one_by_one_and_said(name, arguments, words):
    with pytest.warns(NotBatchedWarning, match=words):
        envs = gym.make_vec(name, num_envs=1, autoreset_mode="SameStep", **arguments)
    assert isinstance(envs, gym.vector.SyncVectorEnv)
    assert envs.metadata["autoreset_mode"] is gym.vector.AutoresetMode.SAME_STEP
    alone = gym.make(name, **arguments)
    one, other = envs.reset(seed=0)[0], alone.reset(seed=0)[0]
    if isinstance(other, dict):
        one, other = one["camera"], other["camera"]
    np.testing.assert_array_equal(one[0], other)


def test_several_that_cannot_be_batched_have_processes_of_their_own():
    with pytest.warns(NotBatchedWarning, match="AsyncVectorEnv"):
        envs = gym.make_vec("FarmToTable-v0", num_envs=2, play_seconds=0.0)
    assert isinstance(envs, gym.vector.AsyncVectorEnv)
    envs.close()


def test_kernels_are_compiled_before_processes_start(monkeypatch):
    played = []

    class Watched(FarmToTableEnv):
        def step(self, action):
            played.append("step")
            return super().step(action)

    def start(environments, **options):
        played.append(f"start {len(environments)}")

    monkeypatch.setattr(entry_point, "FarmToTableEnv", Watched)
    monkeypatch.setattr(entry_point, "AsyncVectorEnv", start)
    monkeypatch.setattr(start, "__name__", "AsyncVectorEnv")
    monkeypatch.setattr(entry_point, "processors", lambda: 2)
    with pytest.warns(NotBatchedWarning):
        entry_point.make_vector_env(3, play_seconds=0.0, render_mode="rgb_array")
    assert played == ["step", "start 3"]


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"num_envs": 0}, "num_envs"),
        ({"num_envs": True}, "num_envs"),
        ({"autoreset_mode": "never"}, "autoreset_mode"),
        ({"threads": -1}, "threads"),
        ({"moves": 0}, "moves"),
        ({"carry": "drag"}, "carry"),
        ({"carry": "fling"}, "carry"),
    ],
)
def test_what_is_wrong_is_said(arguments, field):
    with pytest.raises(OptionError, match=rf"^{field}: "):
        BatchedVectorEnv(**{"num_envs": 2, "carry": "lift", **arguments})


@pytest.mark.parametrize(
    ("actions", "words"),
    [
        ([[0, 0, 0, 0]], r"must be numbers of shape \(2, 4\)"),
        ([[0, 0, 0, 0], [0, 0, 0, 7]], r"actions\[1\]: must be in MultiDiscrete.*got \[0, 0, 0, 7\]"),
        ([[0, 0, 0, 0], [-1, 0, 0, 0]], r"actions\[1\]"),
        ([[0.0, 0, 0, 0], [0, 0, 0, 0]], r"must be numbers"),
    ],
)
def test_actions_that_are_none_are_refused(actions, words):
    envs = BatchedVectorEnv(2, carry="lift")
    envs.reset(seed=0)
    with pytest.raises(gym.error.InvalidAction, match=words):
        envs.step(actions)


def test_numbers_that_are_not_finite_are_refused_and_larger_ones_clipped():
    envs = BatchedVectorEnv(2, game=False, control="layout", scene="L1")
    envs.reset(seed=0)
    actions = np.zeros(envs.action_space.shape)
    actions[1, 2] = np.nan
    with pytest.raises(gym.error.InvalidAction, match=r"actions\[1\]"):
        envs.step(actions)
    actions[1, 2] = 1e300
    assert envs.step(actions)[2].all()


@pytest.mark.parametrize("options", [{"reset_mask": np.zeros(2, bool)}, {"reset_mask": [1, 0]}, {"table": 1}])
def test_options_that_cannot_be_used_are_refused(options):
    with pytest.raises(OptionError, match="options"):
        BatchedVectorEnv(2, carry="lift").reset(options=options)


def test_there_is_no_step_before_a_reset():
    envs = BatchedVectorEnv(2, carry="lift")
    with pytest.raises(gym.error.ResetNeeded):
        envs.step(np.zeros((2, 4), dtype=int))
    envs.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(gym.error.ResetNeeded):
        envs.step(np.zeros((2, 4), dtype=int))


def test_masks_and_attributes_are_told_of_each():
    envs = BatchedVectorEnv(3, carry="lift", action="slot")
    envs.reset(seed=2)
    assert envs.action_masks().shape == (3, 11 + 5 + 3)
    np.testing.assert_array_equal(np.array(envs.call("action_masks")), envs.action_masks())
    assert envs.get_attr("config")[2].action == "slot"
    assert envs.np_random_seed == (2, 3, 4)
    envs.set_attr("difficulty", [1, 2, 3])
    assert envs.get_attr("difficulty") == (1, 2, 3)
    with pytest.raises(AttributeError, match="world"):
        envs.get_attr("world")
    with pytest.raises(OptionError, match="action"):
        BatchedVectorEnv(1, carry="lift", action="continuous").action_masks()


def test_gymnasiums_wrappers_go_around_it():
    envs = gym.make_vec("FarmToTable-v0", num_envs=4, carry="lift", moves=2, play_seconds=0.0)
    told = gym.wrappers.vector.RecordEpisodeStatistics(envs)
    listed = gym.wrappers.vector.DictInfoToList(told)
    listed.reset(seed=3)
    total, lengths = np.zeros(4), []
    for _ in range(9):
        _, reward, over, _, infos = listed.step(envs.action_space.sample())
        total += reward
        for b in np.flatnonzero(over):
            assert infos[b]["episode"]["r"] == pytest.approx(total[b])
            lengths.append(int(infos[b]["episode"]["l"]))
            total[b] = 0.0
    assert set(lengths) <= {1, 2}
    assert len(lengths) > 8
